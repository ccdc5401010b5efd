"""The station: its ports and parts, the sampling, its start, and the friction of the joints."""

import csv

import numpy as np
import pytest
from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator
from pydrake.systems.framework import LeafSystem

from wam_cast.arm.arm_chain import FRICTION_SPEED
from wam_cast.arm.arm_model import arm_model, models_directory
from wam_cast.cast import Cast, default_cup
from wam_cast.errors import InputError
from wam_cast.motion.stages import CastMotion
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario
from wam_cast.visualization.viewer import open_meshcat

CAST = Cast(0.3, 0.6, 0.1, bearing=0.4)
PORTS = {
    "state": 2 * (7 + 2 * 10 + 2),
    "arm_state": 14,
    "ball_position": 3,
    "ball_velocity": 3,
    "hand": 6,
    "hand_desired": 6,
    "stage": 1,
    "torque": 7,
}


class Stub(LeafSystem):
    """A controller in place of the package's: a constant torque, and the casts that it was told."""

    def __init__(self, torque):
        super().__init__()
        self.torque = np.array(torque)
        self.casts = []
        self.DeclareVectorInputPort("arm_state", 14)
        self.DeclareVectorOutputPort("actuation", 7, lambda context, output: output.SetFromVector(self.torque))

    def set_cast(self, context, cast):
        self.casts.append(cast)


def started(station, cast=CAST, cup=None, step=0.002):
    """Return a simulator of `station` at the start of `cast`, under the integrator of the contact-free phase."""
    simulator = Simulator(station.diagram)
    ResetIntegratorFromFlags(simulator, "runge_kutta2", step)
    station.set_start(simulator.get_mutable_context(), cast, cup)
    simulator.Initialize()
    return simulator


def read(station, simulator, name):
    return station.diagram.GetOutputPort(name).Eval(simulator.get_context()).copy()


@pytest.fixture(scope="module")
def contact_free():
    return CastStation(Scenario(), has_scene=False)


@pytest.fixture(scope="module")
def with_contact():
    return CastStation(Scenario())


# ---------------------------------------------------------------- ports and parts


@pytest.mark.parametrize("has_scene", [True, False])
def test_ports_are_exported_by_name(contact_free, with_contact, has_scene):
    diagram = (with_contact if has_scene else contact_free).diagram
    ports = [diagram.get_output_port(i) for i in range(diagram.num_output_ports())]
    vectors = {port.get_name(): port.size() for port in ports if port.get_name() != "query_object"}
    assert vectors == PORTS
    assert diagram.HasOutputPort("query_object") is has_scene
    assert [diagram.get_input_port(i).get_name() for i in range(diagram.num_input_ports())] == ["applied_spatial_force"]


def test_ports_mean_what_they_say(contact_free):
    simulator = started(contact_free)
    simulator.AdvanceTo(0.31)
    plant_context = contact_free.plant.GetMyContextFromRoot(simulator.get_context())
    state = contact_free.plant.GetPositionsAndVelocities(plant_context)
    ball, hand = (contact_free.plant.GetBodyByName(name) for name in ("ball", "tool_plate"))
    expected = {
        "state": state,
        "arm_state": np.r_[state[:7], state[29:36]],
        "ball_position": ball.EvalPoseInWorld(plant_context).translation(),
        "ball_velocity": ball.EvalSpatialVelocityInWorld(plant_context).translational(),
        "hand": np.r_[
            hand.EvalPoseInWorld(plant_context).translation(),
            hand.EvalSpatialVelocityInWorld(plant_context).translational(),
        ],
        "hand_desired": np.concatenate(CastMotion(Scenario(), CAST).evaluate(0.31)),
        "stage": [0],
    }
    for name, value in expected.items():
        np.testing.assert_allclose(read(contact_free, simulator, name), value, atol=1e-12, err_msg=name)


