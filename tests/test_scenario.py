"""The scenario: what it refuses and how it says so, its file, and what its fingerprint stands for."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from pydantic import ValidationError

import wam_cast
from wam_cast.errors import InputError
from wam_cast.scenario import Ball, Bounds, Cup, Motion, Noise, Scenario, String

# One change each of a value that moves a free cast's landing, or of what casts are drawn from.
MATTERS = [
    {"arm": {"mount_height": 1.35}},
    {"arm": {"wrist_pitch": -0.7}},
    {"gravity": 9.8},
    {"arm": {"mount": "wall"}},
    {"arm": {"coulomb_friction": 0.5}},
    {"arm": {"viscous_friction_scale": [1.1, 1, 1, 1, 1, 1, 1]}},
    {"arm": {"mass_scale": 1.01}},
    {"arm": {"inertia_scale": 1.01}},
    {"arm": {"rotor_inertia_scale": 1.01}},
    {"arm": {"torque_scale": 1.01}},
    {"arm": {"knee_speed": 0.5}},
    {"arm": {"encoder_offset": 0.001}},
    {"arm": {"base_tilt": [0.001, 0.0]}},
    {"string": {"length": 0.59}},
    {"string": {"n_links": 11}},
    {"string": {"mass": 0.004}},
    {"string": {"bending_damping": 9e-7}},
    {"string": {"bending_stiffness": 1e-6}},
    {"string": {"hook_damping": 2e-4}},
    {"string": {"knot_damping": 2e-6}},
    {"ball": {"mass": 0.031}},
    {"ball": {"radius": 0.021}},
    {"ball": {"inertia_factor": 0.6}},
    {"cup": {"rim_height": 0.11}},
    {"controller": {"kp": 6001.0}},
    {"controller": {"kd": 251.0}},
    {"controller": {"posture_stiffness": [21, 20, 20, 20, 5, 5, 0.5]}},
    {"controller": {"posture_damping": [3, 3, 3, 3, 0.5, 0.5, 0.03]}},
    {"controller": {"period": 0.001}},
    {"controller": {"delay": 1}},
    {"motion": {"start_radius": 0.21}},
    {"motion": {"start_height": 0.81}},
    {"motion": {"min_move_duration": 0.21}},
    {"motion": {"drop_distance": 0.44}},
    {"motion": {"drop_duration": 0.39}},
    {"motion": {"hold_duration": 0.9}},
    {"noise": {"distance": 0.003}},
    {"noise": {"speed": 0.015}},
    {"noise": {"wait": 0.004}},
    {"noise": {"torque": 0.005}},
    {"noise": {"encoder_counts": 4096}},
    {"noise": {"swing": 0.005}},
    {"simulation": {"max_step": 0.001}},
    {"bounds": {"distance": [0.06, 0.40]}},
    {"bounds": {"speed": [0.22, 0.85]}},
    {"bounds": {"wait": [0.0, 0.4]}},
]

# What a ball meets, or the arm does, only after it has come down through the rim plane, and the turn, after which it hangs at rest.
DOES_NOT_MATTER = [
    {"cup": {"base_height": 0.05}},
    {"cup": {"base_radius": 0.3}},
    {"cup": {"offset": [0.01, 0.0]}},
    {"cup": {"inner_radius": 0.035}},
    {"cup": {"wall_thickness": 0.005}},
    {"cup": {"bottom_thickness": 0.005}},
    {"cup": {"stiffness": 1e5}},
    {"cup": {"restitution": 0.6}},
    {"cup": {"friction": 0.2}},
    {"simulation": {"contact_accuracy": 0.01}},
    {"cameras": {"number": 2}},
    {"cameras": {"positions": [[0.0, -2.0, 0.7], [1.6, -1.2, 0.7]]}},
    {"cameras": {"targets": [[0.5, 0.0, 0.3], [0.6, 0.0, 0.3]]}},
    {"cameras": {"offsets": [[0.01, 0.0, 0.0], [0.0, 0.0, 0.0]]}},
    {"cameras": {"turns": [[0.01, 0.0, 0.0], [0.0, 0.0, 0.0]]}},
    {"cameras": {"calibration_std": 0.001}},
    {"cameras": {"field_of_view": 0.8}},
    {"cameras": {"width": 320}},
    {"cameras": {"height": 240}},
    {"cameras": {"frame_rate": 100.0}},
    {"cameras": {"exposure": 0.004}},
    {"cameras": {"pixel_noise": 0.02}},
    {"motion": {"turn_duration": 3.0}},
    {"motion": {"fetch_duration": 0.9}},
    {"motion": {"pull_duration": 1.9}},
    {"motion": {"slide_duration": 1.6}},
    {"motion": {"lift_duration": 0.9}},
    {"motion": {"retreat_duration": 1.3}},
]

# Values, and what the one line about them must hold: the value's name, what was given, and what is allowed.
REFUSED = [
    ({"string": {"lenght": 0.5}}, ["string.lenght", "unknown", "length, n_links"]),
    ({"strng": {}}, ["strng", "unknown", "string, ball"]),
    ({"ball": {"mass": -0.03}}, ["ball.mass", "-0.03", "greater than or equal to 0.0005"]),
    (
        {"cup": {"base_height": 0.05, "base_radius": 0.01}},
        ["cup.base_radius = 0.01 m", "outer radius 0.0345 m", "as much"],
    ),
    ({"ball": {"mass": 0}}, ["ball.mass", "greater than or equal to 0.0005"]),
    ({"ball": {"mass": float("nan")}}, ["ball.mass", "finite", "nan"]),
    ({"ball": {"mass": float("inf")}}, ["ball.mass", "finite", "inf"]),
    ({"ball": {"mass": "heavy"}}, ["ball.mass", "heavy", "number"]),
    ({"ball": None}, ["ball", "mass, radius"]),
    ({"string": {"n_links": 0}}, ["string.n_links", "0", "greater than or equal to 1"]),
    ({"string": {"n_links": 2.5}}, ["string.n_links", "2.5", "integer"]),
    ({"string": {"length": 0.7}}, ["string.length", "0.7", "0.66", "motion.start_height"]),
    ({"cup": {"inner_radius": 0.02}}, ["cup.inner_radius", "0.02", "ball.radius"]),
    ({"cup": {"bottom_thickness": 0.12}}, ["cup.bottom_thickness", "cup.rim_height = 0.12"]),
    ({"ball": {"mass": True}}, ["ball.mass", "True", "a number"]),
    ({"cup": {"restitution": -1}}, ["cup.restitution", "-1", "greater than or equal to 0.05"]),
    ({"motion": {"start_height": 1.5}}, ["motion.start_height", "1.5", "arm.mount_height = 1.346"]),
    ({"motion": {"drop_distance": 0.7}}, ["motion.drop_distance", "0.7", "0.68"]),
    ({"bounds": {"distance": [0.4, 0.1]}}, ["bounds.distance", "[0.4, 0.1]", "below"]),
    ({"bounds": {"wait": [0.2, 0.2]}}, ["bounds.wait", "[0.2, 0.2]", "below"]),
    ({"bounds": {"speed": [0.3]}}, ["bounds.speed", "missing"]),
    ({"bounds": {"distance": [0.01, 0.04]}}, ["bounds", "0.04 m", "motion.min_move_duration = 0.2"]),
    ({"arm": {"wrist_pitch": 2.0}}, ["arm.wrist_pitch", "2.0", "less than or equal to 1.6"]),
    ({"controller": {"posture_stiffness": [1, 2]}}, ["controller.posture_stiffness", "missing"]),
    ({"noise": {"swing": -0.1}}, ["noise.swing", "-0.1", "greater than or equal to 0"]),
    ({"noise": {"torque": float("inf")}}, ["noise.torque", "finite", "inf"]),
    ({"noise": {"encoder_counts": 0.5}}, ["noise.encoder_counts", "0.5", "integer"]),
    ({"noise": {"encoder_counts": -1}}, ["noise.encoder_counts", "-1", "greater than or equal to 0"]),
    ({"noise": {"wait": True}}, ["noise.wait", "True", "a number"]),
    ({"noise": {"torques": 0.1}}, ["noise.torques", "unknown", "distance, speed"]),
    ({"gravity": 0}, ["gravity", "0", "greater than or equal to 0.1"]),
    ({"arm": {"mount": "desk"}}, ["arm.mount", "desk", "ceiling", "floor", "wall"]),
    ({"arm": {"mount_height": -0.1}}, ["arm.mount_height", "-0.1", "greater than or equal to 0"]),
    ({"arm": {"mass_scale": [1, 1, 1, 1, 1, 1, 0]}}, ["arm.mass_scale", "0", "greater than or equal to 0.05"]),
    ({"arm": {"encoder_offset": 1.0}}, ["arm.encoder_offset", "1.0", "less than or equal to 0.2"]),
    ({"arm": {"urdf": "nowhere.urdf"}}, ["arm.urdf", "nowhere.urdf", "no such file"]),
    ({"arm": {"hand_frame": "gripper"}}, ["arm.hand_frame", "gripper", "tool_plate"]),
    ({"string": {"length": 0.03}}, ["string.length", "0.03", "greater than or equal to 0.1"]),
    ({"cup": {"base_height": 0.115}}, ["cup.bottom_thickness", "0.005 m", "cup.base_height = 0.115"]),
    ({"cup": {"offset": [0.2, 0.0]}}, ["cup.offset", "0.2", "less than or equal to 0.1"]),
    ({"controller": {"delay": -1}}, ["controller.delay", "-1", "greater than or equal to 0"]),
    ({"cameras": {"number": 3}}, ["cameras.number", "3", "less than or equal to 2"]),
    ({"cameras": {"exposure": 0.02}}, ["cameras.exposure = 0.02 s", "cameras.frame_rate = 60", "0.0167 s"]),
    (
        {"cameras": {"positions": [[0.6, 0.0, 2.0], [1.6, -1.2, 0.7]]}},
        ["camera 1 at [0.6, 0.0, 2.0]", "straight", "to the side"],
    ),
    ({"cameras": {"offsets": [[0.3, 0, 0], [0, 0, 0]]}}, ["cameras.offsets.0.0", "0.3", "less than or equal to 0.2"]),
    ([1, 2], ["top level", "[1, 2]", "arm, string"]),
]


def flat(values):
    return ids[0] if (ids := names_of(values)) else "all"


def names_of(values):
    """Return the names of all values in a scenario's nested ones."""
    groups = [[f"{a}.{b}" for b in part] if isinstance(part, dict) else [a] for a, part in values.items()]
    return [name for group in groups for name in group]


