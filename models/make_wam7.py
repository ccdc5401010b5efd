"""Write `wam7.urdf` and its visual meshes from the parameter sheet and the table of shells below.

    python models/make_wam7.py

Every dynamic number of the arm comes from `wam7_parameters.csv` and is copied as text, never through a float.
Only looks are decided here: what stands in `SHELLS` has no influence on the dynamics.
"""

import csv
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

MODELS = Path(__file__).parent
SHEET = MODELS / "wam7_parameters.csv"
URDF = MODELS / "wam7.urdf"

MATERIALS = {
    "white": "0.93 0.93 0.91 1",
    "aluminium": "0.66 0.68 0.70 1",
    "graphite": "0.17 0.18 0.20 1",
    "black": "0.05 0.05 0.06 1",
}


# ---------------------------------------------------------------- the looks


@dataclass(frozen=True)
class Shell:
    """One smooth closed surface: a stack of outlines, each the convex hull of a few discs.

    Attributes
    ----------
    link, material
        What it is fixed to, and its colour: a key of `MATERIALS`.
    rows
        Each row is (height, discs) with discs [(u, v, radius), ...] in m, as many in every row. One disc makes
        a turned part, four a rounded box, two a link with round ends. Outlines between the rows are
        interpolated, and the ends are closed flat.
    fillet
        How far [m] from each edge its rounding begins.
    axis
        The link axis along which heights run: "z" (u, v are x, y), "y" (x, z) or "x" (y, z).
    segments
        Points around an outline.
    """

    link: str
    material: str
    rows: list[tuple[float, list[tuple[float, float, float]]]]
    fillet: float = 0.004
    axis: str = "z"
    segments: int = 32


def turned(*profile: tuple[float, float], at: tuple[float, float] = (0.0, 0.0)):
    """Rows of a turned part: (height, radius) pairs about an axis through `at`."""
    return [(height, [(*at, radius)]) for height, radius in profile]


def box(low: float, high: float, half_u: float, half_v: float, radius: float, at=(0.0, 0.0)):
    """Rows of a box with corners of a radius, between two heights."""
    return [(height, corners(half_u, half_v, radius, at)) for height in (low, high)]


def corners(half_u: float, half_v: float, radius: float, at=(0.0, 0.0)):
    """Return the four discs whose hull is a rounded rectangle."""
    u, v = half_u - radius, half_v - radius
    return [(at[0] + a * u, at[1] + b * v, radius) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]


def plate(low: float, high: float, *discs: tuple[float, float, float]):
    """Rows of a plate between two heights, its outline the hull of discs."""
    return [(low, list(discs)), (high, list(discs))]


def both_sides(shell: Shell) -> list[Shell]:
    """Return the shell (heights along y) and its mirror image in the xz plane."""
    mirrored = [(-height, discs) for height, discs in reversed(shell.rows)]
    return [shell, Shell(shell.link, shell.material, mirrored, shell.fillet, shell.axis, shell.segments)]


SHELLS: list[Shell] = [
    # base: mounting plate, casting, the fixed ring of the yaw bearing, connectors at the back
    Shell("base", "aluminium", box(0.0, 0.018, 0.130, 0.130, 0.025)),
    Shell(
        "base",
        "white",
        [
            (0.018, corners(0.112, 0.112, 0.04)),
            (0.070, corners(0.106, 0.106, 0.07)),
            (0.102, corners(0.103, 0.103, 0.1)),
        ],
        fillet=0.012,
    ),
    Shell("base", "graphite", turned((0.102, 0.094), (0.114, 0.094)), fillet=0.002),
    Shell("base", "graphite", box(-0.134, -0.100, 0.055, 0.020, 0.006, at=(0.0, 0.046)), axis="x"),
]


# ---------------------------------------------------------------- the geometry of a shell


