"""The judge: crossings and verdicts on synthetic paths, limits of the joints and the string at the landing on made-up logs."""

from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant

from wam_cast.arm.posture import starting_posture
from wam_cast.cast import Cast
from wam_cast.motion.stages import CastMotion
from wam_cast.robot.plant import N_ARM, fill_plant, hanging_positions
from wam_cast.robot.station import Log
from wam_cast.robot.station_state import StationState
from wam_cast.scenario import Cup, Scenario
from wam_cast.simulation.contact_free import ContactFree
from wam_cast.simulation.judge import BallTrack, Judge, angle_from_vertical, find_crossing, verdict
from wam_cast.simulation.outcome import Status

CUP = Cup()
R = 0.020
G = 9.81

ABOVE = 0.01
"""How far above a ball in a taut string the rim plane is [m]: less than the ball's radius."""


def ballistic(p0, v0, times):
    """Return the track of a ball in free fall from p0 and v0."""
    p0, v0, a = np.array(p0), np.array(v0), np.array([0, 0, -G])
    t = times[:, None]
    return BallTrack(times, p0 + v0 * t + a * t**2 / 2, v0 + a * t)


# ---------------------------------------------------------------- the crossing


@pytest.mark.parametrize("period", [0.002, 0.0137])
def test_crossing_of_a_free_fall_is_its_closed_form(period):
    # The cubic between two samples holds a parabola, so the sampling must not show.
    track = ballistic([0.1, -0.2, 0.5], [0.7, 0.3, 1.2], np.arange(0, 1, period))
    crossing = find_crossing(track, 0.12)
    t = (1.2 + np.sqrt(1.2**2 + 2 * G * (0.5 - 0.12))) / G
    assert crossing.time == pytest.approx(t, abs=1e-11)
    np.testing.assert_allclose(crossing.p_WL, [0.1 + 0.7 * t, -0.2 + 0.3 * t, 0.12], atol=1e-11)
    np.testing.assert_allclose(crossing.v_WL, [0.7, 0.3, 1.2 - G * t], atol=1e-9)


def test_crossing_from_below_does_not_count():
    rising = ballistic([0, 0, 0.0], [0.1, 0, 2.0], np.arange(0, 0.2, 0.002))
    assert rising.p_WL[-1, 2] > 0.12
    assert find_crossing(rising, 0.12) is None
    whole = ballistic([0, 0, 0.0], [0.1, 0, 2.0], np.arange(0, 0.5, 0.002))
    assert find_crossing(whole, 0.12).v_WL[2] < 0


def test_first_of_several_crossings_counts():
    times = np.arange(0, 2, 0.002)
    z = 0.12 + 0.1 * np.cos(2 * np.pi * times)
    v = -0.2 * np.pi * np.sin(2 * np.pi * times)
    zero = np.zeros_like(times)
    track = BallTrack(times, np.column_stack([times, zero, z]), np.column_stack([zero + 1, zero, v]))
    assert find_crossing(track, 0.12).time == pytest.approx(0.25, abs=1e-6)


def test_ball_that_stays_above_never_crosses():
    times = np.arange(0, 1, 0.002)
    still = BallTrack(times, np.full((500, 3), 0.2), np.zeros((500, 3)))
    assert find_crossing(still, 0.12) is None


def test_sample_exactly_on_the_plane_is_the_crossing():
    track = ballistic([0, 0, 0.12 + G * 0.1**2 / 2], [0, 0, 0.0], np.array([0.0, 0.05, 0.1, 0.15]))
    assert find_crossing(track, 0.12).time == pytest.approx(0.1, abs=1e-9)


def test_first_sample_at_the_plane_or_below_it_ends_the_search_wherever_it_lies():
    # A track is random; its plane is at one of the samples, next to one by rounding, or between two.
    rng = np.random.default_rng(0)
    n_crossed = 0
    for _ in range(3000):
        n, offset = int(rng.integers(2, 8)), float(rng.choice([0.0, 0.0, 1e-17, -1e-17, 1e-3]))
        times = np.cumsum(rng.uniform(1e-4, 0.02, size=n))
        track = BallTrack(times, rng.uniform(-0.3, 0.9, size=(n, 3)), rng.uniform(-3, 3, size=(n, 3)))
        height = track.p_WL[rng.integers(n), 2] + offset
        z = track.p_WL[:, 2]
        falls = [i for i in range(1, n) if z[i - 1] > height >= z[i]]
        crossing = find_crossing(track, height)
        assert (crossing is None) == (not falls)
        if crossing is not None:
            n_crossed += 1
            assert times[falls[0] - 1] <= crossing.time <= times[falls[0]]
            assert crossing.p_WL[2] == pytest.approx(height, abs=1e-9)
    assert n_crossed > 1000