def test_torque_port_is_what_moves_the_arm(contact_free):
    simulator = started(contact_free)
    simulator.AdvanceTo(0.301)
    torque = read(contact_free, simulator, "torque")
    plant_context = contact_free.plant.GetMyContextFromRoot(simulator.get_context())
    actuation = contact_free.plant.get_actuation_input_port().Eval(plant_context)
    np.testing.assert_array_equal(torque, actuation)
    assert np.abs(torque).max() > 1


def test_graph_names_the_parts(with_contact):
    graph = with_contact.graph()
    for name in ("plant", "scene_graph", "controller", "hold", "ball_tracker", "state_log", "torque_log"):
        assert name in graph, name
    for name in PORTS:
        assert name in graph, name
    assert graph.startswith("digraph")


def test_contact_adds_geometry_and_nothing_else(contact_free, with_contact):
    assert contact_free.scene_graph is None
    assert with_contact.plant.num_collision_geometries() == 1 + 16 + 1 + 1  # ball, wall, bottom, floor
    assert contact_free.plant.num_positions() == with_contact.plant.num_positions() == 29
    masses = [s.plant.CalcTotalMass(s.plant.CreateDefaultContext()) for s in (contact_free, with_contact)]
    assert masses[1] - masses[0] == pytest.approx(0.1)  # the cup, which is welded to the floor


# ---------------------------------------------------------------- sampling


def test_torque_is_held_for_a_period(contact_free):
    simulator = started(contact_free)
    simulator.AdvanceTo(0.2005)
    held = read(contact_free, simulator, "torque")
    asked = contact_free.controller.GetOutputPort("actuation")

    def wanted():
        return asked.Eval(contact_free.controller.GetMyContextFromRoot(simulator.get_context())).copy()

    for t in (0.2010, 0.2015, 0.2019):
        simulator.AdvanceTo(t)
        np.testing.assert_array_equal(read(contact_free, simulator, "torque"), held)
        assert not np.array_equal(wanted(), held)
    simulator.AdvanceTo(0.202)  # events at the end of an advance wait for the next one
    sampled = wanted()
    simulator.AdvanceTo(0.2025)
    np.testing.assert_array_equal(read(contact_free, simulator, "torque"), sampled)


def test_logs_have_a_sample_a_period(contact_free):
    simulator = started(contact_free)
    simulator.AdvanceTo(0.1)
    times, states, torques = contact_free.logged(simulator.get_context())
    np.testing.assert_allclose(times, 0.002 * np.arange(51), atol=1e-12)
    assert states.shape == (51, 58)
    assert torques.shape == (51, 7)
    np.testing.assert_array_equal(states[-1], read(contact_free, simulator, "state"))
    # Each sample of the torque is the one that was held up to its time.
    np.testing.assert_array_equal(torques[-1], read(contact_free, simulator, "torque"))
    asked = contact_free.controller.GetOutputPort("actuation")
    first = started(contact_free)
    wanted = asked.Eval(contact_free.controller.GetMyContextFromRoot(first.get_context()))
    np.testing.assert_array_equal(torques[0], wanted)
    motion = CastMotion(Scenario(), CAST)
    wanted = contact_free.desired_path(motion, times)
    np.testing.assert_array_equal(wanted, [motion.evaluate(t)[0] for t in times])


# ---------------------------------------------------------------- the start