def test_yaml_round_trip_keeps_every_value(tmp_path):
    scenario = Scenario.from_dict(
        {
            "string": {"n_links": 7, "length": 0.41},
            "bounds": {"wait": [0.1, 0.3]},
            "arm": {"wrist_pitch": -0.5},
            "noise": {"swing": 0.01, "encoder_counts": 4096},
        }
    )
    path = tmp_path / "scenario.yaml"
    path.write_text(scenario.to_yaml(), encoding="utf-8")
    again = Scenario.from_yaml(path)
    assert again == scenario
    assert again.fingerprint == scenario.fingerprint
    assert again.string.length == 0.41
    assert isinstance(again.bounds.wait, tuple)


def test_yaml_spells_out_every_value():
    values = yaml.safe_load(Scenario().to_yaml())
    assert values == Scenario().model_dump(mode="json")
    assert len(names_of(values)) > 60


@pytest.mark.parametrize("text", ["", "# nothing but a comment\n", "{}"])
def test_what_a_file_leaves_out_keeps_its_default(tmp_path, text):
    path = tmp_path / "scenario.yaml"
    path.write_text(text, encoding="utf-8")
    assert Scenario.from_yaml(path) == Scenario()
    path.write_text("ball: {mass: 0.05}", encoding="utf-8")
    assert Scenario.from_yaml(path) == Scenario(ball=Ball(mass=0.05))


