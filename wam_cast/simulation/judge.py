"""Judge: what became of a simulated cast, from what was logged of its phases."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wam_cast.casting_plane import to_casting_plane
from wam_cast.motion.polling import SLACK_MARGIN, TRACKING_SAMPLES
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.robot.kinematics import Kinematics
from wam_cast.robot.motors import TorqueLimits, motor_utilization
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.station import CastStation, Log
from wam_cast.scenario import Cup
from wam_cast.simulation.ball_and_cup import is_inside, taut_distance, touches_rim
from wam_cast.simulation.contact import Contact
from wam_cast.simulation.contact_free import ContactFree
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.simulation.station_loop import bounded_part
from wam_cast.types import Array


@dataclass(frozen=True, eq=False)
class BallTrack:
    """The ball over time: times (n,) [s], p_WL (n, 3) [m], v_WL (n, 3) [m/s], world frame."""

    times: Array
    p_WL: Array
    v_WL: Array


@dataclass(frozen=True, eq=False)
class Crossing:
    """Where the ball's centre first came down through a horizontal plane: time [s], p_WL and v_WL (3,)."""

    time: float
    p_WL: Array
    v_WL: Array


def log_of(free: ContactFree, contact: Contact | None) -> Log:
    """Return the log of what happened, with contact if there was any."""
    return bounded_part(free.log_to_hand_over) if contact is None else contact.log


class Judge:
    """Turns the phases of a cast into its outcome; `station` is that of the contact-free phase."""

    def __init__(self, station: CastStation) -> None:
        plant = station.plant
        self._station, self._scenario = station, station.scenario
        self._kinematics = Kinematics(plant)
        self._speed_limits = plant.GetVelocityUpperLimits()[:N_ARM]
        self._lower = plant.GetPositionLowerLimits()[:N_ARM]
        self._upper = plant.GetPositionUpperLimits()[:N_ARM]
        self._torque_limits = TorqueLimits(plant, self._scenario.arm)

    def outcome(self, free: ContactFree, rest_of_drop: Log | None = None, contact: Contact | None = None) -> Outcome:
        """Return the outcome of a cast, whose ball comes down as it does in the contact-free phase.

        The log of the `rest_of_drop` is of the arm alone, from `free.down` on, if the ball came down before the drop's end.
        """
        log = log_of(free, contact)
        arm = _to_end_of_drop(free, rest_of_drop)
        limits_hit = self.limits_hit(log, arm)
        has_diverged = free.has_diverged or (contact is not None and contact.has_diverged)
        crossing, slack = (None, np.full(1, np.nan)) if has_diverged else self._landing(free)
        torque_used, velocity_used = self._limits_used(arm)
        nothing = np.full(3, np.nan)
        landing = nothing[:2] if crossing is None else crossing.p_WL[:2]
        velocity = nothing if crossing is None else crossing.v_WL
        along, across = to_casting_plane(landing, free.motion.cast.bearing)
        turn_end = float(free.motion.stage_ends[Stage.TURN])
        if has_diverged:
            status = Status.DIVERGED
        elif limits_hit:
            status = Status.LIMIT_HIT
        elif crossing is None:
            status = Status.NEVER_CROSSED
        else:
            status = Status.LANDED if free.cup is None else self._verdict(free, contact)
        return Outcome(
            status=status,
            landing=landing,
            landing_along=along,
            landing_across=across,
            crossing_time=math.nan if crossing is None else crossing.time - turn_end,
            entry_velocity=velocity,
            entry_angle=angle_from_vertical(velocity),
            is_slack=bool(slack[0] > SLACK_MARGIN * self._scenario.string.length),
            slack=float(np.min(slack)),
            miss=math.nan if free.cup is None else float(np.linalg.norm(landing - free.cup)),
            peak_torque_utilization=torque_used,
            peak_velocity_utilization=velocity_used,
            peak_tracking_error=self._peak_tracking_error(free.motion, log),
            limits_hit=limits_hit,
            end_time=float(log.times[-1]),
        )

    def limits_hit(self, *logs: Log) -> tuple[str, ...]:
        """Return which limits of the arm were met, such as `joint 4 speed`."""
        q = np.concatenate([log.states[:, :N_ARM] for log in logs])
        torque_used, velocity_used = np.max([self._limits_used(log) for log in logs], axis=0)
        outside = np.any((q < self._lower) | (q > self._upper), axis=0)
        checks = (("position", outside), ("torque", torque_used > 1 - 1e-9), ("speed", velocity_used > 1))
        return tuple(f"joint {i + 1} {what}" for what, over in checks for i in np.flatnonzero(over))

    def _limits_used(self, log: Log) -> tuple[Array, Array]:
        """Return the peak utilization of the torque and velocity limits, (7,) each."""
        n_q = log.states.shape[1] // 2
        v = log.states[:, n_q : n_q + N_ARM]
        # A torque was held from the sample before on, at whose speed the motors had their limits.
        limits = self._torque_limits.at(np.vstack([v[:1], v[:-1]]), log.torques)
        torque_used = motor_utilization(log.torques, limits)
        velocity_used = motor_utilization(v, self._speed_limits)
        return torque_used.max(axis=0, initial=0.0), velocity_used.max(axis=0, initial=0.0)

    def _landing(self, free: ContactFree) -> tuple[Crossing | None, Array]:
        """Return the crossing of the rim plane, and the string's slack [m] there and until the ball is below the plane."""
        # Kinematics cost: at all polls but the last ones the ball was seen above the plane.
        end = slice(int(np.searchsorted(free.log.times, free.above_until - 1e-9)), None)
        times = free.log.times[end]
        p_WL, v_WL, p_WE = self._kinematics.evaluate(free.log.states[end])
        rim_height, radius = self._scenario.cup.rim_height, self._scenario.ball.radius
        crossing = find_crossing(BallTrack(times, p_WL, v_WL), rim_height)
        if crossing is None:
            return None, np.full(1, np.nan)
        hand = [np.interp(crossing.time, times, p_WE[:, axis]) for axis in range(3)]
        after = (times > crossing.time) & (p_WL[:, 2] > rim_height - radius)
        p_EL_W = np.vstack([crossing.p_WL - hand, p_WL[after] - p_WE[after]])
        return crossing, self._scenario.string.length - np.linalg.norm(p_EL_W, axis=1)

    def _verdict(self, free: ContactFree, contact: Contact | None) -> Status:
        """Return what became of a ball that came down at a cup."""
        assert free.cup is not None
        log, cup = log_of(free, contact), self._scenario.cup
        since = min(free.above_until, free.hand_over.time)
        p_WL, _, p_WE = self._kinematics.evaluate(log.states[log.times >= since - 1e-9])
        c, s = math.cos(free.motion.cast.bearing), math.sin(free.motion.cast.bearing)
        R_CW = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        p_CL = (p_WL - [*free.cup, cup.rim_height]) @ R_CW.T
        is_at_rest, is_carried = (False, False) if contact is None else (contact.is_at_rest, contact.is_carried)
        is_taut = bool(np.linalg.norm(p_WL[-1] - p_WE[-1]) >= taut_distance(self._scenario))
        return verdict(p_CL, is_at_rest, is_carried, cup, self._scenario.ball.radius, is_taut=is_taut)

    def _peak_tracking_error(self, motion: CastMotion, log: Log) -> float:
        """Return the hand's largest distance from the controller's reference [m]; nan if it has none."""
        _, _, p_WE = self._kinematics.evaluate(log.states[::TRACKING_SAMPLES])
        p_WE_desired = self._station.desired_path(motion, log.times[::TRACKING_SAMPLES])
        return float(np.linalg.norm(p_WE - p_WE_desired, axis=1).max())


