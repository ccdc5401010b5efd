"""Each notebook runs from top to bottom in an empty directory, warns of nothing, and its results are right."""

import sys

import nbformat
import pytest
from nbclient.exceptions import CellExecutionError

pytestmark = pytest.mark.slow

CHECKS = {
    "01_the_robot": [
        "plant.num_velocities() == 7 + 2 * scenario.string.n_links + 2",
        "abs(table['mass [kg]'].sum() - arm.CalcTotalMass(context)) < 1e-9",
        "(table.filter(like='I3').to_numpy() < table.filter(regex='I[12]').sum(axis=1).to_numpy()[:, None]).all()",
        "jacobian_error < 1e-8",
        "0.2 < utilization.max() < 0.5",
        "np.allclose(torques[:, 2] @ np.ones(7), 10 * J[2].sum())",
        "sliders.stop() is None",  # they would be followed on
    ],
    "02_the_diagram": [
        "error < 1e-12",
        "abs(from_port[3]) > abs(given[3]) == arm.GetEffortUpperLimits()[3]",
        "np.abs(np.linalg.solve(J @ J.T, J @ posture)).max() < 1e-9",
        "len(table) == 15 and table['unit'].notna().all()",
        "list(peak_error) == sorted(peak_error, reverse=True)",
        "list(peak_error.values()) == sorted(peak_error.values())",
        "outcomes['CastController'].is_caught",
        "outcomes['PaperLaw'].limits_hit == ('joint 6 position',)",
        "outcomes['PaperLaw'].miss < 2e-3",
        "np.linalg.norm(ball[:2] - cup) < 0.01 and ball[2] < 0.03",
        "paths[0.02][1, -1] > paths[0.01][1, -1] > 0.005 > abs(paths[0.0][1]).max()",
        "image.mean() > 150",
        "np.allclose(swing, swing_frequency(scenario), rtol=1e-4)",
    ],
    "03_one_cast": [
        "outcome.is_caught",
        "abs(recording.times[-1] - sum(times[-1] - times[0] for _, times in pieces)) < 1e-9",
        "tracking_error.max() < 0.01",
        "np.allclose(utilization['torque'][cast_part.stages <= 3].max(axis=0), outcome.peak_torque_utilization, atol=0.02)",
        "abs(utilization['velocity'][cast_part.stages <= 3].max(axis=0)[3] - outcome.peak_velocity_utilization[3]) < 0.02",
        "abs(np.interp(outcome.crossing_time, cast_part.times, slack) - outcome.slack) < 2e-3",
        "abs(slack[cast_part.times < 0.9]).max() < 1e-3",
        "all(draw_moment(number).axes for number in (0, landing + 1, len(moments) - 1))",
    ],
    "04_data_and_model": [
        "(len(few), len(data)) == (10, 1700)",
        "largest_difference < 1e-4",
        "np.abs(difference).max() < 1e-7",
        "tuned.is_converged and 0.3 < tuned.sigma < 0.9",
        "0 < test_rmse < 0.003",
        "share_of_worst > 0.5 and share_fast > 0.6",
        "0.8 < within < 1",
        "np.all(np.diff(np.median(draws, axis=1)) < 0)",
    ],
    "05_planning": [
        "np.allclose(plans['program'].searches[0][-1], plans['program'].cast.to_array(), atol=1e-3)",
        "all(abs(model.predict(path[-1:])[0, 0] - 0.9) < 1e-3 for path in plans['program'].searches)",
        "len(plans['gradient'].searches[0]) > 3",
        "set(trials['status']) == {'caught'}",
        "trials[trials['planner'] == 'program']['executed'].abs().max() < 0.002",
        "trials[trials['planner'] == 'gradient']['executed'].abs().max() < 0.012",
        "noisy_plans['program'].rim_clear_probability > max(0.8, 1.5 * np.median(probabilities))",
        "sum(map(enters_rim_clear, outcomes['program'])) > sum(map(enters_rim_clear, outcomes['gradient']))",
        "all(outcome.is_caught for outcome in thrown)",
    ],
    "06_your_own_scenario": [
        "'string.length' in refusal and 'allow less than' in refusal",
        "scenario.ball.mass == 0.045 and len(data) == 80",
        "set(table['status']) == {'caught'}",
        "table['executed miss [mm]'].max() < 5",
        "recording.outcome.is_caught",
        "model.serves(wider) and not model.serves(reference)",
    ],
    "07_an_unknown_robot": [
        "casts['miss'][0] > 0.008 > casts['miss'][1:].max() and casts['is_caught'].all()",
        "casts['predicted_std_along'].is_monotonic_decreasing",
        "campaign.model.n_observed == practised.n_observed == 5",
        "errors['after five casts to learn from'] < 0.5 * errors['before']",
    ],
}
"""By notebook, what must be true after it ran."""

