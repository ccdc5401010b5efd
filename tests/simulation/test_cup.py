"""The cup as a solid: its shape, what a ball does in it, on its rim and on the floor, and how a contact bounces."""

import numpy as np
import pytest
from pydrake.geometry import Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import SpatialInertia
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import DiagramBuilder

from wam_cast.robot.plant import (
    IMPACT_SPEED,
    N_CUP_WALLS,
    STICTION_SPEED,
    add_cup,
    contact_material,
    hunt_crossley_dissipation,
)
from wam_cast.scenario import Ball, Cup, Simulation

G = 9.81
BALL = Ball()
SIMULATION = Simulation()


class FreeBall:
    """A cup below the world's origin, the floor, and a ball on no string, under the integrator of the casts' contact."""

    def __init__(self, cup=None, accuracy=SIMULATION.contact_accuracy):
        self.cup = cup or Cup()
        builder = DiagramBuilder()
        self.plant, self.scene_graph = AddMultibodyPlant(MultibodyPlantConfig(time_step=0.0), builder)
        inertia = SpatialInertia.SolidSphereWithMass(BALL.mass, BALL.radius)
        self.ball = self.plant.AddRigidBody("ball", self.plant.AddModelInstance("ball"), inertia)
        material = contact_material(self.cup)
        self.plant.RegisterCollisionGeometry(self.ball, RigidTransform(), Sphere(BALL.radius), "ball", material)
        add_cup(self.plant, self.cup)
        self.plant.Finalize()
        self.plant.set_stiction_tolerance(STICTION_SPEED)
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.accuracy = accuracy

    def throw(self, p_WL, v_WL=(0, 0, 0), duration=1.0, period=0.002):
        """Return the ball's positions and velocities, each (n, 3), a sample a period."""
        context = self.simulator.get_mutable_context()
        self.diagram.SetDefaultContext(context)
        context.SetTime(0.0)
        plant_context = self.plant.GetMyContextFromRoot(context)
        self.plant.SetFreeBodyPose(plant_context, self.ball, RigidTransform(np.array(p_WL, float)))
        v = np.zeros(6)
        v[3:] = v_WL
        self.plant.SetVelocities(plant_context, v)
        ResetIntegratorFromFlags(self.simulator, "runge_kutta3", SIMULATION.max_step)
        self.simulator.get_mutable_integrator().set_target_accuracy(self.accuracy)
        self.simulator.Initialize()
        positions, velocities = [], []
        for k in range(round(duration / period) + 1):
            if k > 0:  # Drake 1.51 refuses an advance of no duration
                self.simulator.AdvanceTo(k * period)
            positions.append(self.ball.EvalPoseInWorld(plant_context).translation())
            velocities.append(self.ball.EvalSpatialVelocityInWorld(plant_context).translational())
        return np.array(positions), np.array(velocities)


@pytest.fixture(scope="module")
def world():
    return FreeBall()


def distance_to_cup(world, points):
    """Return the signed distance of world points (n, 3) to the nearest solid of cup and floor."""
    context = world.diagram.CreateDefaultContext()
    # Out of the way, so that the ball itself is not what is nearest.
    plant_context = world.plant.GetMyMutableContextFromRoot(context)
    world.plant.SetFreeBodyPose(plant_context, world.ball, RigidTransform([50.0, 0, 50]))
    query = world.scene_graph.get_query_output_port().Eval(world.scene_graph.GetMyContextFromRoot(context))
    return np.array([min(found.distance for found in query.ComputeSignedDistanceToPoint(np.array(p))) for p in points])


# ---------------------------------------------------------------- shape


