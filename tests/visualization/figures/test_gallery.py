"""What all figures keep: text that can be read, units, and their hands off the data and the settings, whatever the data."""

import copy
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from wam_cast.simulation.outcome import Status
from wam_cast.visualization.figures.adaptation_figures import draw_approach, draw_beliefs
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
    draw_errors,
    draw_histogram,
    draw_parity,
    draw_residual_map,
    draw_residuals,
)
from wam_cast.visualization.figures.planning_figures import draw_landing_map
from wam_cast.visualization.figures.plot_style import CURVE_STYLES, curve_styles

pytestmark = pytest.mark.slow

RNG = np.random.default_rng(0)
NONE = np.array([])
UNKNOWN = np.full(5, np.nan)
FIVE = np.linspace(0.1, 0.9, 5)
SIGMAS = np.geomspace(0.05, 5, 30)
ERRORS = 0.002 * (SIGMAS + 1 / SIGMAS)
N_TRAIN = np.array([25, 100, 400, 1300])
FALLING = 1.0 / N_TRAIN
CUP: Any = {"cup_radius": 0.03, "ball_radius": 0.02}
RADIUS: Any = {"cup_radius": 0.03}
PLANE = np.linspace(0.05, 0.4, 20), np.linspace(0.2, 0.85, 25)
LANDING = np.add.outer(PLANE[1], 0.5 * PLANE[0])
SLOW_ENOUGH = PLANE[0] > 0.2 * PLANE[1][:, None]
LEVELS = np.arange(0.2, 1.1, 0.1)
STATUSES = [status.value for status in Status]


class Case(NamedTuple):
    """A function that draws, and what it is given."""

    draw: Any
    args: tuple
    settings: dict[str, Any] = {}  # noqa: RUF012 - never changed


def error_curve(rmse, **settings):
    return Case(draw_error_curve, (SIGMAS, {"validation": rmse}), {"xlabel": "σ [1]", **settings})


def performance(predicted, executed, statuses, **settings):
    cups = np.linspace(0.3, 0.9, len(predicted))
    return Case(draw_performance, (cups, predicted, executed, statuses), CUP | settings)


def residual_map(residuals):
    axis_labels = {"xlabel": "distance [m]", "ylabel": "speed [m/s]"}
    return Case(draw_residual_map, (np.arange(len(residuals)), np.arange(len(residuals)), residuals), axis_labels)


def landing_map(is_allowed, landing=LANDING):
    settings = {"is_allowed": is_allowed, "wait": 0.2, "levels": LEVELS}
    return Case(draw_landing_map, (*PLANE, landing), settings)


