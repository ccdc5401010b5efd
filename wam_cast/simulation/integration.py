"""How a cast is integrated: by which method, in which steps, and at what cost."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator

from wam_cast.arm.arm_chain import FRICTION_SPEED, arm_chain
from wam_cast.errors import InputError
from wam_cast.robot.forces import bending_gain
from wam_cast.robot.plant import N_ARM, joint_damping
from wam_cast.robot.station import CastStation

EXPLICIT, IMPLICIT = "runge_kutta3", "radau3"

ACCURACY = 0.01
"""Relative error that the integrator allows itself in a step without contact: it keeps every step stable, and the landing to
micrometres."""

MIN_STEP = 1e-8
"""A simulation that needs shorter steps [s] diverges: an arm out of control makes its string flail ever faster."""

ROUNDING = 1 + 1e-9
"""By how much a step may be longer than the longest: two samples may be farther apart by rounding, and a second step for that would
cost as much as the first."""

STIFFNESS, CONTACT_STIFFNESS = 8.0, 40.0
"""Products of fastest rate and longest step from which on the implicit method is the faster one, and so where impacts hinder it."""

STABLE_STEP = 2.5
"""Product of fastest rate and step up to which the explicit method is stable."""

EXPLICIT_EVALUATIONS, IMPLICIT_EVALUATIONS = 3, 15
"""Evaluations of the plant's accelerations in a step; of the implicit method about, with those for its Jacobian."""

EVALUATION_SECONDS = 2.5e-6
"""Processor time of an evaluation, about, for each velocity of the plant [s]."""

SAMPLE_SECONDS = 1e-4
"""The same of a control period, about: the controller's [s]."""

MAX_CAST_SECONDS = 30.0
"""Casts that take more processor time [s] are refused."""


@dataclass(frozen=True)
class Integration:
    """How the casts of a scenario are integrated.

    Attributes
    ----------
    method, contact_method
        `runge_kutta3`, explicit, or `radau3`, implicit, where damping is so stiff that an explicit method's steps would be short:
        in the contact-free phase, and in the contact phase.
    max_step
        Longest step [s].
    expected_step
        Mean step that is to be expected [s], good to a factor of two: the integrator chooses each by the error that it estimates.
    expected_seconds
        Processor time of an ordinary cast without a cup that is to be expected [s]; good to a factor of three.
    """

    method: str
    contact_method: str
    max_step: float
    expected_step: float
    expected_seconds: float


def begin_integration(simulator: Simulator, method: str, max_step: float, accuracy: float) -> None:
    """Give `simulator` a new integrator: it keeps the length of its last step, and outcomes must not depend on it."""
    ResetIntegratorFromFlags(simulator, method, ROUNDING * max_step)
    integrator = simulator.get_mutable_integrator()
    integrator.set_target_accuracy(accuracy)
    integrator.set_requested_minimum_step_size(MIN_STEP)


def choose_integration(station: CastStation) -> Integration:
    """Return how to integrate `station`; raises `.InputError` if a cast would take minutes."""
    scenario, rate = station.scenario, fastest_rate(station)
    max_step = min(scenario.simulation.max_step, scenario.controller.period)
    method, contact_method = (
        IMPLICIT if rate * max_step > limit else EXPLICIT for limit in (STIFFNESS, CONTACT_STIFFNESS)
    )
    step, n_evaluations = max_step, IMPLICIT_EVALUATIONS
    if method == EXPLICIT:
        step, n_evaluations = min(max_step, STABLE_STEP / rate), EXPLICIT_EVALUATIONS
    distance, speed, wait = (sum(bounds) / 2 for _, bounds in scenario.bounds)
    duration = distance / speed + wait + scenario.motion.drop_duration
    step_seconds = n_evaluations * EVALUATION_SECONDS * station.plant.num_velocities()
    if method == IMPLICIT and (scenario.noise.torque > 0 or scenario.noise.encoder_counts > 0):
        # About: each jolt of the torque asks for several steps, as short as they may be, and new Jacobians.
        step_seconds *= max(1.0, scenario.string.n_links * max_step / scenario.controller.period)
    seconds = duration * (step_seconds / step + SAMPLE_SECONDS / scenario.controller.period)
    if seconds > MAX_CAST_SECONDS:
        raise InputError(
            f"simulation.max_step = {scenario.simulation.max_step:g} s, controller.period = {scenario.controller.period:g} s, "
            f"string.n_links = {scenario.string.n_links}: a cast would take about {seconds:.0f} s of processor time; "
            "choose longer steps and periods, fewer links, or no noise.torque and noise.encoder_counts"
        )
    return Integration(method, contact_method, max_step, step, seconds)


def fastest_rate(station: CastStation) -> float:
    """Return the largest absolute eigenvalue [1/s] of small motions about the hanging string, the arm free of its controller."""
    plant, n = station.plant, station.plant.num_velocities()
    context = plant.CreateDefaultContext()  # the string hangs
    q, mass = plant.GetPositions(context), plant.CalcMassMatrix(context)
    damping = joint_damping(plant)
    damping[:N_ARM] += arm_chain(station.scenario.arm).coulomb_friction / FRICTION_SPEED  # where it is steepest
    stiffness = -bending_gain(plant, station.scenario)[:, :n]
    # Gravity's, on the string; that on the arm is the controller's to carry.
    for i in range(N_ARM, n):
        plant.SetPositions(context, q + 1e-6 * np.eye(n)[i])
        stiffness[N_ARM:, i] -= 1e6 * plant.CalcGravityGeneralizedForces(context)[N_ARM:]
    lower = [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, np.diag(damping))]
    modes = np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], lower]))
    return float(np.abs(modes).max())
