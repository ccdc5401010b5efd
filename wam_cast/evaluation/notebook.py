"""What the notebooks show and matplotlib does not: pages inside the page. For JupyterLab, VS Code and rendered documents alike."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass

from wam_cast.evaluation.replay import open_replay
from wam_cast.system.recording import CastRecording


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
    return EmbeddedPage(open_replay(recordings).StaticHtml(), height)
