"""The station as any Drake diagram: run by one's own simulator, in one's own diagram, logged, pushed, filmed and linearized."""

import math
import time

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, OutputPortSelection
from pydrake.systems.primitives import ConstantValueSource, Linearize, VectorLogSink

from wam_cast.cast import Cast, default_cast, default_cup
from wam_cast.motion.pendulum import swing_frequency
from wam_cast.robot.plant import FLOOR_COLOR
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario
from wam_cast.simulation.ball_and_cup import is_inside
from wam_cast.visualization.camera import RENDERER, Camera, make_renderer, view_rotation

DELAYED = {"controller": {"delay": 2, "kp": 2000.0, "kd": 100.0}}
SHORTER = {"bounds": {"distance": [0.05, 0.2]}, "motion": {"start_radius": 0.25}}
FLOOR_MOUNTED = {
    "arm": {"mount": "floor", "mount_height": 0.0},
    "motion": {"start_radius": 0.40, "start_height": 0.85},
    "bounds": {"distance": [0.05, 0.33]},
}


@pytest.fixture(scope="module")
def station():
    return CastStation(Scenario())


@pytest.fixture(scope="module")
def contact_free():
    return CastStation(Scenario(), has_scene=False)


def values_of(context):
    """Return the whole state of a context and its numeric parameters."""
    discrete, n_parameters = context.get_discrete_state(), context.num_numeric_parameter_groups()
    return [
        context.get_continuous_state_vector().CopyToVector(),
        *(discrete.get_vector(i).value().copy() for i in range(discrete.num_groups())),
        *(context.get_numeric_parameter(i).value().copy() for i in range(n_parameters)),
    ]


def ball_of(station, context):
    """Return p_WL, from the diagram's root context."""
    own = station.diagram.GetMyContextFromRoot(context)
    return station.diagram.GetOutputPort("ball_position").Eval(own).copy()


# ---------------------------------------------------------------- the default context


@pytest.mark.parametrize(
    "changes", [{}, DELAYED, SHORTER, FLOOR_MOUNTED], ids=["reference", "delay", "bounds", "floor"]
)
@pytest.mark.parametrize("has_scene", [True, False])
def test_default_context_is_a_cast_at_its_start(changes, has_scene):
    scenario = Scenario.from_dict(changes)
    one = CastStation(scenario, has_scene=has_scene)
    by_default, started = one.diagram.CreateDefaultContext(), one.diagram.CreateDefaultContext()
    one.set_start(started, Cast(0.1, 0.4, 0.3, bearing=0.02), cup=(0.5, 0.01))
    one.set_start(started, default_cast(scenario))
    for found, expected in zip(values_of(by_default), values_of(started), strict=True):
        np.testing.assert_array_equal(found, expected)
    assert one.controller.get_cast(one.controller.GetMyContextFromRoot(by_default)) == default_cast(scenario)
    p_WL = [scenario.motion.start_radius, 0, scenario.motion.start_height - scenario.string.length]
    np.testing.assert_allclose(ball_of(one, by_default), p_WL, atol=1e-12)


def test_default_context_holds_what_the_first_sample_is():
    one = CastStation(Scenario.from_dict(DELAYED), has_scene=False)
    context = one.diagram.CreateDefaultContext()
    held = one.diagram.GetOutputPort("torque").Eval(context).copy()
    own_weight = -one.controller.plant.CalcGravityGeneralizedForces(_arm_context(one, context))
    np.testing.assert_allclose(held, own_weight, atol=1e-9)
    simulator = Simulator(one.diagram, context)
    simulator.AdvanceTo(0.0015)
    np.testing.assert_array_equal(one.diagram.GetOutputPort("torque").Eval(simulator.get_context()), held)


def _arm_context(one, context):
    plant = one.controller.plant
    arm_context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(arm_context, one.diagram.GetOutputPort("arm_state").Eval(context))
    return arm_context