def test_wall_touches_the_inner_radius_and_nowhere_comes_closer(world):
    angles = np.linspace(0, 2 * np.pi, 161)
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    for height in (0.06, 0.10):
        axis = np.array([0, 0, height])
        inside = distance_to_cup(world, 0.0299 * ring + axis)
        assert inside.min() == pytest.approx(1e-4, abs=1e-9)
        # Between the boxes' middles a polygon's corner stands back, by r (1 / cos(pi / 16) - 1) = 0.6 mm.
        assert inside.max() < 1e-4 + 0.030 * (1 / np.cos(np.pi / 16) - 1)
        within = distance_to_cup(world, 0.0325 * ring + axis)
        assert np.all(within < 0), "the wall has gaps"
        outside = distance_to_cup(world, 0.0365 * ring + axis)
        assert np.all(outside > 0)


def test_cup_is_hollow_open_and_has_a_bottom(world):
    heights = np.array([0.005, 0.007, 0.02, 0.05, 0.11, 0.13, 0.2])
    distances = distance_to_cup(world, [[0, 0, z] for z in heights])
    assert distances[0] < 0
    # From the axis the bottom or the wall is nearest; above the rim, its edge.
    expected = np.minimum(heights[1:5] - 0.006, 0.030)
    np.testing.assert_allclose(distances[1:5], expected, atol=1e-6)
    np.testing.assert_allclose(distances[5:], np.hypot(0.030, heights[5:] - 0.12), atol=1e-4)


def test_rim_is_at_its_height(world):
    for height, expected in ((0.1195, -1), (0.1205, 1)):
        assert np.sign(distance_to_cup(world, [[0.0322, 0, height]])[0]) == expected


def test_floor_is_at_height_zero(world):
    np.testing.assert_allclose(distance_to_cup(world, [[0.5, 0.4, 0.01], [-1, 2, 0.3]]), [0.01, 0.3], atol=1e-9)


# ---------------------------------------------------------------- a ball in it


@pytest.mark.parametrize("offset", [[0.0, 0.0], [0.006, 0.003], [-0.009, 0.0]], ids=str)
def test_dropped_ball_rests_on_the_bottom(world, offset):
    positions, velocities = world.throw([*offset, 0.25], duration=1.0)
    sunk = BALL.mass * G / Cup().stiffness
    assert positions[-1, 2] == pytest.approx(0.006 + 0.020 - sunk, abs=2e-6)
    assert np.hypot(*positions[-1, :2]) <= 0.010 + 7e-4
    assert np.linalg.norm(velocities[-1]) < 0.02
    assert positions[:, 2].min() > 0.006 + 0.020 - 2e-3


def test_ball_dropped_on_the_rim_bounces_off_to_its_side(world):
    for middle, goes_in in ((0.036, False), (0.027, True)):
        positions, _ = world.throw([middle, 0.0, 0.25], duration=1.0)
        assert bool(np.hypot(*positions[-1, :2]) < 0.030) is goes_in
        assert positions[-1, 2] < 0.12


@pytest.mark.parametrize("restitution", [0.25, 0.6])
@pytest.mark.parametrize("speed", [3.0, 6.0])
def test_fast_ball_does_not_fall_through_the_bottom(restitution, speed):
    fast = FreeBall(Cup(restitution=restitution))
    positions, _ = fast.throw([0.002, 0.001, 0.20], [0, 0, -speed], duration=0.3)
    # It sinks in by v sqrt(m / k) at most, and its centre stays above the bottom.
    assert positions[:, 2].min() > 0.006 + 0.020 - 1.3 * speed * np.sqrt(BALL.mass / Cup().stiffness)
    assert np.hypot(positions[:, 0], positions[:, 1]).max() < 0.012


@pytest.mark.parametrize("angle", [0.0, np.pi / N_CUP_WALLS])
@pytest.mark.parametrize("from_inside", [True, False])
def test_fast_ball_does_not_pass_through_the_wall(world, angle, from_inside):
    # Onto a box's middle and onto the joint between two of them.
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    start = outward * (0.0 if from_inside else 0.10) + [0, 0, 0.06]
    positions, _ = world.throw(start, outward * (6.0 if from_inside else -6.0), duration=0.05)
    radial = positions @ outward
    if from_inside:
        assert radial.max() < 0.010 + 6.0 * np.sqrt(BALL.mass / Cup().stiffness)
    else:
        assert radial.min() > 0.0345 + 0.020 - 6.0 * np.sqrt(BALL.mass / Cup().stiffness)


