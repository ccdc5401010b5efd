"""Cup after cup without a reset: nothing jumps between two casts, and the second is hardly another for the first."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.motion.stages import Stage
from wam_cast.robot.controller import CastController
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Motion, Noise, Scenario
from wam_cast.simulation.contact_free import ContactFreePhase
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.simulation.recording import Throw
from wam_cast.simulation.simulator import CastSimulator, simulate_cast, simulate_casts

CASTS = [Cast(0.30, 0.60, 0.10), Cast(0.20, 0.30, 0.45, bearing=0.05), Cast(0.30, 0.60, 0.10, bearing=-0.1)]
QUICK = Motion(hold_duration=0.4, pull_duration=0.4, slide_duration=0.4, retreat_duration=1.0)
"""The same casts, and a way home on which a ball is lifted out in less time."""


def assert_identical(found, expected):
    for field in dataclasses.fields(Outcome):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(expected, field.name), err_msg=field.name)


def into_its_cup(simulator, cast):
    return Throw(cast, tuple(simulator.simulate(cast).landing))


@pytest.fixture(scope="module")
def first(simulator):
    return into_its_cup(simulator, CASTS[0])


@pytest.fixture(scope="module")
def throws(simulator, first):
    return [first, *(into_its_cup(simulator, cast) for cast in CASTS[1:])]


@pytest.fixture(scope="module")
def recordings(simulator, throws, once):
    return once("sequence", lambda: simulator.record_sequence(throws))


@pytest.mark.slow
def test_every_ball_is_caught_and_lands_as_it_would_from_rest(simulator, throws, recordings):
    for throw, recording in zip(throws, recordings, strict=True):
        assert recording.outcome.is_caught
        assert recording.outcome.return_faults == ()
        np.testing.assert_allclose(recording.outcome.landing, throw.cup, atol=3e-3)
    assert_identical(recordings[0].outcome, simulator.simulate(CASTS[0], throws[0].cup))


@pytest.mark.slow
def test_each_cast_begins_with_the_state_in_which_the_one_before_ended(recordings):
    for before, after in pairwise(recordings):
        np.testing.assert_array_equal(after.states[0], before.states[-1])
        np.testing.assert_array_equal(after.torques[0], before.torques[-1])
        # The reference too goes on where it was, though the clock begins anew.
        np.testing.assert_allclose(after.p_WE_desired[0], before.p_WE_desired[-1], atol=1e-9)
        assert after.times[0] == 0
        assert after.stages[0] == Stage.TURN
        moved = np.diff(np.concatenate([before.p_WL[-3:], after.p_WL[1:3]]), axis=0) / 0.002
        assert np.linalg.norm(moved, axis=1).max() < 0.02


@pytest.mark.slow
def test_ball_hangs_clear_of_every_cup_when_the_cup_is_moved(recordings):
    scenario = Scenario()
    for recording in recordings:
        assert recording.p_WL[-1, 2] - scenario.ball.radius > scenario.cup.rim_height + 0.05


@pytest.mark.slow
def test_function_tells_the_outcomes_of_the_recordings_and_who_hears_them_may_simulate_something_else(
    throws, recordings
):
    heard = []

    def hear(outcome):
        heard.append(outcome)
        simulate_cast(Scenario(), throws[2].cast, throws[2].cup)  # in the same simulator

    outcomes = simulate_casts(Scenario(), CASTS[:2], [throw.cup for throw in throws[:2]], on_outcome=hear)
    assert heard == outcomes
    assert_identical(outcomes[0], recordings[0].outcome)
    assert_identical(dataclasses.replace(outcomes[1], return_faults=()), recordings[1].outcome)


def test_no_casts_have_no_outcomes():
    assert simulate_casts(Scenario(), [], []) == []


def test_one_throw_is_a_cast_of_its_own(simulator, first):
    throw = dataclasses.replace(first, cast=dataclasses.replace(CASTS[0], bearing=-1e-3))  # its turn is short
    (outcome,) = simulator.simulate_sequence([throw])
    assert outcome.is_caught
    assert_identical(outcome, simulator.simulate(throw.cast, throw.cup))


@pytest.mark.slow
def test_missed_ball_is_put_to_rest_before_the_next_cast(simulator, throws):
    aside = dataclasses.replace(throws[0], cup=(throws[0].cup[0], 0.09))
    outcomes = simulator.simulate_sequence([aside, throws[2]])
    assert outcomes[0].status is Status.SIDE
    assert_identical(outcomes[1], simulator.simulate(throws[2].cast, throws[2].cup))


def test_function_that_is_told_may_simulate_something_else(first):
    scenario, heard = Scenario(), []

    def hear(_):
        heard.append(simulate_cast(scenario, CASTS[0]).status)

    simulate_casts(scenario, [first.cast], [first.cup], on_outcome=hear)
    assert heard == [Status.LANDED]


def test_bearing_that_joint_1_cannot_turn_to_is_refused_before_anything_is_simulated(simulator, first):
    heard = []
    behind = Throw(Cast(0.3, 0.6, 0.1, bearing=3.0), first.cup)
    with pytest.raises(InputError, match="joint 1"):
        simulator.simulate_sequence([first, behind], on_outcome=heard.append)
    assert heard == []


class Counting(CastController):
    """Counts its own control periods in a discrete state."""

    def __init__(self, scenario):
        super().__init__(scenario)
        index = self.DeclareDiscreteState(1)
        self.DeclarePeriodicDiscreteUpdateEvent(scenario.controller.period, 0.0, self._count)
        self._index = index

    def _count(self, context, values):
        values.set_value(self._index, context.get_discrete_state(self._index).value() + 1)


@pytest.mark.slow
def test_controllers_own_state_goes_on_into_the_cup_and_to_the_next_cast(throws):
    simulator = CastSimulator(Scenario(motion=QUICK), make_controller=Counting)
    recordings = simulator.record_sequence(throws[:2])
    loop = simulator._contact._loop
    own = loop.station.controller.GetMyContextFromRoot(loop._simulator.get_context())
    n_periods = sum(round(recording.times[-1] / Scenario().controller.period) for recording in recordings)
    assert own.get_discrete_state(0).value()[0] == pytest.approx(n_periods, abs=4)


def test_diverged_simulation_is_followed_by_a_start_from_rest(simulator, first, monkeypatch):
    limits = iter([1.0, 100.0])  # of the ball's speed [m/s]: what it is in the first throw counts as diverged
    begin = ContactFreePhase._begin

    def begin_with_next_limit(phase, *given):
        monkeypatch.setattr("wam_cast.simulation.station_loop.MAX_BALL_SPEED", next(limits))
        return begin(phase, *given)

    with monkeypatch.context() as patch:
        patch.setattr(ContactFreePhase, "_begin", begin_with_next_limit)
        diverged, after = simulator.simulate_sequence([first, first])
    assert diverged.status is Status.DIVERGED
    assert_identical(after, simulator.simulate(first.cast, first.cup))


@pytest.mark.slow
def test_each_throw_has_the_noise_of_its_own_seed(throws):
    noisy = CastSimulator(Scenario(motion=QUICK, noise=Noise(distance=0.002, swing=0.004)))
    recordings = noisy.record_sequence([throws[0], throws[0]], noise_seed=7)
    assert recordings[0].outcome.is_caught
    for seed, recording in zip((7, 8), recordings, strict=True):
        alone = noisy.record(throws[0].cast, noise_seed=seed)
        reached = recording.p_WE_desired[recording.stages == Stage.WAIT][0]
        np.testing.assert_allclose(reached, alone.p_WE_desired[alone.stages == Stage.WAIT][0], atol=1e-9)
    # Only the first cast starts with noise's swing; the second with what the return left.
    swings = [np.linalg.norm((one.p_WL - one.p_WE)[0, :2]) for one in recordings]
    assert swings[0] > 1e-3
    np.testing.assert_array_equal(recordings[1].states[0], recordings[0].states[-1])


@pytest.mark.parametrize("cup", [(0.6,), (0.6, float("nan"))])
def test_bad_cup_is_refused_before_anything_is_simulated(simulator, first, cup):
    heard = []
    with pytest.raises(InputError, match="cup = "):
        simulator.simulate_sequence([first, Throw(CASTS[1], cup)], on_outcome=heard.append)
    assert heard == []


def test_numbers_of_casts_and_cups_must_agree(first):
    with pytest.raises(InputError, match="3 casts for 1 cups"):
        simulate_casts(Scenario(), CASTS, [first.cup])


def test_controller_that_is_not_told_where_it_starts_cannot_go_on(limp):
    station = CastStation(Scenario(), has_scene=False, controller=limp())
    context = station.diagram.CreateDefaultContext()
    station.set_start(context, CASTS[1])  # a single cast is no trouble
    with pytest.raises(InputError, match="start_bearing"):
        station.set_start(context, CASTS[1], start_bearing=0.2)


@pytest.mark.slow
def test_order_of_cups_over_the_whole_reach_changes_no_landing_much():
    from wam_cast.learning.reference import reference_model
    from wam_cast.planning.plan import plan_cast

    # Lively cups, which leave a ball swinging more.
    simulator = CastSimulator(Scenario.from_dict({"cup": {"restitution": 0.6}}))
    places = [(0.985, 0.0), (0.27, 0.4), (0.83, -0.5), (0.4, 2.5), (0.95, 2.0)]
    plans = [plan_cast(reference_model(), (r * np.cos(b), r * np.sin(b))) for r, b in places]
    outcomes = simulator.simulate_sequence([Throw(plan.cast, plan.cup) for plan in plans])
    for plan, outcome in zip(plans, outcomes, strict=True):
        assert outcome.is_caught
        assert outcome.return_faults == ()
        alone = simulator.simulate(dataclasses.replace(plan.cast, bearing=0.0))
        off = np.subtract([outcome.landing_along, outcome.landing_across], alone.landing)
        assert np.linalg.norm(off) < 5e-3