def rounded(rows: np.ndarray, fillet: float, n: int = 2) -> np.ndarray:
    """Replace every inner corner of a polyline of rows by a quadratic Bezier arc."""
    out = [rows[0]]
    for before, corner, after in zip(rows[:-2], rows[1:-1], rows[2:], strict=True):
        ends = []
        for other in (before, after):
            span = np.abs(other - corner).max()
            ends.append(corner + (other - corner) * min(fillet / span, 0.5))
        for t in np.linspace(0.0, 1.0, n + 1):
            out.append((1 - t) ** 2 * ends[0] + 2 * t * (1 - t) * corner + t**2 * ends[1])
    return np.array([*out, rows[-1]])


def surface(shell: Shell) -> tuple[np.ndarray, list[tuple[int, ...]]]:
    """Return vertices (n, 3) [m] in the link frame, and faces seen counter-clockwise from outside."""
    rows = np.array([[height, *np.ravel(discs)] for height, discs in shell.rows])
    caps = rows[[0, -1]].copy()
    caps[:, 3::3] = 0.0
    rows = rounded(np.vstack([caps[0], rows, caps[1]]), shell.fillet)

    angle = 2 * np.pi * np.arange(shell.segments) / shell.segments
    direction = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rings = []
    for row in rows[1:-1]:
        discs = row[1:].reshape(-1, 3)
        farthest = np.argmax(direction @ discs[:, :2].T + discs[:, 2] - 1e-9 * np.arange(len(discs)), axis=1)
        outline = discs[farthest, :2] + discs[farthest, 2:] * direction
        rings.append(np.column_stack([outline, np.full(shell.segments, row[0])]))
    poles = [np.append(ring[:, :2].mean(axis=0), ring[0, 2]) for ring in (rings[0], rings[-1])]
    vertices = np.vstack([*rings, *poles])

    m, last = shell.segments, len(rings) - 1
    around = [(j, (j + 1) % m) for j in range(m)]
    faces: list[tuple[int, ...]] = [
        (i * m + j, i * m + k, (i + 1) * m + k, (i + 1) * m + j) for i in range(last) for j, k in around
    ]
    faces += [(len(vertices) - 2, k, j) for j, k in around]
    faces += [(len(vertices) - 1, last * m + j, last * m + k) for j, k in around]

    order = {"z": [0, 1, 2], "y": [0, 2, 1], "x": [2, 0, 1]}[shell.axis]
    if shell.axis == "y":  # a mirror image: turn the faces round
        faces = [face[::-1] for face in faces]
    return vertices[:, order], faces


def normals(vertices: np.ndarray, faces: list[tuple[int, ...]]) -> np.ndarray:
    """Return smooth unit normals (n, 3): the mean of the adjoining faces' normals, weighted by area."""
    total = np.zeros_like(vertices)
    for face in faces:
        corner = vertices[list(face)]
        diagonals = (corner[2] - corner[0], corner[-1] - corner[1])
        total[list(face)] += np.cross(*diagonals)
    return total / np.linalg.norm(total, axis=1, keepdims=True)


def obj_text(shells: list[Shell]) -> str:
    """Return the shells as one Wavefront OBJ file."""
    lines = ["# Written by make_wam7.py."]
    n_before = 1
    for shell in shells:
        vertices, faces = surface(shell)
        for tag, digits, table in (("v", 4, vertices), ("vn", 2, normals(vertices, faces))):
            table = np.round(table, digits) + 0.0  # + 0.0 turns -0 into 0
            lines += [f"{tag} " + " ".join(f"{x:.{digits}g}" if x else "0" for x in row) for row in table]
        lines += ["f " + " ".join(f"{n_before + i}//{n_before + i}" for i in face) for face in faces]
        n_before += len(vertices)
    return "\n".join(lines) + "\n"


# ---------------------------------------------------------------- the URDF


def urdf_text(sheet: list[dict[str, str]]) -> str:
    """Return the URDF of the arm whose links are the sheet's rows."""
    robot = ElementTree.Element("robot", {"name": "wam7", "xmlns:drake": "https://drake.mit.edu"})
    robot.append(ElementTree.Comment(" Written by make_wam7.py from wam7_parameters.csv: change those. "))
    for name, rgba in MATERIALS.items():
        material = ElementTree.SubElement(robot, "material", name=name)
        ElementTree.SubElement(material, "color", rgba=rgba)

    add_link(robot, "base")
    for row in sheet:
        add_link(robot, row["name"], row)
        add_joint(robot, row)
    for row in sheet:
        if row["joint_type"] == "revolute":
            add_motor(robot, row)

    ElementTree.indent(robot)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(robot, encoding="unicode") + "\n"


