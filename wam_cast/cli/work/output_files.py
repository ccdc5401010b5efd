"""The files that commands are asked to write: refused before the work if they could not be written after it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import wam_cast as wc
from wam_cast.cli.terminal import err
from wam_cast.errors import InputError
from wam_cast.storage.atomic import check_writable

if TYPE_CHECKING:
    from wam_cast.types import Array


class ThrowFiles(NamedTuple):
    """What `throw` is to write, each a path or none, and how fast replay and animation run; picture and animation show one cast."""

    replay: Path | None
    picture: Path | None
    animation: Path | None
    recording: Path | None
    speed: float = 1.0

    @property
    def is_any_wanted(self) -> bool:
        """Whether there is anything to write."""
        return any((self.replay, self.picture, self.animation, self.recording))

    def check(self, n_cups: int) -> None:
        """Refuse what could not be written of so many casts."""
        if self.speed != 1.0 and not (self.replay or self.animation):
            raise InputError("--speed is how fast --replay and --animation run: give one of them, or leave --speed out")
        for option, path in (("--picture", self.picture), ("--animation", self.animation)):
            if path and n_cups > 1:
                raise InputError(f"{option} shows one cast: give one --cup, not {n_cups}")
        if self.replay:
            check_writable(self.replay)
            if self.replay.suffix.lower() not in (".html", ".htm"):
                raise InputError(f"--replay {self.replay} is a web page: choose a name that ends in .html")
        if self.picture:
            from wam_cast.visualization.picture_files import check_picture

            check_picture(self.picture)
        if self.animation:
            from wam_cast.visualization.film import check_animation

            check_animation(self.animation)
        if self.recording:
            from wam_cast.exchange.mcap_file import check_mcap

            check_mcap(self.recording)

    def check_scene(self, scenario: wc.Scenario) -> None:
        """Refuse a robot that cannot be drawn, if it is to be."""
        from wam_cast.arm.arm_meshes import check_meshes
        from wam_cast.visualization.scene import CastScene

        if self.picture or self.animation:
            CastScene(scenario, None, light_bearing=0.0)  # Drake itself is to read the meshes
        elif self.replay:
            check_meshes(scenario.arm)

    def write(self, recordings: Sequence[wc.CastRecording], landings: Sequence[Array | None]) -> None:
        """Write what is wanted of executed casts, whose predicted `landings` are marked where there are any, and say where.

        A file that cannot be written keeps no other from being written. Raises `.InputError` for the first such.
        """
        from wam_cast.exchange.mcap_file import write_mcap
        from wam_cast.visualization.film import write_animation
        from wam_cast.visualization.film_strip import write_picture
        from wam_cast.visualization.replay import write_replay

        writers: dict[str, Callable[[Path], None]] = {
            "replay": lambda path: write_replay(recordings, path, landings, speed=self.speed),
            "picture": lambda path: write_picture(recordings[0], path, landings[0]),
            "animation": lambda path: write_animation(recordings[0], path, speed=self.speed),
            "recording": lambda path: write_mcap(recordings, path),
        }
        flaws = []
        for what, write in writers.items():
            path = getattr(self, what)
            if path is None:
                continue
            try:
                write(path)
            except InputError as error:
                flaws.append(error)
            else:
                err.print(f"{what}: {path}")
        if flaws:
            raise flaws[0]
