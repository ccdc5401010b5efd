"""The report's figures: what each shows, and in which files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.experiments.paper import published as paper
from wam_cast.experiments.paper.execution import clear_radius
from wam_cast.experiments.paper.findings import PAPERS_PLANNER, Findings
from wam_cast.experiments.paper.results import ErrorCurve, Execution, to_array
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

LEARNED_WITH_NOISE = "learned with noise"
"""Ends the label of an execution whose model did."""


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


def _new(
    height: float, n_rows: int = 1, n_columns: int = 1, *, sharey: bool = False
) -> tuple[Figure, np.ndarray]:
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.subplots(n_rows, n_columns, squeeze=False, sharey=sharey)


def _data_flow(_: Findings) -> Figure:
    figure, axes = _new(3.6)
    draw_data_flow(axes[0, 0])
    return figure


def _middle_trial(findings: Findings) -> tuple[Cast, tuple[float, float]]:
    """Return the cast and the cup in the middle of the line."""
    trials = findings.executions[0].trials
    trial = trials[len(trials) // 2]
    return Cast(trial.distance, trial.speed, trial.wait), (trial.cup, 0.0)


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
    draw_histogram(axes[0, 0], to_array(samples.distance), label="distance [m]", bounds=bounds.distance)
    draw_histogram(axes[0, 1], to_array(samples.speed), label="mean speed [m/s]", bounds=bounds.speed)
    draw_histogram(axes[1, 0], to_array(samples.wait), label="wait [ms]", scale=MS, bounds=bounds.wait)
    draw_histogram(axes[1, 1], to_array(samples.landing_along), label="landing from the base axis [m]")
    return figure


def _curves(curve: ErrorCurve) -> dict[str, np.ndarray]:
    return {
        "validation": to_array(curve.validation_rmse),
        "leave-one-out": to_array(curve.leave_one_out_rmse),
    }


def _selection(findings: Findings) -> Figure:
    figure, axes = _new(3.8, 1, 2)
    selection = findings.selection
    draw_error_curve(
        axes[0, 0],
        np.array(selection.sigma_curve.x),
        _curves(selection.sigma_curve),
        xlabel="sigma, in scaled parameters [1]",
        descents=[(np.array(descent.x), np.array(descent.rmse)) for descent in selection.descents],
        chosen={
            "leave-one-out": selection.isotropic.sigma[0],
            "validation": selection.by_validation.sigma[0],
        },
    )
    draw_error_curve(
        axes[0, 1],
        np.array(selection.regularization_curve.x),
        _curves(selection.regularization_curve),
        xlabel="lambda [1]",
        chosen={"leave-one-out": selection.isotropic.regularization},
    )
    return figure


def _performance(findings: Findings) -> Figure:
    executions = findings.executions
    figure = Figure(figsize=(WIDTH, 2.6 * len(executions) + 2.4), layout="constrained")
    *panels, last = figure.subplots(len(executions) + 1, 1)
    for axes, execution in zip(panels, executions, strict=True):
        _draw_execution(axes, execution, findings.settings.scenario)
    # The program's own predictions hit the middle to far less than what matters.
    papers = findings.execution.trials
    misses = {f"{PAPERS_PLANNER}, predicted": to_array(trial.predicted_miss for trial in papers)} | {
        f"{one.label}, executed": to_array(trial.executed_miss for trial in one.trials) for one in executions
    }
    draw_miss_distribution(last, misses)
    return figure


def _draw_execution(axes: Axes, execution: Execution, scenario: Scenario) -> None:
    trials = execution.trials
    # A ball may miss sideways too: the distance has the sign of its part along the casting plane.
    executed = np.copysign(
        to_array(trial.executed_miss for trial in trials), to_array(trial.executed_offset for trial in trials)
    )
    draw_performance(
        axes,
        np.array([trial.cup for trial in trials]),
        np.array([trial.predicted_offset for trial in trials]),
        executed,
        [trial.status for trial in trials],
        cup_radius=scenario.cup.inner_radius,
        ball_radius=scenario.ball.radius,
    )
    axes.set_title(execution.label, loc="left")


def _comparison(findings: Findings) -> Figure:
    figure, axes = _new(3.6)
    rows = sorted(findings.comparison.rows, key=lambda row: row.rmse)
    low, high = np.array([row.rmse_interval for row in rows]).T
    by_name = {row.name: row.label for row in rows}
    draw_comparison(
        axes[0, 0],
        [row.label for row in rows],
        np.array([row.rmse for row in rows]),
        low,
        high,
        paper={
            by_name["isotropic_by_validation"]: paper.TEST_RMSE,
            by_name["polynomial_12"]: paper.POLYNOMIAL_RMSE,
        },
    )
    return figure


def _polynomials(findings: Findings) -> Figure:
    figure, axes = _new(3.2)
    fits = findings.comparison.polynomials
    curves = {
        part: np.array([getattr(fit, f"{part}_rmse") for fit in fits])
        for part in ("training", "validation", "test")
    }
    draw_polynomials(axes[0, 0], np.array([fit.degree for fit in fits]), curves, paper=paper.POLYNOMIAL_RMSE)
    return figure


def _parity(findings: Findings) -> Figure:
    figure, axes = _new(3.4, 1, 2)
    measured, predicted = (
        np.array(values) for values in (findings.comparison.test_measured, findings.comparison.test_predicted)
    )
    draw_parity(axes[0, 0], measured, predicted)
    draw_residuals(axes[0, 1], predicted, predicted - measured)
    return figure


def _where_wrong(findings: Findings) -> Figure:
    figure, axes = _new(3.6, 1, 2)
    held_out = findings.comparison.held_out
    distance, speed, wait, residual = (
        np.array(values) for values in (held_out.distance, held_out.speed, held_out.wait, held_out.residual)
    )
    draw_residual_map(axes[0, 0], distance, speed, residual, xlabel="distance [m]", ylabel="mean speed [m/s]")
    draw_shortest_move(axes[0, 0], findings.settings.scenario.motion.min_move_duration)
    draw_residual_map(axes[0, 1], wait * MS, speed, residual, xlabel="wait [ms]", ylabel="mean speed [m/s]")
    return figure


def _learning_curves(findings: Findings) -> Figure:
    figure, axes = _new(3.8)
    found = findings.learning_curves
    curves = {
        name: LearningCurve(np.array(band.median), np.array(band.low), np.array(band.high))
        for name, band in found.curves.items()
    }
    draw_learning_curves(
        axes[0, 0],
        np.array(found.n_train),
        curves,
        ylabel="validation RMSE [cm]",
        paper=paper.TEST_RMSE,
    )
    return figure


def _calibration(findings: Findings) -> Figure:
    figure, axes = _new(3.6)
    empirical = {name: np.array(values) for name, values in findings.comparison.empirical.items()}
    draw_calibration(axes[0, 0], np.array(findings.comparison.coverage), empirical)
    return figure


def _landing_map(findings: Findings) -> Figure:
    found = findings.landing_map
    figure, axes = _new(2.8, 1, len(found.waits), sharey=True)
    landing, allowed = np.array(found.landing), np.array(found.is_allowed)
    low, high = np.nanmin(landing[:, allowed]), np.nanmax(landing[:, allowed])
    levels = np.arange(np.floor(10 * low), np.ceil(10 * high) + 1) / 10
    for panel, wait, plane in zip(axes[0], found.waits, landing, strict=True):
        draw_landing_map(
            panel,
            np.array(found.distance),
            np.array(found.speed),
            plane,
            is_allowed=allowed,
            wait=wait,
            levels=levels,
        )
        panel.label_outer()
    draw_landing_scale(axes[0], levels)
    return figure


def _noise(findings: Findings) -> Figure:
    noise, scenario = findings.noise, findings.settings.scenario
    learned = [one for one in noise.executions if one.label.endswith(LEARNED_WITH_NOISE)]
    figure = Figure(figsize=(WIDTH, 2.6 * (len(learned) + 2)), layout="constrained")
    top, *middle, bottom = figure.subfigures(len(learned) + 2, 1, squeeze=False)[:, 0]
    scatter, curve = top.subplots(1, 2)
    draw_landing_scatter(
        scatter, to_array(noise.along), to_array(noise.across), clear_radius=clear_radius(scenario)
    )
    draw_error_curve(
        curve,
        np.array(noise.regularization_curve.x),
        _curves(noise.regularization_curve),
        xlabel="lambda [1]",
        chosen={"leave-one-out": noise.models[0].regularization},
    )
    for panel, execution in zip(middle, learned, strict=True):
        _draw_execution(panel.subplots(), execution, scenario)
    misses = {one.label: to_array(trial.executed_miss for trial in one.trials) for one in noise.executions}
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
    "figure-09-parity": (
        _parity,
        "Figure 9. Predicted and measured landings of the test casts, and the residuals.",
    ),
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
    "figure-13-landing-map": (
        _landing_map,
        "Figure 13. Predicted landing over distance and speed, at four waits.",
    ),
    "figure-14-noise": (
        _noise,
        "Figure 14. Noise: scatter of the landing, the error over lambda, and executed misses.",
    ),
}
"""How each figure is drawn, and its caption, by the name of its files."""

CAPTIONS = {name: caption for name, (_, caption) in _FIGURES.items()}