CHEAPER = {
    "05_planning": {
        "np.linspace(0.3, 0.95, 8)": "np.linspace(0.3, 0.95, 5)",
        "range(20)": "range(8)",
        ", (0.9, 20), (0.6, 140))": ", (0.9, 20))",
    }
}
"""By notebook, what shows readers many casts, to convince them, and what runs instead."""


def warnings_of(executed):
    """Return all that the notebook's cells wrote to the standard error."""
    outputs = [output for cell in executed.cells for output in cell.get("outputs", [])]
    return "".join(output.text for output in outputs if output.get("name") == "stderr")


def notebook_of(*cells):
    return nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code) for code in cells])


def test_every_notebook_has_its_checks(notebook_paths):
    assert set(CHECKS) == set(notebook_paths)


@pytest.mark.parametrize("name", CHECKS)
def test_notebook_runs_and_its_results_are_right(name, notebook_paths, committed, run_notebook):
    notebook = nbformat.reads(committed(notebook_paths[name]), as_version=4)
    for words, cheaper in CHEAPER.get(name, {}).items():
        (cell,) = (cell for cell in notebook.cells if cell.cell_type == "code" and words in cell.source)
        cell.source = cell.source.replace(words, cheaper)
    executed = run_notebook(notebook, after=[f"assert {check}" for check in CHECKS[name]])
    assert warnings_of(executed) == ""


@pytest.mark.parametrize(
    "code",
    [
        "from pydrake.common.deprecation import _warn_deprecated as warn\nwarn('old', date='2099-01-01')",
        "assert 1 + 1 == 3",
    ],
)
def test_deprecated_use_of_drake_and_false_checks_stop_a_notebook(code, run_notebook):
    with pytest.raises(CellExecutionError, match=r"DrakeDeprecationWarning|AssertionError"):
        run_notebook(notebook_of("x = 1"), after=[code])


def test_what_python_and_cpp_warn_of_is_noticed(run_notebook):
    by_python = "import warnings\nwarnings.warn('from Python')"
    by_cpp = "import os\n_ = os.write(2, b'from C++')"
    # A thread of the kernel reads what C++ writes, and may do so after the cell.
    noticed = warnings_of(run_notebook(notebook_of(by_python, by_cpp), after=["import time", "time.sleep(0.5)"]))
    assert "from Python" in noticed
    assert "from C++" in noticed


def test_notebook_runs_this_python_in_an_empty_directory(run_notebook):
    checks = ["import os, sys", "assert os.listdir() == []", f"assert sys.executable == {sys.executable!r}"]
    run_notebook(notebook_of("x = 1"), after=checks)


def test_a_notebook_finds_nothing_of_the_one_before_it(kernel, run_notebook):
    left = ["x = 1\nimport wam_cast.motion.spline", "open('here.txt', 'w').close()"]
    run_notebook(notebook_of(*left), after=["import sys", "assert 'wam_cast.motion.spline' in sys.modules"])
    found = ["assert 'x' not in globals() and 'sys' not in globals()", "import sys"]
    run_notebook(notebook_of("pass"), after=[*found, "assert not [name for name in sys.modules if 'wam_cast' in name]"])


def test_joint_sliders_are_followed_between_the_cells_until_they_are_stopped(run_notebook):
    setup = """
import asyncio

import numpy as np

import wam_cast as wc
from wam_cast.visualization.interactive.joint_sliders import JointSliders
from wam_cast.visualization.viewer import open_meshcat

meshcat = open_meshcat()
sliders = JointSliders(meshcat, wc.Scenario(), {"E": "tool_plate"})
sliders.follow()
"""
    move = "poses.append(meshcat._GetPackedTransform('/frames/E'))\nmeshcat.SetSliderValue('joint 2 [rad]', {})"
    wait = "await asyncio.sleep(0.3)"
    cells = [setup + "poses = []", move.format(0.5), wait, "sliders.stop()", move.format(-0.5), wait, move.format(0)]
    run_notebook(notebook_of(*cells), after=["before, followed, after = poses\nassert before != followed == after"])
