"""One look for all pictures: the style sheet, a colour for each stage, dark to light to read in grey, and the plain names."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from matplotlib import rc_context, rc_params_from_file, rcParamsDefault

from wam_cast.motion.stages import Stage
from wam_cast.simulation.outcome import Status

Color = tuple[float, float, float]

STAGE_COLORS: dict[Stage, Color] = {
    Stage.TURN: (0.10, 0.10, 0.12),
    Stage.MOVE: (0.23, 0.06, 0.36),
    Stage.WAIT: (0.18, 0.36, 0.58),
    Stage.DROP: (0.05, 0.58, 0.51),
    Stage.HOLD: (0.42, 0.76, 0.33),
    Stage.RETURN: (0.68, 0.69, 0.71),
}
"""Red, green, blue of each stage, each in [0, 1]; every stage is lighter than the one before it."""

INK: Color = (0.15, 0.16, 0.18)
"""Of text and thin lines."""

PAPER: Color = (0.94, 0.955, 0.97)
"""Of the background behind a rendered scene."""

STYLE_SHEET = Path(__file__).parent / "wam_cast.mplstyle"
"""Of figures that are printed 16 cm wide, and of how all pictures are stored."""

# Without `matplotlib.style`, which reads all style sheets that a user has, and fails if one cannot be read.
_DEFAULTS: dict[Any, Any] = {name: rcParamsDefault[name] for name in rcParamsDefault if name != "backend"}


def figure_style() -> AbstractContextManager[None]:
    """Return a context in which figures are made in the style of `STYLE_SHEET`, whatever the user's settings are."""
    return rc_context(_DEFAULTS | dict(rc_params_from_file(STYLE_SHEET, use_default_template=False)))


def picture_style() -> AbstractContextManager[None]:
    """Return a context in which pictures of casts are made in matplotlib's own style, whatever the user's settings are."""
    return rc_context(_DEFAULTS)


def storing_style() -> AbstractContextManager[None]:
    """Return a context in which figures of any style are stored as `STYLE_SHEET` says: with their fonts, text as text."""
    sheet = rc_params_from_file(STYLE_SHEET, use_default_template=False)
    return rc_context({name: value for name, value in sheet.items() if name.startswith(("pdf.", "svg."))})


def stage_name(stage: Stage) -> str:
    """Return the stage's name as a reader sees it, such as `move`."""
    return stage.name.lower()


def status_name(status: Status) -> str:
    """Return the status as a reader sees it, such as `rim bounce`."""
    return status.value.replace("_", " ")
