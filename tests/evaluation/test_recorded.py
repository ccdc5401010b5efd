"""Recordings cut and joined for the pictures."""

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.evaluation.recorded import SAMPLED, join, without_turn
from wam_cast.evaluation.replay import cast_ends, describe_all
from wam_cast.system.motion import Stage


def test_cut_recording_begins_with_the_move_and_its_clock_too(missed):
    cut = without_turn(missed)
    assert np.any(missed.stages == Stage.TURN)
    assert cut.stages[0] == Stage.MOVE
    assert cut.times[0] == 0
    n = len(cut.times)
    for name in SAMPLED:
        assert len(getattr(cut, name)) == n
    np.testing.assert_array_equal(cut.states, missed.states[-n:])


def test_ball_of_a_cut_recording_is_at_the_rim_plane_when_its_outcome_says_so(simulator):
    cut = without_turn(simulator.record(Cast(0.3, 0.6, 0.1, bearing=-0.01)))
    after = np.searchsorted(cut.times, cut.outcome.crossing_time)
    assert cut.p_WL[after - 1, 2] > 0.12 >= cut.p_WL[after, 2]


def test_recording_without_a_turn_is_left_as_it_is(caught):
    cut = without_turn(caught)
    for name in SAMPLED:
        np.testing.assert_array_equal(getattr(cut, name), getattr(caught, name))


def test_joined_recordings_have_one_clock_and_no_sample_twice(caught, missed):
    joined = join([caught, missed])
    n = len(caught.times)
    for name in SAMPLED:
        assert len(getattr(joined, name)) == n + len(missed.times) - 1
    assert np.all(np.diff(joined.times) > 0)
    assert joined.times[n] == pytest.approx(caught.times[-1] + missed.times[1], abs=1e-12)
    np.testing.assert_array_equal(joined.p_WL[n:], missed.p_WL[1:])
    np.testing.assert_allclose(cast_ends([caught, missed]), [caught.times[-1], joined.times[-1]], atol=1e-12)
    assert join([caught]) is caught


def test_caption_of_several_casts_counts_and_lists_them(caught, missed):
    headline, first, second = describe_all([caught, missed], [None, None])
    assert headline == "1 of 2 cups in one go"
    assert first.startswith("1  Cup at")
    assert "caught" in first
    assert second.startswith("2  Cup at (0.500, -0.400) m")
    assert len(describe_all([caught], [None])) == 2
