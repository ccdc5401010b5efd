"""How many casts it takes to hit: a learner that knows nothing but rewards, and planners of a forward model, over the same cups.

    python benchmarks/learners.py [--seeds 2] [--generations 48] [--cups 20] [--agreement 60] [--picture FILE] [--out FILE.json]

The learner is CMA-ES (Hansen and Ostermeier 2001; package cmaes). It searches the six numbers of a policy, a cast that is affine in
the cup's distance, with its bearing toward the cup, by the rewards of `wam_cast/Cast-v0` from the batched engine: 16 candidates a
generation, each over 8 cups, which are dealt out such that each candidate has near and far ones. The planner learns a forward model
from so many random casts and plans by the program. Of both, hits are what Drake says, with contact, of cups evenly over the
environment's distances and bearings.

The vector environment tells a hit from the landing. How often Drake says the same is counted over planned casts whose cups stand up
to 45 mm, one and a half of its radii, off along the casting plane.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from pathlib import Path

import gymnasium
import numpy as np
from cmaes import CMA
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import wam_cast.environments  # noqa: F401 - registers
from wam_cast.batch.engine import simulate_batch
from wam_cast.casting_plane import from_polar
from wam_cast.cli.terminal import err, out, print_table
from wam_cast.environments.cast_task import RADII, CastTask
from wam_cast.generation.sampling import sample_casts
from wam_cast.learning.dataset import CastDataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.reference import reference_model
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array, Position
from wam_cast.visualization.figures.plot_style import curve_styles, draw_legend
from wam_cast.visualization.picture_files import check_picture, write_figure
from wam_cast.visualization.style import figure_style

CANDIDATES, CUPS_EACH = 16, 8
CASTS_A_GENERATION = CANDIDATES * CUPS_EACH

FIRST_STEP = 0.5
"""Standard deviation of the policies' first generation."""

EVERY = 6
"""Generations from one test of the learner to the next."""

N_TRAINING = (34, 50, 80, 160, 320)
"""Casts of the forward model; fewer than the first cannot be split."""

ENOUGH = 0.9
"""Share of the cups hit that counts as learned."""

Curve = dict[int, float]
"""Share of the cups that are hit, by the casts learned from."""


def policy(weights: Array, cups: Array) -> Array:
    """Return actions, (n, 4), of cups, (n, 2) [m]: affine in the distance, toward the cup."""
    middle, half = (RADII[0] + RADII[1]) / 2, (RADII[1] - RADII[0]) / 2
    distance = (np.hypot(*cups.T) - middle) / half
    bearing = np.arctan2(cups[:, 1], cups[:, 0]) / CastTask(Scenario()).bearings[1]
    shape = np.column_stack([np.ones_like(distance), distance]) @ weights.reshape(2, 3)
    return np.clip(np.column_stack([shape, bearing]), -1.0, 1.0)


def learn(seed: int, n_generations: int) -> Iterator[tuple[int, Array]]:
    """Yield the casts made so far and the weights (6,), at every `EVERY` generations."""
    envs = gymnasium.make_vec("wam_cast/Cast-v0", num_envs=CASTS_A_GENERATION, precision="float32")
    strategy = CMA(np.zeros(6), FIRST_STEP, population_size=CANDIDATES, seed=seed)
    cups, _ = envs.reset(seed=seed)
    for generation in range(1, n_generations + 1):
        candidates = [strategy.ask() for _ in range(CANDIDATES)]
        # Near and far cups for each.
        dealt = np.argsort(np.hypot(*cups.T)).reshape(CUPS_EACH, CANDIDATES).T
        actions = np.empty((len(cups), 4))
        for weights, own in zip(candidates, dealt, strict=True):
            actions[own] = policy(weights, cups[own])
        cups, rewards, *_ = envs.step(actions)
        losses = [-float(rewards[own].mean()) for own in dealt]
        strategy.tell(list(zip(candidates, losses, strict=True)))
        if generation % EVERY == 0:
            yield generation * CASTS_A_GENERATION, strategy.mean


def hits(simulator: CastSimulator, cups: list[Position], cast: Callable[[Position], object]) -> float:
    """Return the share of the cups that are hit by the casts that a function chooses."""
    caught = [simulator.simulate(cast(cup), cup).is_caught for cup in cups]
    return float(np.mean(caught))


def test_cups(n: int) -> list[Position]:
    """Return cups evenly over the distances; their bearings take turns."""
    low, high = CastTask(Scenario()).bearings
    share = (np.arange(n) * (np.sqrt(5) - 1) / 2) % 1
    return [from_polar(*of) for of in zip(np.linspace(*RADII, n), low + (high - low) * share, strict=True)]


