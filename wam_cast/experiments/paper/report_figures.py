"""The report's figures: what each shows, and in which files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wam_cast.cast import Cast
from wam_cast.experiments.paper import published as paper
from wam_cast.experiments.paper.findings import Findings, clear_radius
from wam_cast.experiments.paper.noise_study import LEARNED_WITH_NOISE
from wam_cast.experiments.paper.settings import PAPERS_PLANNER, PLANNERS
from wam_cast.parallel.workers import Workers, run_rows
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import CastSimulator
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
    """Draw all figures and write each as PDF and PNG into `folder`; the iterator gives the name of each that is done."""
    return run_rows(partial(_draw_and_write, findings, folder), range(len(_FIGURES)), executor)


def _draw_and_write(findings: Findings, folder: Path, row: int) -> str:
    name = list(_FIGURES)[row]
    with figure_style():
        figure = _draw(name, findings)
        for suffix in ("png", "pdf"):
            write_figure(figure, folder / f"{name}.{suffix}", dpi=DPI)
            figure.set_layout_engine("none")  # laid out once is enough
    return name


def _draw(name: str, findings: Findings) -> Figure:
    draw, height, _ = _FIGURES[name]
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    draw(figure, findings)
    return figure


def _data_flow(figure: Figure, _: Findings) -> None:
    draw_data_flow(figure.subplots())


def _middle_trial(findings: Findings) -> tuple[Cast, tuple[float, float]]:
    """Return the cast and the cup in the middle of the line."""
    trials = findings.executions
    papers = trials[trials["planner"] == PAPERS_PLANNER]
    middle = papers.iloc[len(papers) // 2]
    return Cast(middle["distance"], middle["speed"], middle["wait"]), (middle["radius"], 0.0)


def _set_up(figure: Figure, findings: Findings) -> None:
    _, cup = _middle_trial(findings)
    draw_set_up(figure.subplots(), render_set_up(findings.settings.scenario, cup))


def _motion(figure: Figure, findings: Findings) -> None:
    recording = CastSimulator(findings.settings.scenario).record(*_middle_trial(findings))
    left, right = figure.subfigures(1, 2, squeeze=False, width_ratios=(1, 1.25))[0]
    radius_axes, height_axes = right.subplots(2, 1, sharex=True)
    draw_motion(left.subplots(), radius_axes, height_axes, recording)


def _histograms(figure: Figure, findings: Findings) -> None:
    (distance, speed), (wait, landing) = figure.subplots(2, 2)
    samples, bounds = findings.samples, findings.settings.scenario.bounds
    draw_histogram(distance, samples.distance, label="distance [m]", bounds=bounds.distance)
    draw_histogram(speed, samples.speed, label="mean speed [m/s]", bounds=bounds.speed)
    draw_histogram(wait, samples.wait, label="wait [ms]", scale=MS, bounds=bounds.wait)
    draw_histogram(landing, samples.landing_along, label="landing from the base axis [m]")


def _selection(figure: Figure, findings: Findings) -> None:
    sigma, regularization = figure.subplots(1, 2)
    found = findings.selection
    _draw_error_curve(
        sigma,
        found.sigma_curve,
        xlabel="sigma, in scaled parameters [1]",
        descents=[(descent["x"].to_numpy(), descent["rmse"].to_numpy()) for descent in found.descents],
        chosen={"leave-one-out": found.isotropic.sigma[0], "validation": found.by_validation.sigma[0]},
    )
    chosen = {"leave-one-out": found.isotropic.regularization}
    _draw_error_curve(regularization, found.regularization_curve, xlabel="lambda [1]", chosen=chosen)


def _draw_error_curve(axes: Axes, curve: pd.DataFrame, **options: Any) -> None:
    x, validation, loo = (curve[name].to_numpy() for name in ("x", "validation_rmse", "leave_one_out_rmse"))
    draw_error_curve(axes, x, {"validation": validation, "leave-one-out": loo}, **options)


def _performance(figure: Figure, findings: Findings) -> None:
    trials = findings.executions
    by_label = trials.groupby("label", sort=False)
    *panels, last = figure.subplots(by_label.ngroups + 1, 1)
    for axes, (label, group) in zip(panels, by_label, strict=True):
        _draw_execution(axes, str(label), group, findings.settings.scenario)
    # The program's own predictions hit the middle to far less than what matters.
    papers = trials.loc[trials["planner"] == PAPERS_PLANNER, "predicted_miss"]
    misses = {f"{PAPERS_PLANNER}, predicted": papers.to_numpy()}
    misses |= {f"{label}, executed": group["miss"].to_numpy() for label, group in by_label}
    draw_miss_distribution(last, misses)


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


def _comparison(figure: Figure, findings: Findings) -> None:
    rows = findings.comparison.rows.sort_values("rmse", kind="stable")
    low, high = np.array(rows["rmse_interval"].tolist()).T
    label = dict(zip(rows["name"], rows["label"], strict=True))
    papers = {label["isotropic_by_validation"]: paper.TEST_RMSE, label["polynomial_12"]: paper.POLYNOMIAL_RMSE}
    draw_comparison(figure.subplots(), rows["label"].tolist(), rows["rmse"].to_numpy(), low, high, paper=papers)


def _polynomials(figure: Figure, findings: Findings) -> None:
    fits = findings.comparison.polynomials
    curves = {part: fits[f"{part}_rmse"].to_numpy() for part in ("training", "validation", "test")}
    draw_polynomials(figure.subplots(), fits["degree"].to_numpy(), curves, paper=paper.POLYNOMIAL_RMSE)


def _parity(figure: Figure, findings: Findings) -> None:
    parity, residuals = figure.subplots(1, 2)
    measured, predicted = findings.comparison.test_measured, findings.comparison.test_predicted
    draw_parity(parity, measured, predicted)
    draw_residuals(residuals, predicted, predicted - measured)


def _where_wrong(figure: Figure, findings: Findings) -> None:
    left, right = figure.subplots(1, 2)
    cast = findings.comparison.held_out
    for axes, x, xlabel in ((left, cast.distance, "distance [m]"), (right, cast.wait * MS, "wait [ms]")):
        draw_residual_map(axes, x, cast.speed, cast.residual, xlabel=xlabel, ylabel="mean speed [m/s]")
    draw_shortest_move(left, findings.settings.scenario.motion.min_move_duration)


def _learning_curves(figure: Figure, findings: Findings) -> None:
    found = findings.learning_curves
    curves = {name: LearningCurve(*band[["median", "low", "high"]].to_numpy().T) for name, band in found.curves.items()}
    sizes, ylabel = np.array(found.n_train), "validation RMSE [cm]"
    draw_learning_curves(figure.subplots(), sizes, curves, ylabel=ylabel, paper=paper.TEST_RMSE)


def _calibration(figure: Figure, findings: Findings) -> None:
    draw_calibration(figure.subplots(), findings.comparison.coverage, findings.comparison.empirical)


def _landing_map(figure: Figure, findings: Findings) -> None:
    found = findings.landing_map
    panels = figure.subplots(1, len(found.waits), sharey=True)
    landing, allowed = found.landing, np.array(found.is_allowed)
    low, high = np.nanmin(landing[:, allowed]), np.nanmax(landing[:, allowed])
    levels = np.arange(np.floor(10 * low), np.ceil(10 * high) + 1) / 10
    for axes, wait, plane in zip(panels, found.waits, landing, strict=True):
        draw_landing_map(axes, found.distance, found.speed, plane, is_allowed=allowed, wait=wait, levels=levels)
        axes.label_outer()
    draw_landing_scale(panels, levels)


def _noise(figure: Figure, findings: Findings) -> None:
    noise, scenario = findings.noise, findings.settings.scenario
    by_label = noise.executions.groupby("label", sort=False)
    learned = {str(label): group for label, group in by_label if str(label).endswith(LEARNED_WITH_NOISE)}
    top, *middle, bottom = figure.subfigures(len(learned) + 2, 1, squeeze=False)[:, 0]
    scatter, curve = top.subplots(1, 2)
    draw_landing_scatter(scatter, noise.along, noise.across, clear_radius=clear_radius(scenario))
    chosen = {"leave-one-out": noise.models["regularization"].iloc[0]}
    _draw_error_curve(curve, noise.regularization_curve, xlabel="lambda [1]", chosen=chosen)
    for panel, (label, trials) in zip(middle, learned.items(), strict=True):
        _draw_execution(panel.subplots(), label, trials, scenario)
    draw_miss_distribution(bottom.subplots(), {str(label): trials["miss"].to_numpy() for label, trials in by_label})


_FIGURES: dict[str, tuple[Callable[[Figure, Findings], None], float, str]] = {
    "figure-01-data-flow": (_data_flow, 3.6, "The project: from a scenario to casts that hit."),
    "figure-02-set-up": (_set_up, 5.0, "The set-up before a cast."),
    "figure-03-motion": (_motion, 4.6, "The motion of one cast, in its stages."),
    "figure-04-histograms": (_histograms, 4.2, "Parameters of the training casts, and their landings."),
    "figure-05-selection": (
        _selection,
        3.8,
        "RMSE over sigma, with the paths of the descents on the validation error, and over lambda.",
    ),
    "figure-06-performance": (
        _performance,
        2.6 * len(PLANNERS) + 2.4,
        "Predicted and executed distance from the cup's middle, over the cups, and the distribution of misses.",
    ),
    "figure-07-comparison": (_comparison, 3.6, "Test RMSE of all estimators, with 95 % intervals."),
    "figure-08-polynomials": (_polynomials, 3.2, "Polynomials: RMSE over the degree."),
    "figure-09-parity": (_parity, 3.4, "Predicted and measured landings of the test casts, and the residuals."),
    "figure-10-where-wrong": (
        _where_wrong,
        3.6,
        "Where in parameter space the model is wrong: residuals of casts that it has not seen.",
    ),
    "figure-11-learning-curves": (
        _learning_curves,
        3.8,
        "Validation RMSE over the number of training casts: median and range of random subsets, "
        "the curves drawn slightly apart.",
    ),
    "figure-12-calibration": (_calibration, 3.6, "Reliability of the predicted uncertainty on the validation casts."),
    "figure-13-landing-map": (_landing_map, 2.8, "Predicted landing over distance and speed, at four waits."),
    "figure-14-noise": (
        _noise,
        2.6 * (len(PLANNERS) + 2),
        "Noise: scatter of the landing, the error over lambda, and executed misses.",
    ),
}
"""How each figure is drawn, its height [in] and its caption, by the name of its files."""

CAPTIONS = {name: f"Figure {n}. {caption}" for n, (name, (*_, caption)) in enumerate(_FIGURES.items(), 1)}
