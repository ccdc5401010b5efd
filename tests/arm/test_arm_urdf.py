"""An arm's URDF: what is refused, in which words, and that names and frames of a file's own make no difference."""

import math
import os
import re
import time
from copy import deepcopy
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from wam_cast.arm.arm_model import arm_model, models_directory
from wam_cast.arm.arm_urdf import JOINTS
from wam_cast.arm.urdf_file import DRAKE, MOMENTS, rotation, rpy_of
from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.scenario import Arm, Scenario

SHIPPED = models_directory() / "wam7.urdf"
CASTS = (Cast(0.3, 0.6, 0.1), Cast(0.2, 0.45, 0.3, bearing=0.7))


@pytest.fixture(scope="module")
def bare():
    """Return the shipped arm's text without what is drawn."""
    root = ET.parse(SHIPPED).getroot()
    for link in root.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    return ET.tostring(root, encoding="unicode")


def write(folder, text):
    path = folder / "arm.urdf"
    path.write_text(text, encoding="utf-8")
    return path


def edited(text, change):
    """Return an arm's text after `change` has edited its root."""
    root = ET.fromstring(text)
    change(root)
    return ET.tostring(root, encoding="unicode")


def refusal(path, **arm):
    with pytest.raises(InputError) as caught:
        Scenario.from_dict({"arm": {"urdf": str(path), **arm}})
    line = str(caught.value)
    assert "\n" not in line
    assert str(path) in line
    return line


def joint(root, name=JOINTS[3]):
    return root.find(f"joint[@name='{name}']")


def remove_from(path, tag):
    def change(root):
        (owner,) = root.findall(path)
        owner.remove(owner.find(tag))

    return change


def set_in(path, attribute, value):
    return lambda root: root.find(path).set(attribute, value)


def remove_transmission(root):
    root.remove(root.findall("transmission")[3])


def add_finger(root):
    ET.SubElement(root, "link", name="finger")
    finger = ET.SubElement(root, "joint", name="finger_joint", type="revolute")
    ET.SubElement(finger, "parent", link="tool_plate")
    ET.SubElement(finger, "child", link="finger")


def fix_the_last_joint(root):
    joint(root, JOINTS[6]).set("type", "fixed")


def add_second_parent(root):
    other = ET.SubElement(root, "joint", name="other", type="fixed")
    ET.SubElement(other, "parent", link="base")
    ET.SubElement(other, "child", link="link5")


def add_second_transmission(root):
    root.append(deepcopy(root.find("transmission")))


def draw(filename):
    def change(root):
        visual = ET.SubElement(root.find("link[@name='link4']"), "visual")
        ET.SubElement(ET.SubElement(visual, "geometry"), "mesh", filename=filename)

    return change


def shape(tag, **sizes):
    def change(root):
        visual = ET.SubElement(root.find("link[@name='link4']"), "visual")
        geometry = ET.SubElement(visual, "geometry")
        if tag:
            ET.SubElement(geometry, tag, **sizes)

    return change


