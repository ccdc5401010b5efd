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
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import LeafSystem

from wam_cast.cast import Cast, checked_cup
from wam_cast.errors import checked_whole_number
from wam_cast.scenario import Scenario
from wam_cast.system.controller import CastController, motor_load
from wam_cast.system.flight_step import flight_step
from wam_cast.system.motion import CastMotion, Stage
from wam_cast.system.noise import executed_cast
from wam_cast.system.outcome import (
    REST_RISE,
    SLACK_MARGIN,
    BallTrack,
    Crossing,
    Outcome,
    Status,
    angle_from_vertical,
    find_crossing,
    is_inside,
    judge,
    possible_rise,
    to_casting_plane,
)
from wam_cast.system.plant import N_ARM
from wam_cast.system.recording import CastRecording, Throw
from wam_cast.system.station import CastStation

Array = NDArray[np.float64]

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
        self._scratch = plant.CreateDefaultContext()
        self._n_q = plant.num_positions()
        self._ball = plant.GetBodyByName("ball")
        self._hand = plant.GetBodyByName("tool_plate")
        self._speed_limits = plant.GetVelocityUpperLimits()[:N_ARM]
        self._lower, self._upper = (
            plant.GetPositionLowerLimits()[:N_ARM],
            plant.GetPositionUpperLimits()[:N_ARM],
        )
        self._torque_limits = plant.GetEffortUpperLimits()
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
        return self._judge(self._run(cast, cup, noise_seed))

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
        outcome = self._judge(run)
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
    ) -> Iterator[tuple[_Run, Outcome]]:
        noise_seed = checked_whole_number("noise_seed", noise_seed, 0)
        for throw in throws:  # before anything is simulated
            checked_cup(throw.cup)
            self._flight.check_bearing(throw.cast.bearing, is_first=throw is throws[0])
        start = None
        for i, throw in enumerate(throws):
            run = self._run(throw.cast, throw.cup, noise_seed + i, start)
            outcome = self._judge(run)
            start = None
            if returns_at_end or (outcome.is_caught and i + 1 < len(throws)):
                outcome = self._return(run, outcome)
                if outcome.is_caught and not outcome.return_faults:
                    # Now, since whoever is told of the outcome may simulate something else.
                    start = self._end_of(run)
            yield run, outcome

    def _run(
        self, cast: Cast, cup: tuple[float, float] | None, noise_seed: int, start: _Start | None = None
    ) -> _Run:
        if cup is not None:
            cup = checked_cup(cup)
        noise_seed = checked_whole_number("noise_seed", noise_seed, 0)
        executed = executed_cast(self.scenario.noise, cast, noise_seed)
        start_bearing = 0.0 if start is None else start.bearing
        radius = None if cup is None else to_casting_plane(np.array(cup), cast.bearing)[0]
        motion = CastMotion(self.scenario, executed, start_bearing=start_bearing, cup_radius=radius)
        run = _Run(cast, cup, noise_seed, motion, start)
        with self._noticing_breakdown(run):
            self._fly(run)
            if run.scene_start is not None:
                self._settle(run)
        return run

    def _return(self, run: _Run, outcome: Outcome) -> Outcome:
        """Advance to the end of the return, and return the outcome with what went wrong on the way."""
        if run.breakdown is not None:
            return outcome
        period = self.scenario.controller.period
        with self._noticing_breakdown(run):
            if run.scene_start is None:
                self._enter_scene(run)
            # On to a whole number of control periods: there the next cast's clock can start.
            self._scene[1].AdvanceTo(period * math.ceil(run.motion.stage_ends[Stage.RETURN] / period - 1e-9))
        times, states, torques = self._logs(run)
        since = times > outcome.end_time
        faults = self._limits_hit(*self._limits_used(states[since], torques[since]))
        return replace(outcome, return_faults=(*faults, *(["diverged"] if run.breakdown is not None else [])))

    def _end_of(self, run: _Run) -> _Start:
        return _Start(self._scene[1].get_context().Clone(), run.cast.bearing)

    def _recording(self, run: _Run, outcome: Outcome) -> CastRecording:
        times, states, torques = self._logs(run)
        p_WL, v_WL, p_WE = self._kinematics(states)
        p_WE_desired = np.array([run.motion.evaluate(t)[0] for t in times])
        stages = np.array([run.motion.stage(t) for t in times])
        what = (self.scenario, run.cast, run.cup, outcome)
        return CastRecording(*what, times, states, torques, p_WL, v_WL, p_WE, p_WE_desired, stages)

    @contextmanager
    def _noticing_breakdown(self, run: _Run) -> Iterator[None]:
        try:
            # Numbers that run away overflow on their way out, which numpy need not tell.
            with np.errstate(over="ignore", invalid="ignore"):
                yield
        except (RuntimeError, SystemExit) as error:
            # Drake reports a state that is no longer finite by one or the other, depending on who notices first.
            if not isinstance(error, _BreakdownError) and not self._is_broken(run):
                raise
            run.breakdown = str(error)

    def _is_broken(self, run: _Run) -> bool:
        """Return whether the state left all bounds, as it does when an integration becomes unstable."""
        simulators = (
            [self._flight_simulator] if run.scene_start is None else [self._flight_simulator, self._scene[1]]
        )
        states = [
            simulator.get_context().get_continuous_state_vector().CopyToVector() for simulator in simulators
        ]
        return not np.all(np.abs(states) < MAX_STATE)

    def _fly(self, run: _Run) -> None:
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

    def _enter_scene(self, run: _Run) -> None:
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

    def _set_start(self, station: CastStation, context: Any, run: _Run) -> None:
        bearing = 0.0 if run.start is None else run.start.bearing
        station.set_start(context, run.cast, run.cup, noise_seed=run.noise_seed, start_bearing=bearing)

    def _settle(self, run: _Run) -> None:
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

    def _ball_in_scene(self, run: _Run) -> tuple[Array, float, bool]:
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

    def _logs(self, run: _Run) -> tuple[Array, Array, Array]:
        """Return times, states and torques of the flight up to the hand-over and of the scene after it, while they were finite."""
        logs = list(self._flight.logged(self._flight_simulator.get_context()))
        if run.scene_start is not None:
            station, simulator = self._scene
            n_flight = int(np.searchsorted(logs[0], run.scene_start + 1e-9))
            # The scene's first sample is the state that it was handed: the flight's last one.
            later = station.logged(simulator.get_context())
            logs = [np.concatenate([a[:n_flight], b[1:]]) for a, b in zip(logs, later, strict=True)]
        finite = np.all(np.abs(logs[1]) < MAX_STATE, axis=1)
        times, states, torques = (log[finite] for log in logs)
        return times, states, torques

    def _kinematics(self, states: Array) -> tuple[Array, Array, Array]:
        """Return p_WL, v_WL and p_WE of `states`, each of shape (n, 3)."""
        result = np.empty((3, len(states), 3))
        for i, state in enumerate(states):
            self._flight.plant.SetPositionsAndVelocities(self._scratch, state)
            result[0, i] = self._ball.EvalPoseInWorld(self._scratch).translation()
            result[1, i] = self._ball.EvalSpatialVelocityInWorld(self._scratch).translational()
            result[2, i] = self._hand.EvalPoseInWorld(self._scratch).translation()
        return result[0], result[1], result[2]

    def _judge(self, run: _Run) -> Outcome:
        times, states, torques = self._logs(run)
        q, load, speed = self._limits_used(states, torques)
        limits_hit = self._limits_hit(q, load, speed)
        crossing, slack = (None, np.full(1, np.nan)) if run.breakdown is not None else self._landing(run)
        nothing = np.full(3, np.nan)
        landing = nothing[:2] if crossing is None else crossing.p_WL[:2]
        velocity = nothing if crossing is None else crossing.v_WL
        along, across = to_casting_plane(landing, run.cast.bearing)
        turn_end = float(run.motion.stage_ends[Stage.TURN])
        return Outcome(
            status=self._status(run, crossing, limits_hit, times, states),
            landing=landing,
            landing_along=along,
            landing_across=across,
            crossing_time=math.nan if crossing is None else crossing.time - turn_end,
            entry_velocity=velocity,
            entry_angle=angle_from_vertical(velocity),
            is_slack=bool(slack[0] > SLACK_MARGIN * self.scenario.string.length),
            slack=float(np.min(slack)),
            miss=math.nan if run.cup is None else float(np.linalg.norm(landing - run.cup)),
            peak_load=load,
            peak_speed=speed,
            peak_tracking_error=self._peak_tracking_error(run.motion, times, states),
            limits_hit=limits_hit,
            end_time=float(times[-1]),
        )

    def _landing(self, run: _Run) -> tuple[Crossing | None, Array]:
        """Return the flight's crossing of the rim plane, and the string's slack [m] there and until the ball is below the plane."""
        times, states, _ = self._flight.logged(self._flight_simulator.get_context())
        # Kinematics cost: at all looks but the last ones the ball was seen above the plane.
        end = slice(int(np.searchsorted(times, run.high_until - 1e-9)), None)
        times = times[end]
        p_WL, v_WL, p_WE = self._kinematics(states[end])
        crossing = find_crossing(BallTrack(times, p_WL, v_WL), self.scenario.cup.rim_height)
        if crossing is None:
            return None, np.full(1, np.nan)
        hand = [np.interp(crossing.time, times, p_WE[:, axis]) for axis in range(3)]
        rim_height, radius = self.scenario.cup.rim_height, self.scenario.ball.radius
        after = (times > crossing.time) & (p_WL[:, 2] > rim_height - radius)
        p_EL_W = np.vstack([crossing.p_WL - hand, p_WL[after] - p_WE[after]])
        return crossing, self.scenario.string.length - np.linalg.norm(p_EL_W, axis=1)

    def _status(
        self, run: _Run, crossing: Crossing | None, limits_hit: tuple[str, ...], times: Array, states: Array
    ) -> Status:
        if run.breakdown is not None:
            return Status.DIVERGED
        if limits_hit:
            return Status.LIMIT_HIT
        if crossing is None:
            return Status.NEVER_CROSSED
        if run.cup is None:
            return Status.LANDED
        since = run.high_until if run.scene_start is None else min(run.high_until, run.scene_start)
        p_WL, _, _ = self._kinematics(states[times >= since - 1e-9])
        c, s = math.cos(run.cast.bearing), math.sin(run.cast.bearing)
        R_CW = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        p_CL = (p_WL - [*run.cup, self.scenario.cup.rim_height]) @ R_CW.T
        return judge(p_CL, run.is_at_rest, run.is_carried, self.scenario.cup, self.scenario.ball.radius)

    def _limits_used(self, states: Array, torques: Array) -> tuple[Array, Array, Array]:
        """Return the arm's joint angles (n, 7), and the largest shares of torque and speed limits used, (7,) each."""
        load = motor_load(torques, self._torque_limits).max(axis=0, initial=0.0)
        speed = np.abs(states[:, self._n_q : self._n_q + N_ARM]) / self._speed_limits
        return states[:, :N_ARM], load, speed.max(axis=0, initial=0.0)

    def _limits_hit(self, q: Array, load: Array, speed: Array) -> tuple[str, ...]:
        outside = np.any((q < self._lower) | (q > self._upper), axis=0)
        checks = (("position", outside), ("torque", load > 1 - 1e-9), ("speed", speed > 1))
        return tuple(f"joint {i + 1} {what}" for what, over in checks for i in np.flatnonzero(over))

    def _peak_tracking_error(self, motion: CastMotion, times: Array, states: Array) -> float:
        """Return the hand's largest distance from its reference [m] at the looks; in between it cannot change much."""
        _, _, p_WE = self._kinematics(states[::LOOK_PERIODS])
        desired = np.array([motion.evaluate(t)[0] for t in times[::LOOK_PERIODS]])
        return float(np.linalg.norm(p_WE - desired, axis=1).max())


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


@dataclass(frozen=True, eq=False)
class _Start:
    """Where the cast before left the robot: a context of the station with contact, and the bearing [rad]."""

    context: Any
    bearing: float


@dataclass
class _Run:
    """What one simulation carries from phase to phase."""

    cast: Cast
    cup: tuple[float, float] | None
    noise_seed: int
    motion: CastMotion
    start: _Start | None
    high_until: float = 0.0
    was_low: bool = False
    scene_start: float | None = None
    is_at_rest: bool = False
    is_carried: bool = False
    breakdown: str | None = None