def learner_curve(simulator: CastSimulator, cups: list[Position], seed: int, n_generations: int) -> Curve:
    """Return the curve of CMA-ES."""
    task, curve = CastTask(simulator.scenario), {}
    for n, weights in learn(seed, n_generations):
        curve[n] = hits(simulator, cups, lambda cup, w=weights: task.cast(policy(w, np.array([cup]))[0]))
        err.print(f"seed {seed}: {n} casts, {curve[n]:.0%}")
    return curve


def planner_curve(simulator: CastSimulator, cups: list[Position], seed: int) -> Curve:
    """Return the curve of the program, whose forward model learned from the first so many casts of a seed."""
    scenario = simulator.scenario
    casts = sample_casts(scenario, max(N_TRAINING), seed)
    frame = simulate_batch(scenario, casts)
    curve = {}
    for n in N_TRAINING:
        model = ForwardModel.fit(CastDataset(scenario, seed, frame[:n], engine="batch"))
        # A cup beyond what the model knows is cast at as near as it can be planned for.
        reach = Reach.of(model)
        curve[n] = hits(simulator, cups, lambda cup, m=model, r=reach: plan_cast(m, r.nearest_position(cup)).cast)
    return curve


def first_enough(curve: Curve) -> int | None:
    """Return the casts from which on a curve stays at `ENOUGH` or above, or none."""
    low = [n for n, share in curve.items() if share < ENOUGH]
    above = [n for n in curve if n > max(low, default=-1)]
    return min(above, default=None)


def agreement(simulator: CastSimulator, n: int) -> dict[str, int]:
    """Return how many of `n` casts are hits by their landing, are caught, and are both."""
    model, scenario, rng = reference_model(), simulator.scenario, np.random.default_rng(0)
    counts = {"by landing": 0, "caught": 0, "both": 0}
    for distance in np.linspace(*RADII, n):
        plan = plan_cast(model, (float(distance), 0.0))
        cup = (float(distance + rng.uniform(-1.5, 1.5) * scenario.cup.inner_radius), 0.0)
        outcome = simulator.simulate(plan.cast, cup)
        is_hit = not outcome.limits_hit and outcome.is_slack and outcome.miss <= scenario.cup.inner_radius
        for name, is_so in zip(counts, (is_hit, outcome.is_caught, is_hit and outcome.is_caught), strict=True):
            counts[name] += bool(is_so)
    return counts


def draw(axes: Axes, curves: dict[str, list[Curve]]) -> None:
    """Draw each seed's share of hits over the casts."""
    for (name, seeds), style in zip(curves.items(), curve_styles(curves).values(), strict=True):
        for number, curve in enumerate(seeds):
            shares = [100 * share for share in curve.values()]
            axes.plot(list(curve), shares, label=name if number == 0 else None, alpha=0.8, **style)
    axes.axhline(100 * ENOUGH, color="0.5", linewidth=0.8)
    axes.set(xscale="log", ylim=(-2, 102), xlabel="simulated casts learned from", ylabel="cups hit [%]")
    axes.grid()
    draw_legend(axes)


def write_curves(curves: dict[str, list[Curve]], path: Path) -> None:
    """Draw the curves to a file."""
    with figure_style():
        figure = Figure(figsize=(5.2, 3.4), layout="constrained")
        draw(figure.subplots(), curves)
        write_figure(figure, path, dpi=150)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--seeds", type=int, default=2, help="runs of each")
    arguments.add_argument("--generations", type=int, default=48, help="of the learner, of 128 casts")
    arguments.add_argument("--cups", type=int, default=20, help="that are cast at in a test")
    arguments.add_argument("--agreement", type=int, default=60, help="casts over which the two verdicts are compared")
    arguments.add_argument("--picture", type=Path, metavar="FILE", help="draw it there")
    arguments.add_argument("--out", type=Path, metavar="FILE", help="write all numbers there, as JSON")
    options = arguments.parse_args()
    if options.picture is not None:
        check_picture(options.picture)
    simulator, cups = CastSimulator(Scenario()), test_cups(options.cups)
    if options.agreement:
        out.print(f"of {options.agreement} casts: {agreement(simulator, options.agreement)}")
    curves: dict[str, list[Curve]] = {"forward model and program": [], "CMA-ES on rewards": []}
    for seed in range(options.seeds):
        curves["CMA-ES on rewards"].append(learner_curve(simulator, cups, seed, options.generations))
        curves["forward model and program"].append(planner_curve(simulator, cups, seed))
        rows = [(name, f"{seed}", str(of[seed]), f"{first_enough(of[seed])}") for name, of in curves.items()]
        print_table(rows, ("", "seed", "hits by casts", f"{ENOUGH:.0%} from"))
        if options.out is not None:
            options.out.write_text(json.dumps(curves, indent=1), encoding="utf-8")
        if options.picture is not None:
            write_curves(curves, options.picture)
    out.print(f"{len(cups)} cups, {CASTS_A_GENERATION} casts a generation")


if __name__ == "__main__":
    main()
