"""A cast into a cup in MuJoCo, with the contact law of docs/physics.md applied by hand.

MuJoCo finds where ball and cup overlap; its own contact forces are off. Those here depend on position and speed at every stage of
a Runge-Kutta step, so that short steps resolve an impact.
"""

from __future__ import annotations

import math

import numpy as np

from wam_cast.cast import Cast
from wam_cast.crosscheck.flight_numbers import limits_used
from wam_cast.crosscheck.mujoco_flight import Flight, MujocoSimulator, Robot, Samples, run
from wam_cast.crosscheck.mujoco_model import compiled, cup_mjcf, import_mujoco
from wam_cast.motion.polling import CONTACT_POLL_PERIODS
from wam_cast.motion.stages import Stage
from wam_cast.robot.plant import STICTION_SPEED, hunt_crossley_dissipation
from wam_cast.scenario import Scenario
from wam_cast.simulation.ball_and_cup import (
    REST_RISE,
    gap_to_contact,
    height_above_support,
    is_inside,
    possible_rise,
    taut_distance,
)
from wam_cast.simulation.contact import LYING_HEIGHT
from wam_cast.simulation.contact_free import TRAVEL_MARGIN
from wam_cast.simulation.judge import verdict
from wam_cast.simulation.outcome import Status
from wam_cast.types import Array, Position

CONTACT_STEP = 5e-5
"""Of the integration while the ball touches something [s]."""

OWN_STEP = 1e-4
"""The same with MuJoCo's own contact."""

FREE_STEP = 2e-4
"""The same where it touches nothing any more, but has done so [s]: its string may be in a fold, whose damping is fast."""


class CupContact:
    """The force of cup, stand and floor on the ball: f = k x (1 + d x'), and Coulomb friction that fades at low speed.

    Parameters
    ----------
    scenario, cup
        The ball and the cup, and where it stands [m].
    """

    def __init__(self, scenario: Scenario, cup: Position) -> None:
        self._mujoco = import_mujoco()
        self._model = compiled(cup_mjcf(scenario, cup))
        self._data = self._mujoco.MjData(self._model)
        self._ball = self._model.body("ball").geomadr[0]
        self._floor = self._model.geom("floor").id
        self._stiffness, self._friction = scenario.cup.stiffness, scenario.cup.friction
        self._dissipation = hunt_crossley_dissipation(scenario.cup.restitution)

    def force(self, p_WL: Array, v_WL: Array, w_WL: Array) -> tuple[Array, bool, bool]:
        """Return force [N] and moment [N m] on the ball's centre, (6,), and whether it touches anything, and the cup.

        The ball is at `p_WL` [m], moves with `v_WL` [m/s] and turns with `w_WL` [rad/s], (3,) each.
        """
        self._data.qpos[:3] = p_WL
        self._mujoco.mj_kinematics(self._model, self._data)
        self._mujoco.mj_collision(self._model, self._data)
        total, touches, touches_cup = np.zeros(6), False, False
        for i in range(self._data.ncon):
            contact = self._data.contact[i]
            if contact.dist >= 0:
                continue
            touches, touches_cup = True, touches_cup or self._floor not in contact.geom
            normal = contact.frame[:3] * (-1.0 if contact.geom[0] == self._ball else 1.0)  # out of the cup
            arm = contact.pos - p_WL
            speed = v_WL + np.cross(w_WL, arm)
            force = self._force_at(-contact.dist, normal, speed)
            total += np.concatenate([force, np.cross(arm, force)])
        return total, touches, touches_cup

    def _force_at(self, depth: float, normal: Array, speed: Array) -> Array:
        closing = -float(normal @ speed)
        pressure = max(self._stiffness * depth * (1 + self._dissipation * closing), 0.0)
        sliding = speed + closing * normal
        size = float(np.linalg.norm(sliding))
        if size == 0:
            return pressure * normal
        share = min(size / STICTION_SPEED, 1.0)
        # Grows smoothly, with a smooth derivative, to the full coefficient.
        coefficient = self._friction * share**3 * (10 - 15 * share + 6 * share**2)
        return np.asarray(pressure * (normal - coefficient / size * sliding))


