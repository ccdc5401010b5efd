"""The contact phase: from near the cup until the ball rests or has missed, and then the return.

It runs in a station with contact, under an error-controlled method of third order, which takes the short steps that an impact
needs and no others. The plant is that of the contact-free phase.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from wam_cast.motion.polling import CONTACT_POLL_PERIODS
from wam_cast.motion.stages import Stage
from wam_cast.robot.drake_types import evaluate
from wam_cast.robot.station import CastStation, Log
from wam_cast.robot.station_state import StationState
from wam_cast.simulation.ball_and_cup import REST_RISE, height_above_support, is_inside, possible_rise
from wam_cast.simulation.contact_free import ContactFree
from wam_cast.simulation.integration import Integration
from wam_cast.simulation.sampled_loop import make_loop
from wam_cast.simulation.station_loop import DivergedError, StationLoop, bounded_part
from wam_cast.types import Position

LYING_HEIGHT = 1.1
"""A ball whose centre is lower than this many of its radii above floor or stand lies there."""


@dataclass(frozen=True, eq=False)
class Contact:
    """The contact phase of a cast.

    Attributes
    ----------
    log
        Of the whole cast: contact-free up to the hand-over, then with contact, while its states were bounded.
    end
        The state at the end.
    has_diverged
        Whether the simulation diverged.
    is_at_rest, is_carried
        Whether the ball rests inside the cup, and whether the cup carries it, before the return.
    """

    log: Log
    end: StationState
    has_diverged: bool
    is_at_rest: bool = False
    is_carried: bool = False


class BallWatch:
    """Whether the ball has come to rest, seen from poll to poll, `CONTACT_POLL_PERIODS` apart, of a `loop` with contact.

    `cup` is the world (x, y) [m] of the cup's axis.

    Attributes
    ----------
    is_at_rest, is_carried
        Whether the ball rests inside the cup, and whether the cup was touched since it came to rest.
    lies_outside
        Whether it lies on the floor or on the cup's stand, beside the cup.
    """

    def __init__(self, loop: StationLoop, cup: Position) -> None:
        self._loop, self._cup, self._scenario = loop, cup, loop.station.scenario
        self._n_low = 0
        self.is_carried = self.lies_outside = False

    @property
    def is_at_rest(self) -> bool:
        """Whether the ball was low and slow in the cup at the last two polls."""
        return self._n_low > 1

    @property
    def is_caught(self) -> bool:
        """Whether the ball rests inside the cup, carried by it."""
        return self.is_at_rest and self.is_carried

    def poll(self) -> None:
        """Look at the ball; raises `DivergedError` if no ball could be that fast."""
        p_WL, speed = self._loop.poll_ball()
        shape = self._scenario.cup
        p_CL = p_WL - [*self._cup, shape.rim_height]
        inside = bool(is_inside(p_CL, shape))
        is_low = inside and possible_rise(p_CL, speed, self._scenario) < REST_RISE
        self._n_low = self._n_low + 1 if is_low else 0
        self.is_carried = self._touches_cup() or (self.is_carried and is_low)
        lies = height_above_support(p_WL, self._cup, shape) < LYING_HEIGHT * self._scenario.ball.radius
        self.lies_outside = lies and not inside

    def _touches_cup(self) -> bool:
        plant = self._loop.plant
        cup = plant.GetBodyByName("cup").index()
        contacts = evaluate(plant.get_contact_results_output_port(), self._loop.plant_context)
        pairs = (contacts.point_pair_contact_info(i) for i in range(contacts.num_point_pair_contacts()))
        return any(cup in (pair.bodyA_index(), pair.bodyB_index()) for pair in pairs)


class ContactPhase:
    """Simulates the contact phase of casts in a `station` with geometry, each where its contact-free phase handed over."""

    def __init__(self, station: CastStation, integration: Integration) -> None:
        self._scenario = station.scenario
        accuracy = self._scenario.simulation.contact_accuracy
        self._loop = make_loop(station, integration.contact_method, integration.max_step, accuracy)

    def settle(self, free: ContactFree) -> Contact:
        """Simulate until the ball rests in the cup, lies outside of it, or the hold is over."""
        assert free.cup is not None
        self._begin(free)
        period, end = self._scenario.controller.period, free.motion.stage_ends[Stage.HOLD]
        n, watch, has_diverged = round(free.hand_over.time / period), BallWatch(self._loop, free.cup), False
        try:
            while n * period < end and not (watch.is_caught or watch.lies_outside):
                n += CONTACT_POLL_PERIODS
                self._loop.advance(n)
                watch.poll()
        except DivergedError:
            has_diverged = True
        result = self._result(free, has_diverged)
        return replace(result, is_at_rest=watch.is_at_rest, is_carried=watch.is_carried)

    def go_home(self, free: ContactFree, *, is_settled: bool) -> Contact:
        """Simulate the return, on from where `settle` ended, or from the hand-over if the ball came near nothing."""
        if not is_settled:
            self._begin(free)
        period, end = self._scenario.controller.period, free.motion.stage_ends[Stage.RETURN]
        has_diverged = False
        try:
            # On to an integer number of control periods: there the next cast's clock can start.
            self._loop.advance(math.ceil(end / period - 1e-9))
        except DivergedError:
            has_diverged = True
        return self._result(free, has_diverged)

    def _begin(self, free: ContactFree) -> None:
        start = free.hand_over
        self._loop.begin(free.motion, free.cup, noise_seed=free.noise_seed, state=start, time=start.time)

    def _result(self, free: ContactFree, has_diverged: bool) -> Contact:
        # The first sample is the state that was handed over: the last one of the contact-free phase.
        since = self._loop.log().part(slice(1, None))
        log = bounded_part(free.log_to_hand_over.followed_by(since))
        return Contact(log, self._loop.state(), has_diverged)
