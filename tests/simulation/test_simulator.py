"""Casts: the same whoever ran before, converged, symmetric, and judged as the ball went."""

import dataclasses
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import LeafSystem
from pydrake.systems.primitives import PassThrough

from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.motion.polling import SLACK_MARGIN
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.robot.controller import CastController
from wam_cast.robot.kinematics import Kinematics
from wam_cast.robot.motors import motor_utilization
from wam_cast.robot.plant import make_arm_plant
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Motion, Scenario, String
from wam_cast.simulation.contact_free import ContactFreePhase
from wam_cast.simulation.judge import BallTrack, find_crossing
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.simulation.simulator import CastSimulator, simulate_cast

CASTS = [
    Cast(0.30, 0.60, 0.10),
    Cast(0.10, 0.40, 0.00),
    Cast(0.20, 0.30, 0.45),
    Cast(0.35, 0.70, 0.20, bearing=0.8),
    Cast(0.17, 0.85, 0.50),  # the shortest move, and the longest wait: the liveliest string
]
TYPICAL = CASTS[0]
EACH = [pytest.param(cast, marks=[pytest.mark.slow] if cast.bearing else []) for cast in CASTS]
"""Most of what the one with a bearing takes is its turn."""
GRAZED = 0.025
"""Beyond the landing [m] the cup's rim turns the ball aside."""


def scenario(**changes):
    return Scenario.from_dict(changes)


def assert_identical(found, expected):
    for field in dataclasses.fields(Outcome):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(expected, field.name), err_msg=field.name)


def turned(vector, bearing):
    c, s = np.cos(bearing), np.sin(bearing)
    return np.array([[c, -s], [s, c]]) @ vector


@pytest.fixture(scope="module")
def recordings(simulator):
    """Return every cast without a cup."""
    return {cast: simulator.record(cast) for cast in CASTS}


@pytest.fixture(scope="module")
def free(recordings):
    """Return the outcome of every cast without a cup."""
    return {cast: recording.outcome for cast, recording in recordings.items()}


@pytest.fixture(scope="module")
def into_cup(simulator, free):
    """Return a function that gives the outcome of a cast into a cup that stands so far beyond the landing [m]."""

    @cache
    def simulate(cast, beyond):
        radius = np.linalg.norm(free[cast].landing)
        return simulator.simulate(cast, tuple(free[cast].landing * (1 + beyond / radius)))

    # To the cache an argument that is left out is another one than its default.
    return lambda cast, beyond=0.0: simulate(cast, beyond)


# ---------------------------------------------------------------- the same whoever ran before


def test_reused_and_fresh_simulators_give_the_same_free_cast(simulator, free):
    assert_identical(CastSimulator(Scenario()).simulate(TYPICAL), free[TYPICAL])
    simulator.simulate(dataclasses.replace(CASTS[3], bearing=0.1), (0.7, 0.1))
    assert_identical(simulator.simulate(TYPICAL), free[TYPICAL])


@pytest.mark.slow
def test_reused_and_fresh_simulators_give_the_same_cast_into_a_cup(simulator, free):
    cup = tuple(free[TYPICAL].landing)
    fresh = CastSimulator(Scenario()).simulate(TYPICAL, cup)
    assert fresh.is_caught
    simulator.record(CASTS[2], (0.3, 0.1))
    simulator.simulate(CASTS[1])
    assert_identical(simulator.simulate(TYPICAL, cup), fresh)
    assert_identical(simulator.simulate(TYPICAL, cup), fresh)


def test_threads_may_simulate_and_get_the_same(free):
    with ThreadPoolExecutor(4) as threads:
        outcomes = list(threads.map(lambda _: simulate_cast(Scenario(), TYPICAL), range(4)))
    for outcome in outcomes:
        assert_identical(outcome, free[TYPICAL])


# ---------------------------------------------------------------- accuracy


