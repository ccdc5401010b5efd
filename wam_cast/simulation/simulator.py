"""Run casts in a station that is built once and used for many.

A cast flies in a station without geometry, under an explicit Runge-Kutta method of second order with a fixed step: the string's
damping is mild enough, and between two samples of the controller the right-hand side is smooth. Where the ball comes near
the cup or the floor, the state moves to a station with contact, under an error-controlled method of third order, which takes
the short steps that an impact needs and no others. Both hold the same plant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import LeafSystem

from wam_cast.cast import Cast, checked_cup
from wam_cast.casting_plane import to_casting_plane
from wam_cast.errors import checked_whole_number
from wam_cast.motion.stages import CastMotion, Stage
from wam_cast.robot.controller import CastController
from wam_cast.robot.noise import executed_cast
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario
from wam_cast.simulation.integration_step import flight_step
from wam_cast.simulation.judging import Judge, Log
from wam_cast.simulation.kinematics import Kinematics
from wam_cast.simulation.outcome import REST_RISE, SLACK_MARGIN, Outcome, is_inside, possible_rise
from wam_cast.simulation.recording import CastRecording, Throw
from wam_cast.simulation.run import Run, Start
from wam_cast.types import Array

LOOK_PERIODS = 10
"""Control periods between two looks at the flying ball from Python."""

CONTACT_LOOK_PERIODS = 3
"""The same near the cup; longer than an impact, so that a ball at an impact's turning point does not pass for one at rest."""

MAX_SPEED = 100.0
"""A ball that is faster [m/s] belongs to a simulation that broke down."""

MAX_STATE = 1e3
"""So does a joint's angle [rad] or speed [rad/s] beyond this."""


