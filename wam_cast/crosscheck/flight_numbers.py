"""What is told of a cast in MuJoCo: a row of a dataset's columns, from its own samples."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from wam_cast.casting_plane import to_casting_plane
from wam_cast.crosscheck.mujoco_control import ArmLimits
from wam_cast.crosscheck.mujoco_flight import Flight, Samples
from wam_cast.motion.polling import SLACK_MARGIN, TRACKING_SAMPLES
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.robot.plant import N_ARM
from wam_cast.scenario import Scenario
from wam_cast.simulation.judge import BallTrack, Crossing, angle_from_vertical, find_crossing
from wam_cast.simulation.outcome import Status
from wam_cast.types import Array


def flight_numbers(flight: Flight, scenario: Scenario, limits: ArmLimits) -> dict[str, Any]:
    """Return a cast's columns of a dataset but for its parameters; see `.CastDataset`."""
    samples = flight.samples
    crossing, slack = _landing(samples, scenario)
    torque, velocity, is_outside = limits_used(flight, limits)
    is_beyond = bool(np.any(torque > 1 - 1e-9) or np.any(velocity > 1) or is_outside)
    if samples.has_diverged:
        status, crossing, slack = Status.DIVERGED, None, np.full(1, np.nan)
    elif is_beyond:
        status = Status.LIMIT_HIT
    else:
        status = Status.NEVER_CROSSED if crossing is None else Status.LANDED
    if crossing is None:
        crossing = Crossing(math.nan, np.full(3, np.nan), np.full(3, np.nan))
    along, across = to_casting_plane(crossing.p_WL[:2], flight.motion.cast.bearing)
    return {
        "landing_along": along,
        "landing_across": across,
        "status": status.value,
        "crossing_time": crossing.time - float(flight.motion.stage_ends[Stage.TURN]),
        "entry_speed": float(np.linalg.norm(crossing.v_WL)),
        "entry_angle": angle_from_vertical(crossing.v_WL),
        "is_slack": bool(slack[0] > SLACK_MARGIN * scenario.string.length),
        "slack": float(np.min(slack)),
        "peak_torque_utilization": float(np.max(torque)),
        "peak_velocity_utilization": float(np.max(velocity)),
        "peak_tracking_error": _peak_tracking_error(samples, flight.motion),
    }


def _landing(samples: Samples, scenario: Scenario) -> tuple[Crossing | None, Array]:
    """Return the crossing of the rim plane, and the string's slack [m] there and until the ball is below the plane."""
    rim_height = scenario.cup.rim_height
    crossing = find_crossing(BallTrack(samples.times, samples.p_WL, samples.v_WL), rim_height)
    if crossing is None:
        return None, np.full(1, np.nan)
    hand = np.array([np.interp(crossing.time, samples.times, samples.p_WE[:, axis]) for axis in range(3)])
    after = (samples.times > crossing.time) & (samples.p_WL[:, 2] > rim_height - scenario.ball.radius)
    p_EL_W = np.vstack([crossing.p_WL - hand, (samples.p_WL - samples.p_WE)[after]])
    return crossing, scenario.string.length - np.linalg.norm(p_EL_W, axis=1)


def limits_used(flight: Flight, limits: ArmLimits) -> tuple[Array, Array, bool]:
    """Return the peak utilization of torques and velocities, (7,) each, and whether a joint left its range, to the drop's end."""
    last = len(flight.samples.times) - 1 if flight.n_down is None else flight.n_down
    parts = [(flight.samples, slice(last + 1))]
    if flight.rest_of_drop is not None:
        parts.append((flight.rest_of_drop, slice(None)))
    torque, velocity, is_outside = np.zeros(N_ARM), np.zeros(N_ARM), False
    for samples, part in parts:
        q, v, torques = samples.q[part, :N_ARM], samples.v[part, :N_ARM], samples.torques[part]
        # A torque was held from the sample before on, at whose speed the motors had their limits.
        at = limits.torque_at(np.vstack([v[:1], v[:-1]]), torques)
        torque = np.maximum(torque, limits.utilization(torques, at).max(axis=0))
        velocity = np.maximum(velocity, limits.utilization(v, limits.chain.velocity_limits).max(axis=0))
        is_outside = is_outside or bool(np.any((q < limits.chain.lower) | (q > limits.chain.upper)))
    return torque, velocity, is_outside


def _peak_tracking_error(samples: Samples, motion: CastMotion) -> float:
    times, p_WE = samples.times[::TRACKING_SAMPLES], samples.p_WE[::TRACKING_SAMPLES]
    p_WE_desired = np.array([motion.evaluate(float(time))[0] for time in times])
    return float(np.linalg.norm(p_WE - p_WE_desired, axis=1).max())
