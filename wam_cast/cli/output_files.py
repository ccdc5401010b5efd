"""The files that commands are asked to write: refused before the work if they could not be written after it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from wam_cast.cli.terminal import err
from wam_cast.errors import InputError
from wam_cast.storage.atomic import check_writable

if TYPE_CHECKING:
    from wam_cast.planning.plan import Plan
    from wam_cast.simulation.recording import CastRecording


def check_picture(path: Path) -> None:
    """Refuse a picture whose format is none of ours, or whose place cannot be written."""
    from wam_cast.visualization.picture_files import picture_format

    picture_format(path)
    check_writable(path)


@dataclass(frozen=True)
class ThrowFiles:
    """What `throw` is to write, each a path or none; the picture and the animation show one cast."""

    replay: Path | None
    picture: Path | None
    animation: Path | None

    @property
    def are_wanted(self) -> bool:
        """Whether there is anything to write."""
        return any(path is not None for path in astuple(self))

    def check(self, n_cups: int) -> None:
        """Refuse what could not be written of so many casts."""
        for option, path in (("--picture", self.picture), ("--animation", self.animation)):
            if path is not None and n_cups > 1:
                raise InputError(f"{option} shows one cast: give one --cup, not {n_cups}")
        for path in (self.replay, self.picture, self.animation):
            if path is not None:
                check_writable(path)
        if self.replay is not None and self.replay.suffix.lower() not in (".html", ".htm"):
            raise InputError(f"--replay {self.replay} is a web page: choose a name that ends in .html")
        if self.picture is not None:
            check_picture(self.picture)
        if self.animation is not None:
            from wam_cast.visualization.film import check_animation

            check_animation(self.animation)

    def write(self, recordings: Sequence[CastRecording], plans: Sequence[Plan]) -> None:
        """Write what is wanted of casts that were executed as planned, and say where."""
        if self.replay is not None:
            from wam_cast.visualization.replay import write_replay

            write_replay(recordings, self.replay, [plan.predicted_landing for plan in plans])
            err.print(f"replay: {self.replay}")
        if self.picture is not None:
            from wam_cast.visualization.film_strip import write_picture

            write_picture(recordings[0], self.picture, plans[0].predicted_landing)
            err.print(f"picture: {self.picture}")
        if self.animation is not None:
            from wam_cast.visualization.film import write_animation

            write_animation(recordings[0], self.animation)
            err.print(f"animation: {self.animation}")