@pytest.mark.slow
def test_simulator_of_the_diagram_runs_a_cast_into_the_cup(station):
    simulator = Simulator(station.diagram)
    began = time.perf_counter()
    simulator.AdvanceTo(2.0)
    assert time.perf_counter() - began < 60  # from a posture of zero angles it took minutes
    p_CL = ball_of(station, simulator.get_context()) - [*default_cup(station.scenario), station.scenario.cup.rim_height]
    assert is_inside(p_CL, station.scenario.cup)
    assert len(station.logged(simulator.get_context()).times) == 1001


def test_cast_lands_as_the_package_simulates_it(contact_free, simulator):
    own = Simulator(contact_free.diagram)
    own.get_mutable_integrator().set_target_accuracy(1e-6)
    expected = simulator.simulate(default_cast(Scenario()))
    own.AdvanceTo(expected.crossing_time)
    p_WL = ball_of(contact_free, own.get_context())
    np.testing.assert_allclose(p_WL, [*expected.landing, Scenario().cup.rim_height], atol=2e-4)


def test_cast_alone_is_set_in_a_default_context(contact_free):
    cast = Cast(0.25, 0.4, 0.3, bearing=-0.2)
    one, other = (contact_free.diagram.CreateDefaultContext() for _ in range(2))
    contact_free.set_cast(one, cast)
    contact_free.set_start(other, cast)
    paths = []
    for context in (one, other):
        Simulator(contact_free.diagram, context).AdvanceTo(0.5)
        paths.append(contact_free.logged(context))
    for found, expected in zip(*paths, strict=True):
        np.testing.assert_array_equal(found, expected)


# ---------------------------------------------------------------- in a larger diagram


def test_station_in_a_larger_diagram_is_started_and_logged():
    alone, inside = (CastStation(Scenario(), has_scene=False) for _ in range(2))
    builder = DiagramBuilder()
    builder.AddSystem(inside.diagram)
    log = builder.AddSystem(VectorLogSink(3, 0.01))
    builder.Connect(inside.diagram.GetOutputPort("ball_position"), log.get_input_port())
    outer = builder.Build()
    cast = Cast(0.2, 0.5, 0.1, bearing=0.1)
    ends = []
    for diagram, one in ((alone.diagram, alone), (outer, inside)):
        simulator = Simulator(diagram)
        simulator.AdvanceTo(0.05)  # of another cast
        context = simulator.get_mutable_context()
        one.set_start(context, cast)
        log_of = None if diagram is alone.diagram else log.FindMutableLog(context)
        if log_of is not None:
            log_of.Clear()
        assert context.get_time() == 0
        simulator.Initialize()
        simulator.AdvanceTo(0.8)
        ends.append(one.logged(simulator.get_context()))
    for found, expected in zip(*ends, strict=True):
        np.testing.assert_array_equal(found, expected)
    assert log_of.num_samples() == 81
    np.testing.assert_array_equal(log_of.data()[:, -1], ball_of(inside, simulator.get_context()))


# ---------------------------------------------------------------- a disturbance, a camera


OVERDAMPED = {"string": {"n_links": 1, "mass": 1e-4, "hook_damping": 0.08, "knot_damping": 5e-4}}
"""A string of next to no mass, whose ball comes to rest soon."""


@pytest.mark.parametrize(("force", "axis"), [(0.10, 0), (-0.05, 1)])
def test_force_on_the_ball_slants_the_string(force, axis):
    one = CastStation(Scenario.from_dict(OVERDAMPED), has_scene=False)
    push = ExternallyAppliedSpatialForce()
    push.body_index = one.plant.GetBodyByName("ball").index()
    push.F_Bq_W = SpatialForce(np.zeros(3), force * np.eye(3)[axis])
    builder = DiagramBuilder()
    builder.AddSystem(one.diagram)
    source = builder.AddSystem(ConstantValueSource(Value([push])))
    builder.Connect(source.get_output_port(), one.diagram.GetInputPort("applied_spatial_force"))
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    one.set_start(context, Cast(1e-4, 1e-5, 0.0))  # the hand rests
    simulator.AdvanceTo(2.5)
    hook = one.plant.GetFrameByName("hook").CalcPoseInWorld(one.plant.GetMyContextFromRoot(context)).translation()
    across, along = np.delete([0, 1], axis), axis
    p_EL_W = ball_of(one, context) - hook
    slant = math.atan2(p_EL_W[along], -p_EL_W[2])
    assert slant == pytest.approx(math.atan(force / (one.scenario.ball.mass * one.scenario.gravity)), rel=5e-3)
    assert abs(p_EL_W[across[0]]) < 1e-4


