"""How landings depend on engine, integration step and number of links: off MuJoCo's fourth-order method at a fine step.

    python benchmarks/crosscheck.py [--casts 10] [--seed 2] [--links 2 5 7 10 14 20] [--picture FILE]

Drake's method is error-controlled, its step the longest that is allowed. MuJoCo's `Euler` and `implicitfast` are of first order.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from rich.progress import track as track_progress

from wam_cast.cast import Cast
from wam_cast.cli.terminal import err, out, print_table
from wam_cast.crosscheck.flight_numbers import flight_numbers
from wam_cast.crosscheck.mujoco_flight import MujocoSimulator
from wam_cast.crosscheck.mujoco_model import import_mujoco
from wam_cast.generation.sampling import sample_cast
from wam_cast.scenario import Scenario, Simulation
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array
from wam_cast.visualization.picture_files import check_picture, write_figure
from wam_cast.visualization.style import figure_style

track = partial(track_progress, console=err, transient=True)

STEPS = (2e-3, 1e-3, 5e-4, 2.5e-4)
"""Of the integration [s]."""

FINE = 1e-4
"""Step of what the others are held to [s]."""

INTEGRATORS = {"MuJoCo RK4": "mjINT_RK4", "MuJoCo implicitfast": "mjINT_IMPLICITFAST", "MuJoCo Euler": "mjINT_EULER"}
MARKS = dict(zip(("Drake", *INTEGRATORS), "os^v", strict=True))


def drake_landings(scenario: Scenario, step: float, casts: Sequence[Cast]) -> Array:
    """Return how far the balls land from the base axis [m], one a cast."""
    simulator = CastSimulator(scenario.model_copy(update={"simulation": Simulation(max_step=step)}))
    return np.array([simulator.simulate(cast).landing_along for cast in track(casts, "Drake")])


def mujoco_landings(scenario: Scenario, step: float, casts: Sequence[Cast], integrator: str = "mjINT_RK4") -> Array:
    """Return the same in MuJoCo."""
    simulator = MujocoSimulator(scenario, step)
    kind = getattr(import_mujoco().mjtIntegrator, integrator)
    simulator.robot.model.opt.integrator = kind

    def landing(cast: Cast) -> float:
        return float(flight_numbers(simulator.fly(cast), scenario, simulator.limits)["landing_along"])

    return np.array([landing(cast) for cast in track(casts, integrator)])


def by_step(scenario: Scenario, casts: Sequence[Cast]) -> dict[str, list[Array]]:
    """Return by engine, for each of `STEPS`, the landings' distances [m] from those of MuJoCo's fine step."""
    fine = mujoco_landings(scenario, FINE, casts)
    engines: dict[str, Callable[[float], Array]] = {"Drake": lambda step: drake_landings(scenario, step, casts)}
    for name, integrator in INTEGRATORS.items():
        engines[name] = lambda step, integrator=integrator: mujoco_landings(scenario, step, casts, integrator)
    return {name: [np.abs(land(step) - fine) for step in STEPS] for name, land in engines.items()}


def by_links(links: Sequence[int], casts: Sequence[Cast]) -> tuple[dict[str, list[Array]], list[Array]]:
    """Return by engine, for each number of links, landings' distances [m] from those with the most, and Drake's from MuJoCo's."""
    scenarios = [Scenario.from_dict({"string": {"n_links": n}}) for n in links]
    step = Simulation().max_step
    drake = [drake_landings(scenario, step, casts) for scenario in scenarios]
    mujoco = [mujoco_landings(scenario, step, casts) for scenario in scenarios]
    off = {
        name: [np.abs(one - own[-1]) for one in own[:-1]] for name, own in (("Drake", drake), ("MuJoCo RK4", mujoco))
    }
    return off, [np.abs(a - b) for a, b in zip(drake, mujoco, strict=True)]


def draw_by_step(axes: Axes, off: dict[str, list[Array]]) -> None:
    """Draw the median, and the largest as a thin line, of landings' distances [m] over the step."""
    for name, columns in off.items():
        (line,) = axes.loglog(
            1e3 * np.array(STEPS), [1e3 * np.median(one) for one in columns], marker=MARKS[name], label=name
        )
        axes.loglog(1e3 * np.array(STEPS), [1e3 * one.max() for one in columns], color=line.get_color(), lw=0.6)
    axes.set(xlabel="step [ms]", ylabel="landing off the converged one [mm]", title="By integration step")
    axes.minorticks_off()
    axes.set_xticks([1e3 * step for step in STEPS], [f"{1e3 * step:g}" for step in STEPS])
    axes.legend(fontsize="small")


def draw_by_links(axes: Axes, links: Sequence[int], off: dict[str, list[Array]], apart: list[Array]) -> None:
    """Draw the same over the number of links, off the most, and how far the engines are apart."""
    for name, columns in off.items():
        style = {"ls": "-"} if name == "Drake" else {"ls": "none", "mfc": "none", "ms": 10}
        axes.semilogy(
            links[:-1],
            [1e3 * np.median(one) for one in columns],
            marker=MARKS[name],
            label=f"{name}, off {links[-1]} links",
            **style,
        )
    axes.semilogy(links, [1e3 * np.median(one) for one in apart], marker="x", label="Drake off MuJoCo RK4")
    axes.set(xlabel="links", ylabel="landing [mm]", title="By number of links")
    axes.set_xticks(links)
    axes.legend(fontsize="small")


def print_distances(title: str, rows: Sequence[tuple[str, str, Array]]) -> None:
    """Print quantiles of distances [m] in millimetres."""
    out.print(title)
    cells = [
        (name, at, *(f"{value:.2g}" for value in np.percentile(1e3 * off, [50, 95, 100]))) for name, at, off in rows
    ]
    print_table(cells, ["engine", "at", "median", "P95", "max"])


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--casts", type=int, default=10)
    arguments.add_argument("--seed", type=int, default=2)
    arguments.add_argument(
        "--links", type=int, nargs="+", default=[2, 5, 7, 10, 14, 20], help="the last is the standard"
    )
    arguments.add_argument("--picture", type=Path, metavar="FILE", help="draw it there")
    options = arguments.parse_args()
    if options.picture is not None:
        check_picture(options.picture)
    scenario = Scenario()
    casts = [sample_cast(scenario, options.seed, row) for row in range(options.casts)]
    steps = by_step(scenario, casts)
    links, apart = by_links(options.links, casts)
    print_distances(
        f"landings of {len(casts)} casts, off MuJoCo RK4 at {1e3 * FINE:g} ms [mm]",
        [
            (name, f"{1e3 * step:g} ms", off)
            for name, own in steps.items()
            for step, off in zip(STEPS, own, strict=True)
        ],
    )
    print_distances(
        f"off {options.links[-1]} links [mm]",
        [(name, f"{n} links", off) for name, own in links.items() for n, off in zip(options.links, own, strict=False)],
    )
    print_distances(
        "Drake off MuJoCo RK4, both at the default step [mm]",
        [("Drake", f"{n} links", off) for n, off in zip(options.links, apart, strict=True)],
    )
    if options.picture is not None:
        with figure_style():
            figure = Figure(figsize=(8.4, 3.4), layout="constrained")
            left, right = figure.subplots(1, 2)
            draw_by_step(left, steps)
            draw_by_links(right, options.links, links, apart)
            write_figure(figure, options.picture, dpi=110)


if __name__ == "__main__":
    main()
