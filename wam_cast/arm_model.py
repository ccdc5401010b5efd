"""The arm's model file, `models/wam7.urdf`: where it is, and what of it is needed without Drake."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from wam_cast.types import Array


def models_directory() -> Path:
    """Return the folder of the robot's models: inside the package once installed, beside it in a checkout."""
    package = Path(__file__).parent
    installed = package / "models"
    return installed if installed.is_dir() else package.parent / "models"


def arm_model_path() -> Path:
    """Return the path of the arm's URDF."""
    return models_directory() / "wam7.urdf"


def arm_coulomb_friction() -> Array:
    """Return the joints' Coulomb friction [N m], shape (7,), which Drake's parser does not read."""
    joints = ET.parse(arm_model_path()).getroot().iterfind("joint[@type='revolute']/dynamics")
    return np.array([float(joint.attrib["friction"]) for joint in joints])


def bearing_limits() -> tuple[float, float]:
    """Return the smallest and the largest bearing [rad] that joint 1, which turns by the bearing's negative, allows."""
    limit = ET.parse(arm_model_path()).getroot().find("joint[@type='revolute']/limit")
    assert limit is not None
    return -float(limit.attrib["upper"]), -float(limit.attrib["lower"])


@cache
def shoulder_depth() -> float:
    """Return how far below the mounting face the axes of joints 1 to 3 meet [m]."""
    origin = ET.parse(arm_model_path()).getroot().find("joint[@type='revolute']/origin")
    assert origin is not None
    return float(origin.attrib["xyz"].split()[2])


def physical_urdf() -> str:
    """Return the arm's model without what is only for the eye, in canonical form."""
    root = ET.parse(arm_model_path()).getroot()
    for link in root.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    for material in root.findall("material"):
        root.remove(material)
    return ET.canonicalize(ET.tostring(root, encoding="unicode"), strip_text=True)
