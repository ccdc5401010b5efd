"""The arm's model: every number of its sheet arrives in the plant, and the plant moves as the sources say.

The checks against the DH table, the holding torques and the moving mass do not read the sheet: they are what
the manufacturer's documents say of the whole arm.
"""

import csv
import runpy
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import SpatialInertia

from wam_cast.arm.arm_model import arm_model
from wam_cast.scenario import Arm

MODELS = Path(__file__).parents[2] / "models"
URDF = MODELS / "wam7.urdf"
CEILING = RigidTransform(RollPitchYaw(np.pi, 0, 0), [0, 0, 1.346])

with (MODELS / "wam7_parameters.csv").open(encoding="utf-8", newline="") as file:
    LINKS = list(csv.DictReader(file))
MOVING = [row for row in LINKS if row["joint_type"] == "revolute"]

each_link = pytest.mark.parametrize("row", LINKS, ids=lambda row: row["name"])
each_moving_link = pytest.mark.parametrize("row", MOVING, ids=lambda row: row["name"])


def numbers(row, *columns):
    return np.array([float(row[column]) for column in columns])


def load_arm(X_WB=None):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(URDF))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"), X_WB or RigidTransform())
    plant.Finalize()
    return plant


def poses_of(plant, q):
    """Return the pose of every link frame in the world, by name."""
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    return {row["name"]: plant.GetFrameByName(row["name"]).CalcPoseInWorld(context) for row in LINKS}


def random_positions(n, seed=0):
    """Return n configurations (n, 7) within the joints' ranges."""
    limits = np.array([numbers(row, "lower", "upper") for row in MOVING])
    return np.random.default_rng(seed).uniform(limits[:, 0], limits[:, 1], (n, 7))


@pytest.fixture(scope="module")
def arm():
    return load_arm()


def test_axes_of_the_shoulder_meet_as_far_below_the_mounting_face_as_is_read_without_drake(arm):
    poses = poses_of(arm, random_positions(1)[0])
    for name in ("link1", "link2", "link3"):
        np.testing.assert_allclose(
            poses[name].translation(), [0, 0, 1.346 - arm_model(Arm()).shoulder_height], atol=1e-15
        )


@pytest.fixture(scope="module")
def generated():
    """Return the text of each generated file, as the script would write it now."""
    return runpy.run_path(str(MODELS / "make_wam7.py"))["model_files"]()


# ---------------------------------------------------------------- the files


def test_urdf_is_what_the_script_writes(generated):
    assert URDF.read_text(encoding="utf-8") == generated["wam7.urdf"]


def test_meshes_are_what_the_script_writes(generated):
    committed = {path.relative_to(MODELS).as_posix() for path in MODELS.glob("meshes/*")}
    assert committed == set(generated) - {"wam7.urdf"}
    for name in sorted(committed):
        lines = (MODELS / name).read_text(encoding="utf-8").splitlines()
        expected = generated[name].splitlines()
        assert [line.split()[0] for line in lines] == [line.split()[0] for line in expected], name
        assert [x for x in lines if x[0] == "f"] == [x for x in expected if x[0] == "f"], name
        for tag, last_digit in (("v", 1e-4), ("vn", 1e-2)):  # another libm may round the last digit elsewhere
            ours, theirs = (
                np.array([x.split()[1:] for x in text if x.split()[0] == tag], float) for text in (lines, expected)
            )
            np.testing.assert_allclose(ours, theirs, atol=1.01 * last_digit, rtol=0, err_msg=name)


def test_meshes_are_light():
    files = list(MODELS.glob("meshes/*.obj"))
    faces = [line.split() for path in files for line in path.read_text("utf-8").splitlines() if line[0] == "f"]
    assert 1000 < sum(len(face) - 3 for face in faces) < 15_000, "triangles"
    assert sum(path.stat().st_size for path in files) < 600_000, "bytes"


