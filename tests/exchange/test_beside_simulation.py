"""A measured cast beside a simulated one: errors are differences, and a cast lies on itself."""

import dataclasses

import numpy as np
import pytest

import wam_cast as wc
from wam_cast.errors import InputError
from wam_cast.exchange.beside_simulation import beside_figure, landing_of, lay_beside, write_beside_figure
from wam_cast.exchange.cast_table import MeasuredCast


@pytest.fixture(scope="module")
def measured(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp("tables") / "cast.csv"
    wc.write_recording(recording, path)
    return wc.read_recording(path)


def test_a_cast_lies_on_itself(recording, measured):
    found = lay_beside(measured, recording)
    for error in (found.q_error, found.torque_error, found.ball_error):
        np.testing.assert_array_equal(error, 0.0)
    # Between two samples it is taken to move straight.
    assert np.abs(found.landing_error).max() < 2e-5


def test_errors_are_what_was_added(recording, measured):
    rng = np.random.default_rng(0)
    q, tau = rng.normal(0, 0.01, 7), rng.normal(0, 0.1, 7)
    off = np.array([0.011, -0.007, 0.0])
    moved = dataclasses.replace(measured, q=measured.q + q, torques=measured.torques + tau, p_WL=measured.p_WL + off)
    found = lay_beside(moved, recording)
    np.testing.assert_allclose(found.q_error, np.tile(q, (len(found.q_error), 1)), atol=1e-12)
    np.testing.assert_allclose(found.torque_error, np.tile(tau, (len(found.q_error), 1)), atol=1e-12)
    np.testing.assert_allclose(found.landing_error, off[:2], atol=2e-5)


def test_a_slow_camera_and_another_clock_find_the_same_landing(recording, measured):
    every = slice(1, None, 5)  # 100 Hz
    slow = MeasuredCast(*(getattr(measured, field.name)[every] for field in dataclasses.fields(measured)))
    late = dataclasses.replace(slow, times=slow.times - 0.3).shifted(0.3)
    late.p_WL[::3] = np.nan
    found = lay_beside(late, recording)
    assert np.nanmax(np.abs(found.q_error)) < 1e-9
    assert np.abs(found.landing_error).max() < 5e-4


def test_of_a_ball_in_free_fall_the_landing_is_exact_on_a_straight_path():
    times = 0.1 * np.arange(5)
    p_WL = np.column_stack([0.5 + times, -times, 0.4 - times])
    nothing = np.zeros((5, 7))
    fall = MeasuredCast(times, nothing, nothing, nothing, p_WL)
    np.testing.assert_allclose(landing_of(fall, 0.12), [0.78, -0.28])
    assert np.isnan(landing_of(fall, -1.0)).all()
    np.testing.assert_allclose(landing_of(fall, 0.1), [0.8, -0.3])  # a sample in the plane itself


def test_no_common_time_is_one_line(recording, measured):
    with pytest.raises(InputError, match="shift the recording's clock"):
        lay_beside(measured.shifted(100.0), recording)


def test_one_figure_shows_joints_torques_ball_and_landing(recording, measured, tmp_path):
    off = dataclasses.replace(measured, p_WL=measured.p_WL + np.array([0.01, 0.0, 0.0]), q=measured.q + 0.002)
    found = lay_beside(off, recording)
    joints, ball, torques, landing = beside_figure(found).axes
    curves = {line.get_label(): line for line in joints.lines}
    np.testing.assert_allclose(curves["joint 3"].get_ydata(), 2.0)  # mrad
    assert {line.get_label() for line in ball.lines} >= {"simulated", "measured"}
    assert len([line for line in torques.lines if line.get_label().startswith("joint")]) == 7
    marks = {line.get_label().split(":")[0]: np.ravel(line.get_xydata()) for line in landing.lines}
    c, s = np.cos(recording.cast.bearing), np.sin(recording.cast.bearing)
    np.testing.assert_allclose(marks["measured"] - marks["simulated"], [10 * c, -10 * s], atol=0.05)
    assert landing.patches[0].radius == pytest.approx(30.0)
    write_beside_figure(found, tmp_path / "beside.png")
    assert (tmp_path / "beside.png").read_bytes()[:4] == b"\x89PNG"