def land_error_controlled(cast, accuracy):
    """Return where the ball of the contact-free diagram lands under an error-controlled method of third order."""
    reference = Scenario()
    station = CastStation(reference, has_scene=False)
    integrated = Simulator(station.diagram)
    ResetIntegratorFromFlags(integrated, "runge_kutta3", 0.002)
    integrated.get_mutable_integrator().set_fixed_step_mode(False)
    integrated.get_mutable_integrator().set_target_accuracy(accuracy)
    context = integrated.get_mutable_context()
    station.set_start(context, cast)
    position, velocity = (station.diagram.GetOutputPort(f"ball_{name}") for name in ("position", "velocity"))
    drop_begins = float(CastMotion(reference, cast).stage_ends[2])
    integrated.AdvanceTo(drop_begins)
    samples = []
    while not samples or samples[-1][1][2] > reference.cup.rim_height:
        samples.append((context.get_time(), position.Eval(context).copy(), velocity.Eval(context).copy()))
        integrated.AdvanceTo(context.get_time() + 0.002)
    track = BallTrack(*(np.array(column) for column in zip(*samples, strict=True)))
    return find_crossing(track, reference.cup.rim_height).p_WL[:2]


@pytest.mark.parametrize("cast", EACH, ids=str)
def test_landing_agrees_with_error_controlled_integration(free, cast):
    np.testing.assert_allclose(free[cast].landing, land_error_controlled(cast, 1e-5), atol=1e-5)


@pytest.mark.parametrize(
    ("wait", "returns"),
    [(0.05, False), *(pytest.param(wait, True, marks=pytest.mark.slow) for wait in (0.02, 0.35, 0.38))],
)
def test_last_sample_before_a_poll_is_logged_whatever_the_period(wait, returns):
    # Thirty times 3 ms is not ten times 0.03 s in floating point; the crossing may be in the very sample between the two.
    sampled = CastSimulator(scenario(controller={"period": 0.003}))
    cast = dataclasses.replace(TYPICAL, wait=wait)
    free_cast = sampled.simulate(cast)
    assert free_cast.status is Status.LANDED
    recording = sampled.record(cast, tuple(free_cast.landing), returns=returns)
    assert recording.outcome.is_caught
    np.testing.assert_allclose(recording.times, 0.003 * np.arange(len(recording.times)), atol=1e-9)


@pytest.mark.slow
def test_landing_converges_with_the_number_of_links(free):
    finer = CastSimulator(scenario(string={"n_links": 20})).simulate(TYPICAL)
    assert np.linalg.norm(finer.landing - free[TYPICAL].landing) < 2e-3


# ---------------------------------------------------------------- symmetry


@pytest.mark.parametrize("bearing", [pytest.param(-0.5, marks=pytest.mark.slow), 2.0])
def test_bearing_turns_the_landing_about_the_base_axis(simulator, free, bearing):
    straight = free[TYPICAL]
    outcome = simulator.simulate(dataclasses.replace(TYPICAL, bearing=bearing))
    # What swing the turn left is in the landing: up to 0.2 mm of it, see test_turn.
    np.testing.assert_allclose(outcome.landing, turned(straight.landing, bearing), atol=4e-4)
    assert outcome.landing_along == pytest.approx(straight.landing_along, abs=3e-4)
    assert outcome.landing_across == pytest.approx(straight.landing_across, abs=3e-4)
    assert outcome.crossing_time == pytest.approx(straight.crossing_time, abs=2e-4)


@pytest.mark.slow
def test_opposite_bearings_mirror_each_other(simulator):
    # But for the arm's own asymmetry, whose links are not mirrored.
    left, right = (simulator.simulate(dataclasses.replace(TYPICAL, bearing=b)) for b in (0.7, -0.7))
    np.testing.assert_allclose(left.landing, right.landing * [1, -1], atol=1e-4)


def test_ball_stays_in_the_casting_plane(free):
    # The arm is not quite symmetric, and a string that buckles enlarges what it is given.
    across = [abs(outcome.landing_across) for outcome in free.values()]
    assert np.median(across) < 1e-4
    assert max(across) < 1e-3


