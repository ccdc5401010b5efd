"""Advance a station from poll to poll, and notice a simulation that diverges."""

from __future__ import annotations

import numpy as np
from pydrake.systems.analysis import Simulator

from wam_cast.robot.station import CastStation, Log
from wam_cast.types import Array

POLL_PERIODS = 10
"""Control periods between two polls of the ball from Python."""

CONTACT_POLL_PERIODS = 3
"""The same near the cup; longer than an impact, so that a ball at an impact's turning point does not pass for one at rest."""

MAX_BALL_SPEED = 100.0
"""A ball that is faster [m/s] belongs to a simulation that diverges."""

MAX_STATE = 1e3
"""So does a joint's angle [rad] or speed [rad/s] beyond this."""


TOO_SHORT_A_STEP = "step smaller than minimum allowed"
"""Of an integrator's message."""


class DivergedError(RuntimeError):
    """The simulated numbers run away."""


def advance(simulator: Simulator, time: float) -> None:
    """Advance `simulator` to `time` [s]; raises `DivergedError` if its numbers run away."""
    try:
        # Numbers that run away overflow on their way out, which numpy need not tell.
        with np.errstate(over="ignore", invalid="ignore"):
            simulator.AdvanceTo(time)
    except (RuntimeError, SystemExit) as error:
        # Drake reports a state that is no longer finite by one or the other, depending on who notices first.
        # Or that no step is short enough, before that.
        state = simulator.get_context().get_continuous_state_vector().CopyToVector()
        if np.all(np.abs(state) < MAX_STATE) and TOO_SHORT_A_STEP not in str(error):
            raise
        raise DivergedError(str(error)) from error


def poll_ball(station: CastStation, simulator: Simulator) -> tuple[Array, float]:
    """Return p_WL [m], shape (3,), and the ball's speed [m/s]; raises `DivergedError` if no ball could be that fast."""
    context = station.plant.GetMyContextFromRoot(simulator.get_context())
    ball = station.plant.GetBodyByName("ball")
    with np.errstate(over="ignore", invalid="ignore"):
        speed = float(np.linalg.norm(ball.EvalSpatialVelocityInWorld(context).translational()))
    if not speed < MAX_BALL_SPEED:
        raise DivergedError(f"the ball's speed is {speed} m/s")
    return ball.EvalPoseInWorld(context).translation(), speed


def bounded_part(log: Log) -> Log:
    """Return the samples whose states have not run away."""
    return log.part(np.all(np.abs(log.states) < MAX_STATE, axis=1))
