"""The contact-free phase: from the start of a cast until the ball has crossed the rim plane, as if there were no cup.

It runs in a station without geometry, under an error-controlled method of third order: explicit, or implicit where the string's
damping is stiff. Between two samples of the controller the right-hand side is smooth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from wam_cast.cast import Cast
from wam_cast.motion.polling import CONTACT_POLL_PERIODS, POLL_PERIODS, SLACK_MARGIN
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.robot.station import CastStation, Log
from wam_cast.robot.station_state import StationState
from wam_cast.simulation.ball_and_cup import gap_to_contact
from wam_cast.simulation.integration import ACCURACY, choose_integration
from wam_cast.simulation.sampled_loop import make_loop
from wam_cast.simulation.station_loop import DivergedError
from wam_cast.types import Array, Position

TRAVEL_MARGIN = 2e-4
"""How much farther than at its present speed the ball may get in a control period [m]."""


@dataclass(frozen=True, eq=False)
class Start:
    """Where a cast begins: state and bearing [rad] as the cast before left them; or, in its midst, at a time [s]."""

    state: StationState
    bearing: float = 0.0
    time: float = 0.0


@dataclass(frozen=True, eq=False)
class ContactFree:
    """The contact-free phase of a cast.

    Attributes
    ----------
    motion
        That the arm executes, of the cast with its noise.
    cup, noise_seed
        World (x, y) [m] of the cup's axis, where it does stand, or none; what the noise was drawn from.
    log
        Up to the end of the phase.
    above_until
        When the ball was last seen above the rim plane [s].
    hand_over
        The state with which the contact phase begins: where the ball came near the cup or the floor, else the last one.
    comes_near
        Whether it did.
    has_diverged
        Whether the simulation diverged.
    down
        The state in which the ball was first seen at the rim plane or below it, none if it never was.
    """

    motion: CastMotion
    cup: Position | None
    noise_seed: int
    log: Log
    above_until: float
    hand_over: StationState
    comes_near: bool
    has_diverged: bool
    down: StationState | None

    @property
    def log_to_hand_over(self) -> Log:
        """The samples up to the hand-over."""
        n = int(np.searchsorted(self.log.times, self.hand_over.time + 1e-9))
        return self.log.part(slice(n))


class ContactFreePhase:
    """Simulates the contact-free phase of any number of casts in a `station` without geometry.

    Attributes
    ----------
    station
        As given.
    integration
        By which method and in which steps.
    """

    def __init__(self, station: CastStation) -> None:
        self.station = station
        self.integration = choose_integration(station)
        self._scenario = station.scenario
        self._loop = make_loop(station, self.integration.method, self.integration.max_step, ACCURACY)

    def run(
        self, cast: Cast, cup: Position | None = None, noise_seed: int = 0, start: Start | None = None
    ) -> ContactFree:
        """Simulate `cast` until the ball has crossed the rim plane and, with a cup, is near something that it can touch.

        `cup` is where it is said to stand, world (x, y) [m].

        There the contact phase takes over. This one goes on all the same, until the ball is below the rim plane or the
        string taut: the model learns where and how the ball comes down, and what the rim makes of it must not count.
        """
        motion = self._begin(cast, cup, noise_seed, start)
        cup = None if cup is None else self._scenario.place_of_cup(cup)
        period, end = self._scenario.controller.period, motion.stage_ends[Stage.HOLD]
        above_until = 0.0 if start is None else start.time
        n, n_poll = round(above_until / period), POLL_PERIODS
        hand_over: StationState | None = None
        down: StationState | None = None
        has_diverged = False
        try:
            while n * period < end:
                n += n_poll
                self._loop.advance(n)
                p_WL, speed = self._loop.poll_ball()
                if down is None and p_WL[2] <= self._scenario.cup.rim_height:
                    down = self._loop.state()
                if down is None:
                    above_until = n * period
                is_far = cup is None
                if cup is not None and hand_over is None:
                    gap = gap_to_contact(p_WL, cup, self._scenario)
                    travel = speed * period + TRAVEL_MARGIN  # in a control period
                    is_far = gap > 2 * POLL_PERIODS * travel
                    if gap < CONTACT_POLL_PERIODS * travel:
                        hand_over = self._loop.state()
                n_poll = POLL_PERIODS if is_far and down is None else CONTACT_POLL_PERIODS
                if down is not None and (cup is None or hand_over is not None) and self._is_down(p_WL):
                    break
        except DivergedError:
            has_diverged = True
        return ContactFree(
            motion=motion,
            cup=cup,
            noise_seed=noise_seed,
            log=self._loop.log(),
            above_until=above_until,
            hand_over=self._loop.state() if hand_over is None else hand_over,
            comes_near=hand_over is not None,
            has_diverged=has_diverged,
            down=down,
        )

    def _begin(self, cast: Cast, cup: Position | None, noise_seed: int, start: Start | None) -> CastMotion:
        bearing, state, time = (0.0, None, 0.0) if start is None else (start.bearing, start.state, start.time)
        motion = self.station.executed_motion(cast, cup, noise_seed=noise_seed, start_bearing=bearing)
        self._loop.begin(motion, noise_seed=noise_seed, state=state, time=time)
        return motion

    def _is_down(self, p_WL: Array) -> bool:
        """Return whether a ball that has come down to the rim plane is all below it, or hangs in a taut string."""
        cup, hand = self._scenario.cup, self._loop.plant.GetBodyByName("tool_plate")
        p_EL_W = p_WL - hand.EvalPoseInWorld(self._loop.plant_context).translation()
        is_taut = np.linalg.norm(p_EL_W) >= (1 - SLACK_MARGIN) * self._scenario.string.length
        return bool(is_taut or p_WL[2] <= cup.rim_height - self._scenario.ball.radius)
