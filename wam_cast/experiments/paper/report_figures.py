"""The report's figures: what each shows, and in which files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.experiments.paper import published as paper
from wam_cast.experiments.paper.findings import Findings, clear_radius
from wam_cast.experiments.paper.noise_study import LEARNED_WITH_NOISE
from wam_cast.experiments.paper.settings import PAPERS_PLANNER
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array
from wam_cast.visualization.figures.box_diagrams import draw_data_flow
from wam_cast.visualization.figures.estimator_figures import (
    LearningCurve,
    draw_comparison,
    draw_error_curve,
    draw_learning_curves,
    draw_polynomials,
)
from wam_cast.visualization.figures.execution_figures import (
    draw_landing_scatter,
    draw_miss_distribution,
    draw_performance,
)
from wam_cast.visualization.figures.model_figures import (
    draw_calibration,
    draw_histogram,
    draw_parity,
    draw_residual_map,
    draw_residuals,
    draw_shortest_move,
)
from wam_cast.visualization.figures.motion_figures import draw_motion
from wam_cast.visualization.figures.planning_figures import draw_landing_map, draw_landing_scale
from wam_cast.visualization.figures.plot_style import MS
from wam_cast.visualization.figures.robot_figures import draw_set_up, render_set_up
from wam_cast.visualization.picture_files import write_figure
from wam_cast.visualization.style import figure_style

WIDTH = 7.2
"""Of a figure [in]: fills a page's width."""

DPI = 180
"""Of pixel pictures."""


def draw_figures(findings: Findings, folder: Path, executor: Executor | Workers) -> Iterator[str]:
    """Draw all figures and write each as PDF and PNG into `folder`; yield the name of each that is done."""
    names = list(_FIGURES)
    drawn = run_rows(partial(_draw_and_write, findings, folder, names), range(len(names)), executor)
    for name, done in zip(names, drawn, strict=True):
        if done is None:
            raise InputError(f"{name}: its process died; free memory and start again")
        yield name


def _draw_and_write(findings: Findings, folder: Path, names: list[str], row: int) -> str:
    draw, _ = _FIGURES[names[row]]
    with figure_style():
        figure = draw(findings)
        for suffix in ("png", "pdf"):
            write_figure(figure, folder / f"{names[row]}.{suffix}", dpi=DPI)
            figure.set_layout_engine("none")  # laid out once is enough
    return names[row]


def _new(height: float, n_rows: int = 1, n_columns: int = 1, *, sharey: bool = False) -> tuple[Figure, np.ndarray]:
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.subplots(n_rows, n_columns, squeeze=False, sharey=sharey)


def _data_flow(_: Findings) -> Figure:
    figure, axes = _new(3.6)
    draw_data_flow(axes[0, 0])
    return figure


def _middle_trial(findings: Findings) -> tuple[Cast, tuple[float, float]]:
    """Return the cast and the cup in the middle of the line."""
    trials = findings.executions.trials
    papers = trials[trials["planner"] == PAPERS_PLANNER]
    middle = papers.iloc[len(papers) // 2]
    return Cast(middle["distance"], middle["speed"], middle["wait"]), (middle["radius"], 0.0)


def _set_up(findings: Findings) -> Figure:
    figure, axes = _new(5.0)
    _, cup = _middle_trial(findings)
    draw_set_up(axes[0, 0], render_set_up(findings.settings.scenario, cup))
    return figure


def _motion(findings: Findings) -> Figure:
    recording = CastSimulator(findings.settings.scenario).record(*_middle_trial(findings))
    figure = Figure(figsize=(WIDTH, 4.6), layout="constrained")
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=(1, 1.25))[0]
    radius_axes, height_axes = right.subplots(2, 1, sharex=True)
    draw_motion(left.subplots(), radius_axes, height_axes, recording)
    return figure


def _histograms(findings: Findings) -> Figure:
    figure, axes = _new(4.2, 2, 2)
    samples, bounds = findings.samples, findings.settings.scenario.bounds
    draw_histogram(axes[0, 0], samples.distance, label="distance [m]", bounds=bounds.distance)
    draw_histogram(axes[0, 1], samples.speed, label="mean speed [m/s]", bounds=bounds.speed)
    draw_histogram(axes[1, 0], samples.wait, label="wait [ms]", scale=MS, bounds=bounds.wait)
    draw_histogram(axes[1, 1], samples.landing_along, label="landing from the base axis [m]")
    return figure


