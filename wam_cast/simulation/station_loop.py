"""StationLoop: a station under way from poll to poll, and how it is noticed that its numbers run away."""

from __future__ import annotations

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from wam_cast.motion.polling import MAX_BALL_SPEED, MAX_STATE
from wam_cast.motion.stages import CastMotion
from wam_cast.robot.station import CastStation, Log
from wam_cast.robot.station_state import StationState
from wam_cast.simulation.integration import begin_integration
from wam_cast.types import Array, Position

TOO_SHORT_A_STEP = "step smaller than minimum allowed"
"""Of an integrator's message."""


class DivergedError(RuntimeError):
    """The simulated numbers run away."""


class StationLoop:
    """Simulates any number of motions of a station, in its own diagram, whatever its controller.

    Time is told in control periods from the start of a motion, at whose ends all polls are.

    Parameters
    ----------
    station
        What is simulated.
    method, max_step, accuracy
        Of the integrator: see `.begin_integration`.

    Attributes
    ----------
    station
        As given.
    plant, plant_context
        That moves, here the station's, and its context.
    """

    def __init__(self, station: CastStation, method: str, max_step: float, accuracy: float) -> None:
        self.station = station
        self._integrator = method, max_step, accuracy
        self._period = station.scenario.controller.period
        self.plant, self._simulator = self._plant_and_simulator()
        self.plant_context = self.plant.GetMyMutableContextFromRoot(self._simulator.get_mutable_context())

    def _plant_and_simulator(self) -> tuple[MultibodyPlant, Simulator]:
        return self.station.plant, Simulator(self.station.diagram)

    def begin(
        self,
        motion: CastMotion,
        cup: Position | None = None,
        *,
        noise_seed: int = 0,
        state: StationState | None = None,
        time: float = 0.0,
    ) -> None:
        """Begin a `motion` at its start, see `.CastStation.begin`, or in a `state` at a `time` [s]; the log begins there."""
        self._begin(self._simulator.get_mutable_context(), motion, cup, noise_seed, state, time)
        begin_integration(self._simulator, *self._integrator)
        self._simulator.Initialize()

    def _begin(
        self,
        context: Context,
        motion: CastMotion,
        cup: Position | None,
        noise_seed: int,
        state: StationState | None,
        time: float,
    ) -> None:
        self.station.begin(context, motion, cup, noise_seed=noise_seed)
        context.SetTime(time)
        if state is not None:
            self.station.set_state(context, state)

    def advance(self, n: int) -> None:
        """Advance to the end of `n` control periods; raises `DivergedError` if the numbers run away."""
        try:
            # Numbers that run away overflow on their way out, which numpy need not tell.
            with np.errstate(over="ignore", invalid="ignore"):
                self._advance(n)
        except (RuntimeError, SystemExit) as error:
            # Drake reports a state that is no longer finite by one or the other, depending on who notices first.
            # Or that no step is short enough, before that.
            state = self.plant.GetPositionsAndVelocities(self.plant_context)
            if np.all(np.abs(state) < MAX_STATE) and TOO_SHORT_A_STEP not in str(error):
                raise
            raise DivergedError(str(error)) from error

    def _advance(self, n: int) -> None:
        # A product, as Drake counts its samples: a sum could fall short of the last one.
        self._simulator.AdvanceTo(n * self._period)

    def poll_ball(self) -> tuple[Array, float]:
        """Return p_WL [m], shape (3,), and the ball's speed [m/s]; raises `DivergedError` if no ball could be that fast."""
        context, ball = self.plant_context, self.plant.GetBodyByName("ball")
        with np.errstate(over="ignore", invalid="ignore"):
            speed = float(np.linalg.norm(ball.EvalSpatialVelocityInWorld(context).translational()))
        if not speed < MAX_BALL_SPEED:
            raise DivergedError(f"the ball's speed is {speed} m/s")
        return ball.EvalPoseInWorld(context).translation(), speed

    def state(self) -> StationState:
        """Return a copy of the time and the state."""
        return self.station.state(self._simulator.get_context())

    def log(self) -> Log:
        """Return the samples since `begin`, the first one there included."""
        return self.station.logged(self._simulator.get_context())


def bounded_part(log: Log) -> Log:
    """Return the samples whose states have not run away."""
    return log.part(np.all(np.abs(log.states) < MAX_STATE, axis=1))