def test_every_link_has_a_shell_and_none_collides(arm):
    robot = ET.parse(URDF).getroot()
    assert robot.get("name") == "wam7"
    for link in robot.iter("link"):
        meshes = [mesh.get("filename") for mesh in link.iter("mesh")]
        assert meshes, link.get("name")
        assert all((MODELS / mesh).is_file() for mesh in meshes)
        assert all(mesh.startswith(f"meshes/{link.get('name')}_") for mesh in meshes)
    assert not list(robot.iter("collision"))
    assert arm.num_collision_geometries() == 0


# ---------------------------------------------------------------- every number of the sheet, through Drake


def test_joints_are_the_sheets_in_its_order(arm):
    names = [arm.get_joint(index).name() for index in arm.GetJointIndices()]
    assert [name for name in names if name.startswith("j")] == [row["joint"] for row in MOVING]
    assert [arm.GetJointByName(row["joint"]).position_start() for row in MOVING] == list(range(7))
    assert (arm.num_positions(), arm.num_velocities(), arm.num_actuators()) == (7, 7, 7)
    assert [arm.get_joint_actuator(index).joint().name() for index in arm.GetJointActuatorIndices()] == [
        row["joint"] for row in MOVING
    ]


@each_link
def test_joint_frame(arm, row):
    joint = arm.GetJointByName(row["joint"])
    X_PF = joint.frame_on_parent().GetFixedPoseInBodyFrame()
    R_PF = RollPitchYaw(numbers(row, "origin_roll", "origin_pitch", "origin_yaw")).ToRotationMatrix()
    assert joint.parent_body().name() == row["parent"]
    assert joint.child_body().name() == row["name"]
    np.testing.assert_array_equal(X_PF.translation(), numbers(row, "origin_x", "origin_y", "origin_z"))
    np.testing.assert_array_equal(X_PF.rotation().matrix(), R_PF.matrix())
    assert joint.frame_on_child().GetFixedPoseInBodyFrame().IsExactlyIdentity()
    if row["joint_type"] == "fixed":
        assert joint.num_velocities() == 0
    else:
        np.testing.assert_array_equal(joint.revolute_axis(), numbers(row, "axis_x", "axis_y", "axis_z"))