@pytest.mark.parametrize(
    ("velocity", "angle"), [([0, 0, -2], 0), ([1, 0, -1], 45), ([0, -1, -1], 45), ([3, 4, 0], 90), ([0, 0, 1], 180)]
)
def test_angle_is_from_straight_down(velocity, angle):
    assert np.rad2deg(angle_from_vertical(np.array(velocity, float))) == pytest.approx(angle)


# ---------------------------------------------------------------- the verdict


def fall(x, y, to=-0.1):
    """Return a path straight down at (x, y) about the cup, from 10 cm above the rim plane."""
    z = np.linspace(0.1, to, 101)
    return np.column_stack([np.full(101, x), np.full(101, y), z])


@pytest.mark.parametrize(
    ("x", "y", "expected"),
    [
        (-0.07, 0.0, Status.SHORT),
        (0.07, 0.0, Status.LONG),
        (0.0, 0.07, Status.SIDE),
        (0.0, -0.07, Status.SIDE),
        (-0.07, 0.06, Status.SHORT),
        (0.06, -0.07, Status.SIDE),
        (-0.04, 0.0, Status.RIM_BOUNCE),
        (0.0, 0.05, Status.RIM_BOUNCE),
    ],
)
def test_miss_is_named_after_its_side(x, y, expected):
    assert verdict(fall(x, y), False, False, CUP, R) is expected


@pytest.mark.parametrize(
    ("is_at_rest", "is_carried", "expected"),
    [
        (True, True, Status.CAUGHT),
        (True, False, Status.NOT_SETTLED),
        (False, True, Status.NOT_SETTLED),
        (False, False, Status.NOT_SETTLED),
    ],
)
def test_ball_is_caught_only_at_rest_and_carried(is_at_rest, is_carried, expected):
    assert verdict(fall(0.005, -0.003, to=-0.094), is_at_rest, is_carried, CUP, R) is expected


@pytest.mark.parametrize("is_at_rest", [True, False])
@pytest.mark.parametrize("is_carried", [True, False])
def test_ball_inside_in_a_taut_string_hangs_unless_the_cup_carries_it(is_at_rest, is_carried):
    path = fall(0.005, -0.003, to=-0.05)
    expected = Status.CAUGHT if is_at_rest and is_carried else Status.HANGING
    assert verdict(path, is_at_rest, is_carried, CUP, R, is_taut=True) is expected


def test_ball_outside_in_a_taut_string_does_not_hang():
    assert verdict(fall(0.0, 0.0, to=0.015), True, False, CUP, R, is_taut=True) is Status.NOT_SETTLED
    assert verdict(fall(0.07, 0.0), True, False, CUP, R, is_taut=True) is Status.LONG


def test_ball_that_leaves_the_cup_came_out():
    inside, outside = fall(0.0, 0.0, to=-0.05), fall(0.08, 0.0)
    assert verdict(np.vstack([inside, inside[::-1], outside]), True, True, CUP, R) is Status.CAME_OUT


def test_ball_above_the_rim_at_the_end_has_not_settled():
    assert verdict(fall(0.0, 0.0, to=0.015), True, True, CUP, R) is Status.NOT_SETTLED


def test_touching_the_outside_of_the_wall_is_no_rim_bounce():
    slides = fall(CUP.outer_radius + R + 0.001, 0.0)
    assert verdict(slides, False, True, CUP, R) is Status.LONG


# ---------------------------------------------------------------- made-up logs


@pytest.fixture(scope="module")
def scenario():
    """Return one whose hand starts where a drop would take it: a scenario that is read must begin with the ball above the rim."""
    motion, string, cup = Scenario().motion, Scenario().string, Scenario().cup
    rim_height = motion.start_height - string.length + ABOVE
    return Scenario().model_copy(update={"cup": cup.model_copy(update={"rim_height": rim_height})})


@pytest.fixture(scope="module")
def plant(scenario):
    plant = MultibodyPlant(time_step=0.0)
    fill_plant(plant, scenario)
    return plant


