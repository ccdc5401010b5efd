"""The rest of the drop, of the arm alone: the ball comes down early in the drop, and what limits the arm meets later counts too.

A ball that lies in a cup pulls at nothing. So from where the ball comes down the arm goes on without string and ball, whatever
becomes of them.
"""

from __future__ import annotations

import numpy as np

from wam_cast.motion.polling import POLL_PERIODS
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.station import CastStation, Log
from wam_cast.robot.station_state import PartState, StationState
from wam_cast.simulation.integration import ACCURACY, EXPLICIT, Integration
from wam_cast.simulation.sampled_loop import make_loop
from wam_cast.simulation.station_loop import DivergedError


class RestOfDrop:
    """Simulates the arm of a `station` without a ball to the end of the drop, in steps as long as with one."""

    def __init__(self, station: CastStation, integration: Integration) -> None:
        self._loop = make_loop(station, EXPLICIT, integration.max_step, ACCURACY)
        self._period = station.scenario.controller.period

    def run(self, motion: CastMotion, since: StationState, noise_seed: int) -> Log:
        """Return the log from `since`, a state of a station with a ball, to the end of the drop; its states are (n, 14)."""
        self._loop.begin(motion, noise_seed=noise_seed, state=_of_arm(since), time=since.time)
        end, n = motion.stage_ends[Stage.DROP], round(since.time / self._period)
        try:
            while n * self._period < end:
                n += POLL_PERIODS
                self._loop.advance(n)
        except DivergedError:
            pass  # the log shows it: no arm keeps its limits so
        log = self._loop.log()
        return log.part(log.times <= end)


def _of_arm(state: StationState) -> StationState:
    """Return what a station without a ball has of the state of one with it."""
    plant, *others = state.parts
    q, v = np.split(plant.continuous, 2)
    arm = PartState(np.concatenate([q[:N_ARM], v[:N_ARM]]), plant.discrete, plant.abstract)
    return StationState(state.time, (arm, *others))
