"""What the closed form of a cast is worth before the first cast, and as the mean of a model that learns from few.

    python benchmarks/from_nothing.py [--tests 300] [--seeds 8] [--cups 30] [--picture FILE] [--out FILE.json]

Root mean squared error of the landing along the casting plane over random casts that no model has seen, by how many random casts it
learned from: median over several draws of these, with the least and the greatest. Landings are the batched engine's, without noise.
Kernel ridge regression learns what a closed form leaves, or all of the landing, with sigma and lambda of least leave-one-out
error. Closed forms are wrong on purpose, one at a time. Casts that are planned by the closed form alone are executed by Drake.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wam_cast.adaptation.closed_form.closed_form_model import ClosedFormModel
from wam_cast.adaptation.closed_form.hand_path import HandPath, PlannedPath
from wam_cast.adaptation.closed_form.planar_arm import move_arm
from wam_cast.adaptation.closed_form.point_mass import Swing, fall
from wam_cast.batch.engine import simulate_batch
from wam_cast.cast import cast_bounds
from wam_cast.cli.terminal import out, print_table
from wam_cast.experiments.statistics import wilson_interval
from wam_cast.generation.sampling import sample_casts
from wam_cast.learning.hyperparameters import tune_by_lbfgs
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.losses import LeaveOneOutLoss
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.prediction import ALONG
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array
from wam_cast.visualization.picture_files import check_picture, write_figure
from wam_cast.visualization.style import figure_style

N_TRAINING = (0, 2, 5, 10, 20, 50, 100, 200)
"""Casts that are learned from."""

MOST_TRAINING = max(N_TRAINING)

FEW = 50
"""Training casts from which on each parameter has a sigma of its own; fewer choose one for all, from a grid."""

SIGMAS = (0.3, 0.5, 0.8, 1.2, 2.0, 4.0)
REGULARIZATIONS = (1e-4, 1e-3, 1e-2, 1e-1)

TEST_SEED, TRAINING_SEED = 1000, 1001

NO_PRIOR, MODEL = "no prior", "closed form, as a model"
DRAWN = (NO_PRIOR, "closed form", "point mass, planned hand path", "string 3 % too long", "string 3 % too short")

Prior = Callable[[Array], Array]
"""Predicted landings [m], (n,), of casts (n, 3)."""


def closed_form(believed: Scenario, swing: Swing, *, is_planned: bool = False) -> Prior:
    """Return the landings of a scenario as it is believed to be, with the hand where it is planned, or where the arm brings it."""

    def predict(casts: Array) -> Array:
        planned = PlannedPath(believed, casts)
        path: HandPath = planned if is_planned else move_arm(believed, casts).path
        latest = planned.drop_end + believed.motion.hold_duration
        return fall(swing, path, latest, believed.cup.rim_height, believed.ball.radius).radius

    return predict


def with_string(scenario: Scenario, name: str, factor: float) -> Scenario:
    """Return the scenario with a number of its string multiplied."""
    string = scenario.string.model_copy(update={name: factor * getattr(scenario.string, name)})
    return scenario.model_copy(update={"string": string})


def priors(scenario: Scenario) -> dict[str, Prior]:
    """Return what is compared, by name."""
    wrong = {
        "string 3 % too long": with_string(scenario, "length", 1.03),
        "string 3 % too short": with_string(scenario, "length", 0.97),
        "string twice as heavy": with_string(scenario, "mass", 2.0),
        "string half as heavy": with_string(scenario, "mass", 0.5),
    }
    model = ClosedFormModel.of(scenario)
    right = Swing.of(scenario)
    return {
        NO_PRIOR: lambda casts: np.zeros(len(casts)),
        "point mass, planned hand path": closed_form(scenario, Swing.of_point(scenario), is_planned=True),
        "point mass": closed_form(scenario, Swing.of_point(scenario)),
        "closed form, undamped": closed_form(scenario, right._replace(damping=0.0)),
        "closed form, planned hand path": closed_form(scenario, right, is_planned=True),
        "closed form": closed_form(scenario, right),
        MODEL: lambda casts: model.predict(casts)[:, ALONG],
        **{name: closed_form(believed, Swing.of(believed)) for name, believed in wrong.items()},
    }


def fitted(scenario: Scenario, casts: Array, targets: Array) -> KernelRidge:
    """Return the regression of least leave-one-out error."""
    bounds = cast_bounds(scenario)
    if len(casts) >= FEW:
        tuned = tune_by_lbfgs(LeaveOneOutLoss(casts, targets, input_bounds=bounds), sigma0=[0.5] * casts.shape[1])
        estimator = KernelRidge(sigma=tuned.sigma, regularization=tuned.regularization, input_bounds=bounds)
        return estimator.fit(casts, targets)
    tried = [
        KernelRidge(sigma=sigma, regularization=regularization, input_bounds=bounds).fit(casts, targets)
        for sigma, regularization in product(SIGMAS, REGULARIZATIONS)
    ]
    return min(tried, key=lambda one: float(np.mean(one.leave_one_out_residuals() ** 2)))


def learning_curve(
    scenario: Scenario, known: tuple[Array, Array], tests: tuple[Array, Array], n_seeds: int
) -> dict[int, list[float]]:
    """Return the errors [m] by the number of training casts, one for each seed.

    `known` and `tests` are casts, (n, 3), and what a prior leaves of their landings, (n,).
    """
    curve = {0: [rmse(tests[1])]}
    for n in N_TRAINING[1:]:
        errors = []
        for seed in range(n_seeds):
            rows = np.random.default_rng(seed).permutation(len(known[1]))[:n]
            estimator = fitted(scenario, known[0][rows], known[1][rows])
            errors.append(rmse(tests[1] - estimator.predict(tests[0])))
        curve[n] = errors
    return curve


def rmse(errors: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(errors**2)))


def landed(scenario: Scenario, n_casts: int, seed: int) -> tuple[Array, Array]:
    """Return random casts that land, (n, 3), and their landings [m], (n,)."""
    casts = sample_casts(scenario, n_casts, seed)
    landing = simulate_batch(scenario, casts)["landing_along"].to_numpy(dtype=float)
    return casts[np.isfinite(landing)], landing[np.isfinite(landing)]


def catch(scenario: Scenario, n_cups: int) -> list[dict[str, Any]]:
    """Return what becomes of casts that are planned by the closed form alone, for cups evenly over its reach."""
    model, simulator = ClosedFormModel.of(scenario), CastSimulator(scenario)
    trials = []
    for radius in np.linspace(*model.reach, n_cups):
        cup = (float(radius), 0.0)
        plan = plan_cast(model, cup)
        outcome = simulator.simulate(plan.cast, cup)
        trials.append(
            {
                "radius": cup[0],
                "is_feasible": plan.is_feasible,
                "is_caught": outcome.is_caught,
                "status": str(outcome.status),
                "miss": abs(outcome.landing_along - cup[0]),
            }
        )
    return trials


def calibration(scenario: Scenario, tests: tuple[Array, Array]) -> float:
    """Return the share of casts that land within two of the model's standard deviations."""
    model = ClosedFormModel.of(scenario)
    casts, landing = tests
    std = np.array([model.linearize(cast).std for cast in casts])
    return float(np.mean(np.abs(model.predict(casts)[:, ALONG] - landing) <= 2 * std))


