"""Recordings cut and sampled for the pictures."""

from dataclasses import replace

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.motion.stages import Stage
from wam_cast.simulation.outcome import Status
from wam_cast.visualization.recorded import SAMPLED, describe_all, finite_part, frame_moments, holds_ball, without_turn


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


@pytest.mark.parametrize("name", ["states", "p_WL", "p_WE"])
@pytest.mark.parametrize("broken", [np.nan, np.inf])
def test_finite_part_ends_with_the_last_sample_before_the_first_broken_one(caught, name, broken):
    values = getattr(caught, name).copy()
    values[[7, 30], -1] = broken
    part = finite_part(replace(caught, **{name: values}))
    for sampled in SAMPLED:
        np.testing.assert_array_equal(getattr(part, sampled), getattr(caught, sampled)[:7])


def test_finite_part_of_a_recording_that_did_not_diverge_is_all_of_it(caught):
    part = finite_part(caught)
    for sampled in SAMPLED:
        np.testing.assert_array_equal(getattr(part, sampled), getattr(caught, sampled))


def test_frames_show_the_nearest_samples_of_the_cast_that_runs(caught, missed):
    casts = [caught, missed]
    ends = [caught.times[-1], caught.times[-1] + missed.times[-1]]
    moments = frame_moments(casts, 24.0)
    assert (len(moments) - 2) / 24 < ends[-1] <= (len(moments) - 1) / 24
    assert moments[-1] == (1, len(missed.times) - 1)
    shown = [casts[number].times[sample] + (0, ends[0])[number] for number, sample in moments]
    assert np.max(np.abs(shown[:-1] - np.arange(len(moments) - 1) / 24)) <= 0.001 + 1e-9
    numbers = [number for number, _ in moments]
    assert numbers == sorted(numbers)
    assert numbers.count(0) == int(ends[0] * 24) + 1


def test_ball_is_held_from_its_last_entry_until_it_is_lifted_out_and_never_in_a_miss(caught, missed, landed):
    holds = holds_ball(caught)
    changes = np.flatnonzero(np.diff(holds))
    assert len(changes) == 2
    assert caught.stages[changes[0]] == Stage.DROP
    assert caught.stages[changes[1]] == Stage.RETURN
    assert caught.p_WL[changes[0] + 1, 2] < caught.scenario.cup.rim_height < caught.p_WL[changes[0], 2]
    assert not holds_ball(missed).any()
    assert not holds_ball(landed).any()
    # A ball that went in and came out again was not caught.
    came_out = replace(caught, outcome=replace(caught.outcome, status=Status.CAME_OUT))
    assert not holds_ball(came_out).any()


def test_caption_of_several_casts_counts_and_lists_them(caught, missed):
    headline, first, second = describe_all([caught, missed], [None, None])
    assert headline == "1 of 2 cups without a reset"
    assert first.startswith("1  Cup at")
    assert "caught" in first
    assert second.startswith("2  Cup at (0.500, -0.400) m")
    assert len(describe_all([caught], [None])) == 2