J4, L4 = f"joint[@name='{JOINTS[3]}']", "link[@name='link4']"


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            set_in("link[@name='base']", "name", "wam_base"),
            "joint 'j1_base_yaw' has the parent link 'base', which is not there",
        ),
        (set_in(f"{J4}/child", "link", "nothing"), "joint 'j4_elbow_pitch' has the child link 'nothing'"),
        (remove_from(J4, "child"), "joint 'j4_elbow_pitch' has the child link ''"),
        (set_in(f"{L4}", "name", "link5"), "2 links are named 'link5'"),
        (add_second_parent, "link 'link5' is the child of two joints, 'j5_wrist_yaw' and 'other'"),
        (remove_from(L4, "inertial"), "link 'link4' has no <inertial>; give it its mass"),
        (remove_from(f"{L4}/inertial", "mass"), "link 'link4' has no mass and inertia that can be used"),
        (remove_from(f"{L4}/inertial", "inertia"), "link 'link4' has no mass and inertia that can be used"),
        (set_in(f"{L4}/inertial/mass", "value", "0"), "link 'link4' has no mass and inertia that can be used"),
        (set_in(f"{L4}/inertial/mass", "value", "nan"), "link 'link4' has <mass value=\"nan\"/>; give 1 finite number"),
        (
            set_in(f"{L4}/inertial/mass", "value", "${m}"),
            "link 'link4' has <mass value=\"${m}\"/>; give 1 finite number",
        ),
        (set_in(f"{L4}/inertial/inertia", "izz", "-1e-3"), "link 'link4' has an inertia that no body has"),
        (set_in(f"{L4}/inertial/inertia", "izz", "0.1"), "none above the sum of the others"),
        (set_in(f"{L4}/inertial/origin", "xyz", "0 0"), "link 'link4' has <origin xyz=\"0 0\"/>; give 3 finite number"),
        (shape(""), "link 'link4': a <geometry> has 0 shapes; give it one of box"),
        (shape("blob"), "link 'link4': a <geometry> has 0 shapes"),
        (shape("box"), "link 'link4': <box size=None> cannot be drawn; give positive numbers"),
        (shape("sphere", radius="-0.1"), "link 'link4': <sphere radius='-0.1'> cannot be drawn"),
        (remove_from(J4, "dynamics"), "joint 'j4_elbow_pitch' has no damping; give it <dynamics damping= friction=/>"),
        (set_in(f"{J4}/dynamics", "friction", "-1"), "joint 'j4_elbow_pitch' has the friction -1"),
        (remove_from(J4, "limit"), "joint 'j4_elbow_pitch' has limits that cannot be used: lower nan"),
        (set_in(f"{J4}/limit", "effort", "0"), "effort 0"),
        (
            set_in(f"{J4}/limit", "effort", "inf"),
            "joint 'j4_elbow_pitch' has <limit effort=\"inf\"/>; give 1 finite number",
        ),
        (
            set_in(f"{J4}/limit", "lower", "4"),
            "joint 'j4_elbow_pitch' has limits that cannot be used: lower 4, upper 3.1",
        ),
        (remove_transmission, "joint 'j4_elbow_pitch' has no rotor_inertia of its motor; give it a <transmission>"),
        (remove_from("transmission[@name='j4_elbow_pitch_motor']/actuator", f"{DRAKE}gear_ratio"), "has no gear_ratio"),
        (add_second_transmission, "joint 'j1_base_yaw' has 2 transmissions; keep one"),
        (set_in(J4, "type", "continuous"), "j4_elbow_pitch (continuous), j5_wrist_yaw (revolute)"),
        (fix_the_last_joint, "6 joints move between 'base' and 'tool_plate'"),
        (add_finger, 'beside the arm\'s joints finger_joint move; make them type="fixed"'),
        (
            set_in(f"{J4}/axis", "xyz", "1 0 0"),
            "joint 'j4_elbow_pitch' turns about (1, 0, 0) of the base, a WAM's about (0, 1, 0)",
        ),
        (set_in(f"{J4}/axis", "xyz", "0 -1 0"), "joint 'j4_elbow_pitch' turns about (0, -1, 0)"),
        (set_in(f"{J4}/axis", "xyz", "0 0 0"), "joint 'j4_elbow_pitch' turns about (0, 0, 0)"),
        (
            set_in(f"{J4}/origin", "xyz", "0.045 0.1 0.55"),
            "must be in the plane y = 0 of the base, they are off by 0.1 m",
        ),
        (set_in(f"joint[@name='{JOINTS[1]}']/origin", "xyz", "0.2 0 0"), "joints 1 to 3 must be on the z axis"),
        (draw("meshes/none.obj"), "link 'link4' is drawn with the mesh 'meshes/none.obj', which is not there"),
        (
            draw("package://wam_description/link4.obj"),
            "the mesh 'package://wam_description/link4.obj', which is not there",
        ),
        (draw("arm.urdf"), "the mesh 'arm.urdf', which is of no format that can be drawn"),
    ],
)
def test_what_a_file_lacks_is_one_line(tmp_path, bare, change, words):
    assert words in refusal(write(tmp_path, edited(bare, change)))


