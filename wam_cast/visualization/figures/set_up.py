"""Figure 2 of the paper: the set-up, rendered, with its parts named and measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from wam_cast.robot.plant import make_arm_plant, starting_posture
from wam_cast.scenario import Scenario
from wam_cast.types import Array
from wam_cast.visualization.camera import Camera, view_rotation
from wam_cast.visualization.recorded import CEILING_THICKNESS
from wam_cast.visualization.scene import CastScene, make_renderer
from wam_cast.visualization.style import INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes


PICTURE_SIZE = (1000, 1240)
"""Width and height of the rendered picture [pixels]."""

SHORT = 0.2
"""Of an upright dimension line, by the picture's height: what it says is longer than the line."""

TURN, ELEVATION = math.radians(8), math.radians(6)
"""Of the camera: see `view_rotation`."""

LEFT = ("ceiling mount", "WAM arm")
"""What is named at the picture's left; the rest is named at its right."""


@dataclass(frozen=True, eq=False)
class SetUpView:
    """A rendered picture of the set-up, and where in it things are.

    Attributes
    ----------
    image
        Red, green and blue, shape (height, width, 3), from 0 to 255.
    parts
        Column and row of each named part [pixels], shape (2,).
    dimensions
        By what they say, the ends of dimension lines [pixels], shape (2, 2).
    """

    image: NDArray[np.uint8]
    parts: dict[str, Array]
    dimensions: dict[str, Array]


def render_set_up(scenario: Scenario, cup: tuple[float, float]) -> SetUpView:
    """Render the arm in its starting posture, the ball hanging, and a cup at world (x, y) [m], off screen."""
    bearing = math.atan2(cup[1], cup[0])
    scene = CastScene(scenario, cup, renderers={"vtk": make_renderer(bearing)})
    scene.set_posture(starting_posture(make_arm_plant(scenario), scenario, bearing))
    parts = _parts(scenario, math.hypot(*cup), bearing) | {"WAM arm": scene.position("link2")}
    dimensions = _dimensions(scenario, math.hypot(*cup), bearing)
    mount = parts["ceiling mount"]
    room = [_in_world(along, 0.0, bearing) for along in (-0.34, math.hypot(*cup) + 0.1)]
    shown = [*dimensions.values(), mount, *room]
    camera = Camera.framing(np.vstack(shown), view_rotation(bearing, TURN, ELEVATION), PICTURE_SIZE)
    return SetUpView(
        scene.render(camera.to_drake("vtk")),
        {name: camera.project(point[None])[0] for name, point in parts.items()},
        {text: camera.project(ends) for text, ends in dimensions.items()},
    )


def _in_world(along: float, height: float, bearing: float, across: float = 0.0) -> Array:
    """Return the point [m], shape (3,), at a distance along the casting plane, across it to the left, and a height."""
    c, s = math.cos(bearing), math.sin(bearing)
    return np.array([c * along - s * across, s * along + c * across, height])


def _parts(scenario: Scenario, cup_distance: float, bearing: float) -> dict[str, Array]:
    """Return a point of each named part [m], shape (3,); the arm's depend on its posture and are not here."""
    radius, hand = scenario.motion.start_radius, scenario.motion.start_height
    places = {
        "ceiling mount": (0.0, scenario.arm.mount_height + CEILING_THICKNESS),
        "hand": (radius, hand),
        "string": (radius, hand - 0.15 * scenario.string.length),
        "ball": (radius, hand - scenario.string.length),
        "cup": (cup_distance, 0.7 * scenario.cup.rim_height),
    }
    return {name: _in_world(*place, bearing) for name, place in places.items()}


def _dimensions(scenario: Scenario, cup_distance: float, bearing: float) -> dict[str, Array]:
    """Return the ends of each dimension line [m], shape (2, 3), by what it says."""
    radius, hand = scenario.motion.start_radius, scenario.motion.start_height
    rim, ceiling, string = scenario.cup.rim_height, scenario.arm.mount_height, scenario.string.length
    behind, beside_string, beside_cup = -0.27, radius + 0.07, cup_distance - scenario.cup.outer_radius - 0.04
    spans = {
        f"ceiling {_m(ceiling)}": ((behind, 0.0), (behind, ceiling)),
        f"string {_m(string)}": ((beside_string, hand - string), (beside_string, hand)),
        f"hand {_m(hand)}": ((beside_string + 0.12, 0.0), (beside_string + 0.12, hand)),
        f"rim {_m(rim)}": ((beside_cup, 0.0), (beside_cup, rim)),
        f"cup {_m(cup_distance)} from the base axis": ((0.0, 0.0, -0.15), (cup_distance, 0.0, -0.15)),
    }
    return {
        text: np.array([_in_world(along, height, bearing, *across) for along, height, *across in ends])
        for text, ends in spans.items()
    }


def _m(length: float) -> str:
    return f"{round(length, 3):g} m"


def draw_set_up(axes: Axes, view: SetUpView) -> None:
    """Draw the picture with its parts named beside it, and dimension lines in it."""
    height, width = view.image.shape[:2]
    axes.imshow(view.image, interpolation="antialiased")
    for text, ends in view.dimensions.items():
        _draw_dimension(axes, text, ends)
    leader = {"arrowstyle": "-", "color": INK, "linewidth": 0.6, "shrinkB": 0}
    for name, point in view.parts.items():
        column, align = (-0.04 * width, "right") if name in LEFT else (1.04 * width, "left")
        label: Any = {"ha": align, "va": "center", "annotation_clip": False}
        axes.annotate(name, tuple(point), (column, point[1]), arrowprops=leader, **label)
        axes.plot(*point, "o", color=INK, markersize=2.5)
    axes.set_xlim(-0.5, width - 0.5)
    axes.set_ylim(height - 0.5, -0.5)
    axes.set_axis_off()


def _draw_dimension(axes: Axes, text: str, ends: Array) -> None:
    """Draw a line with a bar at each end, and what it says: below it if it lies, else at its left, along it if it is long."""
    bars = {
        "arrowstyle": "|-|,widthA=0.25,widthB=0.25",
        "color": INK,
        "linewidth": 0.7,
        "shrinkA": 0,
        "shrinkB": 0,
    }
    axes.annotate("", tuple(ends[0]), tuple(ends[1]), arrowprops=bars)
    across, up = np.abs(ends[1] - ends[0])
    is_long = up > SHORT * PICTURE_SIZE[1]
    upright: Any = {
        "xytext": (-2 if is_long else -5, 0),
        "ha": "right",
        "va": "center",
        "rotation": 90 * is_long,
    }
    lying: Any = {"xytext": (0, -4), "ha": "center", "va": "top"}
    halo = [withStroke(linewidth=2.5, foreground="white")]
    where = lying if across > up else upright
    axes.annotate(
        text,
        tuple(ends.mean(axis=0)),
        textcoords="offset points",
        fontsize="small",
        path_effects=halo,
        **where,
    )