@pytest.fixture(scope="module")
def hanging(plant, scenario):
    return hanging_positions(plant, starting_posture(scenario))


def log_of(plant, positions, velocities=None):
    """Return a log of motors at rest with one sample every 10 ms, for positions of shape (n, n_q)."""
    n = len(positions)
    if velocities is None:
        velocities = np.zeros((n, plant.num_velocities()))
    return Log(0.01 * np.arange(n), np.hstack([positions, velocities]), np.zeros((n, N_ARM)))


def judge_of(scenario, plant, desired=None):
    """Return a judge of logs of `plant`, whose controller wants the hand at `desired`, shape (n, 3), if it says."""

    def desired_path(_, times):
        return np.full((len(times), 3), np.nan) if desired is None else desired[np.rint(100 * times).astype(int)]

    return Judge(SimpleNamespace(scenario=scenario, plant=plant, desired_path=desired_path))


def contact_free(scenario, cast, log):
    """Return a contact-free phase without a cup that was logged so."""
    return ContactFree(
        motion=CastMotion(scenario, cast),
        cup=None,
        noise_seed=0,
        log=log,
        above_until=0.0,
        hand_over=StationState(log.times[-1], ()),
        comes_near=False,
        has_diverged=False,
        down=None,
    )


@pytest.mark.parametrize("joint", range(N_ARM))
def test_each_joint_has_a_stop_at_either_end_of_its_range(plant, scenario, hanging, joint):
    judge = judge_of(scenario, plant)
    for stops, outward in ((plant.GetPositionLowerLimits(), -1), (plant.GetPositionUpperLimits(), 1)):
        positions = np.tile(hanging, (3, 1))
        positions[1, joint] = stops[joint] - 1e-3 * outward
        assert judge.limits_hit(log_of(plant, positions)) == ()
        positions[1, joint] = stops[joint] + 1e-3 * outward
        assert judge.limits_hit(log_of(plant, positions)) == (f"joint {joint + 1} position",)


def unfolding(plant, scenario, hanging, fold, fold_rate):
    """Return a log of a string bent in its middle, by angles shape (n,), below a hand at rest: the ball stays right below it.

    Its links then reach down by their length times the angle's cosine, and the ball hangs straight below them.
    """
    middle, knot = N_ARM + 2 * (scenario.string.n_links // 2), N_ARM + 2 * scenario.string.n_links
    positions, velocities = np.tile(hanging, (len(fold), 1)), np.zeros((len(fold), plant.num_velocities()))
    for values, angle in ((positions, fold), (velocities, fold_rate)):
        values[:, N_ARM] += angle
        values[:, middle] -= 2 * angle
        values[:, knot] += angle
    return log_of(plant, positions, velocities)


def test_string_is_slack_by_its_state_at_the_landing_whatever_it_is_afterwards(plant, scenario, hanging):
    cast, length = Cast(0.3, 0.6, 0.1), scenario.string.length - scenario.ball.radius
    time = 0.01 * np.arange(41)
    # It unfolds as the ball comes down: shorter by ABOVE at the rim plane, taut before the ball is all below it.
    log = unfolding(plant, scenario, hanging, 1.25 * (0.4 - time), np.full(41, -1.25))
    outcome = judge_of(scenario, plant).outcome(contact_free(scenario, cast, log))
    assert outcome.limits_hit == ()
    assert outcome.crossing_time == pytest.approx(0.4 - np.arccos(1 - ABOVE / length) / 1.25, abs=1e-6)
    np.testing.assert_allclose(outcome.landing, [scenario.motion.start_radius, 0.0], atol=1e-9)
    assert outcome.is_slack
    assert outcome.slack == pytest.approx(0.0, abs=1e-6)


def test_hand_is_scored_against_what_the_controller_wanted_of_it(plant, scenario, hanging):
    log = log_of(plant, np.tile(hanging, (31, 1)))
    p_WE = np.array([scenario.motion.start_radius, 0.0, scenario.motion.start_height])
    phase = contact_free(scenario, Cast(0.3, 0.6, 0.1), log)
    assert np.isnan(judge_of(scenario, plant).outcome(phase).peak_tracking_error)
    desired = np.tile(p_WE, (31, 1))
    desired[20] += [0.03, -0.04, 0.0]
    outcome = judge_of(scenario, plant, desired).outcome(phase)
    assert outcome.peak_tracking_error == pytest.approx(0.05, abs=1e-12)
