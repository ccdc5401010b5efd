"""How far plans for unknown robots land from the cup, over many robots and cups, and whether the model knows how far.

    python benchmarks/robots.py --robots 30 --cups 20

As in `wam-cast transfer`, robots within the ranges, within twice these and beyond practise chosen casts, with noise; the learned
prior adapts, and plans. What is planned is cast without noise, by the batched engine: nothing is said here of what a cup does with
the ball, and a robot takes seconds in place of minutes. Needs the extra `batch`.
"""

from __future__ import annotations

import argparse

import numpy as np
from practice import landings, practised

import wam_cast as wc
from wam_cast.adaptation.practice import choose_practice
from wam_cast.casting_plane import from_polar, to_casting_plane, to_polar
from wam_cast.experiments.transfer.transfer_settings import Group, TransferSettings
from wam_cast.experiments.trials import Region, draw_cups
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.planning.reach import Reach
from wam_cast.types import Array

KS = (0, 1, 2, 5, 10, 20)
N_RADII = 9
"""Cups on the line for which practice casts are chosen."""


class Study:
    """The robots of a group, what is known of them, and how far their plans land from the cup."""

    def __init__(self, settings: TransferSettings, group: Group, region: Region) -> None:
        self.belief, self.group = settings.scenario, group
        self.seeds = [derived_seed(settings.seed, Purpose.ROBOTS, number) for number in range(settings.n_robots)]
        self.prior = wc.AdaptiveModel.from_prior(group.expected)
        on_line = [(float(radius), 0.0) for radius in np.linspace(*self.prior.reach, N_RADII)]
        self.practice = choose_practice(self.prior, max(KS), on_line if region == "line" else None)
        reach = Reach.of(self.prior)
        self.cups = [
            [from_polar(*cup) for cup in draw_cups(reach, settings.n_cups, seed, region)] for seed in self.seeds
        ]

    def found(self) -> tuple[Array, Array]:
        """Return the errors along and across the plane [m], and the same in standard deviations, (n_ks, n_robots * n_cups, 2)."""
        casts: list[wc.Cast] = []
        truths: list[wc.Scenario] = []
        expected, stds = [], []
        for number, seed in enumerate(self.seeds):
            truth, rng = self.group.draw(number, seed), np.random.default_rng(seed)
            made, seen = practised(self.belief, truth, self.practice, rng)
            for k in KS:
                model = self.prior.observe(made[:k], seen[:k], is_measured=True)
                plans = [wc.plan_cast(model, cup) for cup in self.cups[number]]
                casts += [plan.cast for plan in plans]
                truths += [truth.without_noise] * len(plans)
                expected += [plan.predicted_landing for plan in plans]
                stds += [self._std(model, plan) for plan in plans]
        landed = landings(truths, casts, self.belief)
        errors = [
            to_casting_plane(off, cast.bearing) for off, cast in zip(landed - np.array(expected), casts, strict=True)
        ]
        by_robot = np.array(errors).reshape(len(self.seeds), len(KS), -1, 2).swapaxes(0, 1)
        found = by_robot.reshape(len(KS), -1, 2)
        std = np.array(stds).reshape(len(self.seeds), len(KS), -1, 2).swapaxes(0, 1).reshape(len(KS), -1, 2)
        return found, np.abs(found) / std

    @staticmethod
    def _std(model: wc.AdaptiveModel, plan: wc.Plan) -> Array:
        _, bearing = to_polar(plan.cup)
        return model.toward(bearing).predict_std(plan.cast.to_array()[np.newaxis, :3])[0, :2]


def print_study(group: Group, errors: Array, deviations: Array) -> None:
    """Print a line for each k."""
    for k, off, z in zip(KS, errors, deviations, strict=True):
        bias = 1e3 * np.hypot(*off.T)
        if (n_lost := np.isnan(bias).sum()) > 0:
            print(f"{group.name}, k = {k}: {n_lost} of {len(bias)} do not come down, and count as infinitely far")
            bias = np.where(np.isnan(bias), np.inf, bias)
        within = [f"{100 * np.mean(z[:, axis] < n):5.0f}" for axis in (0, 1) for n in (1, 2)]
        numbers = (np.median(bias), np.quantile(bias, 0.95), bias.max())
        print(f"{group.name:<14}{k:>4}" + "".join(f"{value:8.1f}" for value in numbers) + "   " + " ".join(within))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=30, help="of each group")
    parser.add_argument("--cups", type=int, default=20, help="for each robot")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--region", choices=("line", "floor"), default="line", help="where the cups are")
    given = parser.parse_args()
    settings = TransferSettings.of(wc.Scenario(), given.seed, False, "batch", given.robots, given.cups)
    print(
        f"{given.robots} robots x {given.cups} cups on the {given.region}, seed {given.seed}; bias [mm]: median, P95,"
    )
    print("largest; share [%] within one and two standard deviations, along the casting plane and across it")
    print("robots           k  median     P95 largest     along    across")
    for group in settings.groups:
        print_study(group, *Study(settings, group, given.region).found())


if __name__ == "__main__":
    main()