def _curves(curve: pd.DataFrame) -> dict[str, Array]:
    return {"validation": curve["validation_rmse"].to_numpy(), "leave-one-out": curve["leave_one_out_rmse"].to_numpy()}


def _selection(findings: Findings) -> Figure:
    figure, axes = _new(3.8, 1, 2)
    selection = findings.selection
    draw_error_curve(
        axes[0, 0],
        selection.sigma_curve["x"].to_numpy(),
        _curves(selection.sigma_curve),
        xlabel="sigma, in scaled parameters [1]",
        descents=[(descent["x"].to_numpy(), descent["rmse"].to_numpy()) for descent in selection.descents],
        chosen={"leave-one-out": selection.isotropic.sigma[0], "validation": selection.by_validation.sigma[0]},
    )
    draw_error_curve(
        axes[0, 1],
        selection.regularization_curve["x"].to_numpy(),
        _curves(selection.regularization_curve),
        xlabel="lambda [1]",
        chosen={"leave-one-out": selection.isotropic.regularization},
    )
    return figure


def _performance(findings: Findings) -> Figure:
    trials = findings.executions.trials
    by_label = trials.groupby("label", sort=False)
    figure = Figure(figsize=(WIDTH, 2.6 * by_label.ngroups + 2.4), layout="constrained")
    *panels, last = figure.subplots(by_label.ngroups + 1, 1)
    for axes, (label, group) in zip(panels, by_label, strict=True):
        _draw_execution(axes, str(label), group, findings.settings.scenario)
    # The program's own predictions hit the middle to far less than what matters.
    papers = trials.loc[trials["planner"] == PAPERS_PLANNER, "predicted_miss"]
    misses = {f"{PAPERS_PLANNER}, predicted": papers.to_numpy()}
    misses |= {f"{label}, executed": group["miss"].to_numpy() for label, group in by_label}
    draw_miss_distribution(last, misses)
    return figure


def _draw_execution(axes: Axes, label: str, trials: pd.DataFrame, scenario: Scenario) -> None:
    # A ball may miss sideways too: the distance has the sign of its part along the casting plane.
    executed = np.copysign(trials["miss"].to_numpy(), (trials["landing_along"] - trials["radius"]).to_numpy())
    draw_performance(
        axes,
        trials["radius"].to_numpy(),
        trials["predicted_offset"].to_numpy(),
        executed,
        trials["status"].tolist(),
        cup_radius=scenario.cup.inner_radius,
        ball_radius=scenario.ball.radius,
    )
    axes.set_title(label, loc="left")


def _comparison(findings: Findings) -> Figure:
    figure, axes = _new(3.6)
    rows = findings.comparison.rows.sort_values("rmse", kind="stable")
    low, high = np.array(rows["rmse_interval"].tolist()).T
    by_name = dict(zip(rows["name"], rows["label"], strict=True))
    draw_comparison(
        axes[0, 0],
        rows["label"].tolist(),
        rows["rmse"].to_numpy(),
        low,
        high,
        paper={by_name["isotropic_by_validation"]: paper.TEST_RMSE, by_name["polynomial_12"]: paper.POLYNOMIAL_RMSE},
    )
    return figure


def _polynomials(findings: Findings) -> Figure:
    figure, axes = _new(3.2)
    fits = findings.comparison.polynomials
    curves = {part: fits[f"{part}_rmse"].to_numpy() for part in ("training", "validation", "test")}
    draw_polynomials(axes[0, 0], fits["degree"].to_numpy(), curves, paper=paper.POLYNOMIAL_RMSE)
    return figure


def _parity(findings: Findings) -> Figure:
    figure, axes = _new(3.4, 1, 2)
    measured, predicted = findings.comparison.test_measured, findings.comparison.test_predicted
    draw_parity(axes[0, 0], measured, predicted)
    draw_residuals(axes[0, 1], predicted, predicted - measured)
    return figure


def _where_wrong(findings: Findings) -> Figure:
    figure, axes = _new(3.6, 1, 2)
    cast = findings.comparison.held_out
    for panel, x, xlabel in ((axes[0, 0], cast.distance, "distance [m]"), (axes[0, 1], cast.wait * MS, "wait [ms]")):
        draw_residual_map(panel, x, cast.speed, cast.residual, xlabel=xlabel, ylabel="mean speed [m/s]")
    draw_shortest_move(axes[0, 0], findings.settings.scenario.motion.min_move_duration)
    return figure