@each_link
def test_mass_centre_and_inertia(arm, row):
    M_B: SpatialInertia = arm.GetBodyByName(row["name"]).default_spatial_inertia()
    assert M_B.get_mass() == float(row["mass"])
    assert M_B.IsPhysicallyValid()
    if row["joint_type"] == "fixed":  # the tool plate's mass is in link 7's
        return
    np.testing.assert_allclose(M_B.get_com(), numbers(row, "com_x", "com_y", "com_z"), atol=1e-15, rtol=1e-14)
    ixx, iyy, izz, ixy, ixz, iyz = numbers(row, "ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    I_Bcm = M_B.Shift(M_B.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
    expected = [[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]
    np.testing.assert_allclose(I_Bcm, expected, atol=1e-14, rtol=0)


@each_moving_link
def test_limits_and_friction(arm, row):
    joint = arm.GetJointByName(row["joint"])
    assert joint.position_lower_limits() == float(row["lower"])
    assert joint.position_upper_limits() == float(row["upper"])
    assert joint.velocity_upper_limits() == float(row["velocity"])
    assert joint.velocity_lower_limits() == -float(row["velocity"])
    assert joint.default_damping() == float(row["damping"])
    # Drake's parser has no use for Coulomb friction; the file carries it all the same.
    dynamics = ET.parse(URDF).getroot().find(f"joint[@name='{row['joint']}']/dynamics")
    assert dynamics.get("friction") == row["coulomb"]


@each_moving_link
def test_motor(arm, row):
    motor = arm.GetJointActuatorByName(f"{row['joint']}_motor")
    assert motor.joint().name() == row["joint"]
    assert motor.effort_limit() == float(row["effort"])
    assert motor.default_rotor_inertia() == float(row["rotor_inertia"])
    assert motor.default_gear_ratio() == float(row["gear_ratio"])
    reflected = motor.calc_reflected_inertia(arm.CreateDefaultContext())
    assert reflected == pytest.approx(float(row["reflected_inertia"]), abs=0.51e-6)


@each_moving_link
def test_effort_is_no_more_than_what_barrett_publishes(row):
    assert float(row["effort_continuous"]) < float(row["effort"]) <= float(row["effort_published"])


# ---------------------------------------------------------------- the arm as a whole


@pytest.mark.parametrize(
    ("name", "q", "p_WE"),
    [
        ("zero", [0, 0, 0, 0, 0, 0, 0], [0, 0, 1.256]),
        ("elbow", [0, 0, 0, np.pi / 2, 0, 0, 0], [0.405, 0, 0.941]),
        ("stretched", [0, np.pi / 2, 0, 0, 0, 0, 0], [0.910, 0, 0.346]),
    ],
)
def test_tool_plate_where_the_manual_has_it(arm, name, q, p_WE):
    np.testing.assert_allclose(poses_of(arm, q)["tool_plate"].translation(), p_WE, atol=1e-15, err_msg=name)


def test_forward_kinematics_is_that_of_the_dh_table(arm):
    table = [  # a [m], alpha [rad], d [m]: the manual's standard DH parameters
        (0.0, -np.pi / 2, 0.0),
        (0.0, np.pi / 2, 0.0),
        (0.045, -np.pi / 2, 0.550),
        (-0.045, np.pi / 2, 0.0),
        (0.0, -np.pi / 2, 0.300),
        (0.0, np.pi / 2, 0.0),
        (0.0, 0.0, 0.060),
    ]
    for q in random_positions(50):
        T = np.eye(4)
        T[2, 3] = 0.346
        for (a, alpha, d), angle in zip(table, q, strict=True):
            c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
            T = T @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        np.testing.assert_allclose(poses_of(arm, q)["tool_plate"].GetAsMatrix4(), T, atol=1e-14)


def test_mirror_in_the_casting_plane(arm):
    """Turning q1, q3, q5 and q7 the other way mirrors every frame in the xz plane."""
    mirror = np.diag([1.0, -1.0, 1.0])
    flip = np.array([-1, 1, -1, 1, -1, 1, -1])
    for q in random_positions(20, seed=1):
        poses, mirrored = poses_of(arm, q), poses_of(arm, flip * q)
        for name, X_WF in poses.items():
            np.testing.assert_allclose(mirrored[name].translation(), mirror @ X_WF.translation(), atol=1e-14)
            R_WF = mirror @ X_WF.rotation().matrix() @ mirror
            np.testing.assert_allclose(mirrored[name].rotation().matrix(), R_WF, atol=1e-14)


def test_moving_mass(arm):
    moving = [arm.GetBodyByName(row["name"]) for row in LINKS]
    assert sum(body.default_mass() for body in moving) == pytest.approx(19.4555, abs=5e-5)


def test_holding_torques_hanging_and_stretched():
    arm = load_arm(CEILING)
    context = arm.CreateDefaultContext()
    arm.SetPositions(context, [0, np.pi / 2, 0, 0, 0, 0, 0])
    holding = -arm.CalcGravityGeneralizedForces(context)
    np.testing.assert_allclose(np.abs(holding[[1, 3, 5]]), [27.94, 5.05, 0.14], atol=0.005)
    assert abs(holding[0]) < 1e-12  # joint 1 is vertical


def test_mass_matrix_is_symmetric_positive_definite_and_counts_the_rotors(arm):
    reflected = np.array([float(row["rotor_inertia"]) * float(row["gear_ratio"]) ** 2 for row in MOVING])
    context = arm.CreateDefaultContext()
    for q in random_positions(50, seed=2):
        arm.SetPositions(context, q)
        M = arm.CalcMassMatrix(context)
        np.testing.assert_array_equal(M, M.T)
        assert np.linalg.eigvalsh(M - np.diag(reflected)).min() > 1e-6, "links alone"
        assert (np.diag(M) > reflected).all()
        assert np.linalg.eigvalsh(M).min() > reflected.min()
