"""The meshes that an arm is drawn with: looked through before Drake reads them, which ends Python over some that are broken."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree as ET

from wam_cast.arm.arm_model import arm_model
from wam_cast.errors import InputError, quoted
from wam_cast.scenario_parts import Arm
from wam_cast.text_file import read_bytes

LARGEST_MESH = 50_000_000
"""Bytes: half a million triangles and more."""


@contextmanager
def drawn_meshes(arm: Arm) -> Iterator[None]:
    """Check an arm's meshes, and let Drake read them within: what it refuses is an `.InputError` that names the mesh, too."""
    check_meshes(arm)
    try:
        yield
    except RuntimeError as error:
        if refused := [path for path in mesh_files(arm) if str(path) in str(error)]:
            raise _unusable(refused[0], str(error).replace(str(refused[0]), "").strip(" :;.")) from None
        raise


def check_meshes(arm: Arm) -> None:
    """Raise `.InputError` if a mesh that an arm is drawn with is none."""
    for path in mesh_files(arm):
        try:
            _check(path)
        except OSError as error:
            raise _unusable(path, (error.strerror or str(error)).lower()) from None
        except (ValueError, RecursionError) as error:
            raise _unusable(path, str(error)) from None


def mesh_files(arm: Arm) -> list[Path]:
    """Return the files of the meshes that an arm is drawn with."""
    meshes = ET.fromstring(arm_model(arm).urdf).iterfind("link/visual/geometry/mesh")
    return [Path(mesh.get("filename", "").removeprefix("file://")) for mesh in meshes]


def _unusable(path: Path, reason: str) -> InputError:
    return InputError(f"arm.urdf: the mesh {path} cannot be drawn: {reason}; mend the file, or remove its <visual>")


def _check(path: Path) -> None:
    """Raise `ValueError` or `OSError` if a file is no mesh of its format; of VTK's that is left to Drake."""
    content = read_bytes(path, LARGEST_MESH)
    suffix = path.suffix.lower()
    if not content:
        raise ValueError("it is empty")
    if suffix == ".gltf":
        values = json.loads(content)
        if not isinstance(values, dict) or not values.get("meshes"):
            raise ValueError("it has no meshes")
    if suffix == ".obj":
        _check_obj(content)


def _check_obj(content: bytes) -> None:
    """Raise `ValueError` unless a Wavefront OBJ has faces, of points, texture points and normals that are there."""
    known, n_faces = {b"v": 0, b"vt": 0, b"vn": 0}, 0
    for number, line in enumerate(content.splitlines(), 1):
        kind, *words = line.split() or [b""]
        try:
            if kind in known:
                known[kind] += 1
                _check_numbers(words)
            elif kind == b"f":
                n_faces += 1
                _check_face(words, known)
        except ValueError as error:
            raise ValueError(f"line {number}, {quoted(line.decode(errors='replace'))}: {error}") from None
    if n_faces == 0:
        raise ValueError("it has no faces")


def _check_numbers(words: list[bytes]) -> None:
    if not all(math.isfinite(float(word)) for word in words):
        raise ValueError("a number is not finite")


def _check_face(words: list[bytes], known: dict[bytes, int]) -> None:
    for word in words:
        for index, n in zip(word.split(b"/"), known.values(), strict=False):
            if index and not (1 <= int(index) <= n or -n <= int(index) <= -1):
                raise ValueError(f"there is no {int(index)} among {n}")