def _to_end_of_drop(free: ContactFree, rest: Log | None) -> Log:
    """Return the arm's log, states (n, 14), of the contact-free phase until the ball was down, and of the rest of the drop.

    It does not depend on a cup.
    """
    end = None if free.down is None else int(np.searchsorted(free.log.times, free.down.time + 1e-9))
    log = free.log.part(slice(end))
    n_q = log.states.shape[1] // 2
    arm = Log(log.times, log.states[:, np.r_[0:N_ARM, n_q : n_q + N_ARM]], log.torques)
    return bounded_part(arm if rest is None else arm.followed_by(rest))


def find_crossing(track: BallTrack, height: float) -> Crossing | None:
    """Return the first downward crossing of the plane at `height` [m], or none.

    Between samples the ball follows the cubic that has their positions and velocities.
    """
    z = track.p_WL[:, 2]
    (falling,) = np.nonzero((z[:-1] > height) & (z[1:] <= height))
    if len(falling) == 0:
        return None
    pair = slice(falling[0], falling[0] + 2)
    (start, end), p, v = track.times[pair], track.p_WL[pair], track.v_WL[pair]
    above, below = 0.0, 1.0  # shares of the way from one sample to the next, halved to the last digit
    while above < (middle := (above + below) / 2) < below:
        if _between(p[:, 2], v[:, 2], end - start, middle)[0] > height:
            above = middle
        else:
            below = middle
    return Crossing(float(start + below * (end - start)), *_between(p, v, end - start, below))


def _between(p: Array, v: Array, duration: float, u: float) -> tuple[Array, Array]:
    """Return place and velocity at the share `u` of the way, given both at its ends, in each row one: Hermite's cubic."""
    left = 1.0 - u
    place = (
        left * left * (1 + 2 * u) * p[0]
        + u * u * (1 + 2 * left) * p[1]
        + u * left * duration * (left * v[0] - u * v[1])
    )
    return place, 6 * u * left / duration * (p[1] - p[0]) + left * (1 - 3 * u) * v[0] + u * (3 * u - 2) * v[1]


def angle_from_vertical(velocity: Array) -> float:
    """Return the angle between `velocity`, shape (3,), and straight down [rad]."""
    return math.atan2(math.hypot(velocity[0], velocity[1]), -velocity[2])


def verdict(
    p_CL: Array, is_at_rest: bool, is_carried: bool, cup: Cup, ball_radius: float, *, is_taut: bool = False
) -> Status:
    """Return what became of a ball whose path about the cup was `p_CL`, shape (n, 3), x along the casting plane, y to its left.

    `is_at_rest`, `is_carried` (the cup was touched since it came to rest) and `is_taut` (the string) describe the end of the path.
    """
    inside = is_inside(p_CL, cup)
    last = p_CL[-1]
    if inside[-1]:
        if is_at_rest and is_carried:
            return Status.CAUGHT
        return Status.HANGING if is_taut else Status.NOT_SETTLED
    if last[2] >= 0:
        return Status.NOT_SETTLED
    if np.any(inside):
        return Status.CAME_OUT
    if np.any(touches_rim(p_CL, cup, ball_radius)):
        return Status.RIM_BOUNCE
    below = p_CL[int(np.argmax(p_CL[:, 2] < 0))]
    if abs(below[1]) > abs(below[0]):
        return Status.SIDE
    return Status.SHORT if below[0] < 0 else Status.LONG