@pytest.mark.parametrize("bearing", [0.0, 0.4, -1.3])
def test_start_puts_the_hand_and_the_ball_where_the_scenario_says(contact_free, bearing):
    simulator = Simulator(contact_free.diagram)
    contact_free.set_start(simulator.get_mutable_context(), CAST, start_bearing=bearing)
    p_WE = np.array([0.20 * np.cos(bearing), 0.20 * np.sin(bearing), 0.80])
    np.testing.assert_allclose(read(contact_free, simulator, "hand"), [*p_WE, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(read(contact_free, simulator, "ball_position"), p_WE - [0, 0, 0.6], atol=1e-12)
    np.testing.assert_array_equal(read(contact_free, simulator, "ball_velocity"), 0)


def test_start_forgets_all_that_came_before(with_contact):
    used = started(with_contact, Cast(0.1, 0.3, 0.0, -0.5), cup=(0.5, 0.2))
    used.AdvanceTo(0.15)
    context = used.get_mutable_context()
    with_contact.set_start(context, CAST, (0.6, 0.1))
    fresh = with_contact.diagram.CreateDefaultContext()
    with_contact.set_start(fresh, CAST, (0.6, 0.1))
    assert context.get_time() == 0
    np.testing.assert_array_equal(
        context.get_continuous_state_vector().CopyToVector(), fresh.get_continuous_state_vector().CopyToVector()
    )
    groups = [c.get_discrete_state() for c in (context, fresh)]
    for i in range(groups[0].num_groups()):
        np.testing.assert_array_equal(*(group.get_vector(i).value() for group in groups))
    assert len(with_contact.logged(context)[0]) == 0
    assert with_contact.controller.get_cast(with_contact.controller.GetMyContextFromRoot(context)) == CAST
    with_contact.set_start(context, CAST)  # the cup of the last cast does not stay either
    np.testing.assert_allclose(cup_position(with_contact, context), [*default_cup(Scenario()), 0.12], atol=1e-15)


def cup_position(station, context):
    body = station.plant.GetBodyByName("cup")
    return body.EvalPoseInWorld(station.plant.GetMyContextFromRoot(context)).translation()


def test_cup_stands_where_it_is_put_in_its_own_context_only(with_contact):
    one, other = with_contact.diagram.CreateDefaultContext(), with_contact.diagram.CreateDefaultContext()
    with_contact.set_cup(one, (0.7, -0.2))
    np.testing.assert_allclose(cup_position(with_contact, one), [0.7, -0.2, 0.12], atol=1e-15)
    np.testing.assert_allclose(cup_position(with_contact, other), [*default_cup(Scenario()), 0.12], atol=1e-15)


@pytest.mark.parametrize("bearing", [0.0, 0.3, -2.0])
def test_cup_is_turned_to_face_the_base_axis(with_contact, bearing):
    # Then the flat boxes of its wall meet a ball alike at any bearing.
    context = with_contact.diagram.CreateDefaultContext()
    outward = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    with_contact.set_cup(context, (0.7 * outward[0], 0.7 * outward[1]))
    body = with_contact.plant.GetBodyByName("cup")
    R_WC = body.EvalPoseInWorld(with_contact.plant.GetMyContextFromRoot(context)).rotation().matrix()
    np.testing.assert_allclose(R_WC[:, 0], outward, atol=1e-15)
    np.testing.assert_allclose(R_WC[:, 2], [0, 0, 1], atol=1e-15)


def test_arm_at_rest_holds_still():
    # A move so slow that it has hardly begun: the spline is 10 u^3 of 0.1 mm.
    station = CastStation(Scenario(), has_scene=False)
    simulator = started(station, Cast(1e-4, 1e-5, 0.0))
    start = read(station, simulator, "hand")[:3]
    simulator.AdvanceTo(0.5)
    hand = read(station, simulator, "hand")
    # The controller knows nothing of string and ball: 0.32 N on 6000 N/m.
    assert np.linalg.norm(hand[:3] - start) < 1e-4
    assert hand[2] - start[2] == pytest.approx(-0.033 * 9.81 / 6000, rel=0.1)
    assert np.linalg.norm(hand[3:]) < 1e-4


# ---------------------------------------------------------------- other controllers


def test_controller_can_be_replaced():
    stub = Stub([1.0, -2.0, 0.3, 0.4, 0.05, -0.06, 0.01])
    station = CastStation(Scenario(), has_scene=False, controller=stub)
    assert station.controller is stub
    simulator = started(station)
    simulator.AdvanceTo(0.1)
    assert stub.casts == [CAST]
    np.testing.assert_array_equal(read(station, simulator, "torque"), stub.torque)
    for name in ("hand", "hand_desired", "stage"):  # which it has not
        assert not station.diagram.HasOutputPort(name)
    assert np.isnan(station.desired_path(CastMotion(Scenario(), CAST), np.array([0.0, 0.1]))).all()
    # With nothing that holds it, the arm falls.
    state = read(station, simulator, "arm_state")
    assert np.linalg.norm(state[7:]) > 0.1


# ---------------------------------------------------------------- friction


def joint_acceleration(share, v_arm):
    """Return the arm's accelerations (7,) and the mass matrix's arm rows without torque, at speeds `v_arm`."""
    scenario = Scenario.from_dict({"arm": {"coulomb_friction": share}})
    station = CastStation(scenario, has_scene=False, controller=Stub(np.zeros(7)))
    simulator = started(station)
    plant_context = station.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    v = np.zeros(29)
    v[:7] = v_arm
    station.plant.SetVelocities(plant_context, v)
    derivatives = station.diagram.EvalTimeDerivatives(simulator.get_context()).CopyToVector()
    return derivatives[29:], station.plant.CalcMassMatrix(plant_context)


@pytest.mark.parametrize("share", [1.0, 0.5])
@pytest.mark.parametrize("relative_speed", [3.0, -3.0, 0.4, 0.0])
def test_friction_opposes_each_joint_with_its_own_torque(share, relative_speed):
    v_arm = relative_speed * FRICTION_SPEED * np.array([1, -1, 1, 1, -1, 1, -1])
    with_friction, M = joint_acceleration(share, v_arm)
    without, _ = joint_acceleration(0.0, v_arm)
    torque = M @ (with_friction - without)
    with (models_directory() / "wam7_parameters.csv").open(encoding="utf-8", newline="") as file:
        sheet = np.array([float(row["coulomb"]) for row in csv.DictReader(file) if row["joint_type"] == "revolute"])
    np.testing.assert_array_equal(arm_model(Scenario().arm).coulomb_friction, sheet)
    expected = -share * sheet * np.clip(v_arm / FRICTION_SPEED, -1, 1)
    np.testing.assert_allclose(torque[:7], expected, atol=1e-9)
    np.testing.assert_allclose(torque[7:], 0, atol=1e-9)


def test_arm_works_against_its_friction():
    errors = []
    for share in (0.0, 1.0):
        scenario = Scenario.from_dict({"arm": {"coulomb_friction": share}})
        station = CastStation(scenario, has_scene=False)
        simulator = started(station, step=0.0005)
        worst = 0.0
        for t in np.arange(0.05, 0.55, 0.05):
            simulator.AdvanceTo(t)
            hand, desired = (read(station, simulator, name) for name in ("hand", "hand_desired"))
            worst = max(worst, np.linalg.norm((hand - desired)[:3]))
        errors.append(worst)
    assert errors[1] < 0.015
    assert abs(errors[1] - errors[0]) > 1e-4  # and it feels it


def test_what_has_no_geometry_cannot_be_shown():
    with pytest.raises(InputError, match="leave has_scene=False out"):
        CastStation(Scenario(), has_scene=False, meshcat=open_meshcat())


def test_cast_is_set_without_touching_anything_else(contact_free):
    context = contact_free.diagram.CreateDefaultContext()
    contact_free.set_start(context, CAST)
    state = context.get_continuous_state_vector().CopyToVector()
    other = Cast(0.25, 0.4, 0.3, bearing=0.2)
    contact_free.set_cast(context, other, (0.5, 0.1))
    assert contact_free.controller.get_cast(contact_free.controller.GetMyContextFromRoot(context)) == other
    np.testing.assert_array_equal(context.get_continuous_state_vector().CopyToVector(), state)
