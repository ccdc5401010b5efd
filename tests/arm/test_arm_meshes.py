"""An arm's meshes: what is broken is named in one line before Drake reads it, and only where the arm is drawn."""

import os
import shutil

import numpy as np
import pytest

from wam_cast.arm.arm_meshes import LARGEST_MESH, check_meshes, drawn_meshes
from wam_cast.arm.arm_model import models_directory
from wam_cast.errors import InputError
from wam_cast.scenario import Arm, Scenario
from wam_cast.visualization.scene import CastScene

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n"


@pytest.fixture
def arm(tmp_path):
    """Return an arm of the shipped meshes, copied."""
    shutil.copy(models_directory() / "wam7.urdf", tmp_path)
    shutil.copytree(models_directory() / "meshes", tmp_path / "meshes")
    return Arm(urdf=str(tmp_path / "wam7.urdf"))


@pytest.fixture
def mesh(tmp_path, arm):
    return tmp_path / "meshes" / "base_aluminium.obj"


def test_shipped_meshes_are_whole(arm):
    check_meshes(Arm())
    check_meshes(arm)


@pytest.mark.parametrize(
    "faces",
    ["f 1//1 2//1 3//1", "f -3//-1 -2//-1 -1//-1", "o a\ng b\ns off\n# of three points\nf 1//1 2//1 3//1\nl 1 2"],
    ids=["counted from the first", "counted back", "with other lines"],
)
def test_faces_of_points_that_are_there_can_be_drawn(arm, mesh, faces):
    mesh.write_text(f"{TRIANGLE}{faces}\n")
    CastScene(Scenario(arm=arm), None, light_bearing=0.0)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "it is empty"),
        (np.random.default_rng(0).bytes(20_000), "it has no faces"),
        (b"\0" * 1_000_000, "it has no faces"),
        ("v 0 0 0\n", "it has no faces"),
        (f"{TRIANGLE}f 1 2 9\n", "line 5, 'f 1 2 9': there is no 9 among 3"),
        (f"{TRIANGLE}f 1 2 999999999\n", "line 5, 'f 1 2 999999999': there is no 999999999 among 3"),
        (f"{TRIANGLE}f 1//1 2//1 3//2\n", "line 5, 'f 1//1 2//1 3//2': there is no 2 among 1"),
        (f"{TRIANGLE}f 1 2 -4\n", "line 5, 'f 1 2 -4': there is no -4 among 3"),
        (f"{TRIANGLE}f 0 1 2\n", "line 5, 'f 0 1 2': there is no 0 among 3"),
        (f"{TRIANGLE}f 1 2 x\n", "line 5, 'f 1 2 x': invalid literal"),
        (f"v nan 0 0\n{TRIANGLE}f 1 2 3\n", "line 1, 'v nan 0 0': a number is not finite"),
        (f"{TRIANGLE}f 1 2 3\n", "normals"),
    ],
)
def test_a_broken_mesh_is_one_line_that_names_it_and_what_is_not_drawn_needs_none(arm, mesh, content, reason):
    mesh.write_bytes(content if isinstance(content, bytes) else content.encode())
    scenario = Scenario(arm=arm)
    with pytest.raises(InputError) as error:
        CastScene(scenario, None, light_bearing=0.0)
    line = str(error.value)
    assert f"the mesh {mesh} cannot be drawn: " in line
    assert reason in line
    assert line.endswith("; mend the file, or remove its <visual>")
    assert CastScene(scenario, None).arm_points().shape == (56, 3)


@pytest.mark.parametrize("kind", ["directory", "pipe", "gigabytes"])
def test_what_is_no_file_of_a_sane_size_is_not_read(arm, mesh, kind):
    scenario = Scenario(arm=arm)
    mesh.unlink()
    if kind == "directory":
        mesh.mkdir()
    elif kind == "pipe":
        os.mkfifo(mesh)
    else:
        mesh.touch()
        os.truncate(mesh, 4 * 1024**3)
    expected = {"directory": "is a directory", "pipe": "not a regular file", "gigabytes": f"larger than {LARGEST_MESH}"}
    with pytest.raises(InputError, match=expected[kind]):
        CastScene(scenario, None, light_bearing=0.0)


@pytest.mark.parametrize("content", ["", "[", "[]", "{}", '{"meshes": []}', "[" * 100_000])
def test_a_gltf_has_meshes(tmp_path, arm, content):
    urdf = tmp_path / "wam7.urdf"
    urdf.write_text(urdf.read_text().replace("base_aluminium.obj", "base.gltf"))
    (tmp_path / "meshes" / "base.gltf").write_text(content)
    with pytest.raises(InputError, match=r"base\.gltf cannot be drawn"):
        check_meshes(arm)


def test_other_errors_stay_what_they_are(arm):
    with pytest.raises(RuntimeError, match=r"^of something else$"), drawn_meshes(arm):
        raise RuntimeError("of something else")
