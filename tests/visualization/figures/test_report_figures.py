"""What the experiment gives to the drawing functions: signed misses, all descents, and noise for each planner."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from wam_cast.experiments.paper import report_figures as figures
from wam_cast.experiments.paper.noise_study import NoiseStudy
from wam_cast.experiments.paper.selection import Chosen, Selection
from wam_cast.scenario import Scenario
from wam_cast.visualization.style import figure_style

CURVE = pd.DataFrame({"x": [0.1, 1.0], "validation_rmse": [0.01, 0.02], "leave_one_out_rmse": [0.03, np.nan]})

TRIALS = pd.DataFrame(
    {
        "radius": [0.4, 0.5, 0.6],
        "predicted_offset": -0.001,
        "landing_along": [0.397, 0.506, np.nan],
        "miss": [0.005, 0.01, np.nan],
        "status": ["caught", "caught", "never_crossed"],
    }
)


def chosen(sigma):
    return Chosen(sigma=(sigma,), regularization=1e-6, leave_one_out_rmse=0.01, validation_rmse=0.01)


@pytest.fixture
def noise_figure():
    labels = ("gradient, learned with noise", "program, learned with noise", "program, learned without noise")
    noise = NoiseStudy(
        levels={},
        statuses={"landed": 2},
        test_floor=0.01,
        along=np.array([0.01, np.nan]),
        across=np.array([0.001, np.nan]),
        along_std=0.01,
        across_std=0.001,
        models=pd.DataFrame({"regularization": [0.1]}),
        regularization_curve=CURVE,
        executions=pd.concat([TRIALS.assign(label=label) for label in labels]),
    )
    with figure_style():
        yield figures._noise(SimpleNamespace(noise=noise, settings=SimpleNamespace(scenario=Scenario())))


def test_a_miss_is_the_whole_distance_with_the_sign_of_its_part_along_the_plane(axes, line_of):
    figures._draw_execution(axes, "program", TRIALS, Scenario())
    np.testing.assert_allclose(line_of(axes, "caught"), [[0.4, -5], [0.5, 10]])
    np.testing.assert_allclose(line_of(axes, "predicted"), [[0.4, -1], [0.5, -1], [0.6, -1]])
    assert sum(line.get_marker() == "|" for line in axes.lines) == 2  # in the legend, and at the edge


def test_noise_is_shown_for_each_planner_that_learned_with_it(noise_figure, legend_of, assert_reads_well):
    titles = [axes.get_title(loc="left") for axes in noise_figure.axes]
    assert [title for title in titles if title] == ["gradient, learned with noise", "program, learned with noise"]
    assert len(legend_of(noise_figure.axes[-1])) == 3
    assert "chosen by leave-one-out: 0.1" in legend_of(noise_figure.axes[1])
    assert_reads_well(noise_figure)


def test_selection_shows_all_descents_and_both_sigmas_but_not_the_papers(line_of, legend_of, assert_reads_well):
    selection = Selection(
        by_validation=chosen(0.6),
        isotropic=chosen(0.44),
        per_parameter=chosen(0.5),
        sigma_curve=CURVE,
        regularization_curve=CURVE,
        papers_curve=CURVE,
        descents=(
            pd.DataFrame({"x": [0.2, 0.6], "rmse": [0.02, 0.01]}),
            pd.DataFrame({"x": [0.9, 0.7], "rmse": [0.03, 0.01]}),
        ),
    )
    with figure_style():
        figure = figures._selection(SimpleNamespace(selection=selection))
    sigma, regularization = figure.axes
    names = ["validation", "leave-one-out", "descents"]
    marks = ["chosen by leave-one-out: 0.44", "chosen by validation: 0.6"]
    assert legend_of(sigma) == names + marks
    np.testing.assert_allclose(line_of(sigma, "descents"), [[0.2, 2], [0.6, 1]])
    np.testing.assert_allclose(line_of(sigma, "_"), [[0.9, 3], [0.7, 1]])
    assert sigma.get_xlabel() == "sigma, in scaled parameters [1]"
    assert legend_of(regularization) == [*names[:2], "chosen by leave-one-out: 1e-06"]
    assert_reads_well(figure)