def test_ball_on_the_floor_stays_on_the_floor(world):
    positions, velocities = world.throw([0.3, 0.2, 0.1], [0.2, 0, 0], duration=1.0)
    sunk = BALL.mass * G / Cup().stiffness
    assert positions[-1, 2] == pytest.approx(0.020 - sunk, abs=2e-6)
    assert abs(velocities[-1, 2]) < 1e-3
    assert positions[-1, 1] == pytest.approx(0.2, abs=1e-3)


@pytest.mark.parametrize(("x", "goes_in"), [(0.0, True), (0.054, False), (0.08, False)])
def test_finer_integration_gives_the_same_verdict(world, x, goes_in):
    # To the axis, onto the outer side of the rim, beside the cup; at a slant of some 27 degrees.
    finer = FreeBall(accuracy=1e-3)
    start, velocity = (
        np.array([x, 0, 0.12]) - 0.08 * np.array([1.2, 0, -2.1]) + [0, 0, G * 0.08**2 / 2],
        [1.2, 0, -2.1],
    )
    for cup in (world, finer):
        end = cup.throw(start, velocity, duration=0.6)[0][-1]
        assert bool(np.hypot(end[0], end[1]) < 0.030) is goes_in


# ---------------------------------------------------------------- restitution


def rebound(cup, speed, accuracy=SIMULATION.contact_accuracy):
    """Return the share of its speed that a ball keeps which falls on the floor and touches it at `speed`."""
    lead = 0.01
    start = [0.4, 0, BALL.radius + speed * lead - G * lead**2 / 2]
    positions, velocities = FreeBall(cup, accuracy).throw(
        start, [0, 0, -speed + G * lead], duration=lead + 0.012, period=1e-4
    )
    apart = (positions[:, 2] > BALL.radius) & (velocities[:, 2] > 0)
    return velocities[apart, 2][0] / speed


def hunt_crossley(dissipation, speed, gravity=0.0):
    """Return the restitution of the law f = k x (1 + d x'), integrated by itself: m x'' = m g - f, from touch to separation."""
    x, v, h = 0.0, speed, 1e-6
    k, m = Cup().stiffness, BALL.mass
    while x >= 0:
        x_mid, v_mid = x + h / 2 * v, v + h / 2 * (gravity - k / m * max(x, 0) * max(1 + dissipation * v, 0))
        x, v = x + h * v_mid, v + h * (gravity - k / m * max(x_mid, 0) * max(1 + dissipation * v_mid, 0))
    return -v / speed


@pytest.mark.parametrize("wanted", [0.1, 0.25, 0.6, 0.95])
def test_dissipation_gives_the_restitution_that_it_was_asked_for(wanted):
    assert hunt_crossley(hunt_crossley_dissipation(wanted), IMPACT_SPEED) == pytest.approx(wanted, abs=1e-3)


@pytest.mark.parametrize("restitution", [0.25, 0.6])
@pytest.mark.parametrize("speed", [0.5, 2.0, 3.0])
def test_impact_keeps_the_speed_that_hunt_and_crossleys_law_leaves(restitution, speed):
    expected = hunt_crossley(hunt_crossley_dissipation(restitution), speed, G)
    cup = Cup(restitution=restitution)
    assert rebound(cup, speed, accuracy=1e-4) == pytest.approx(expected, abs=0.01)
    # The casts' own accuracy, which buys its speed with a few percent.
    assert rebound(cup, speed) == pytest.approx(expected, abs=0.05)


def test_lively_cup_rebounds_higher_than_an_inelastic_one():
    heights = {}
    for restitution in (0.6, 0.25):
        positions, _ = FreeBall(Cup(restitution=restitution)).throw([0, 0, 0.306], duration=0.6)
        k = int(np.argmin(positions[:, 2]))
        heights[restitution] = positions[k:, 2].max() - 0.026
    assert heights[0.6] > 0.08
    assert heights[0.25] < 0.03