CASES = {
    "histogram": Case(draw_histogram, (FIVE,), {"label": "wait [ms]", "scale": 1e3, "bounds": (0.0, 1.0)}),
    "histogram of nothing": Case(draw_histogram, (NONE,), {"label": "wait [s]"}),
    "histogram of nan": Case(draw_histogram, (UNKNOWN,), {"label": "wait [s]", "bounds": (0.0, 1.0)}),
    "error curve": error_curve(
        ERRORS, descents=[(SIGMAS[3:6], ERRORS[3:6])] * 2, chosen={"validation": 0.5, "leave-one-out": 0.35}
    ),
    "error curve of nan": error_curve(np.full(30, np.nan)),
    "performance": performance(
        RNG.normal(0, 0.002, len(STATUSES)), np.array([*RNG.normal(0, 0.02, len(STATUSES) - 1), np.nan]), STATUSES
    ),
    "performance, all caught": performance(0.1 * FIVE, 0.1 * FIVE, ["caught"] * 5),
    "performance, none landed": performance(0.1 * FIVE, UNKNOWN, ["never_crossed"] * 5),
    "performance of nothing": performance(NONE, NONE, []),
    "misses": Case(draw_miss_distribution, ({"program": 0.1 * FIVE, "gradient": 0.01 * FIVE},)),
    "misses of nan and nothing": Case(draw_miss_distribution, ({"program": UNKNOWN, "gradient": NONE},)),
    "parity": Case(draw_parity, (FIVE, FIVE + 0.01)),
    "parity of nan": Case(draw_parity, (UNKNOWN, UNKNOWN)),
    "residuals": Case(draw_residuals, (FIVE, 0.01 * FIVE)),
    "residuals of nothing": Case(draw_residuals, (NONE, NONE)),
    "residual map": residual_map(np.array([1e-5, -0.02, 0.001, np.nan, 0.0])),
    "residual map of zeros": residual_map(np.zeros(3)),
    "residual map of one": residual_map(np.array([0.01])),
    "residual map of nan": residual_map(UNKNOWN),
    "residual map of nothing": residual_map(NONE),
    "learning curves": Case(
        draw_learning_curves,
        (N_TRAIN, {"kernel ridge": LearningCurve(FALLING, 0.8 * FALLING, 1.2 * FALLING)}),
        {"ylabel": "RMSE [cm]", "paper": 0.0224},
    ),
    "learning curves of nan": Case(
        draw_learning_curves, (FIVE, {"kernel ridge": LearningCurve(UNKNOWN, UNKNOWN, UNKNOWN)}), {"ylabel": "RMSE [cm]"}
    ),
    "landing map": landing_map(SLOW_ENOUGH),
    "landing map, all allowed": landing_map(np.ones_like(SLOW_ENOUGH)),
    "landing map, none allowed": landing_map(np.zeros_like(SLOW_ENOUGH)),
    "landing map beyond its levels": landing_map(SLOW_ENOUGH, LANDING + 5),
    "calibration": Case(draw_calibration, (FIVE, {"test": FIVE**2, "validation": FIVE})),
    "calibration of nan": Case(draw_calibration, (FIVE, {"test": UNKNOWN})),
    "errors": Case(draw_errors, (0.01 * FIVE, 0.01 * FIVE**2)),
    "errors of nan": Case(draw_errors, (FIVE, UNKNOWN)),
    "errors of nothing": Case(draw_errors, (NONE, NONE)),
    "comparison": Case(
        draw_comparison,
        (["kernel ridge", "polynomial", "linear"], np.array([0.002, 0.1, np.nan])) + ((FIVE[:3] * 0.01,) * 2),
        {"paper": {"kernel ridge": 0.0224, "not compared": 1.0}},
    ),
    "comparison of nan": Case(draw_comparison, (list("abcde"), UNKNOWN, UNKNOWN, UNKNOWN)),
    "polynomials": Case(
        draw_polynomials, (np.arange(1, 6), {"training": FIVE, "validation": FIVE, "test": FIVE}), {"paper": 0.217}
    ),
    "polynomials that hit all casts": Case(draw_polynomials, (np.arange(1, 6), {"training": 1e-15 * FIVE})),
    "polynomials of nan": Case(draw_polynomials, (np.arange(1, 6), {"test": UNKNOWN})),
    "landing scatter": Case(draw_landing_scatter, (RNG.normal(0, 0.01, 9), RNG.normal(0, 0.01, 9)), {"clear_radius": 0.01}),
    "landing scatter of nothing": Case(
        draw_landing_scatter, (NONE, NONE), {"clear_radius": 0.01}
    ),
    "beliefs": Case(
        draw_beliefs, (FIVE, {"before": (0.01 * FIVE, 0.02 * FIVE), "after": (0.02 * FIVE, 0.001 * FIVE)}, (FIVE, 0.02 * FIVE)),
        {"xlabel": "mean speed [m/s]"},
    ),
    "beliefs of nan": Case(draw_beliefs, (FIVE, {"before": (UNKNOWN, UNKNOWN)}), {"xlabel": "mean speed [m/s]"}),
    "approach": Case(
        draw_approach, (np.array([[0.06, 0.01], [np.nan, np.nan], [-0.01, 0.0], [0.002, 0.001]]), np.arange(4) > 1), RADIUS
    ),
    "approach of nan": Case(draw_approach, (np.full((2, 2), np.nan), np.zeros(2, dtype=bool)), RADIUS),
    "approach of nothing": Case(draw_approach, (np.empty((0, 2)), np.zeros(0, dtype=bool)), RADIUS),
    "data flow": Case(draw_data_flow, ()),
}  # fmt: skip


WIDE = ("performance", "data flow")
"""Meant to be as wide as a page; the others fit in half of it."""


@pytest.mark.parametrize("name", CASES)
@pytest.mark.filterwarnings("error")
def test_figures_read_well_and_leave_data_and_settings_alone(name, axes, assert_reads_well):
    draw, args, settings = CASES[name]
    given, style = copy.deepcopy((args, settings)), dict(mpl.rcParams)
    if name.startswith(WIDE):
        axes.figure.set_size_inches(6.3, 3.5)
    assert draw(axes, *args, **settings) is None
    np.testing.assert_equal(as_plain((args, settings)), as_plain(given))
    assert dict(mpl.rcParams) == style
    assert_reads_well(axes.figure)


def as_plain(value):
    """Return dataclasses within `value` as dictionaries, which numpy compares."""
    if isinstance(value, LearningCurve):
        return vars(value)
    if isinstance(value, dict):
        return {key: as_plain(item) for key, item in value.items()}
    return [as_plain(item) for item in value] if isinstance(value, tuple | list) else value


def lightness(color):
    return float(np.dot(to_rgb(color), [0.299, 0.587, 0.114]))


def test_looks_differ_without_colour():
    """Two curves differ in dash, and where their dashes agree, in lightness and marker."""
    for number, one in enumerate(CURVE_STYLES):
        for other in CURVE_STYLES[number + 1 :]:
            assert one["marker"] != other["marker"]
            is_lighter = abs(lightness(one["color"]) - lightness(other["color"])) > 0.15
            assert one["linestyle"] != other["linestyle"] or is_lighter


def test_curves_of_one_name_look_the_same_in_all_figures_and_no_two_alike():
    looks = curve_styles(["a", "test", "b", "validation", "training", "c"])
    assert len({str(look) for look in looks.values()}) == 6
    assert looks["test"] == curve_styles(["test"])["test"] == curve_styles(["x", "y", "z", "test"])["test"]
