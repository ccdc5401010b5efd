"""The picture of a preview: the scenario from the side."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from pydrake.multibody.plant import MultibodyPlant

from wam_cast.arm.posture import starting_posture
from wam_cast.errors import InputError
from wam_cast.experiments.preview import Preview
from wam_cast.experiments.preview_verdict import Fate
from wam_cast.robot.plant import make_arm_plant
from wam_cast.scenario import Scenario
from wam_cast.types import Array
from wam_cast.visualization.figures.preview_figures import SideOfScenario, draw_scenario
from wam_cast.visualization.picture_files import write_figure
from wam_cast.visualization.style import figure_style

SIZE = (7.2, 4.4)
"""Width and height [in]."""

DPI = 180
"""Of a PNG."""

JOINTS = ("base", "link2", "link4", "link6", "tool_plate")
"""Where the arm bends, by the names of frames whose origins lie there."""


def write_preview_picture(preview: Preview, path: str | Path) -> None:
    """Write the picture of a preview to `path`, as PNG, PDF or SVG by its suffix.

    Raises
    ------
    InputError
        If the suffix is another one, or the file cannot be written; then nothing is.
    """
    with figure_style():
        figure = draw_preview_picture(preview)
        write_figure(figure, path, dpi=DPI)


def draw_preview_picture(preview: Preview) -> Figure:
    """Draw the scenario with what the preview found."""
    figure = Figure(figsize=SIZE, layout="constrained")
    draw_scenario(figure.subplots(), _side_of(preview))
    return figure


def _side_of(preview: Preview) -> SideOfScenario:
    middle = [float(np.mean(ends)) for ends in (preview.cups, preview.landings, preview.hand_radii)]
    return SideOfScenario(
        scenario=preview.scenario,
        postures=_postures(preview.scenario),
        hand_radii=preview.hand_radii,
        hand_heights=preview.hand_heights,
        landings=preview.casts["landing_along"].to_numpy(),
        is_good=(preview.casts["fate"] == Fate.GOOD).to_numpy(),
        cups=preview.cups,
        cup=next(value for value in middle if np.isfinite(value)),
    )


def _postures(scenario: Scenario) -> dict[str, Array]:
    """Return the arm's joints in the casting plane [m] at the start and, if the wrist reaches there as it is, farthest down."""
    plant, motion = make_arm_plant(scenario), scenario.motion
    lowest = {
        "start_radius": motion.start_radius + scenario.bounds.distance[1],
        "start_height": motion.start_height - motion.drop_distance,
        "drop_distance": 0.0,
    }
    nowhere = scenario.bounds.model_copy(update={"distance": (0.0, 0.0)})
    down = scenario.model_copy(update={"motion": motion.model_copy(update=lowest), "bounds": nowhere})
    found = {"arm at the start": _joints(plant, starting_posture(scenario))}
    with suppress(InputError):
        found["arm farthest down"] = _joints(plant, starting_posture(down))
    return found


def _joints(plant: MultibodyPlant, q: Array) -> Array:
    """Return where the arm bends, shape (n, 2): distance from the base axis and height [m]."""
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    places = [plant.GetFrameByName(name).CalcPoseInWorld(context).translation() for name in JOINTS]
    return np.array(places)[:, [0, 2]]
