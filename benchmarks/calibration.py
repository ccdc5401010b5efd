"""Whether the model's predictive standard deviation is right: casts that it has never seen, and plans that are executed with noise.

    python benchmarks/calibration.py [--casts 1000] [--cups 100] [--seed 1] [--workers N] [--engine drake]
                                      [--picture FILE]

The casts are of another seed than those that the model was fitted to, chosen and scaled by. Prints the expected calibration
error (the mean difference between the share of casts that central intervals hold and the share that they should hold), and the
errors of casts in eight groups by their predicted standard deviation; then the predicted and the executed share of plans whose
ball enters the cup without touching its rim.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import Progress

from wam_cast.cast import PARAMETERS, cast_bounds
from wam_cast.cli.terminal import out, print_table
from wam_cast.experiments.statistics import coverage, rmse, wilson_interval
from wam_cast.experiments.trials import Thrower, draw_cups, plan_and_execute
from wam_cast.learning.dataset import generate_dataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.kernel_ridge import KernelRidge
from wam_cast.learning.reference import reference_model
from wam_cast.parallel.workers import Workers
from wam_cast.planning.plan import METHODS
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Noise, Scenario
from wam_cast.types import Array
from wam_cast.visualization.figures.model_figures import draw_calibration
from wam_cast.visualization.picture_files import check_picture, write_figure
from wam_cast.visualization.style import figure_style

SHARES = np.linspace(0.05, 0.95, 19)
N_GROUPS = 8


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--casts", type=int, default=1000)
    arguments.add_argument("--cups", type=int, default=100)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument("--workers", type=int, help="default: one for each processor")
    arguments.add_argument("--engine", default="drake", help="that simulates the casts: drake or batch")
    arguments.add_argument("--picture", type=Path, metavar="FILE", help="write the reliability diagram there")
    options = arguments.parse_args()
    if options.picture is not None:
        check_picture(options.picture)
    model = reference_model()
    with Workers(options.workers) as workers, Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("casts", total=options.casts)
        data = generate_dataset(
            model.scenario,
            options.casts,
            options.seed,
            engine=options.engine,
            executor=workers,
            on_progress=lambda done, _: bar.update(task, completed=done),
        )
        frame = data.frame.dropna(subset=list(OUTPUTS))
        casts = frame[list(PARAMETERS)].to_numpy(dtype=float)
        residuals = model.predict(casts)[:, 0] - frame["landing_along"].to_numpy(dtype=float)
        curves = _print_calibration(model, casts, residuals)
        _print_groups(residuals, model.uncertainty.std(casts))
        _print_clear_entries(model, options.cups, options.seed, workers)
    if options.picture is not None:
        with figure_style():
            figure = Figure(figsize=(5.2, 3.4), layout="constrained")
            draw_calibration(figure.subplots(), SHARES, curves)
            write_figure(figure, options.picture, dpi=150)


def _print_calibration(model: ForwardModel, casts: Array, residuals: Array) -> dict[str, Array]:
    """Print the calibration of the posterior alone and of the corrected one; return their coverage."""
    posterior = KernelRidge(
        sigma=model.info.sigma, regularization=model.info.regularization, input_bounds=cast_bounds(model.scenario)
    ).fit(model.training_casts, model.training_outputs[:, 0])
    deviations = {"posterior alone": posterior.predict_std(casts), "corrected": model.uncertainty.std(casts)}
    curves = {name: coverage(residuals, std, SHARES) for name, std in deviations.items()}
    rows = []
    for name, std in deviations.items():
        normalized = np.abs(residuals) / std
        within = ", ".join(f"{np.mean(normalized <= k):.1%}" for k in (1, 2, 3))
        likelihood = np.mean(normalized**2 / 2 + np.log(std * np.sqrt(2 * np.pi)))
        rows.append((name, f"{np.mean(np.abs(curves[name] - SHARES)):.1%}", within, f"{likelihood:.2f}"))
    out.print(f"{len(casts)} casts; the errors' RMSE is {1e3 * rmse(residuals):.2f} mm")
    headings = ["expected calibration error", "within 1, 2, 3 standard deviations", "mean negative log likelihood"]
    print_table(rows, ["standard deviation", *headings])
    return curves


def _print_groups(residuals: Array, std: Array) -> None:
    rows = [
        (
            f"{1e3 * np.sqrt(np.mean(std[group] ** 2)):.2f}",
            f"{1e3 * rmse(residuals[group]):.2f}",
            f"{1e3 * np.abs(residuals[group]).max():.1f}",
        )
        for group in np.array_split(np.argsort(std), N_GROUPS)
    ]
    out.print("errors, by predicted deviation")
    print_table(rows, ["predicted [mm]", "root mean square [mm]", "largest [mm]"])


def _print_clear_entries(model: ForwardModel, n_cups: int, seed: int, workers: Workers) -> None:
    """Print how often balls enter the cup rim-clear with the noise of a typical arm, and how often they are predicted to."""
    scenario = Scenario(noise=Noise.typical())
    bound, cups = model.bound_to(scenario), draw_cups(Reach.of(model), n_cups, seed)
    rows = []
    throwers = [Thrower(method, method, bound, cups) for method in METHODS]
    trials = plan_and_execute(scenario, throwers, seed=seed, executor=workers)
    for method, group in trials.groupby("label", sort=False):
        low, high = wilson_interval(int(group["entered_rim_clear"].sum()), n_cups)
        predicted, executed = group["rim_clear_probability"].mean(), group["entered_rim_clear"].mean()
        rows.append((str(method), f"{predicted:.1%}", f"{executed:.1%}", f"{low:.0%} to {high:.0%}"))
    out.print(f"rim-clear entries, {n_cups} cups, noise on")
    print_table(rows, ["planner", "predicted", "executed", "95 % interval"])


if __name__ == "__main__":
    main()