class ByHand:
    """Advances a robot from sample to sample with `CupContact`, in short steps where its ball may touch something.

    Attributes
    ----------
    robot
        That is advanced.
    is_near, touches_cup
        Whether the ball has come near anything, and whether it touched the cup just now.
    """

    def __init__(self, simulator: MujocoSimulator, cup: Position) -> None:
        scenario = simulator.scenario
        self.robot = simulator.robot
        self._cup, self._scenario = cup, scenario
        self._n_free, self._period = simulator.n_steps, scenario.controller.period
        self._n_fine = math.ceil(self._period / FREE_STEP - 1e-9)
        self.is_near = self.touches_cup = False
        self._prepare()

    def _prepare(self) -> None:
        self._contact = CupContact(self._scenario, self._cup)
        self._n_short = math.ceil(FREE_STEP / CONTACT_STEP - 1e-9)

    def advance(self, _sample: int) -> None:
        """Bring the robot to the next sample."""
        p_WL, v_WL, _ = self.robot.places
        travel = float(np.linalg.norm(v_WL)) * self._period + TRAVEL_MARGIN
        if gap_to_contact(p_WL, self._cup, self._scenario) > travel:
            self.touches_cup = False
            self._advance_free(max(self._n_free, self._n_fine) if self.is_near else self._n_free)
        else:
            self.is_near = True
            self._advance_near()

    def _advance_free(self, n_steps: int) -> None:
        model = self.robot.model
        model.opt.timestep = self._period / n_steps
        self.robot.mujoco.mj_step(model, self.robot.data, n_steps)

    def _advance_near(self) -> None:
        data = self.robot.data
        step = self._period / self._n_fine
        for _fine in range(self._n_fine):
            before = data.qpos.copy(), data.qvel.copy()
            if self._step(step):  # again, in shorter ones
                data.qpos[:], data.qvel[:] = before
                for _short in range(self._n_short):
                    self._step(step / self._n_short)
        data.xfrc_applied[:] = 0

    def _step(self, step: float) -> bool:
        """Make one step of the classical fourth-order method; return whether the ball touched anything."""
        data = self.robot.data
        q, v = data.qpos.copy(), data.qvel.copy()
        touched = False
        v_now, slopes = v, []
        for share in (0.5, 0.5, 1.0, 0.0):
            acceleration, touches = self._acceleration()
            touched = touched or touches
            slopes.append((v_now, acceleration))
            v_next = v + share * step * acceleration
            data.qpos[:], data.qvel[:] = q + share * step * v_now, v_next
            v_now = v_next
        weights = np.array([1.0, 2.0, 2.0, 1.0]) * step / 6
        data.qpos[:] = q + weights @ np.array([rate for rate, _ in slopes])
        data.qvel[:] = v + weights @ np.array([acceleration for _, acceleration in slopes])
        return touched

    def _acceleration(self) -> tuple[Array, bool]:
        robot = self.robot
        mj, model, data = robot.mujoco, robot.model, robot.data
        mj.mj_fwdPosition(model, data)
        mj.mj_fwdVelocity(model, data)
        p_WL, v_WL, _ = robot.places
        force, touches, self.touches_cup = self._contact.force(p_WL, v_WL, robot.ball_spin)
        data.xfrc_applied[robot.ball] = force
        mj.mj_fwdActuation(model, data)
        mj.mj_fwdAcceleration(model, data)
        return data.qacc_smooth.copy(), touches


class Own(ByHand):
    """Does so with MuJoCo's own contact, a linear spring and damper that keeps the same share of the speed at 2 m/s."""

    def _prepare(self) -> None:
        self.robot = Robot(self._scenario, self._period, cup=self._cup)
        self._floor = self.robot.model.geom("floor").id

    def _advance_near(self) -> None:
        self._advance_free(math.ceil(self._period / OWN_STEP - 1e-9))
        contacts = self.robot.data.contact
        self.touches_cup = bool(np.any((contacts.dist < 0) & np.all(contacts.geom != self._floor, axis=1)))


def cast_into_cup(
    simulator: MujocoSimulator, cast: Cast, cup: Position, noise_seed: int = 0, law: type[ByHand] = ByHand
) -> tuple[Status, Samples]:
    """Simulate `cast` until the ball rests in a cup that is said to stand at `cup` [m], lies outside of it, or the hold is over.

    Return what became of the ball, by the definitions of the package, and the samples; `law` is of contact: `ByHand` or `Own`.
    """
    scenario, shape = simulator.scenario, simulator.scenario.cup
    place = scenario.place_of_cup(cup)
    pusher = law(simulator, place)
    control = simulator.begin(cast, noise_seed, pusher.robot)
    watch = _Watch(scenario, place, pusher)
    end, period = control.motion.stage_ends[Stage.HOLD], scenario.controller.period
    samples = run(
        pusher.robot,
        control,
        period,
        simulator.n_steps,
        lambda n, p_WL, _: watch.is_over(n, p_WL) or n * period >= end,
        advance=pusher.advance,
    )
    if samples.has_diverged:
        return Status.DIVERGED, samples
    torque, velocity, is_outside = limits_used(Flight(control.motion, samples, None, None), simulator.limits)
    if np.any(torque > 1 - 1e-9) or np.any(velocity > 1) or is_outside:
        return Status.LIMIT_HIT, samples
    falling = slice(int(np.argmax(samples.p_WL[:, 2] < shape.rim_height + scenario.string.length / 2)), None)
    c, s = math.cos(cast.bearing), math.sin(cast.bearing)
    p_CL = (samples.p_WL[falling] - [*place, shape.rim_height]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    is_taut = bool(np.linalg.norm(samples.p_WL[-1] - samples.p_WE[-1]) >= taut_distance(scenario))
    return verdict(p_CL, watch.is_at_rest, watch.is_carried, shape, scenario.ball.radius, is_taut=is_taut), samples


class _Watch:
    """Sees whether a ball near the cup has come to rest."""

    def __init__(self, scenario: Scenario, place: Position, pusher: ByHand) -> None:
        self._scenario, self._place, self._pusher = scenario, place, pusher
        self._n_low = 0
        self.is_at_rest = self.is_carried = False

    def is_over(self, n: int, p_WL: Array) -> bool:
        """Look at the ball at a sample's number, every few samples, and return whether it rests or lies outside."""
        if n % CONTACT_POLL_PERIODS or not self._pusher.is_near:
            return False
        cup = self._scenario.cup
        p_CL = p_WL - [*self._place, cup.rim_height]
        inside = bool(is_inside(p_CL, cup))
        speed = float(np.linalg.norm(self._pusher.robot.places[1]))
        is_low = inside and possible_rise(p_CL, speed, self._scenario) < REST_RISE
        self._n_low = self._n_low + 1 if is_low else 0
        self.is_carried = self._pusher.touches_cup or (self.is_carried and is_low)
        self.is_at_rest = self._n_low > 1
        lies = height_above_support(p_WL, self._place, cup) < LYING_HEIGHT * self._scenario.ball.radius
        return (self.is_at_rest and self.is_carried) or (lies and not inside)