def test_camera_sees_a_floor_that_is_lit():
    one = CastStation(Scenario())
    one.scene_graph.AddRenderer(RENDERER, make_renderer())
    corners = np.array([(x, y, z) for x in (0.0, 0.8) for y in (-0.2, 0.2) for z in (0.0, 1.0)])
    camera = Camera.framing(corners, view_rotation(0.0, 0.3, 0.2), (160, 160))
    builder = DiagramBuilder()
    builder.AddSystem(one.diagram)
    sensor = builder.AddSystem(camera.to_sensor(one.scene_graph.world_frame_id()))
    builder.Connect(one.diagram.GetOutputPort("query_object"), sensor.query_object_input_port())
    diagram = builder.Build()
    own = sensor.GetMyContextFromRoot(diagram.CreateDefaultContext())
    color, depth = (
        port.Eval(own).data for port in (sensor.color_image_output_port(), sensor.depth_image_32F_output_port())
    )
    p_WQ = np.array([[0.7, -0.2, 0.0]])  # on the floor, away from the cup
    column, row = np.rint(camera.project(p_WQ)[0]).astype(int)
    np.testing.assert_allclose(color[row, column, :3] / 255, FLOOR_COLOR[:3], atol=0.15)
    ahead = (p_WQ[0] - camera.p_WV) @ camera.R_WV[:, 2]
    assert depth[row, column, 0] == pytest.approx(ahead, rel=0.01)


# ---------------------------------------------------------------- linearized


def linearized(station):
    """Return A, (n_x, n_x), of the station at rest about the hanging string, the controller's law closing the loop."""
    plant, controller = station.plant, station.controller
    context = plant.CreateDefaultContext()
    motors = plant.get_actuation_input_port()
    motors.FixValue(context, -plant.CalcGravityGeneralizedForces(context)[:7])
    linear = Linearize(plant, context, motors.get_index(), OutputPortSelection.kNoOutput)
    # Python systems have no derivatives of their own.
    n_q = plant.num_positions()
    arm = np.r_[:7, n_q : n_q + 7]
    own, x = controller.CreateDefaultContext(), plant.GetPositionsAndVelocities(context)[arm]

    def torque(x):
        controller.GetInputPort("arm_state").FixValue(own, x)
        return controller.GetOutputPort("actuation").Eval(own).copy()

    gain = np.column_stack([(torque(x + d) - torque(x - d)) / 2e-6 for d in 1e-6 * np.eye(14)])
    A = linear.A().copy()
    A[:, arm] += linear.B() @ gain
    return A


@pytest.mark.parametrize(
    "changes", [{}, {"ball": {"mass": 0.045}, "string": {"length": 0.5}}], ids=["reference", "own"]
)
def test_linearized_station_swings_at_the_pendulum_s_frequency(changes):
    scenario = Scenario.from_dict(changes)
    eigenvalues = np.linalg.eigvals(linearized(CastStation(scenario, has_scene=False)))
    assert eigenvalues.real.max() < 1e-6  # it is stable
    slowest = np.sort(np.abs(eigenvalues[eigenvalues.imag > 0]))[:2]  # along the casting plane and across it
    np.testing.assert_allclose(slowest, swing_frequency(scenario), rtol=1e-4)