def test_what_is_no_urdf_is_one_line(tmp_path):
    assert "no such file" in refusal(tmp_path / "none.urdf")
    assert "is a directory; name a URDF file" in refusal(tmp_path)
    with pytest.raises(InputError, match="name too long; name a URDF file"):
        Scenario.from_dict({"arm": {"urdf": "x" * 300}})
    with pytest.raises(InputError, match=r"arm\.urdf = 'a.x00b': .* name a URDF file"):
        Scenario.from_dict({"arm": {"urdf": "a\0b"}})
    huge = tmp_path / "huge.urdf"
    huge.touch()
    os.truncate(huge, 1 << 40)
    assert "larger than" in refusal(huge)
    for text in ("", "kp: 3", "<robot><link name='base'></robot>", "<?xml version='1.0' encoding='utf-99'?><robot/>"):
        assert "is not XML" in refusal(write(tmp_path, text))
    binary = tmp_path / "binary.urdf"
    binary.write_bytes(bytes(range(256)) * 64)
    assert "is not XML" in refusal(binary)
    assert "has a <sdf> where a URDF has its <robot>" in refusal(write(tmp_path, "<sdf/>"))
    xacro = '<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:include filename="x"/></robot>'
    assert "is a xacro file" in refusal(write(tmp_path, xacro))
    assert "no link 'base'; set arm.base_frame to one of its links: it has none" in refusal(write(tmp_path, "<robot/>"))


def test_frames_and_joints_that_are_not_there_are_one_line(tmp_path, bare):
    path = write(tmp_path, bare)
    assert "no link 'wam'; set arm.base_frame to one of base, link1, link2" in refusal(path, base_frame="wam")
    assert "no link 'palm'; set arm.hand_frame to one of base, link1" in refusal(path, hand_frame="palm")
    assert "no joints lead from 'link7' to 'link1'" in refusal(path, base_frame="link7", hand_frame="link1")
    assert "0 joints move between 'base' and 'base': none" in refusal(path, hand_frame="base")
    names = [f"wam/{i}" for i in range(7)]
    assert "its joints are, from base to hand, j1_base_yaw, j2" in refusal(path, joints=names)
    Scenario.from_dict({"arm": {"urdf": str(path), "joints": list(JOINTS)}})


def test_a_mesh_is_found_beside_the_file_and_in_its_package(tmp_path, bare):
    package = tmp_path / "wam_description"
    for folder in ("urdf", "meshes"):
        (package / folder).mkdir(parents=True)
    mesh = package / "meshes" / "link 4.obj"
    mesh.write_bytes((models_directory() / "meshes" / "link4_white.obj").read_bytes())
    names = ("../meshes/link 4.obj", f"file://{mesh}", "package://wam_description/meshes/link 4.obj")
    for name in names:
        path = write(package / "urdf", edited(bare, draw(name)))
        assert str(mesh.resolve()) in arm_model(Arm(urdf=str(path))).urdf
    path = write(tmp_path, edited(bare, draw(names[2])))
    assert str(mesh.resolve()) in arm_model(Arm(urdf=str(path))).urdf
    assert drawn_shapes(Arm(urdf=str(path)))["link4"] == 1


def drawn_shapes(arm):
    """Return how many shapes each link of the arm is drawn with."""
    from pydrake.geometry import SceneGraph
    from pydrake.multibody.plant import MultibodyPlant

    from wam_cast.robot.plant import add_arm

    plant, graph = MultibodyPlant(0.0), SceneGraph()
    plant.RegisterAsSourceForSceneGraph(graph)
    add_arm(plant, Scenario(arm=arm))
    names = [f"link{i}" for i in range(1, 8)]
    return {name: len(plant.GetVisualGeometriesForBody(plant.GetBodyByName(name))) for name in names}


def test_the_shipped_arm_is_drawn():
    assert min(drawn_shapes(Arm()).values()) >= 1