def draw(axes: Axes, curves: dict[str, dict[int, list[float]]]) -> None:
    """Draw error by number of casts; no casts at all stand left of a gap."""
    places = {0: 0.9} | {n: float(n) for n in N_TRAINING[1:]}
    for name in DRAWN:
        shown = {n: errors for n, errors in curves[name].items() if n > 0 or name != NO_PRIOR}
        x = [places[n] for n in shown]
        low, middle, high = (1e3 * np.array([of(errors) for errors in shown.values()]) for of in (min, np.median, max))
        (line,) = axes.plot(x, middle, marker="o", markersize=3, label=name)
        axes.fill_between(x, low, high, alpha=0.15, color=line.get_color(), linewidth=0)
    axes.set(xscale="log", yscale="log", xlabel="training casts", ylabel="RMSE of the landing [mm]")
    axes.set_xticks(list(places.values()), [str(n) for n in places])
    axes.minorticks_off()
    axes.set_yticks([2, 5, 10, 20, 50, 100], ["2", "5", "10", "20", "50", "100"])
    axes.legend()


def print_curves(curves: dict[str, dict[int, list[float]]]) -> None:
    """Print a row for each prior: the median over seeds, and the least and the greatest."""

    def cell(name: str, n: int, errors: Sequence[float]) -> str:
        if n == 0:
            return "-" if name == NO_PRIOR else f"{1e3 * errors[0]:.2f}"
        return f"{1e3 * np.median(errors):.2f} ({1e3 * min(errors):.1f} to {1e3 * max(errors):.1f})"

    out.print("RMSE of the landing [mm], by training casts: median, least and greatest over seeds")
    rows = [(name, *(cell(name, n, errors) for n, errors in curve.items())) for name, curve in curves.items()]
    print_table(rows, ("prior mean", *map(str, N_TRAINING)))


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--tests", type=int, default=300, help="casts that are predicted")
    arguments.add_argument("--seeds", type=int, default=8, help="draws of the training casts")
    arguments.add_argument("--cups", type=int, default=30, help="planned by the closed form alone; 0: none")
    arguments.add_argument("--scenario", type=Path, metavar="FILE", help="by default the reference scenario")
    arguments.add_argument("--picture", type=Path, metavar="FILE", help="draw it there")
    arguments.add_argument("--out", type=Path, metavar="FILE", help="write all numbers there, as JSON")
    options = arguments.parse_args()
    if options.picture is not None:
        check_picture(options.picture)
    scenario = Scenario() if options.scenario is None else Scenario.from_yaml(options.scenario)
    tests = landed(scenario, options.tests, TEST_SEED)
    known = landed(scenario, 2 * MOST_TRAINING, TRAINING_SEED)
    curves = {}
    for name, prior in priors(scenario).items():
        left, left_of_tests = ((casts, landing - prior(casts)) for casts, landing in (known, tests))
        curves[name] = learning_curve(scenario, left, left_of_tests, options.seeds)
    print_curves(curves)
    share = calibration(scenario, tests)
    out.print(f"{share:.1%} of {len(tests[1])} landings are within two standard deviations of the closed form's model")
    trials = catch(scenario, options.cups)
    if trials:
        n_caught = sum(trial["is_caught"] for trial in trials)
        low, high = wilson_interval(n_caught, len(trials))
        median, greatest = (1e3 * of([trial["miss"] for trial in trials]) for of in (np.median, max))
        out.print(
            f"before the first cast: {n_caught} of {len(trials)} cups caught (95 % interval {low:.0%} to {high:.0%}); "
            f"miss {median:.1f} mm at the median, {greatest:.1f} mm at most"
        )
    if options.out is not None:
        found = {"rmse": curves, "within_two_std": share, "cups": trials}
        options.out.write_text(json.dumps(found, indent=1), encoding="utf-8")
    if options.picture is not None:
        with figure_style():
            figure = Figure(figsize=(5.2, 3.6), layout="constrained")
            draw(figure.subplots(), curves)
            write_figure(figure, options.picture, dpi=150)


if __name__ == "__main__":
    main()
