"""Which casts to practise: chosen by the model, at random, by Sobol's sequence, or the planner's own for the wanted cups.

    python benchmarks/practice.py --robots 30

Robots are drawn, practise with noise, and are then asked where the casts land that the model had planned for cups on the line
before the first one. Printed is the root mean square of the error along the casting plane, without noise, over robots and cups.
Needs the extra `batch`.
"""

from __future__ import annotations

import argparse

import numpy as np

import wam_cast as wc
from wam_cast.adaptation.practice import choose_practice
from wam_cast.adaptation.priors.filling import filling_casts
from wam_cast.adaptation.robot import LANDING_STD, MOVE_STD
from wam_cast.casting_plane import from_casting_plane
from wam_cast.motion.noise_draws import executed_cast
from wam_cast.planning.prediction import ALONG
from wam_cast.types import Array

KS = (1, 2, 5, 10)
N_CUPS = 9


def practice_casts(model: wc.AdaptiveModel, cups: list[tuple[float, float]], seed: int) -> dict[str, list[wc.Cast]]:
    """Return the casts of each way to choose them."""
    rng, most = np.random.default_rng(seed), max(KS)
    scenario = model.scenario
    everywhere = filling_casts(scenario, 400)
    own = [wc.plan_cast(model, cups[i]).cast for i in rng.permutation(len(cups))]
    return {
        "chosen": choose_practice(model, most, cups),
        "random": [wc.Cast(*row) for row in rng.permutation(everywhere)[:most]],
        "Sobol": [wc.Cast(*row) for row in everywhere[:most]],
        "planner's own": (own * 2)[:most],
    }


def landings(
    truth: wc.Scenario | list[wc.Scenario], casts: list[wc.Cast], belief: wc.Scenario, seeds: Array | None = None
) -> Array:
    """Return where casts land, world (x, y) [m], (n, 2), with one robot or one for each."""
    frame = wc.simulate_batch(truth, casts, precision="float32", belief=belief, noise_seeds=seeds)
    pairs = zip(frame["landing_along"], frame["landing_across"], casts, strict=True)
    return np.array([from_casting_plane(along, across, cast.bearing) for along, across, cast in pairs])


def practised(
    belief: wc.Scenario, truth: wc.Scenario, casts: list[wc.Cast], rng: np.random.Generator
) -> tuple[list[wc.Cast], Array]:
    """Return practice casts as a robot's encoders see them made, with noise, and their measured landings, (n, 2)."""
    seeds = rng.integers(2**31, size=len(casts))
    seen = landings(truth, casts, belief, seeds) + LANDING_STD * rng.standard_normal((len(casts), 2))
    made = []
    for cast, noise_seed in zip(casts, seeds, strict=True):
        executed = executed_cast(belief.noise, cast, int(noise_seed)).to_array()
        off = rng.standard_normal(3) * [MOVE_STD.distance, MOVE_STD.speed, MOVE_STD.wait]
        made.append(wc.Cast.from_array(np.maximum(executed + off, [1e-3, 1e-3, 0]), cast.bearing))
    return made, seen


def errors(
    model: wc.AdaptiveModel, truth: wc.Scenario, ways: dict[str, list[wc.Cast]], targets: Array, seed: int
) -> Array:
    """Return the errors along the plane at the targets before any cast, and after each k of each way, (1 + n_ways * n_ks, n)."""
    belief, rng = model.scenario, np.random.default_rng(seed)
    there = landings(truth.without_noise, [wc.Cast(*row) for row in targets], belief)[:, 0]
    found = [model.predict(targets)[:, ALONG] - there]
    for casts in ways.values():
        made, seen = practised(belief, truth, casts, rng)
        for k in KS:
            learned = model.observe(made[:k], seen[:k], is_measured=True)
            found.append(learned.predict(targets)[:, ALONG] - there)
    return np.array(found)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--scale", type=float, default=1.0, help="of the robots' ranges, which the model knows")
    given = parser.parse_args()
    robots = wc.RobotDistribution().scaled(given.scale)
    model = wc.AdaptiveModel.from_prior(robots)
    cups = [(float(radius), 0.0) for radius in np.linspace(*model.reach, N_CUPS)]
    targets = np.array([wc.plan_cast(model, cup).cast.to_array()[:3] for cup in cups])
    ways = practice_casts(model, cups, given.seed)
    all_errors = np.array(
        [
            errors(model, robots.draw(10_000 * given.seed + number), ways, targets, number)
            for number in range(given.robots)
        ]
    )
    rms = 1e3 * np.sqrt(np.nanmean(all_errors**2, axis=(0, 2)))
    print(f"{given.robots} robots, ranges times {given.scale:g}, seed {given.seed}; RMS [mm] at {N_CUPS} planned casts")
    print(f"before the first cast  {rms[0]:.1f}")
    print("practice casts " + "".join(f"{k:>8}" for k in KS))
    for way, row in zip(ways, rms[1:].reshape(len(ways), len(KS)), strict=True):
        print(f"{way:<15}" + "".join(f"{value:8.1f}" for value in row))


if __name__ == "__main__":
    main()
