"""What the notebooks show and matplotlib does not: pages inside the page, pictures that follow sliders, and Meshcat's address."""

from __future__ import annotations

import html
from base64 import b64encode
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from pydrake.geometry import Meshcat

from wam_cast.errors import InputError
from wam_cast.simulation.recording import CastRecording
from wam_cast.visualization.replay import replay_page
from wam_cast.visualization.viewer import keep, open_meshcat


@dataclass(frozen=True)
class EmbeddedPage:
    """A web page that a notebook shows inside a cell's output, `height` pixels high.

    It is part of the output: it needs no server and no network, and goes along when the notebook is saved or rendered.
    """

    page: str
    height: int

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{html.escape(self.page)}" width="100%" height="{self.height}" '
            'style="border: 0" allowfullscreen></iframe>'
        )


def show_replay(recordings: CastRecording | Sequence[CastRecording], *, height: int = 480) -> EmbeddedPage:
    """Return the replay of one cast, or of several that followed each other, for a notebook to show, `height` pixels high."""
    return EmbeddedPage(replay_page(recordings), height)


def embed(meshcat: Meshcat, *, height: int = 480) -> EmbeddedPage:
    """Return what `meshcat` shows now, to be looked at from all sides; it does not change with the Meshcat any more."""
    return EmbeddedPage(meshcat.StaticHtml(), height)


@dataclass(frozen=True)
class Explorable:
    """Sliders above a picture that follows them, all `ipywidgets`; where there is no kernel to move them, the picture alone.

    `ipywidgets.interactive` leaves nothing in a page without a kernel.
    """

    sliders: tuple[Any, ...]
    picture: Any

    def _repr_mimebundle_(self, **_: Any) -> dict[str, Any]:
        from ipywidgets import VBox

        shown: dict[str, Any] = VBox([*self.sliders, self.picture])._repr_mimebundle_()
        return shown | {"image/png": b64encode(self.picture.value).decode()}


def explore(draw: Callable[..., Figure], **sliders: Any) -> Explorable:
    """Return the sliders and, below them, the picture that `draw` makes of their values, anew whenever one moves.

    The sliders are widgets with a value. `draw` takes these by name; the figure that it returns is closed once its picture is
    taken.
    """
    from ipywidgets import Image  # the package works without

    image = Image(format="png", layout={"align_self": "flex-start"})  # else as wide as the page

    def redraw(_: Any = None) -> None:
        figure, stored = draw(**{name: slider.value for name, slider in sliders.items()}), BytesIO()
        figure.savefig(stored, format="png", dpi="figure")
        plt.close(figure)  # lest the notebook show it too
        image.value = stored.getvalue()

    for slider in sliders.values():
        slider.observe(redraw, "value")
    redraw()
    return Explorable(tuple(sliders.values()), image)


def open_viewer() -> Meshcat | None:
    """Return a Meshcat and say where it is, or say that there is none and return none.

    Whether the reader's browser can reach it, only the reader can tell: a kernel may run on another machine.
    """
    try:
        meshcat = keep(open_meshcat())
    except InputError:
        print("No port could be opened for Meshcat: the pictures here show the same, without motion.")
        return None
    print(f"Meshcat is at {meshcat.web_url()} on the kernel's machine; from another one, forward the port first.")
    return meshcat
