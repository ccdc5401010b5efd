"""OnePass: a cast in a single pass of time, as real time has it, with the cup there from the start.

The phases of `wam_cast.simulation` go back in time: the contact-free one goes on below the rim plane as if there were no cup, and
the contact phase begins before. Here the second goes on where the first ends, and the landing is where the ball did come down,
whatever the rim made of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from wam_cast.cast import Cast
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.robot.plant import N_ARM
from wam_cast.robot.station import CastStation, Log
from wam_cast.simulation.contact import Contact, ContactPhase
from wam_cast.simulation.contact_free import ContactFree, ContactFreePhase, Start
from wam_cast.simulation.judge import Judge
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.station_loop import StationLoop, bounded_part
from wam_cast.types import Position


class _WithCup(ContactFreePhase):
    """The contact-free phase, in a station where there is a cup; `before_it_moves` is called when all is in place."""

    def __init__(self, station: CastStation, before_it_moves: Callable[[], None]) -> None:
        super().__init__(station)
        self._before_it_moves = before_it_moves

    @property
    def loop(self) -> StationLoop:
        """What simulates it."""
        return self._loop

    def _begin(self, cast: Cast, cup: Position | None, noise_seed: int, start: Start | None) -> CastMotion:
        del start
        motion = self.station.executed_motion(cast, cup, noise_seed=noise_seed)
        self._loop.begin(motion, None if cup is None else self._scenario.place_of_cup(cup), noise_seed=noise_seed)
        self._before_it_moves()
        return motion


class _GoingOn(ContactPhase):
    """The contact phase, on in the loop of the phase before."""

    def __init__(self, station: CastStation, loop: StationLoop) -> None:
        self._scenario, self._loop = station.scenario, loop

    def _begin(self, free: ContactFree) -> None:
        """Go on."""

    def _result(self, free: ContactFree, has_diverged: bool) -> Contact:
        del free
        return Contact(bounded_part(self._loop.log()), self._loop.state(), has_diverged)


class OnePass:
    """Simulates casts of a `station` with a scene, each in one pass; `before_it_moves` is called when all is in place."""

    def __init__(self, station: CastStation, before_it_moves: Callable[[], None]) -> None:
        self._free = _WithCup(station, before_it_moves)
        self._contact = _GoingOn(station, self._free.loop)
        self._judge = Judge(station)

    def log(self) -> Log:
        """Return the samples of the last cast, as far as it went."""
        return self._free.loop.log()

    def simulate(self, cast: Cast, cup: Position | None, noise_seed: int) -> Outcome:
        """Simulate a cast: with a cup until the ball rests or has missed, else to the landing."""
        free = self._free.run(cast, cup, noise_seed)
        contact = None
        if free.comes_near and not free.has_diverged:
            contact = self._contact.settle(replace(free, hand_over=self._free.loop.state()))
        return self._judge.outcome(free, _rest_of_drop(free, self.log()), contact)


def _rest_of_drop(free: ContactFree, log: Log) -> Log | None:
    """Return what the arm did from where the ball came down to the end of the drop, states (n, 14), if there was such a time."""
    if free.down is None:
        return None
    part = log.part((log.times > free.down.time) & (log.times <= free.motion.stage_ends[Stage.DROP]))
    n_q = log.states.shape[1] // 2
    return Log(part.times, part.states[:, np.r_[0:N_ARM, n_q : n_q + N_ARM]], part.torques)