def test_bearing_beyond_joint_one_is_refused_and_harms_nothing(simulator, free):
    with pytest.raises(InputError, match=r"cast\.bearing = 2\.7 rad: joint 1 .* -2\.6 to 2\.6"):
        simulator.simulate(dataclasses.replace(TYPICAL, bearing=2.7))
    assert_identical(simulator.simulate(TYPICAL), free[TYPICAL])


# ---------------------------------------------------------------- with a cup


@pytest.mark.parametrize("cast", [EACH[0], *EACH[2:]], ids=str)
def test_cup_at_the_landing_catches(free, into_cup, cast):
    outcome = into_cup(cast)
    assert outcome.status is Status.CAUGHT
    assert outcome.is_caught
    assert outcome.miss < 1e-3
    # In the last poll before the crossing the contact's integrator, of first order, has taken over.
    np.testing.assert_allclose(outcome.landing, free[cast].landing, atol=5e-4)


@pytest.mark.parametrize(
    ("cast", "along", "across", "expected"),
    [
        (TYPICAL, 0.06, 0, Status.SHORT),
        (TYPICAL, -0.10, 0, Status.LONG),
        (TYPICAL, 0, 0.06, Status.SIDE),
        (TYPICAL, 0, -0.06, Status.SIDE),
        # Whose landing would be on another side, and as far off, if the cup's place were not seen in the casting plane.
        pytest.param(CASTS[3], 0.06, 0, Status.SHORT, marks=pytest.mark.slow),
        pytest.param(CASTS[3], 0, -0.06, Status.SIDE, marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_cup_beside_the_landing_is_missed_on_the_right_side(simulator, free, cast, along, across, expected):
    cup = free[cast].landing + turned([along, across], cast.bearing)
    outcome = simulator.simulate(cast, tuple(cup))
    assert outcome.status is expected
    assert not outcome.is_caught
    assert outcome.miss == pytest.approx(np.hypot(along, across), abs=1e-3)


def test_ball_that_hits_the_rim_bounces(simulator, free):
    outcome = simulator.simulate(TYPICAL, tuple(free[TYPICAL].landing - [0.0, 0.045]))
    assert outcome.status is Status.RIM_BOUNCE


@pytest.mark.parametrize("cast", EACH, ids=str)
def test_cup_out_of_reach_changes_no_landing(simulator, free, cast):
    outcome = simulator.simulate(cast, (-1.0, 0.0))
    np.testing.assert_allclose(outcome.landing, free[cast].landing, atol=5e-5)
    assert outcome.crossing_time == pytest.approx(free[cast].crossing_time, abs=2e-5)


@pytest.mark.parametrize("cast", EACH, ids=str)
def test_hand_over_to_the_station_with_contact_changes_no_landing(free, into_cup, cast):
    outcome = into_cup(cast)
    assert outcome.is_caught
    # The landing is the contact-free phase's, whatever the rim does to the ball.
    np.testing.assert_array_equal(outcome.landing, free[cast].landing)
    grazed = into_cup(cast, GRAZED)
    np.testing.assert_array_equal(grazed.landing, free[cast].landing)
    assert grazed.miss == pytest.approx(GRAZED, abs=1e-4)


@pytest.mark.slow
def test_ball_that_never_comes_down_never_crosses():
    # A scenario that is read is refused, since no ball could rest in a cup.
    shallow = {"motion": Motion(drop_distance=0.05), "string": String(length=0.5)}
    high = CastSimulator(Scenario().model_copy(update=shallow))
    for cup in (None, (0.4, 0.0)):
        outcome = high.simulate(TYPICAL, cup)
        assert outcome.status is Status.NEVER_CROSSED
        assert np.isnan(outcome.landing).all()
        assert np.isnan([outcome.crossing_time, outcome.entry_angle, outcome.landing_along]).all()
        assert np.isnan(outcome.slack)
        assert not outcome.is_slack
    recording = high.record(TYPICAL, (0.4, 0.0))
    assert recording.times[-1] == pytest.approx(high.record(TYPICAL, (0.4, 0.0)).times[-1])
    assert recording.stages[-1] == Stage.RETURN


@pytest.mark.parametrize("cup", [(0.6,), (0.6, float("nan")), "here", 0.6])
def test_cup_that_is_not_a_place_is_refused(cup):
    with pytest.raises(InputError, match="cup = "):
        simulate_cast(Scenario(), TYPICAL, cup)


# ---------------------------------------------------------------- what an outcome tells


def test_entry_is_consistent_with_the_recording(recordings):
    outcome, recording = recordings[TYPICAL].outcome, recordings[TYPICAL]
    k = np.searchsorted(recording.times, outcome.crossing_time)
    assert recording.p_WL[k - 1, 2] > 0.12 >= recording.p_WL[k, 2]
    for axis in range(2):
        low, high = sorted(recording.p_WL[k - 1 : k + 1, axis])
        assert low - 1e-6 <= outcome.landing[axis] <= high + 1e-6
    np.testing.assert_allclose(outcome.entry_velocity, recording.v_WL[k], atol=0.05)
    assert outcome.entry_speed == pytest.approx(np.linalg.norm(outcome.entry_velocity))
    assert np.cos(outcome.entry_angle) == pytest.approx(-outcome.entry_velocity[2] / outcome.entry_speed)
    assert np.isnan(outcome.miss)


def test_fast_drop_leaves_the_string_slack_and_a_slow_one_does_not(free):
    assert all(outcome.is_slack for outcome in free.values())
    slow = CastSimulator(scenario(motion={"drop_duration": 2.0})).simulate(TYPICAL)
    assert slow.status is Status.LANDED
    assert not slow.is_slack
    assert slow.slack <= SLACK_MARGIN * Scenario().string.length


@pytest.mark.parametrize("cast", CASTS, ids=str)
def test_slack_is_the_least_from_the_landing_until_the_ball_is_below_the_rim(recordings, cast):
    outcome, recording = recordings[cast].outcome, recordings[cast]
    length, rim = Scenario().string.length, Scenario().cup.rim_height
    slack = length - np.linalg.norm(recording.p_WL - recording.p_WE, axis=1)
    crossing_time = outcome.crossing_time + CastMotion(Scenario(), cast).stage_ends[0]  # the turn comes first
    at_landing = np.interp(crossing_time, recording.times, slack)
    assert 0 < outcome.slack <= at_landing + 1e-5  # between samples 2 ms apart
    is_entering = recording.times >= crossing_time
    is_entering &= recording.p_WL[:, 2] > rim - Scenario().ball.radius
    assert is_entering.sum() >= 3
    assert outcome.slack == pytest.approx(min(at_landing, slack[is_entering].min()), abs=1e-5)


@pytest.mark.parametrize("cast", EACH, ids=str)
def test_a_cup_changes_nothing_that_is_told_of_the_contact_free_phase(free, into_cup, cast):
    for miss in (0.0, GRAZED):
        outcome = into_cup(cast, miss)
        for name in ("landing", "crossing_time", "entry_velocity", "entry_angle", "is_slack", "slack"):
            np.testing.assert_array_equal(getattr(outcome, name), getattr(free[cast], name), err_msg=name)
        for name in ("peak_torque_utilization", "peak_velocity_utilization"):  # the arm is alone from another sample on
            np.testing.assert_allclose(getattr(outcome, name), getattr(free[cast], name), atol=1e-5, err_msg=name)


def test_peaks_are_those_of_the_whole_drop_though_the_ball_is_down_before_its_middle(simulator, free):
    """They are what the arm does with a ball that lies in its cup."""
    outcome, cast = free[TYPICAL], TYPICAL
    recording = simulator.record(cast, tuple(outcome.landing), returns=False)
    ends = CastMotion(Scenario(), cast).stage_ends
    assert outcome.crossing_time < ends[Stage.WAIT] + 0.22 - ends[Stage.TURN]
    is_cast = recording.times <= ends[Stage.DROP]
    n_q = recording.states.shape[1] // 2
    plant = make_arm_plant(Scenario())
    speeds = motor_utilization(recording.states[is_cast, n_q : n_q + 7], plant.GetVelocityUpperLimits())
    torques = motor_utilization(recording.torques[is_cast], plant.GetEffortUpperLimits())
    np.testing.assert_allclose(outcome.peak_velocity_utilization, speeds.max(axis=0), atol=0.01)
    np.testing.assert_allclose(outcome.peak_torque_utilization, torques.max(axis=0), atol=0.02)


def test_limit_that_is_met_after_the_landing_is_met_without_a_cup_too():
    folded = {"mount": "floor", "mount_height": 0.65}
    motion, bounds = {"start_radius": 0.35}, {"distance": (0.05, 0.25)}
    simulator = CastSimulator(Scenario.from_dict({"arm": folded, "motion": motion, "bounds": bounds}))
    cast = Cast(0.2, 0.5, 0.1)
    free = simulator.simulate(cast)
    into_cup = simulator.simulate(cast, tuple(free.landing))
    assert free.status is into_cup.status is Status.LIMIT_HIT
    assert set(free.limits_hit) == set(into_cup.limits_hit)


def test_too_fast_a_drop_hits_limits_that_are_named():
    outcome = CastSimulator(scenario(motion={"drop_duration": 0.15})).simulate(TYPICAL)
    assert outcome.status is Status.LIMIT_HIT
    assert {"joint 4 torque", "joint 4 speed"} <= set(outcome.limits_hit)
    assert outcome.peak_torque_utilization.max() == pytest.approx(1, abs=1e-9)
    for i in range(7):
        assert (f"joint {i + 1} speed" in outcome.limits_hit) == (outcome.peak_velocity_utilization[i] > 1)
    assert np.isfinite(outcome.landing).all()  # what the ball did is told all the same


def test_ordinary_casts_keep_the_limits_and_their_reference(free):
    for outcome in free.values():
        assert outcome.status is Status.LANDED
        assert outcome.limits_hit == ()
        assert outcome.peak_torque_utilization.max() < 1
        assert outcome.peak_velocity_utilization.max() < 1
        assert 1e-4 < outcome.peak_tracking_error < 0.02


def test_diverged_simulation_is_reported_and_harms_nothing(monkeypatch):
    # A ball that nothing could throw so fast: the motors' limits bound all that an arm out of control can do.
    monkeypatch.setattr("wam_cast.simulation.station_loop.MAX_BALL_SPEED", 1.0)
    wild = CastSimulator(Scenario())
    for cup in (None, (0.6, 0.0)):
        outcome = wild.simulate(TYPICAL, cup)
        assert outcome.status is Status.DIVERGED
        assert not outcome.is_caught
        assert np.isnan(outcome.landing).all()
    recording = wild.record(TYPICAL, (0.6, 0.0))
    assert recording.outcome.status is Status.DIVERGED
    assert np.isfinite(recording.p_WL).all()


def test_arm_out_of_control_meets_its_limits():
    # Those gains are refused but of a controller of one's own.
    stiff = scenario(controller={"kp": 1e6})
    outcome = CastSimulator(stiff, make_controller=lambda known: CastController(known)).simulate(TYPICAL)
    assert outcome.status is Status.LIMIT_HIT
    assert "joint 2 torque" in outcome.limits_hit


def test_simulator_works_after_a_diverged_simulation(simulator, free, monkeypatch):
    # The same simulator, whose ball is thrown out of the world in the middle of a cast.
    monkeypatch.setattr("wam_cast.simulation.station_loop.MAX_BALL_SPEED", 1.0)
    assert simulator.simulate(TYPICAL).status is Status.DIVERGED
    assert simulator.simulate(TYPICAL, (0.6, 0.0)).status is Status.DIVERGED
    monkeypatch.undo()
    assert_identical(simulator.simulate(TYPICAL), free[TYPICAL])


def fixed_steps(simulator, *_):
    ResetIntegratorFromFlags(simulator, "runge_kutta2", 0.002)


def test_state_that_is_not_finite_breaks_no_recording(monkeypatch):
    # Undamped and at too long a fixed step the string blows up within a cast, past the largest number that a float holds.
    monkeypatch.setattr("wam_cast.simulation.station_loop.begin_integration", fixed_steps)
    broken = CastSimulator(scenario(string={"n_links": 20, "bending_damping": 0.0}))
    recording = broken.record(TYPICAL)
    assert recording.outcome.status is Status.DIVERGED
    assert len(recording.times) == len(recording.p_WL) > 10
    assert np.isfinite(recording.p_WL).all()


# ---------------------------------------------------------------- recordings


@pytest.fixture(scope="module")
def caught(simulator, free, once):
    return once("turned_and_caught", lambda: simulator.record(CASTS[3], tuple(free[CASTS[3]].landing)))


@pytest.mark.slow
def test_recordings_outcome_is_that_of_the_simulation(simulator, free, caught):
    assert_identical(caught.outcome, simulator.simulate(CASTS[3], tuple(free[CASTS[3]].landing)))
    assert_identical(simulator.simulate(TYPICAL), free[TYPICAL])


def test_recording_has_a_sample_a_period_to_the_end_of_the_return(caught):
    ends = CastMotion(Scenario(), CASTS[3], cup_radius=float(np.hypot(*caught.cup))).stage_ends
    n = len(caught.times)
    np.testing.assert_allclose(caught.times, 0.002 * np.arange(n), atol=1e-9)
    assert caught.times[-1] == pytest.approx(ends[-1], abs=0.002 + 1e-9)
    shapes = {name: getattr(caught, name).shape for name in ("p_WL", "v_WL", "p_WE", "p_WE_desired")}
    assert set(shapes.values()) == {(n, 3)}
    assert caught.states.shape == (n, 2 * (7 + 2 * 10 + 2))
    assert caught.torques.shape == (n, 7)
    np.testing.assert_array_equal(caught.stages, np.searchsorted(ends[:5], caught.times, side="right"))


def test_recording_is_continuous_across_the_hand_over(caught):
    by_difference = np.diff(caught.p_WL, axis=0) / np.diff(caught.times)[:, None]
    mean = (caught.v_WL[1:] + caught.v_WL[:-1]) / 2
    # A contact may turn the velocity within a sample, by twice the ball's speed of some 3 m/s at most.
    assert np.linalg.norm(by_difference - mean, axis=1).max() < 3.0
    turn_end = CastMotion(Scenario(), CASTS[3]).stage_ends[Stage.TURN]
    before = caught.times[1:] < turn_end + caught.outcome.crossing_time - 0.002
    assert np.linalg.norm(by_difference - mean, axis=1)[before].max() < 0.02


def test_hand_follows_its_reference_through_the_whole_recording(caught):
    assert np.linalg.norm(caught.p_WE - caught.p_WE_desired, axis=1).max() < 0.02
    home = 0.2 * np.array([np.cos(0.8), np.sin(0.8), 0]) + [0, 0, 0.8]
    assert np.linalg.norm(caught.p_WE[-1] - home) < 2e-3


def test_string_keeps_its_length_through_the_whole_recording(caught):
    distance = np.linalg.norm(caught.p_WL - caught.p_WE, axis=1)
    assert distance[0] == pytest.approx(0.6, abs=1e-12)
    assert distance.max() <= 0.6 + 1e-9


def test_caught_ball_is_at_the_bottom_of_the_cup_when_the_hold_ends(caught, free):
    k = np.flatnonzero(caught.stages == Stage.HOLD)[-1]
    x, y, z = caught.p_WL[k]
    assert z == pytest.approx(0.006 + 0.020, abs=1e-3)
    assert np.hypot(x - caught.cup[0], y - caught.cup[1]) < 0.030 - 0.020 + 1e-3
    assert np.linalg.norm(caught.v_WL[k]) < 0.1


def test_ball_starts_at_rest_below_the_hand(caught):
    np.testing.assert_allclose(caught.p_WL[0], caught.p_WE[0] - [0, 0, 0.6], atol=1e-12)
    np.testing.assert_array_equal(caught.v_WL[0], 0)
    np.testing.assert_allclose(caught.p_WE[0], caught.p_WE_desired[0], atol=1e-12)


def test_diverged_cast_says_which_limits_it_met_before(simulator, monkeypatch):
    # More than three times as fast as the bounds allow: the motors saturate before the ball is faster than it may be.
    monkeypatch.setattr("wam_cast.simulation.station_loop.MAX_BALL_SPEED", 2.5)
    outcome = simulator.simulate(Cast(0.3, 3.0, 0.1))
    assert outcome.status is Status.DIVERGED
    assert "joint 2 torque" in outcome.limits_hit
    assert np.isnan(outcome.landing).all()


def test_hand_must_be_able_to_reach_the_longest_moves_end():
    with pytest.raises(InputError, match=r"bounds.distance = \[0.3, 0.9\].*the arm allows"):
        CastSimulator(scenario(bounds={"distance": (0.3, 0.9)}))


def test_own_controller_takes_the_place_of_ours(limp):
    outcome = CastSimulator(Scenario(), make_controller=limp).simulate(TYPICAL)
    assert outcome.peak_torque_utilization.max() == 0.0
    assert outcome.peak_tracking_error > 0.05  # from what it says that it wants, which is zero
    with pytest.raises(InputError, match="set_cast"):
        CastStation(Scenario(), controller=PassThrough(14))


class Silent(LeafSystem):
    """A controller with no ports but those that it needs."""

    def __init__(self, _scenario):
        super().__init__()
        self.DeclareVectorInputPort("arm_state", 14)
        self.DeclareVectorOutputPort("actuation", 7, lambda context, output: output.SetZero())

    def set_cast(self, context, cast):
        pass


def test_controller_that_does_not_say_what_it_wants_of_the_hand_is_not_scored():
    simulator = CastSimulator(Scenario(), make_controller=Silent)
    assert np.isnan(simulator.simulate(TYPICAL).peak_tracking_error)
    recording = simulator.record(TYPICAL, (0.6, 0.0), returns=False)
    assert np.isnan(recording.outcome.peak_tracking_error)
    assert np.isnan(recording.p_WE_desired).all()
    assert recording.p_WE_desired.shape == recording.p_WE.shape


class Elsewhere(CastController):
    """Does what ours does, and says that it wants the hand 0.3 m higher."""

    def hand_desired(self, time, motion):
        p_WE, v_WE = motion.evaluate(time)
        return p_WE + np.array([0, 0, 0.3]), v_WE

    def torque(self, arm, desired):
        p_WE, _ = desired.motion.evaluate(desired.time)
        return super().torque(arm, desired._replace(p_WE=p_WE))


def test_controller_is_scored_against_what_it_wants_of_the_hand(free):
    simulator = CastSimulator(Scenario(), make_controller=Elsewhere)
    outcome = simulator.simulate(TYPICAL)
    np.testing.assert_array_equal(outcome.landing, free[TYPICAL].landing)
    assert outcome.peak_tracking_error == pytest.approx(0.3, abs=0.02)


def test_ball_is_handed_over_to_the_contact_phase_before_it_can_touch_anything(free):
    phase = ContactFreePhase(CastStation(Scenario(), has_scene=False))
    for cast, outward in ((TYPICAL, 0.0), (TYPICAL, -0.045), (TYPICAL, -0.2), (CASTS[4], 0.045)):
        radius = np.linalg.norm(free[cast].landing)
        cup = tuple(free[cast].landing * (1 + outward / radius))
        free_cast = phase.run(cast, cup)
        p_WL, _, _ = Kinematics(phase.station.plant).evaluate(free_cast.log_to_hand_over.states)
        outside = np.maximum(np.hypot(*(p_WL[:, :2] - cup).T) - 0.0345, 0)
        to_cup = np.hypot(outside, np.maximum(p_WL[:, 2] - 0.12, 0))
        gaps = np.minimum(to_cup, p_WL[:, 2]) - 0.020
        assert free_cast.comes_near
        assert free_cast.log_to_hand_over.times[-1] == pytest.approx(free_cast.hand_over.time, abs=1e-9)
        assert gaps.min() > 0
        assert gaps[-1] < 0.03  # and not long before
