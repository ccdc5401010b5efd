"""The string's bending stiffness against closed forms: the energy of an arc, the modes of a beam, and what keeps its energy."""

import numpy as np
import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder
from scipy.linalg import eigh
from scipy.optimize import brentq

from wam_cast.arm.posture import starting_posture
from wam_cast.robot.forces import connect_forces
from wam_cast.robot.plant import HOOK, N_ARM, fill_plant, hanging_positions
from wam_cast.scenario import Scenario

STIFFNESS = 1e-3
UNDAMPED = {"bending_damping": 0.0, "hook_damping": 0.0, "knot_damping": 0.0}


class Robot:
    """An arm without motors that holds a stiff string with a ball."""

    def __init__(self, n_links=10, bending_stiffness=STIFFNESS, **parts):
        string = UNDAMPED | {"n_links": n_links, "bending_stiffness": bending_stiffness}
        self.scenario = Scenario.from_dict({"string": string, "arm": {"viscous_friction_scale": 1e-12}} | parts)
        builder = DiagramBuilder()
        self.plant = builder.AddSystem(MultibodyPlant(0.0))
        fill_plant(self.plant, self.scenario)
        connect_forces(builder, self.plant, self.scenario)
        self.diagram = builder.Build()
        self.root = self.diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)
        self.hanging = hanging_positions(self.plant, starting_posture(self.scenario))
        self.n = self.plant.num_positions()
        self.bends = np.arange(HOOK.stop, self.n - 2)  # of the joints between links

    def bent(self, curvature, across=False):
        """Return positions of a string that hangs from the hook and is bent to an arc."""
        q = self.hanging.copy()
        q[self.bends[int(across) :: 2]] = curvature * (0.6 - self.scenario.ball.radius) / self.scenario.string.n_links
        return q

    def force(self, q):
        self.plant.SetPositions(self.context, q)
        return self.plant.get_applied_generalized_force_input_port().Eval(self.context)

    def bending_energy(self, q):
        return -self.force(q) @ q / 2

    def energy(self, context):
        q = self.plant.GetPositions(context)
        kept = self.plant.EvalPotentialEnergy(context) + self.plant.EvalKineticEnergy(context)
        return kept + self.bending_energy(q)


@pytest.mark.parametrize("across", [False, True])
@pytest.mark.parametrize("n_links", [2, 5, 10, 40])
def test_arc_holds_the_same_energy_whatever_the_number_of_links(n_links, across):
    robot, curvature = Robot(n_links), 2.0
    # E I kappa^2 / 2 along the string, of which the joints between n links stand for the share (n - 1) / n.
    expected = STIFFNESS * curvature**2 / 2 * 0.58 * (n_links - 1) / n_links
    assert robot.bending_energy(robot.bent(curvature, across)) == pytest.approx(expected, rel=1e-12)


def test_neither_arm_nor_hook_nor_knot_is_stiff():
    robot = Robot(4)
    q = np.random.default_rng(0).uniform(-1, 1, robot.n)
    force = robot.force(q)
    np.testing.assert_array_equal(np.delete(force, robot.bends), 0)
    np.testing.assert_allclose(force[robot.bends], -STIFFNESS * 4 / 0.58 * q[robot.bends], rtol=1e-14)


def test_string_without_stiffness_has_no_block_for_it():
    assert not Robot(bending_stiffness=0.0).diagram.HasSubsystemNamed("bending_stiffness")


def test_single_link_cannot_bend():
    robot = Robot(1)
    np.testing.assert_array_equal(robot.force(robot.hanging + 1), 0)


def beam_frequency(mode, length, mu, mass):
    """Return a frequency of a beam that is pinned at one end and carries a point mass at the other [rad/s].

    Of its shape sinh(b l) sin(b x) + sin(b l) sinh(b x) the moment vanishes at both ends, and the shear E I w''' = -M omega^2 w at
    the mass makes cos(b l) - sin(b l) coth(b l) = 2 (M / mu) b sin(b l).
    """

    def end_condition(bl):
        return np.cos(bl) - np.sin(bl) / np.tanh(bl) - 2 * mass / (mu * length) * bl * np.sin(bl)

    bl = brentq(end_condition, mode * np.pi + 1e-9, (mode + 0.5) * np.pi)
    return (bl / length) ** 2 * np.sqrt(STIFFNESS / mu)


@pytest.mark.parametrize(("mass", "mode"), [(0.030, 1), (0.030, 2), (1e-3, 1)])
def test_modes_of_many_links_converge_to_the_beams(mass, mode):
    # Pushed at its surface, a ball without weight turns out of the way: it has 1 / (1 + 1 / k) of its mass.
    expected = beam_frequency(mode, 0.58, 0.003 / 0.58, mass / (1 + 1 / 0.4))
    errors = []
    for n_links in (5, 10, 20):
        robot = Robot(n_links, ball={"mass": mass})
        stiffness = np.array([robot.force(robot.hanging) - robot.force(robot.hanging + e) for e in np.eye(robot.n)])
        robot.plant.SetPositions(robot.context, robot.hanging)
        mass_matrix = robot.plant.CalcMassMatrix(robot.context)
        plane = np.ix_(*2 * [np.arange(N_ARM, robot.n, 2)])  # the hand held, without gravity
        squares = eigh(stiffness[plane], mass_matrix[plane], eigvals_only=True)
        # Turning about the hook and about the knot costs nothing.
        errors.append(abs(np.sqrt(squares[1 + mode]) / expected - 1))
    assert errors[0] < 3e-3
    assert errors[0] > 10 * errors[1] > 100 * errors[2]


def test_stiff_string_keeps_its_energy_on_a_falling_arm():
    robot = Robot(5)
    simulator = Simulator(robot.diagram)
    ResetIntegratorFromFlags(simulator, "runge_kutta3", 1e-3)
    simulator.get_mutable_integrator().set_target_accuracy(1e-6)
    context = robot.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    q = robot.bent(3.0)
    robot.plant.SetPositions(context, q)
    start, bent = robot.energy(context), robot.bending_energy(q)
    simulator.AdvanceTo(0.1)
    assert robot.bending_energy(robot.plant.GetPositions(context)) < 0.8 * bent
    assert robot.energy(context) == pytest.approx(start, abs=1e-3 * bent)