def dh_framed(root):
    """Give an arm frames of Denavit and Hartenberg's kind, names of its own, its motors from hand to base, and links beyond it.

    Each joint turns about its frame's z, so that every second frame is rolled; the hand's is turned too; above the base is a
    world, beyond the hand a camera.
    """
    turned = {"base": np.eye(3), "tool_plate": rotation(np.array([0.3, math.pi / 2, 0.1]))}
    arm_joints = [joint(root, name) for name in JOINTS]
    for one in arm_joints:
        is_pitch = one.find("axis").get("xyz") == "0 1 0"
        turned[one.find("child").get("link")] = rotation(np.array([-math.pi / 2 if is_pitch else 0, 0, 0]))
        one.find("axis").set("xyz", "0 0 1")
    for one in root.findall("joint"):
        R_P, R_C = (turned[one.find(end).get("link")] for end in ("parent", "child"))
        place(one.find("origin"), R_P.T @ vector(one.find("origin")), R_P.T @ R_C)
    for link in root.findall("link"):
        R, inertial = turned[link.get("name")], link.find("inertial")
        if inertial is None:
            continue
        place(inertial.find("origin"), R.T @ vector(inertial.find("origin")), np.eye(3))
        xx, xy, xz, yy, yz, zz = (float(inertial.find("inertia").get(key)) for key in MOMENTS)
        moments = R.T @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R
        for key, value in zip(MOMENTS, moments[np.triu_indices(3)], strict=True):
            inertial.find("inertia").set(key, repr(float(value)))
    motors = root.findall("transmission")
    for motor in motors:
        root.remove(motor)
    root.extend(reversed(motors))
    ET.SubElement(root, "link", name="world")
    ET.SubElement(root, "link", name="tool camera")
    for name, parent, child in (("mount", "world", "base"), (JOINTS[0] + "_camera", "tool_plate", "tool camera")):
        fixed = ET.SubElement(root, "joint", name=name, type="fixed")
        ET.SubElement(fixed, "parent", link=parent)
        ET.SubElement(fixed, "child", link=child)
        ET.SubElement(fixed, "origin", xyz="0.1 0.2 0.3", rpy="0.4 0.5 0.6")
    text = ET.tostring(root, encoding="unicode")
    for old in ("base", *(f"link{i}" for i in range(1, 8)), "tool_plate"):
        text = text.replace(f'"{old}"', f'"wam/{old}"')
    for i, old in enumerate(JOINTS):
        text = text.replace(f'"{old}"', f'"wam/J{8 - i}"')
    return text


def vector(origin):
    return np.array([float(value) for value in origin.get("xyz").split()])


def place(origin, xyz, R):
    for key, values in (("xyz", xyz), ("rpy", rpy_of(R))):
        origin.set(key, " ".join(repr(float(value)) for value in values))


@pytest.fixture(scope="module")
def dh_arm(bare, tmp_path_factory):
    path = write(tmp_path_factory.mktemp("arm"), dh_framed(ET.fromstring(bare)))
    return {"urdf": str(path), "base_frame": "wam/base", "hand_frame": "wam/tool_plate"}


@pytest.mark.parametrize("mount", ["ceiling", "wall"])
def test_names_and_frames_of_a_file_make_no_difference(dh_arm, mount):
    from wam_cast.simulation.simulator import CastSimulator

    place_of_arm = {} if mount == "ceiling" else {"mount": "wall", "mount_height": 1.1}
    motion = {} if mount == "ceiling" else {"start_radius": 0.6, "drop_distance": 0.35}
    bounds = {} if mount == "ceiling" else {"distance": [0.05, 0.2]}
    shipped, other = (
        CastSimulator(Scenario.from_dict({"arm": arm | place_of_arm, "motion": motion, "bounds": bounds}))
        for arm in ({}, dh_arm)
    )
    for cast in CASTS[: 2 if mount == "ceiling" else 1]:
        expected, found = (one.simulate(cast) for one in (shipped, other))
        assert np.all(np.isfinite(expected.landing))
        np.testing.assert_allclose(found.landing, expected.landing, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.peak_torque_utilization, expected.peak_torque_utilization, rtol=0, atol=1e-9)
        assert found.slack == pytest.approx(expected.slack, abs=1e-9)


def test_what_is_known_without_drake_is_the_same_too(dh_arm):
    shipped, other = arm_model(Arm()), arm_model(Arm(**dh_arm))
    assert other.bearing_limits == shipped.bearing_limits
    np.testing.assert_array_equal(other.coulomb_friction, shipped.coulomb_friction)
    for name in ("shoulder_height", "shoulder_radius", "stretched_length"):
        assert getattr(other, name) == pytest.approx(getattr(shipped, name), abs=1e-12)


def test_a_hand_that_is_a_moving_link_ends_the_arm_there():
    whole, shorter = arm_model(Arm()), arm_model(Arm(hand_frame="link7"))
    assert whole.stretched_length - shorter.stretched_length == pytest.approx(0.06)


def test_rpy_is_the_inverse_of_rotation():
    rng = np.random.default_rng(0)
    for rpy in (*rng.uniform(-3, 3, (20, 3)), np.array([0.3, math.pi / 2, 1.0]), np.array([0.3, -math.pi / 2, 1.0])):
        np.testing.assert_allclose(rotation(rpy_of(rotation(rpy))), rotation(rpy), atol=1e-12)