def add_link(robot: ElementTree.Element, name: str, row: dict[str, str] | None = None) -> None:
    """Add a link: its inertia if the sheet has one, and its meshes."""
    link = ElementTree.SubElement(robot, "link", name=name)
    if row and float(row["mass"]) > 0:
        inertial = ElementTree.SubElement(link, "inertial")
        ElementTree.SubElement(inertial, "origin", xyz=join(row, "com_x", "com_y", "com_z"), rpy="0 0 0")
        ElementTree.SubElement(inertial, "mass", value=row["mass"])
        tensor = {element: row[element] for element in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
        ElementTree.SubElement(inertial, "inertia", tensor)
    for (owner, material), file in mesh_files().items():
        if owner == name:
            visual = ElementTree.SubElement(link, "visual", name=material)
            geometry = ElementTree.SubElement(visual, "geometry")
            ElementTree.SubElement(geometry, "mesh", filename=file)
            ElementTree.SubElement(visual, "material", name=material)


def add_joint(robot: ElementTree.Element, row: dict[str, str]) -> None:
    """Add the joint that carries a link."""
    joint = ElementTree.SubElement(robot, "joint", name=row["joint"], type=row["joint_type"])
    ElementTree.SubElement(joint, "parent", link=row["parent"])
    ElementTree.SubElement(joint, "child", link=row["name"])
    ElementTree.SubElement(
        joint,
        "origin",
        xyz=join(row, "origin_x", "origin_y", "origin_z"),
        rpy=join(row, "origin_roll", "origin_pitch", "origin_yaw"),
    )
    if row["joint_type"] != "revolute":
        return
    ElementTree.SubElement(joint, "axis", xyz=join(row, "axis_x", "axis_y", "axis_z"))
    limits = {name: row[name] for name in ("lower", "upper", "effort", "velocity")}
    ElementTree.SubElement(joint, "limit", limits)
    ElementTree.SubElement(joint, "dynamics", damping=row["damping"], friction=row["coulomb"])


def add_motor(robot: ElementTree.Element, row: dict[str, str]) -> None:
    """Add the motor of a joint, with the inertia of its rotor before the gears."""
    name = f"{row['joint']}_motor"
    transmission = ElementTree.SubElement(robot, "transmission", name=name)
    ElementTree.SubElement(transmission, "type").text = "transmission_interface/SimpleTransmission"
    ElementTree.SubElement(transmission, "joint", name=row["joint"])
    actuator = ElementTree.SubElement(transmission, "actuator", name=name)
    ElementTree.SubElement(actuator, "drake:rotor_inertia", value=row["rotor_inertia"])
    ElementTree.SubElement(actuator, "drake:gear_ratio", value=row["gear_ratio"])


def join(row: dict[str, str], *names: str) -> str:
    """Return cells of the sheet, separated by blanks."""
    return " ".join(row[name] for name in names)


# ---------------------------------------------------------------- the files


def read_sheet() -> list[dict[str, str]]:
    """Return the rows of the parameter sheet, cells as text."""
    with SHEET.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def mesh_files() -> dict[tuple[str, str], str]:
    """Return the mesh of each (link, material), its path relative to the URDF."""
    pairs = dict.fromkeys((shell.link, shell.material) for shell in SHELLS)
    return {(link, material): f"meshes/{link}_{material}.obj" for link, material in pairs}


def model_files() -> dict[str, str]:
    """Return the text of every generated file, by its path relative to the URDF."""
    texts = {URDF.name: urdf_text(read_sheet())}
    for (link, material), file in mesh_files().items():
        texts[file] = obj_text([s for s in SHELLS if (s.link, s.material) == (link, material)])
    return texts


def main() -> None:
    """Write every generated file beside this script."""
    (MODELS / "meshes").mkdir(exist_ok=True)
    for file, text in model_files().items():
        (MODELS / file).write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    main()
