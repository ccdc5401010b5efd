"""Write `wam7.urdf` and its visual meshes from the parameter sheet and the table of shells below.

    python models/make_wam7.py

Every dynamic number of the arm comes from `wam7_parameters.csv` and is copied as text, never through a float.
Only looks are decided here: what stands in `SHELLS` has no influence on the dynamics.
"""

import csv
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

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


Disc = tuple[float, float, float]
Rows = list[tuple[float, list[Disc]]]


@dataclass(frozen=True)
class Shell:
    """One smooth closed surface: a stack of outlines, each the convex hull of a few discs.

    Attributes
    ----------
    link, material
        What it is fixed to, and its colour: a key of `MATERIALS`.
    rows
        Each row is (height, discs) with discs [(u, v, radius), ...] in m, as many in every row. One disc
        makes a turned part, four a rounded box, two a link with round ends. Outlines between the rows are
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
    rows: Rows
    fillet: float = 0.004
    axis: str = "z"
    segments: int = 28


def turned(*profile: tuple[float, float], at: tuple[float, float] = (0.0, 0.0)) -> Rows:
    """Rows of a turned part: (height, radius) pairs about an axis through `at`."""
    return [(height, [(*at, radius)]) for height, radius in profile]


def box(
    low: float, high: float, half_u: float, half_v: float, radius: float, at: tuple[float, float] = (0.0, 0.0)
) -> Rows:
    """Rows of a box with corners of a radius, between two heights."""
    return [(height, corners(half_u, half_v, radius, at)) for height in (low, high)]


def corners(half_u: float, half_v: float, radius: float, at: tuple[float, float] = (0.0, 0.0)) -> list[Disc]:
    """Return the four discs whose hull is a rounded rectangle."""
    u, v = half_u - radius, half_v - radius
    return [(at[0] + a * u, at[1] + b * v, radius) for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]


def plate(low: float, high: float, *discs: Disc) -> Rows:
    """Rows of a plate between two heights, its outline the hull of discs."""
    return [(low, list(discs)), (high, list(discs))]


def both_sides(shell: Shell) -> list[Shell]:
    """Return the shell (heights along y) and its mirror image in the xz plane."""
    mirrored = [(-height, discs) for height, discs in reversed(shell.rows)]
    return [shell, Shell(shell.link, shell.material, mirrored, shell.fillet, shell.axis, shell.segments)]


SHELLS: list[Shell] = [
    # base: mounting plate, casting, the fixed ring of the yaw bearing, connectors at the back
    Shell("base", "aluminium", box(0.0, 0.018, 0.130, 0.130, 0.025), segments=24),
    *(
        Shell("base", "graphite", turned((0.018, 0.008), (0.025, 0.008), at=(x, y)), 0.001, "z", 12)
        for x in (-0.114, 0.114)
        for y in (-0.114, 0.114)
    ),
    Shell(
        "base",
        "white",
        [
            (0.018, corners(0.112, 0.112, 0.040)),
            (0.070, corners(0.106, 0.106, 0.070)),
            (0.102, corners(0.103, 0.103, 0.102)),
        ],
        fillet=0.010,
    ),
    Shell("base", "graphite", turned((0.102, 0.095), (0.118, 0.095)), fillet=0.002),
    Shell("base", "graphite", box(-0.128, -0.100, 0.055, 0.020, 0.006, at=(0.0, 0.046)), axis="x", segments=16),
    # link 1: the yaw housing, the shoulder's fork with the covers of the differential, two motors at the back
    Shell(
        "link1",
        "white",
        [
            (-0.230, corners(0.104, 0.104, 0.103)),
            (-0.195, corners(0.110, 0.122, 0.075)),
            (-0.120, corners(0.100, 0.127, 0.050)),
            (-0.090, corners(0.078, 0.127, 0.040)),
        ],
        fillet=0.015,
    ),
    *both_sides(
        Shell(
            "link1",
            "white",
            plate(0.091, 0.130, (0.0, 0.0, 0.082), (0.036, -0.120, 0.058), (-0.036, -0.120, 0.058)),
            fillet=0.012,
            axis="y",
        )
    ),
    *both_sides(Shell("link1", "graphite", turned((0.129, 0.068), (0.138, 0.064)), axis="y")),
    *both_sides(Shell("link1", "aluminium", turned((0.137, 0.022), (0.142, 0.022)), 0.002, "y", 20)),
    *(
        Shell("link1", "graphite", turned((-0.205, 0.036), (-0.105, 0.036), at=(-0.108, y)), 0.006, "z", 24)
        for y in (-0.052, 0.052)
    ),
    # link 2: the drum of the shoulder's differential, up to the bearing of joint 3
    Shell("link2", "graphite", turned((-0.088, 0.066), (0.088, 0.066)), axis="y"),
    Shell("link2", "graphite", turned((-0.055, 0.045), (-0.025, 0.074), (0.055, 0.076), (0.098, 0.064)), fillet=0.018),
    Shell("link2", "aluminium", turned((0.096, 0.059), (0.108, 0.059)), fillet=0.002),
    # link 3: the upper arm's tube, which broadens to the fork that holds the elbow's axis 45 mm ahead of it
    Shell("link3", "white", turned((0.109, 0.058), (0.150, 0.057), (0.190, 0.0445), (0.400, 0.0435)), 0.012),
    Shell(
        "link3",
        "white",
        [
            (0.345, corners(0.0440, 0.0440, 0.0435)),
            (0.425, corners(0.0445, 0.0640, 0.0360)),
            (0.490, corners(0.0420, 0.0640, 0.0250)),
        ],
        fillet=0.008,
    ),
    *both_sides(Shell("link3", "white", plate(0.047, 0.066, (0.045, 0.55, 0.046), (0.003, 0.455, 0.040)), 0.006, "y")),
    *both_sides(Shell("link3", "graphite", turned((0.065, 0.036), (0.072, 0.033), at=(0.045, 0.55)), 0.003, "y", 24)),
    *both_sides(Shell("link3", "aluminium", turned((0.071, 0.012), (0.075, 0.012), at=(0.045, 0.55)), 0.002, "y", 16)),
    # link 4: the elbow's drum, its web back to the arm's centre line, the forearm
    Shell("link4", "graphite", turned((-0.046, 0.042), (0.046, 0.042)), axis="y"),
    Shell("link4", "graphite", plate(-0.040, 0.040, (0.0, 0.0, 0.040), (-0.045, 0.040, 0.038)), 0.006, "y", 24),
    Shell(
        "link4",
        "white",
        turned((0.018, 0.041), (0.034, 0.046), (0.125, 0.045), (0.195, 0.036), (0.243, 0.035), at=(-0.045, 0)),
        fillet=0.008,
    ),
    Shell("link4", "aluminium", turned((0.242, 0.031), (0.251, 0.031), at=(-0.045, 0)), 0.002, "z", 24),
    # link 5: the wrist's fork
    Shell("link5", "graphite", turned((0.251, 0.034), (0.268, 0.034)), 0.004, "z", 24),
    *both_sides(Shell("link5", "graphite", plate(0.029, 0.039, (0, 0.300, 0.024), (0, 0.264, 0.027)), 0.003, "y", 24)),
    *both_sides(Shell("link5", "aluminium", turned((0.038, 0.016), (0.042, 0.016), at=(0, 0.3)), 0.002, "y", 16)),
    # link 6: the drum of the wrist's differential, the bearing and the motor of joint 7
    Shell("link6", "black", turned((-0.029, 0.025), (0.029, 0.025)), 0.003, "y", 24),
    Shell("link6", "graphite", turned((0.000, 0.023), (0.018, 0.029), (0.045, 0.029)), 0.005, "z", 24),
    Shell("link6", "black", turned((-0.028, 0.013), (0.028, 0.013), at=(-0.037, 0.033)), 0.003, "x", 20),
    # link 7 and the tool plate
    Shell("link7", "black", turned((0.045, 0.024), (0.055, 0.024)), 0.002, "z", 24),
    Shell("tool_plate", "aluminium", turned((-0.006, 0.036), (0.000, 0.036)), 0.0015, "z", 28),
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
        steps = np.linspace(0.0, 1.0, n + 1)
        out += [(1 - t) ** 2 * ends[0] + 2 * t * (1 - t) * corner + t**2 * ends[1] for t in steps]
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
        reach = direction @ discs[:, :2].T + discs[:, 2]
        farthest = np.argmax(reach - 1e-9 * np.arange(len(discs)), axis=1)  # of equals, the first
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
    total /= np.linalg.norm(total, axis=1, keepdims=True)
    return total


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
    robot = ET.Element("robot", {"name": "wam7", "xmlns:drake": "https://drake.mit.edu"})
    robot.append(ET.Comment(" Written by make_wam7.py from wam7_parameters.csv: change those. "))
    for name, rgba in MATERIALS.items():
        material = ET.SubElement(robot, "material", name=name)
        ET.SubElement(material, "color", rgba=rgba)

    add_link(robot, "base")
    for row in sheet:
        add_link(robot, row["name"], row)
        add_joint(robot, row)
    for row in sheet:
        if row["joint_type"] == "revolute":
            add_motor(robot, row)

    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def add_link(robot: ET.Element, name: str, row: dict[str, str] | None = None) -> None:
    """Add a link: its inertia if the sheet has one, and its meshes."""
    link = ET.SubElement(robot, "link", name=name)
    if row and float(row["mass"]) > 0:
        inertial = ET.SubElement(link, "inertial")
        ET.SubElement(inertial, "origin", xyz=join(row, "com_x", "com_y", "com_z"), rpy="0 0 0")
        ET.SubElement(inertial, "mass", value=row["mass"])
        tensor = {element: row[element] for element in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
        ET.SubElement(inertial, "inertia", tensor)
    for (owner, material), file in mesh_files().items():
        if owner == name:
            visual = ET.SubElement(link, "visual", name=material)
            geometry = ET.SubElement(visual, "geometry")
            ET.SubElement(geometry, "mesh", filename=file)
            ET.SubElement(visual, "material", name=material)


def add_joint(robot: ET.Element, row: dict[str, str]) -> None:
    """Add the joint that carries a link."""
    joint = ET.SubElement(robot, "joint", name=row["joint"], type=row["joint_type"])
    ET.SubElement(joint, "parent", link=row["parent"])
    ET.SubElement(joint, "child", link=row["name"])
    ET.SubElement(
        joint,
        "origin",
        xyz=join(row, "origin_x", "origin_y", "origin_z"),
        rpy=join(row, "origin_roll", "origin_pitch", "origin_yaw"),
    )
    if row["joint_type"] != "revolute":
        return
    ET.SubElement(joint, "axis", xyz=join(row, "axis_x", "axis_y", "axis_z"))
    limits = {name: row[name] for name in ("lower", "upper", "effort", "velocity")}
    ET.SubElement(joint, "limit", limits)
    ET.SubElement(joint, "dynamics", damping=row["damping"], friction=row["coulomb"])


def add_motor(robot: ET.Element, row: dict[str, str]) -> None:
    """Add the motor of a joint, with the inertia of its rotor before the gears."""
    name = f"{row['joint']}_motor"
    transmission = ET.SubElement(robot, "transmission", name=name)
    ET.SubElement(transmission, "type").text = "transmission_interface/SimpleTransmission"
    ET.SubElement(transmission, "joint", name=row["joint"])
    actuator = ET.SubElement(transmission, "actuator", name=name)
    ET.SubElement(actuator, "drake:rotor_inertia", value=row["rotor_inertia"])
    ET.SubElement(actuator, "drake:gear_ratio", value=row["gear_ratio"])


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