class CastSimulator:
    """Simulates casts of one scenario; building it takes longer than a cast, so keep it.

    Outcomes do not depend on what was simulated before. `make_controller` makes a controller of your own from the scenario, see
    `CastStation`.
    """

    def __init__(
        self, scenario: Scenario, *, make_controller: Callable[[Scenario], LeafSystem] = CastController
    ) -> None:
        self.scenario = scenario
        self._make_controller = make_controller
        self._flight = CastStation(scenario, has_scene=False, controller=make_controller(scenario))
        self._flight_simulator = Simulator(self._flight.diagram)
        plant = self._flight.plant
        self._ball = plant.GetBodyByName("ball")
        self._hand = plant.GetBodyByName("tool_plate")
        self._kinematics = Kinematics(plant)
        self._judge = Judge(scenario, plant)
        self.step = flight_step(self._flight)
        ResetIntegratorFromFlags(self._flight_simulator, "runge_kutta2", self.step)

    @cached_property
    def _scene(self) -> tuple[CastStation, Any]:
        station = CastStation(self.scenario, has_scene=True, controller=self._make_controller(self.scenario))
        return station, Simulator(station.diagram)

    def simulate(self, cast: Cast, cup: tuple[float, float] | None = None, *, noise_seed: int = 0) -> Outcome:
        """Simulate `cast`: with a cup at world (x, y) [m] until the ball rests or has missed, else to the landing.

        `noise_seed`, a whole number, draws the scenario's noise; without noise it is of no consequence.
        """
        return self._outcome(self._run(cast, cup, noise_seed))

    def record(
        self,
        cast: Cast,
        cup: tuple[float, float] | None = None,
        *,
        noise_seed: int = 0,
        returns: bool = True,
    ) -> CastRecording:
        """Simulate `cast` as `simulate` does, then on to the end of the return, and keep all of it.

        Without `returns` it ends with the outcome, in a quarter of the time.
        """
        run = self._run(cast, cup, noise_seed)
        outcome = self._outcome(run)
        if cup is not None and returns:
            outcome = self._return(run, outcome)
        return self._recording(run, outcome)

    def simulate_sequence(
        self,
        throws: Sequence[Throw],
        *,
        noise_seed: int = 0,
        on_outcome: Callable[[Outcome], None] | None = None,
    ) -> list[Outcome]:
        """Simulate `throws` after each other in one go, up to the last one's outcome.

        Arm, string and ball go on from cast to cast as the return left them. A ball that missed would swing on for minutes, and
        nothing measures it: someone puts it to rest, so that the next cast starts anew, from rest at home; so it does after
        a return that met a limit or broke down. One cup stands on the floor at a time: it is moved to its next place at the
        end of each return, when the ball hangs clear. The clock starts anew with each turn.

        Throw i has the noise of `noise_seed + i`; of noise's initial swing only those that start anew have any, the others have
        what the return left. `on_outcome` is called with each outcome as soon as it is known.
        """
        outcomes = []
        for _, outcome in self._sequence(throws, noise_seed, returns_at_end=False):
            outcomes.append(outcome)
            if on_outcome is not None:
                on_outcome(outcome)
        return outcomes

    def record_sequence(
        self,
        throws: Sequence[Throw],
        *,
        noise_seed: int = 0,
        on_outcome: Callable[[Outcome], None] | None = None,
    ) -> list[CastRecording]:
        """Simulate `throws` as `simulate_sequence` does, on to the end of the last return, and keep all of it.

        Each recording begins with the state that the one before it ended with, if its ball was caught.
        """
        recordings = []
        for run, outcome in self._sequence(throws, noise_seed, returns_at_end=True):
            recordings.append(self._recording(run, outcome))
            if on_outcome is not None:
                on_outcome(outcome)
        return recordings

    def _sequence(
        self, throws: Sequence[Throw], noise_seed: int, *, returns_at_end: bool
    ) -> Iterator[tuple[Run, Outcome]]:
        noise_seed = checked_whole_number("noise_seed", noise_seed, 0)
        for throw in throws:  # before anything is simulated
            checked_cup(throw.cup)
            self._flight.check_bearing(throw.cast.bearing, is_first=throw is throws[0])
        start = None
        for i, throw in enumerate(throws):
            run = self._run(throw.cast, throw.cup, noise_seed + i, start)
            outcome = self._outcome(run)
            start = None
            if returns_at_end or (outcome.is_caught and i + 1 < len(throws)):
                outcome = self._return(run, outcome)
                if outcome.is_caught and not outcome.return_faults:
                    # Now, since whoever is told of the outcome may simulate something else.
                    start = self._end_of(run)
            yield run, outcome

    def _run(
        self, cast: Cast, cup: tuple[float, float] | None, noise_seed: int, start: Start | None = None
    ) -> Run:
        if cup is not None:
            cup = checked_cup(cup)
        noise_seed = checked_whole_number("noise_seed", noise_seed, 0)
        executed = executed_cast(self.scenario.noise, cast, noise_seed)
        start_bearing = 0.0 if start is None else start.bearing
        radius = None if cup is None else to_casting_plane(np.array(cup), cast.bearing)[0]
        motion = CastMotion(self.scenario, executed, start_bearing=start_bearing, cup_radius=radius)
        run = Run(cast, cup, noise_seed, motion, start)
        with self._noticing_breakdown(run):
            self._fly(run)
            if run.scene_start is not None:
                self._settle(run)
        return run

    def _return(self, run: Run, outcome: Outcome) -> Outcome:
        """Advance to the end of the return, and return the outcome with what went wrong on the way."""
        if run.breakdown is not None:
            return outcome
        period = self.scenario.controller.period
        with self._noticing_breakdown(run):
            if run.scene_start is None:
                self._enter_scene(run)
            # On to a whole number of control periods: there the next cast's clock can start.
            self._scene[1].AdvanceTo(period * math.ceil(run.motion.stage_ends[Stage.RETURN] / period - 1e-9))
        log = self._log(run)
        since = log.times > outcome.end_time
        faults = self._judge.limits_hit(Log(log.times[since], log.states[since], log.torques[since]))
        return replace(outcome, return_faults=(*faults, *(["diverged"] if run.breakdown is not None else [])))

    def _end_of(self, run: Run) -> Start:
        return Start(self._scene[1].get_context().Clone(), run.cast.bearing)

    def _recording(self, run: Run, outcome: Outcome) -> CastRecording:
        log = self._log(run)
        p_WL, v_WL, p_WE = self._kinematics.evaluate(log.states)
        p_WE_desired = np.array([run.motion.evaluate(t)[0] for t in log.times])
        stages = np.array([run.motion.stage(t) for t in log.times])
        what = (self.scenario, run.cast, run.cup, outcome)
        return CastRecording(
            *what, log.times, log.states, log.torques, p_WL, v_WL, p_WE, p_WE_desired, stages
        )

    @contextmanager
    def _noticing_breakdown(self, run: Run) -> Iterator[None]:
        try:
            # Numbers that run away overflow on their way out, which numpy need not tell.
            with np.errstate(over="ignore", invalid="ignore"):
                yield
        except (RuntimeError, SystemExit) as error:
            # Drake reports a state that is no longer finite by one or the other, depending on who notices first.
            if not isinstance(error, _BreakdownError) and not self._is_broken(run):
                raise
            run.breakdown = str(error)

    def _is_broken(self, run: Run) -> bool:
        """Return whether the state left all bounds, as it does when an integration becomes unstable."""
        simulators = (
            [self._flight_simulator] if run.scene_start is None else [self._flight_simulator, self._scene[1]]
        )
        states = [
            simulator.get_context().get_continuous_state_vector().CopyToVector() for simulator in simulators
        ]
        return not np.all(np.abs(states) < MAX_STATE)

    def _fly(self, run: Run) -> None:
        """Advance until the ball has crossed the rim plane and, with a cup, is near something that it can touch.

        There the state is handed over to the station with contact. The flight goes on all the same, until the ball is below the
        rim plane or the string taut: the model learns where and how the ball comes down, and what the rim makes of it must
        not count.
        """
        simulator = self._flight_simulator
        context = simulator.get_mutable_context()
        self._set_start(self._flight, context, run)
        if run.start is not None:
            _load(self._flight, context, self._scene[0], run.start.context)
        simulator.Initialize()
        plant_context = self._flight.plant.GetMyContextFromRoot(context)
        period, n_look, n = self.scenario.controller.period, LOOK_PERIODS, 0
        while n * period < run.motion.stage_ends[Stage.HOLD]:
            n += n_look
            # A product, as Drake counts its samples: a sum could fall short of the last one.
            simulator.AdvanceTo(n * period)
            p_WL, speed = _position_and_speed(self._ball, plant_context)
            run.was_low |= bool(p_WL[2] <= self.scenario.cup.rim_height)
            if not run.was_low:
                run.high_until = n * period
            if run.cup is not None and run.scene_start is None:
                gap, per_period = self._gap(p_WL, run.cup), speed * period + 2e-4
                if gap < CONTACT_LOOK_PERIODS * per_period:
                    self._enter_scene(run)
                n_look = LOOK_PERIODS if gap > 2 * LOOK_PERIODS * per_period else CONTACT_LOOK_PERIODS
            if run.was_low:
                n_look = CONTACT_LOOK_PERIODS
                if (run.cup is None or run.scene_start is not None) and self._has_ended(p_WL):
                    return

    def _has_ended(self, p_WL: Array) -> bool:
        """Return whether a ball that has come down to the rim plane is all below it, or hangs in a taut string."""
        context = self._flight.plant.GetMyContextFromRoot(self._flight_simulator.get_context())
        p_EL_W = p_WL - self._hand.EvalPoseInWorld(context).translation()
        is_taut = np.linalg.norm(p_EL_W) >= (1 - SLACK_MARGIN) * self.scenario.string.length
        return bool(is_taut or p_WL[2] <= self.scenario.cup.rim_height - self.scenario.ball.radius)

    def _gap(self, p_WL: Array, cup: tuple[float, float]) -> float:
        """Return the distance [m] between the ball's surface and the floor or a solid cylinder as large as the cup."""
        shape, radius = self.scenario.cup, self.scenario.ball.radius
        outside = math.hypot(p_WL[0] - cup[0], p_WL[1] - cup[1]) - shape.outer_radius
        above = p_WL[2] - shape.rim_height
        to_cup = math.hypot(max(outside, 0.0), max(above, 0.0))
        return float(min(to_cup, p_WL[2]) - radius)

    def _enter_scene(self, run: Run) -> None:
        """Hand the state over to the station with contact."""
        station, simulator = self._scene
        source, target = self._flight_simulator.get_context(), simulator.get_mutable_context()
        self._set_start(station, target, run)
        target.SetTime(source.get_time())
        _load(station, target, self._flight, source)
        # A new integrator each time: it keeps the length of its last step, and outcomes must not depend on it.
        ResetIntegratorFromFlags(simulator, "runge_kutta3", self.scenario.simulation.max_step)
        simulator.get_mutable_integrator().set_target_accuracy(self.scenario.simulation.contact_accuracy)
        simulator.Initialize()
        run.scene_start = source.get_time()

    def _set_start(self, station: CastStation, context: Any, run: Run) -> None:
        bearing = 0.0 if run.start is None else run.start.bearing
        station.set_start(context, run.cast, run.cup, noise_seed=run.noise_seed, start_bearing=bearing)

    def _settle(self, run: Run) -> None:
        """Advance until the ball rests in the cup, lies outside of it, or the hold is over."""
        _, simulator = self._scene
        period = self.scenario.controller.period
        n = round(simulator.get_context().get_time() / period)
        n_low = 0
        while n * period < run.motion.stage_ends[Stage.HOLD]:
            n += CONTACT_LOOK_PERIODS
            simulator.AdvanceTo(n * period)
            p_CL, speed, touches_cup = self._ball_in_scene(run)
            inside = bool(is_inside(p_CL, self.scenario.cup))
            is_low = (
                inside
                and possible_rise(p_CL, speed, self.scenario.cup, self.scenario.ball.radius) < REST_RISE
            )
            n_low = n_low + 1 if is_low else 0
            run.is_carried = touches_cup or (run.is_carried and is_low)
            run.is_at_rest = n_low > 1
            on_floor = p_CL[2] + self.scenario.cup.rim_height < 1.1 * self.scenario.ball.radius
            if (run.is_at_rest and run.is_carried) or (on_floor and not inside):
                return

    def _ball_in_scene(self, run: Run) -> tuple[Array, float, bool]:
        """Return p_CL, the ball's speed, and whether it touches the cup."""
        station, simulator = self._scene
        context = station.plant.GetMyContextFromRoot(simulator.get_context())
        ball, cup = station.plant.GetBodyByName("ball"), station.plant.GetBodyByName("cup")
        assert run.cup is not None
        p_WL, speed = _position_and_speed(ball, context)
        p_CL = p_WL - [*run.cup, self.scenario.cup.rim_height]
        contacts = station.plant.get_contact_results_output_port().Eval(context)
        pairs = (contacts.point_pair_contact_info(i) for i in range(contacts.num_point_pair_contacts()))
        touches_cup = any(cup.index() in (pair.bodyA_index(), pair.bodyB_index()) for pair in pairs)
        return p_CL, speed, touches_cup

    def _outcome(self, run: Run) -> Outcome:
        flight = Log(*self._flight.logged(self._flight_simulator.get_context()))
        return self._judge.outcome(run, self._log(run), flight)

    def _log(self, run: Run) -> Log:
        """Return the log of the flight up to the hand-over and of the scene after it, while its states were finite."""
        logs = list(self._flight.logged(self._flight_simulator.get_context()))
        if run.scene_start is not None:
            station, simulator = self._scene
            n_flight = int(np.searchsorted(logs[0], run.scene_start + 1e-9))
            # The scene's first sample is the state that it was handed: the flight's last one.
            later = station.logged(simulator.get_context())
            logs = [np.concatenate([a[:n_flight], b[1:]]) for a, b in zip(logs, later, strict=True)]
        finite = np.all(np.abs(logs[1]) < MAX_STATE, axis=1)
        return Log(*(log[finite] for log in logs))