def _learning_curves(findings: Findings) -> Figure:
    figure, axes = _new(3.8)
    found = findings.learning_curves
    curves = {name: LearningCurve(*band[["median", "low", "high"]].to_numpy().T) for name, band in found.curves.items()}
    draw_learning_curves(
        axes[0, 0], np.array(found.n_train), curves, ylabel="validation RMSE [cm]", paper=paper.TEST_RMSE
    )
    return figure


def _calibration(findings: Findings) -> Figure:
    figure, axes = _new(3.6)
    draw_calibration(axes[0, 0], findings.comparison.coverage, findings.comparison.empirical)
    return figure


def _landing_map(findings: Findings) -> Figure:
    found = findings.landing_map
    figure, axes = _new(2.8, 1, len(found.waits), sharey=True)
    landing, allowed = found.landing, np.array(found.is_allowed)
    low, high = np.nanmin(landing[:, allowed]), np.nanmax(landing[:, allowed])
    levels = np.arange(np.floor(10 * low), np.ceil(10 * high) + 1) / 10
    for panel, wait, plane in zip(axes[0], found.waits, landing, strict=True):
        draw_landing_map(panel, found.distance, found.speed, plane, is_allowed=allowed, wait=wait, levels=levels)
        panel.label_outer()
    draw_landing_scale(axes[0], levels)
    return figure


def _noise(findings: Findings) -> Figure:
    noise, scenario = findings.noise, findings.settings.scenario
    by_label = noise.executions.groupby("label", sort=False)
    learned = {str(label): group for label, group in by_label if str(label).endswith(LEARNED_WITH_NOISE)}
    figure = Figure(figsize=(WIDTH, 2.6 * (len(learned) + 2)), layout="constrained")
    top, *middle, bottom = figure.subfigures(len(learned) + 2, 1, squeeze=False)[:, 0]
    scatter, curve = top.subplots(1, 2)
    draw_landing_scatter(scatter, noise.along, noise.across, clear_radius=clear_radius(scenario))
    draw_error_curve(
        curve,
        noise.regularization_curve["x"].to_numpy(),
        _curves(noise.regularization_curve),
        xlabel="lambda [1]",
        chosen={"leave-one-out": noise.models["regularization"].iloc[0]},
    )
    for panel, (label, trials) in zip(middle, learned.items(), strict=True):
        _draw_execution(panel.subplots(), label, trials, scenario)
    misses = {str(label): trials["miss"].to_numpy() for label, trials in by_label}
    draw_miss_distribution(bottom.subplots(), misses)
    return figure


_FIGURES: dict[str, tuple[Callable[[Findings], Figure], str]] = {
    "figure-01-data-flow": (_data_flow, "Figure 1. The project: from a scenario to casts that hit."),
    "figure-02-set-up": (_set_up, "Figure 2. The set-up before a cast."),
    "figure-03-motion": (_motion, "Figure 3. The motion of one cast, in its stages."),
    "figure-04-histograms": (_histograms, "Figure 4. Parameters of the training casts, and their landings."),
    "figure-05-selection": (
        _selection,
        "Figure 5. RMSE over sigma, with the paths of the descents on the validation error, and over lambda.",
    ),
    "figure-06-performance": (
        _performance,
        "Figure 6. Predicted and executed distance from the cup's middle, over the cups, and the distribution of misses.",
    ),
    "figure-07-comparison": (_comparison, "Figure 7. Test RMSE of all estimators, with 95 % intervals."),
    "figure-08-polynomials": (_polynomials, "Figure 8. Polynomials: RMSE over the degree."),
    "figure-09-parity": (_parity, "Figure 9. Predicted and measured landings of the test casts, and the residuals."),
    "figure-10-where-wrong": (
        _where_wrong,
        "Figure 10. Where in parameter space the model is wrong: residuals of casts that it has not seen.",
    ),
    "figure-11-learning-curves": (
        _learning_curves,
        "Figure 11. Validation RMSE over the number of training casts: median and range of random subsets, "
        "the curves drawn slightly apart.",
    ),
    "figure-12-calibration": (
        _calibration,
        "Figure 12. Reliability of the predicted uncertainty on the validation casts.",
    ),
    "figure-13-landing-map": (_landing_map, "Figure 13. Predicted landing over distance and speed, at four waits."),
    "figure-14-noise": (
        _noise,
        "Figure 14. Noise: scatter of the landing, the error over lambda, and executed misses.",
    ),
}
"""How each figure is drawn, and its caption, by the name of its files."""

CAPTIONS = {name: caption for name, (_, caption) in _FIGURES.items()}
