"""Panel: Meshcat's sliders and buttons and a caption in its page, and what its readers did with them.

`ipywidgets` would need a notebook, which `wam-cast show` has not. Meshcat has no text; but a control's name is shown as HTML,
wherever its own style puts it. So the caption is a button's name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from matplotlib.colors import to_hex
from pydrake.geometry import Meshcat

from wam_cast.visualization.style import INK, PAPER, Color
from wam_cast.visualization.viewer import FIELD_OF_VIEW

WIDE, NARROW = 1000, 560
"""Of windows [pixels]: below the first the caption stands below the scene, below the second the controls take all of the width."""

CAPTION_STYLE = (
    "position:fixed; left:0; top:0; width:21em; padding:12px 16px; font:13px/1.45 sans-serif; white-space:normal; "
    f"text-shadow:none; color:{to_hex(INK)}; background:{to_hex(PAPER)}b0; pointer-events:none"
)

PAGE_STYLE = (
    # Drake's page says nothing of phones, which then show it as a page for desks.
    '<meta name="viewport" content="width=device-width, initial-scale=1">'
    "<style>"
    ".dg.main > ul:not(.closed) {max-height:calc(100vh - 22px); overflow-y:auto} "  # down to the button that closes it
    # The panel's own controls come first, then those of the replay, then Meshcat's others.
    ".dg.main > ul {display:flex; flex-direction:column} "
    ".dg.main > ul > li {flex-shrink:0} "
    ".dg.main > ul > li.folder {order:2} "
    ".dg.main > ul > li.folder:nth-child(3) {order:1} "
    # The caption's row in the panel is empty.
    ".dg .cr.function:has(.caption) {height:0; border:0} "
    ".dg .property-name {letter-spacing:-0.2px} "
    f".dg .caption {{{CAPTION_STYLE}}} "
    ".dg .caption .legend {margin-top:1.2em} "
    f"@media (max-width:{WIDE}px) {{"
    ".dg .caption {top:auto; bottom:0; width:100%; max-height:34vh; overflow:auto; box-sizing:border-box; pointer-events:auto; "
    f"font-size:12px; padding:6px 12px; background:{to_hex(PAPER)}e0}} "
    ".dg .caption .legend {margin-top:0.3em} "
    ".dg .caption .legend div {display:inline-block; margin-right:1em}} "
    f"@media (min-width:{NARROW}px) {{.dg.main, .dg.main .close-button {{width:290px !important}}}} "
    f"@media (max-width:{NARROW}px) {{"
    ".dg.main, .dg.main .close-button {width:100vw !important; margin-right:0} "
    ".dg.main > ul:not(.closed) {max-height:45vh} "
    ".dg.main > ul > li.folder {display:none}}"
    "</style>"
)

PAGE_SCRIPT = (
    # As much of the scene as fits, whatever the shape of the window: the camera was placed for a square one.
    "if (!window.fitted) {window.fitted = true; const fit = () => {const c = viewer.camera; if (c.isPerspectiveCamera) {"
    f"const f = 2 * Math.atan({math.tan(FIELD_OF_VIEW / 2):.6f} * Math.max(1, 1 / c.aspect)) * 180 / Math.PI; "
    "if (Math.abs(c.fov - f) > 1e-3) {c.fov = f; viewer.set_dirty()}} requestAnimationFrame(fit)}; fit()}"
)
"""Meshcat runs none of ours; an image that cannot be loaded does."""


@dataclass(frozen=True)
class Slider:
    """A slider: its name on the page, its ends and its step in the page's unit, and how many of that unit are one SI unit."""

    name: str
    lowest: float
    highest: float
    step: float
    scale: float = 1.0


class Panel:
    """Controls of the page of a `meshcat`; with several browsers open they are the same in all.

    The `sliders`, by key, come from the top and start at their lowest value. Below them are the `buttons`: their names, and the
    key on the keyboard, such as `KeyC`, that presses each of them.
    """

    def __init__(self, meshcat: Meshcat, sliders: Mapping[str, Slider], buttons: Mapping[str, str]) -> None:
        self._meshcat = meshcat
        self._sliders = dict(sliders)
        self._known = {
            key: meshcat.AddSlider(one.name, one.lowest, one.highest, one.step, one.lowest)
            for key, one in sliders.items()
        }
        for name, keycode in buttons.items():
            meshcat.AddButton(name, keycode)
        self._clicks = dict.fromkeys(buttons, 0)
        self._caption = ""

    def moved(self) -> dict[str, float]:
        """Return the sliders that were moved since the last call or `show`: their values in SI units, by key."""
        moved = {}
        for key, slider in self._sliders.items():
            value = self._meshcat.GetSliderValue(slider.name)
            # A browser may send back what it was told, rounded its own way.
            if abs(value - self._known[key]) > slider.step / 2:
                self._known[key] = value
                moved[key] = value / slider.scale
        return moved

    def pressed(self) -> list[str]:
        """Return the names of the buttons that were pressed since the last call, however often."""
        clicks = {name: self._meshcat.GetButtonClicks(name) for name in self._clicks}
        pressed = [name for name, number in clicks.items() if number > self._clicks[name]]
        self._clicks = clicks
        return pressed

    def show(self, values: Mapping[str, float]) -> None:
        """Set the sliders to `values` in SI units, rounded to their steps."""
        for key, value in values.items():
            slider = self._sliders[key]
            target = value * slider.scale
            if abs(target - self._known[key]) > slider.step / 2:
                self._known[key] = self._meshcat.SetSliderValue(slider.name, target)

    @property
    def caption(self) -> str:
        """The HTML in the page's corner."""
        return self._caption

    @caption.setter
    def caption(self, html: str) -> None:
        if html == self._caption:
            return
        before, self._caption = self._caption, html
        # The new one first: so there is no moment without.
        self._meshcat.AddButton(_as_name(html))
        if before:
            self._meshcat.DeleteButton(_as_name(before))


def swatch(color: Color, sign: str, words: str) -> str:
    """Return HTML that says what a colour means, on one line."""
    return f'<span style="white-space:nowrap"><span style="color:{to_hex(color)}">{sign}</span> {words}</span>'


def _as_name(html: str) -> str:
    """Return a button's name that shows `html`; the page takes it for a JavaScript string between single quotes."""
    script = f'<img alt="" hidden src="data:," onerror="{PAGE_SCRIPT}">'
    name = f'{PAGE_STYLE}{script}<div class="caption">{html}</div>'
    return name.replace("\\", "&#92;").replace("'", "&#39;").replace("\n", " ")