class _BreakdownError(RuntimeError):
    """The simulated numbers left all bounds."""


def _position_and_speed(ball: Any, context: Any) -> tuple[Array, float]:
    """Return p_WL and the ball's speed; raises `_BreakdownError` if no ball could be that fast."""
    speed = float(np.linalg.norm(ball.EvalSpatialVelocityInWorld(context).translational()))
    if not speed < MAX_SPEED:
        raise _BreakdownError(f"the ball's speed is {speed} m/s")
    return ball.EvalPoseInWorld(context).translation(), speed


def _load(station: CastStation, context: Any, other: CastStation, source: Any) -> None:
    """Give `context` of `station` the state that `source` of the other station has, of plant, controller and held torque.

    Both have the same systems with state: what the other has besides, a scene, has none.
    """
    pairs = (station.plant, other.plant), (station.controller, other.controller), (station.hold, other.hold)
    for own, others in pairs:
        target, given = own.GetMyMutableContextFromRoot(context), others.GetMyContextFromRoot(source)
        target.get_mutable_continuous_state_vector().SetFromVector(
            given.get_continuous_state_vector().CopyToVector()
        )
        for group in range(given.num_discrete_state_groups()):
            target.SetDiscreteState(group, given.get_discrete_state(group).value())
        for index in range(given.num_abstract_states()):
            target.get_mutable_abstract_state(index).SetFrom(given.get_abstract_state(index))
