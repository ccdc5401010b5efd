"""Judge: what became of a simulated cast, from what was logged of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from wam_cast.casting_plane import to_casting_plane
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.robot.controller import motor_load
from wam_cast.robot.plant import N_ARM
from wam_cast.scenario import Scenario
from wam_cast.simulation.kinematics import Kinematics
from wam_cast.simulation.outcome import (
    SLACK_MARGIN,
    BallTrack,
    Crossing,
    Outcome,
    Status,
    angle_from_vertical,
    find_crossing,
    judge,
)
from wam_cast.simulation.run import Run
from wam_cast.types import Array

TRACKING_SAMPLES = 10
"""Samples between two looks at the tracking error; in between it cannot change much."""


@dataclass(frozen=True, eq=False)
class Log:
    """Samples of a simulation: times [s], shape (n,), states of the plant (n, n_x) and torques of the motors [N m], (n, 7)."""

    times: Array
    states: Array
    torques: Array


class Judge:
    """Turns the logs of runs of a `scenario` into outcomes; `plant` is that of its flying station."""

    def __init__(self, scenario: Scenario, plant: Any) -> None:
        self._scenario = scenario
        self._kinematics = Kinematics(plant)
        self._n_q = plant.num_positions()
        self._speed_limits = plant.GetVelocityUpperLimits()[:N_ARM]
        self._lower = plant.GetPositionLowerLimits()[:N_ARM]
        self._upper = plant.GetPositionUpperLimits()[:N_ARM]
        self._torque_limits = plant.GetEffortUpperLimits()

    def outcome(self, run: Run, log: Log, flight: Log) -> Outcome:
        """Return the outcome of a `run`: `log` is what happened, with contact; `flight` how the ball flies without a cup."""
        load, speed = self._limits_used(log)
        limits_hit = self.limits_hit(log)
        crossing, slack = (
            (None, np.full(1, np.nan)) if run.breakdown is not None else self._landing(run, flight)
        )
        nothing = np.full(3, np.nan)
        landing = nothing[:2] if crossing is None else crossing.p_WL[:2]
        velocity = nothing if crossing is None else crossing.v_WL
        along, across = to_casting_plane(landing, run.cast.bearing)
        turn_end = float(run.motion.stage_ends[Stage.TURN])
        return Outcome(
            status=self._status(run, crossing, limits_hit, log),
            landing=landing,
            landing_along=along,
            landing_across=across,
            crossing_time=math.nan if crossing is None else crossing.time - turn_end,
            entry_velocity=velocity,
            entry_angle=angle_from_vertical(velocity),
            is_slack=bool(slack[0] > SLACK_MARGIN * self._scenario.string.length),
            slack=float(np.min(slack)),
            miss=math.nan if run.cup is None else float(np.linalg.norm(landing - run.cup)),
            peak_load=load,
            peak_speed=speed,
            peak_tracking_error=self._peak_tracking_error(run.motion, log),
            limits_hit=limits_hit,
            end_time=float(log.times[-1]),
        )

    def limits_hit(self, log: Log) -> tuple[str, ...]:
        """Return which limits of the arm were met, such as `joint 4 speed`."""
        q = log.states[:, :N_ARM]
        load, speed = self._limits_used(log)
        outside = np.any((q < self._lower) | (q > self._upper), axis=0)
        checks = (("position", outside), ("torque", load > 1 - 1e-9), ("speed", speed > 1))
        return tuple(f"joint {i + 1} {what}" for what, over in checks for i in np.flatnonzero(over))

    def _limits_used(self, log: Log) -> tuple[Array, Array]:
        """Return the largest shares of torque and speed limits used, (7,) each."""
        load = motor_load(log.torques, self._torque_limits).max(axis=0, initial=0.0)
        speed = np.abs(log.states[:, self._n_q : self._n_q + N_ARM]) / self._speed_limits
        return load, speed.max(axis=0, initial=0.0)

    def _landing(self, run: Run, flight: Log) -> tuple[Crossing | None, Array]:
        """Return the flight's crossing of the rim plane, and the string's slack [m] there and until the ball is below the plane."""
        # Kinematics cost: at all looks but the last ones the ball was seen above the plane.
        end = slice(int(np.searchsorted(flight.times, run.high_until - 1e-9)), None)
        times = flight.times[end]
        p_WL, v_WL, p_WE = self._kinematics.evaluate(flight.states[end])
        rim_height, radius = self._scenario.cup.rim_height, self._scenario.ball.radius
        crossing = find_crossing(BallTrack(times, p_WL, v_WL), rim_height)
        if crossing is None:
            return None, np.full(1, np.nan)
        hand = [np.interp(crossing.time, times, p_WE[:, axis]) for axis in range(3)]
        after = (times > crossing.time) & (p_WL[:, 2] > rim_height - radius)
        p_EL_W = np.vstack([crossing.p_WL - hand, p_WL[after] - p_WE[after]])
        return crossing, self._scenario.string.length - np.linalg.norm(p_EL_W, axis=1)

    def _status(self, run: Run, crossing: Crossing | None, limits_hit: tuple[str, ...], log: Log) -> Status:
        if run.breakdown is not None:
            return Status.DIVERGED
        if limits_hit:
            return Status.LIMIT_HIT
        if crossing is None:
            return Status.NEVER_CROSSED
        if run.cup is None:
            return Status.LANDED
        cup, radius = self._scenario.cup, self._scenario.ball.radius
        since = run.high_until if run.scene_start is None else min(run.high_until, run.scene_start)
        p_WL, _, _ = self._kinematics.evaluate(log.states[log.times >= since - 1e-9])
        c, s = math.cos(run.cast.bearing), math.sin(run.cast.bearing)
        R_CW = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        p_CL = (p_WL - [*run.cup, cup.rim_height]) @ R_CW.T
        return judge(p_CL, run.is_at_rest, run.is_carried, cup, radius)

    def _peak_tracking_error(self, motion: CastMotion, log: Log) -> float:
        """Return the hand's largest distance from its reference [m]."""
        _, _, p_WE = self._kinematics.evaluate(log.states[::TRACKING_SAMPLES])
        desired = np.array([motion.evaluate(t)[0] for t in log.times[::TRACKING_SAMPLES]])
        return float(np.linalg.norm(p_WE - desired, axis=1).max())
