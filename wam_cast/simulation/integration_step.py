"""How long the steps of the contact-free phase's integrator may be."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.robot.forces import FRICTION_SPEED, coulomb_friction
from wam_cast.robot.plant import N_ARM, hanging_positions
from wam_cast.robot.station import CastStation
from wam_cast.types import Array

MAX_GROWTH = 5.0
"""What the integrator may add to the rate of any mode [1/s]: a vibration too small to see stays so for a cast."""

SHORTEST_STEP = 1e-6
"""Shorter steps [s] would make a cast take minutes."""

MODE_MARGIN = 1.5
"""How much faster than the hanging string's modes those of a folded one were seen to decay, and of a pulled one to vibrate."""


def integration_step(station: CastStation) -> float:
    """Return the longest step [s] that divides the control period and that neither damping nor vibration make unstable.

    A step h of a method of second order multiplies a mode of eigenvalue s by 1 + s h + (s h)^2 / 2: too long a step blows
    up what is damped fast, and any step what is not damped at all.
    """
    modes = MODE_MARGIN * small_motion_modes(station)
    period = station.scenario.controller.period

    def growth(n_steps: int) -> float:
        sh = modes * period / n_steps
        return float(np.log(np.abs(1 + sh + sh**2 / 2)).max()) * n_steps / period

    n_steps = math.ceil(period / station.scenario.simulation.max_step - 1e-9)
    while growth(n_steps) > MAX_GROWTH:
        n_steps += 1
        if period / n_steps < SHORTEST_STEP:
            raise InputError(
                f"string: needs integration steps below {SHORTEST_STEP:g} s, too many to simulate; choose more string.mass, "
                "less string.bending_damping or string.hook_damping, or fewer string.n_links"
            )
    return period / n_steps


def small_motion_modes(station: CastStation) -> NDArray[np.complex128]:
    """Return the eigenvalues [1/s] of small motions about the hanging string, the arm free of its controller."""
    plant, n = station.plant, station.plant.num_velocities()
    root = station.diagram.CreateDefaultContext()
    station.set_start(root, Cast(0.3, 0.6, 0.1))
    context = plant.GetMyMutableContextFromRoot(root)
    q = hanging_positions(plant, plant.GetPositions(context)[:N_ARM])
    plant.SetPositions(context, q)
    mass = plant.CalcMassMatrix(context)
    stiffness = np.zeros((n, n))  # gravity's, on the string; that on the arm is the controller's to carry
    for i in range(N_ARM, n):
        plant.SetPositions(context, q + 1e-6 * np.eye(n)[i])
        stiffness[N_ARM:, i] = -1e6 * plant.CalcGravityGeneralizedForces(context)[N_ARM:]
    damping = np.diag(_joint_damping(station))
    lower = [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]
    return np.asarray(np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], lower])), dtype=complex)


def _joint_damping(station: CastStation) -> Array:
    """Return the damping of every velocity [N m s], Coulomb friction where it is steepest."""
    plant = station.plant
    damping = np.zeros(plant.num_velocities())
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        start = joint.velocity_start()
        damping[start : start + joint.num_velocities()] = joint.default_damping_vector()
    damping[:N_ARM] += coulomb_friction(station.scenario) / FRICTION_SPEED
    return damping