def test_scales_act_as_in_closed_form():
    from wam_cast.robot.plant import make_arm_plant

    factors = np.array([1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7])
    q = np.array([0.3, -0.4, 0.2, 1.1, -0.5, 0.6, 0.7])

    def quantities(**arm):
        plant = make_arm_plant(Scenario.from_dict({"arm": arm}))
        context = plant.CreateDefaultContext()
        plant.SetPositions(context, q)
        joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
        damping = np.array([one.default_damping_vector()[0] for one in joints if one.num_velocities()])
        return (
            plant.CalcMassMatrix(context),
            plant.CalcGravityGeneralizedForces(context),
            damping,
            plant.GetEffortUpperLimits(),
        )

    mass, gravity, damping, efforts = quantities()
    _, _, scaled, _ = quantities(viscous_friction_scale=list(factors))
    np.testing.assert_allclose(scaled, factors * damping, rtol=1e-12)
    _, _, _, scaled = quantities(torque_scale=list(factors))
    np.testing.assert_allclose(scaled, factors * efforts, rtol=1e-12)

    motors = ET.parse(SHIPPED).getroot().findall("transmission/actuator")
    rotor, ratio = (
        np.array([float(one.find(f"{DRAKE}{key}").get("value")) for one in motors])
        for key in ("rotor_inertia", "gear_ratio")
    )
    reflected = rotor * ratio**2
    rotors, _, _, _ = quantities(rotor_inertia_scale=list(factors))
    np.testing.assert_allclose(rotors - mass, np.diag((factors - 1) * reflected), atol=1e-12)

    masses, weights, _, _ = quantities(mass_scale=1.5)
    np.testing.assert_allclose(masses - np.diag(reflected), 1.5 * (mass - np.diag(reflected)), rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(weights, 1.5 * gravity, rtol=1e-10, atol=1e-14)
    # Of the last link alone, the seventh joint sees the inertia about its own axis: twice as much of it is added once.
    link = ET.parse(SHIPPED).getroot().find("link[@name='link7']/inertial")
    izz = float(link.find("inertia").get("izz"))
    wrists, weights, _, _ = quantities(inertia_scale=[1, 1, 1, 1, 1, 1, 2])
    assert wrists[6, 6] - mass[6, 6] == pytest.approx(izz, rel=1e-9)
    np.testing.assert_allclose(weights, gravity, atol=1e-14)


def test_coulomb_friction_is_read_from_the_file(tmp_path, bare):
    path = write(tmp_path, edited(bare, set_in(f"{J4}/dynamics", "friction", "4.25")))
    assert arm_model(Arm(urdf=str(path))).coulomb_friction[3] == 4.25


def test_a_file_that_was_edited_is_read_again(tmp_path, bare):
    import os

    path = write(tmp_path, bare)
    before = Scenario.from_dict({"arm": {"urdf": str(path)}}).fingerprint
    path.write_text(re.sub('upper="3.1"', 'upper="3.0"', bare), encoding="utf-8")
    os.utime(path, ns=(1, 1))
    assert Scenario.from_dict({"arm": {"urdf": str(path)}}).fingerprint != before


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("".join(f'<link name="l{i}"/>' for i in range(200_000)), "has 200000 parts, 10000 at most can be read"),
        ("".join(f'<link name="l{i}"/>' for i in range(9999)), "no link 'base'; set arm.base_frame to one of l0, l1"),
        (f"<link>{'<a/>' * 200_000}</link>", "1 links are named ''"),
        (f"<link name='a'>{'<b>' * 50_000}{'</b>' * 50_000}</link>", "more than 20 deep"),
    ],
    ids=["parts", "links", "elements of a link", "elements within elements"],
)
def test_of_too_many_parts_a_line_is_said_soon(tmp_path, content, words):
    path = tmp_path / "many.urdf"
    path.write_text(f'<robot name="many">{content}</robot>')
    started = time.process_time()
    with pytest.raises(InputError, match=words) as error:
        Scenario.from_dict({"arm": {"urdf": str(path)}})
    assert time.process_time() - started < 2
    assert len(str(error.value)) < 1300
