"""Simulate casts: one, or several after each other without a reset, in stations that are built once and used for many.

The contact-free phase ends with the ball below the rim plane; where the ball comes near the cup or the floor, the contact phase
takes over, and the return goes on from there.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from pydrake.systems.framework import LeafSystem

from wam_cast.arm.arm_model import arm_model
from wam_cast.cast import Cast, checked_cup
from wam_cast.errors import InputError, checked_integer
from wam_cast.motion.in_flight import InFlight
from wam_cast.motion.stages import Stage
from wam_cast.robot.controller import CastController
from wam_cast.robot.kinematics import Kinematics
from wam_cast.robot.station import CastStation, Log, believed
from wam_cast.scenario import Scenario
from wam_cast.simulation.contact import Contact, ContactPhase
from wam_cast.simulation.contact_free import ContactFree, ContactFreePhase, Start
from wam_cast.simulation.integration import Integration
from wam_cast.simulation.judge import Judge, log_of
from wam_cast.simulation.loop_stability import check_loop
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.simulation.recording import CastRecording, Throw
from wam_cast.simulation.rest_of_drop import RestOfDrop
from wam_cast.types import Position, checks_types


@dataclass(frozen=True, eq=False)
class Simulated:
    """A simulated cast: its phases, the second one if the ball came near something, and its outcome."""

    cast: Cast
    free: ContactFree
    contact: Contact | None
    outcome: Outcome


class CastSimulator:
    """Simulates casts of one scenario; building it takes longer than a cast, so keep it.

    Outcomes do not depend on what was simulated before. `belief` is the robot as the controller knows it, by default the same;
    `make_controller` makes a controller of your own from what is believed: see `.CastStation`.

    Raises
    ------
    InputError
        If the scenario cannot be simulated: the arm does not reach where it is to, the string needs too short steps, or the gains
        of `.CastController` are unstable at its period and delay.
    """

    @checks_types
    def __init__(
        self,
        scenario: Scenario,
        belief: Scenario | None = None,
        *,
        make_controller: Callable[[Scenario], LeafSystem] = CastController,
    ) -> None:
        self.scenario, self._belief = scenario, belief
        self._make_controller = make_controller
        if make_controller is CastController:
            check_loop(scenario, believed(scenario, belief))
        self._contact_free = ContactFreePhase(self._station(has_scene=False))
        self._kinematics = Kinematics(self._contact_free.station.plant)
        self._judge = Judge(self._contact_free.station)
        self._rest_of_drop = RestOfDrop(self._station(has_scene=False, has_ball=False), self.integration)

    @cached_property
    def _contact(self) -> ContactPhase:
        return ContactPhase(self._station(has_scene=True), self.integration)

    def _station(self, *, has_scene: bool, has_ball: bool = True) -> CastStation:
        controller = self._make_controller(believed(self.scenario, self._belief))
        return CastStation(
            self.scenario, belief=self._belief, has_scene=has_scene, has_ball=has_ball, controller=controller
        )

    @property
    def integration(self) -> Integration:
        """How the contact-free phase is integrated, in which steps, and what a cast is expected to cost."""
        return self._contact_free.integration

    @checks_types
    def simulate(self, cast: Cast, cup: Position | None = None, *, noise_seed: int = 0) -> Outcome:
        """Simulate `cast`: with a cup at world (x, y) [m] until the ball rests or has missed, else to the landing.

        `noise_seed`, an integer, draws the scenario's noise; without noise it is of no consequence.
        """
        return self._simulate(cast, cup, noise_seed).outcome

    @checks_types
    def simulate_on(self, cast: Cast, cup: Position, since: InFlight, *, noise_seed: int = 0) -> Outcome:
        """Simulate the rest of a `cast` into a cup, from where another engine has brought it.

        Of the arm the outcome tells no more than this rest, and not what it meets later in the drop; of the ball, all.
        """
        station = self._contact_free.station
        motion = station.executed_motion(cast, cup, noise_seed=noise_seed)
        start = Start(station.state_in_flight(motion, since, noise_seed=noise_seed), time=since.time)
        free, contact = self._to_rest(cast, cup, noise_seed, start)
        return self._judge.outcome(free, contact=contact)

    @checks_types
    def record(
        self, cast: Cast, cup: Position | None = None, *, noise_seed: int = 0, returns: bool = True
    ) -> CastRecording:
        """Simulate `cast` as `simulate` does, then on to the end of the return, and keep all of it.

        Without `returns` it ends with the outcome, in a quarter of the time.
        """
        simulated = self._simulate(cast, cup, noise_seed)
        if cup is not None and returns:
            simulated = self._go_home(simulated)
        return self._recording(simulated)

    @checks_types
    def simulate_sequence(
        self, throws: Sequence[Throw], *, noise_seed: int = 0, on_outcome: Callable[[Outcome], None] | None = None
    ) -> list[Outcome]:
        """Simulate `throws` after each other without a reset, up to the last one's outcome.

        Arm, string and ball go on from cast to cast as the return left them. A ball that missed would swing on for minutes, and
        nothing measures it: someone puts it to rest, so that the next cast starts anew, from rest at home; so it does after
        a return that met a limit or diverged. One cup stands on the floor at a time: it is moved to its next place at the
        end of each return, when the ball hangs clear. The clock starts anew with each turn.

        Throw i has the noise of `noise_seed + i`; of noise's initial swing only those that start anew have any, the others have
        what the return left. `on_outcome` is called with each outcome as soon as it is known.
        """
        outcomes = []
        for simulated in self._sequence(throws, noise_seed, returns_at_end=False):
            outcomes.append(simulated.outcome)
            if on_outcome is not None:
                on_outcome(simulated.outcome)
        return outcomes

    @checks_types
    def record_sequence(
        self,
        throws: Sequence[Throw],
        *,
        noise_seed: int = 0,
        on_outcome: Callable[[Outcome], None] | None = None,
        on_recording: Callable[[CastRecording], None] | None = None,
    ) -> list[CastRecording]:
        """Simulate `throws` as `simulate_sequence` does, on to the end of the last return, and keep all of it.

        Each recording begins with the state that the one before it ended with, if its ball was caught. `on_recording` is called
        with each as soon as it is complete.
        """
        recordings = []
        for simulated in self._sequence(throws, noise_seed, returns_at_end=True):
            recordings.append(self._recording(simulated))
            if on_recording is not None:
                on_recording(recordings[-1])
            if on_outcome is not None:
                on_outcome(simulated.outcome)
        return recordings

    def _sequence(self, throws: Sequence[Throw], noise_seed: int, *, returns_at_end: bool) -> Iterator[Simulated]:
        noise_seed = checked_integer("noise_seed", noise_seed, 0)
        for throw in throws:  # before anything is simulated
            checked_cup(throw.cup)
            self._contact_free.station.check_bearing(throw.cast.bearing, is_first=throw is throws[0])
        start = None
        for i, throw in enumerate(throws):
            simulated = self._simulate(throw.cast, throw.cup, noise_seed + i, start)
            start = None
            if returns_at_end or (simulated.outcome.is_caught and i + 1 < len(throws)):
                simulated = self._go_home(simulated)
                outcome, contact = simulated.outcome, simulated.contact
                if contact is not None and outcome.is_caught and not outcome.return_faults:
                    start = Start(contact.end, throw.cast.bearing)
            yield simulated

    def _simulate(self, cast: Cast, cup: Position | None, noise_seed: int, start: Start | None = None) -> Simulated:
        free, contact = self._to_rest(cast, cup, noise_seed, start)
        return Simulated(cast, free, contact, self._judge.outcome(free, self._finish_drop(free), contact))

    def _to_rest(
        self, cast: Cast, cup: Position | None, noise_seed: int, start: Start | None
    ) -> tuple[ContactFree, Contact | None]:
        cup = None if cup is None else checked_cup(cup)
        free = self._contact_free.run(cast, cup, checked_integer("noise_seed", noise_seed, 0), start)
        return free, self._contact.settle(free) if free.comes_near and not free.has_diverged else None

    def _finish_drop(self, free: ContactFree) -> Log | None:
        """Return the log of the arm alone from where the ball came down to the end of the drop, if there is such a time."""
        if free.down is None or free.down.time >= free.motion.stage_ends[Stage.DROP]:
            return None
        return self._rest_of_drop.run(free.motion, free.down, free.noise_seed)

    def _go_home(self, simulated: Simulated) -> Simulated:
        """Simulate the return as well, unless the cast diverged; the outcome tells what went wrong on the way."""
        if simulated.outcome.status is Status.DIVERGED:
            return simulated
        contact = self._contact.go_home(simulated.free, is_settled=simulated.contact is not None)
        since = contact.log.times > simulated.outcome.end_time
        faults = self._judge.limits_hit(contact.log.part(since))
        if contact.has_diverged:
            faults = (*faults, "diverged")
        return replace(simulated, contact=contact, outcome=replace(simulated.outcome, return_faults=faults))

    def _recording(self, simulated: Simulated) -> CastRecording:
        log, motion = log_of(simulated.free, simulated.contact), simulated.free.motion
        p_WL, v_WL, p_WE = self._kinematics.evaluate(log.states)
        return CastRecording(
            scenario=self.scenario,
            cast=simulated.cast,
            cup=simulated.free.cup,
            outcome=simulated.outcome,
            times=log.times,
            states=log.states,
            torques=log.torques,
            p_WL=p_WL,
            v_WL=v_WL,
            p_WE=p_WE,
            p_WE_desired=self._contact_free.station.desired_path(motion, log.times),
            stages=np.array([motion.stage(t) for t in log.times]),
        )


@lru_cache(maxsize=4)
def _shared_simulator(
    scenario: Scenario,
    belief: Scenario | None,
    make_controller: Callable[[Scenario], LeafSystem],
    _urdfs: tuple[str, ...],
) -> CastSimulator:
    """Return the simulator of `scenario` with such a belief and controller that this process keeps, unless a URDF has changed."""
    return CastSimulator(scenario, belief, make_controller=make_controller)


def _urdfs(scenario: Scenario, belief: Scenario | None) -> tuple[str, ...]:
    return tuple(arm_model(one.arm).urdf for one in (scenario, belief or scenario))


_one_at_a_time = threading.RLock()  # whoever is told of an outcome may simulate something else


@checks_types
def simulate_cast(
    scenario: Scenario,
    cast: Cast,
    cup: Position | None = None,
    *,
    belief: Scenario | None = None,
    noise_seed: int = 0,
    make_controller: Callable[[Scenario], LeafSystem] | None = None,
) -> Outcome:
    """Simulate one cast, in a simulator that is kept for the next ones.

    Threads take turns, since Drake's Python systems are not made for several at once; use processes to go faster.

    Parameters
    ----------
    scenario, cast
        What is cast, and how.
    cup
        World (x, y) [m] of where the axis of a physical cup is said to be; without one the simulation ends when the ball has
        crossed the rim plane.
    belief
        The robot as its controller knows it, by default the same `scenario`.
    noise_seed
        Draws the scenario's noise: the same seed gives the same outcome. Without noise it is of no consequence.
    make_controller
        Makes a controller of your own from the scenario, as for `CastSimulator`; by default there is `.CastController`.

    Raises
    ------
    InputError
        If the cup's position is not a pair of finite numbers, the noise seed not an integer from 0 on, or the arm cannot turn
        to the cast's bearing.
    """
    with _one_at_a_time:
        simulator = _shared_simulator(scenario, belief, make_controller or CastController, _urdfs(scenario, belief))
        return simulator.simulate(cast, cup, noise_seed=noise_seed)


@checks_types
def simulate_casts(
    scenario: Scenario,
    casts: Sequence[Cast],
    cups: Sequence[Position],
    *,
    belief: Scenario | None = None,
    noise_seed: int = 0,
    on_outcome: Callable[[Outcome], None] | None = None,
) -> list[Outcome]:
    """Simulate casts after each other without a reset, each into its cup: cast, lift the ball out, return, turn, and cast again.

    See `CastSimulator.simulate_sequence`; threads take turns as for `simulate_cast`.

    Parameters
    ----------
    scenario
        What is fixed.
    casts, cups
        What is cast in turn, and world (x, y) [m] of each one's cup; as many of the one as of the other.
    belief
        As for `simulate_cast`.
    noise_seed
        Draws the scenario's noise of the first cast, `noise_seed + 1` that of the second, and so on.
    on_outcome
        Called with each outcome as soon as it is known, or none.

    Raises
    ------
    InputError
        As `simulate_cast` does, and if the numbers of casts and cups differ.
    """
    if len(casts) != len(cups):
        raise InputError(f"casts, cups: {len(casts)} casts for {len(cups)} cups; give each cast its cup")
    throws = [Throw(cast, cup) for cast, cup in zip(casts, cups, strict=True)]
    with _one_at_a_time:
        simulator = _shared_simulator(scenario, belief, CastController, _urdfs(scenario, belief))
        return simulator.simulate_sequence(throws, noise_seed=noise_seed, on_outcome=on_outcome)


@checks_types
def record_cast(
    scenario: Scenario, cast: Cast, cup: Position | None = None, *, belief: Scenario | None = None, noise_seed: int = 0
) -> CastRecording:
    """Simulate one cast as `simulate_cast` does, and keep all of it up to its outcome."""
    with _one_at_a_time:
        simulator = _shared_simulator(scenario, belief, CastController, _urdfs(scenario, belief))
        return simulator.record(cast, cup, noise_seed=noise_seed, returns=False)