def test_defaults_are_the_reference_scenario():
    scenario = Scenario()
    assert (scenario.string.length, scenario.string.mass, scenario.string.n_links) == (0.60, 0.003, 10)
    assert (scenario.ball.mass, scenario.ball.radius) == (0.030, 0.020)
    assert (scenario.cup.rim_height, scenario.cup.inner_radius) == (0.12, 0.030)
    assert scenario.cup.outer_radius == pytest.approx(0.0345)
    assert scenario.arm.mount_height - 0.346 == pytest.approx(1.0)  # the height of the shoulder


@pytest.mark.parametrize(("values", "named"), REFUSED, ids=lambda value: str(value)[:40])
def test_refusal_is_one_line_that_names_the_value_and_what_is_allowed(tmp_path, monkeypatch, values, named):
    monkeypatch.chdir(tmp_path)  # from where paths count, as from the file's folder
    with pytest.raises(InputError) as caught:
        Scenario.from_dict(values)
    message = str(caught.value)
    assert "\n" not in message
    for part in named:
        assert part in message

    path = tmp_path / "broken.yaml"
    path.write_text(yaml.safe_dump(values), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        Scenario.from_yaml(path)
    assert str(caught.value) == f"scenario {path}: {message}"


def test_refusal_counts_what_else_is_wrong():
    with pytest.raises(InputError, match=r"ball\.mass.*and 1 more"):
        Scenario.from_dict({"ball": {"mass": -1, "radius": -1}})


@pytest.mark.parametrize(
    "content", [b"ball: {mass: 1", b"ball:\n\tmass: 1\n", b"\xff\xfe\x00", b"!!python/object:os.system {}"]
)
def test_file_that_is_not_yaml_is_refused_in_one_line(tmp_path, content):
    path = tmp_path / "scenario.yaml"
    path.write_bytes(content)
    with pytest.raises(InputError, match="not a YAML file") as caught:
        Scenario.from_yaml(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["missing.yaml", "."])
def test_file_that_cannot_be_read_is_refused_in_one_line(tmp_path, name):
    with pytest.raises(InputError, match="name a readable YAML file") as caught:
        Scenario.from_yaml(tmp_path / name)
    assert str(tmp_path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Ball(mass=-1),
        lambda: Ball(weight=1),
        lambda: String(length=float("nan")),
        lambda: Bounds(wait=(0.3, 0.1)),
        lambda: Scenario(cup=Cup(inner_radius=0.01)),
        lambda: Scenario(motion=Motion(start_height=0.7)),
    ],
)
def test_parts_made_directly_are_validated_too(make):
    with pytest.raises(InputError) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_scenario_is_frozen_and_hashable():
    scenario = Scenario()
    with pytest.raises(ValidationError, match="frozen"):
        scenario.ball = Ball(mass=1)
    with pytest.raises(ValidationError, match="frozen"):
        scenario.ball.mass = 1
    assert {scenario: 1}[Scenario()] == 1
    assert hash(scenario) != hash(Scenario(ball=Ball(mass=0.04)))


@pytest.mark.parametrize("change", MATTERS, ids=flat)
def test_fingerprint_changes_with_what_a_free_cast_depends_on(change):
    assert Scenario.from_dict(change).fingerprint != Scenario().fingerprint


@pytest.mark.parametrize("change", DOES_NOT_MATTER, ids=flat)
def test_fingerprint_keeps_with_what_a_free_cast_cannot_feel(change):
    changed = Scenario.from_dict(change)
    assert changed != Scenario()
    assert changed.fingerprint == Scenario().fingerprint


def test_noise_is_off_by_default_and_each_of_its_values_switches_it_on():
    assert Scenario().noise == Noise()
    assert not Noise().is_on
    assert Noise.typical().is_on
    for name, value in Noise.typical():
        assert value > 0
        assert Noise(**{name: value}).is_on
        with pytest.raises(InputError, match="greater than or equal to 0"):
            Noise(**{name: -value})


def test_fingerprint_of_a_scenario_without_noise_is_that_of_the_reference_dataset():
    # Whose casts were made before scenarios knew of noise.
    path = Path(wam_cast.__file__).parent / "reference" / "dataset"
    stored = json.loads((path / "manifest.json").read_text(encoding="utf-8"))["fingerprint"]
    assert Scenario.from_yaml(path / "scenario.yaml").fingerprint == stored
    assert Scenario(noise=Noise()).fingerprint == stored
    assert Scenario(noise=Noise(swing=0.001)).fingerprint != Scenario(noise=Noise(swing=0.002)).fingerprint


def test_every_value_is_known_to_matter_or_not_to():
    named = {flat(change) for change in [*MATTERS, *DOES_NOT_MATTER]}
    names_in_the_arms_file = {"arm.urdf", "arm.base_frame", "arm.hand_frame", "arm.joints"}
    assert named | names_in_the_arms_file == set(names_of(Scenario().model_dump()))


def test_fingerprint_changes_with_the_arm_but_not_with_its_looks(tmp_path, monkeypatch):
    import wam_cast.arm.arm_model as module

    original = (module.models_directory() / "wam7.urdf").read_text(encoding="utf-8")
    here, meshes = Scenario().fingerprint, module.models_directory() / "meshes"
    monkeypatch.setattr(module, "models_directory", lambda: tmp_path)
    for text, is_same in [
        (original, True),
        (original.replace("0.93 0.93 0.91 1", "1 0 0 1"), True),
        (original.replace('mass value="10.76768767"', 'mass value="10.8"'), False),
    ]:
        (tmp_path / "wam7.urdf").write_text(text.replace("meshes/", f"{meshes}/"), encoding="utf-8")
        assert (Scenario().fingerprint == here) is is_same


def test_fingerprint_is_the_same_in_another_process():
    # Python salts the hashes of strings in each process, which no fingerprint may inherit.
    code = "from wam_cast.scenario import Scenario; print(Scenario().fingerprint)"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert found.strip() == Scenario().fingerprint


def test_key_that_stands_twice_is_refused(tmp_path):
    path = tmp_path / "twice.yaml"
    path.write_text("ball: {mass: 0.03, mass: 0.9}\n", encoding="utf-8")
    with pytest.raises(InputError, match="the key 'mass' stands twice"):
        Scenario.from_yaml(path)
