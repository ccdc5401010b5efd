"""`wam-cast check`: what a preview of a scenario shows, and how other commands ask it before they begin."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import wam_cast as wc
from wam_cast.cli.terminal import out, print_table, progress
from wam_cast.errors import InputError

if TYPE_CHECKING:
    from wam_cast.experiments.preview import Preview
    from wam_cast.storage.work_directory import WorkDirectory
    from wam_cast.types import Array


def require_workable(scenario: wc.Scenario, path: Path | None, work: type[WorkDirectory], directory: Path) -> None:
    """Raise `.InputError` if a preview says that the scenario at `path` cannot work, or `work` cannot begin in `directory`.

    Where it has begun, the scenario was asked about before.
    """
    if work.is_begun(directory):
        return
    with progress("checking the scenario"):
        verdict = wc.preview_scenario(scenario, ends_early=True).verdict
    if not verdict.can_work:
        name = "the reference scenario" if path is None else f"scenario {path}"
        command = ["wam-cast", "check", *([] if path is None else ["--scenario", str(path)])]
        raise InputError(f"{name} cannot work: {verdict.reason}; see `{shlex.join(command)}`")


def print_preview(preview: Preview, n_training_casts: int) -> None:
    """Print what a preview found, and its verdict."""
    record = preview.record(n_training_casts)
    n = record["n_casts"]
    low, high = map(math.degrees, record["bearings"])
    torque, velocity = (_peak(getattr(preview, f"peak_{what}_utilization")) for what in ("torque", "velocity"))
    statuses = ", ".join(f"{count} {status}" for status, count in record["statuses"].items())
    rows = [
        ("hand goes down, from the base axis [m]", _range(preview.hand_radii)),
        ("hand at its highest and lowest [m]", _range(preview.hand_heights[::-1])),
        ("bearings [deg]", f"{low:.0f} to {high:.0f}"),
        ("landings of all casts [m]", _range(preview.landings)),
        ("where a cup can stand [m]", _range(preview.cups)),
        (f"what became of {n} casts", statuses),
        ("of them with a slack string", str(record["n_slack"])),
        ("of them good for a cup", str(record["n_good"])),
        ("peak torque utilization", torque),
        ("peak velocity utilization", velocity),
        ("integration step, about [ms]", f"{1e3 * preview.step:.3g}"),
        ("processor time of a cast [s]", f"{preview.cast_time:.2f}"),
        (
            f"`wam-cast generate`, {n_training_casts} casts on {record['n_processors']} processors",
            f"about {_duration(preview.generation_time(n_training_casts))}",
        ),
    ]
    print_table(rows)
    out.print(f"this scenario {'can' if preview.verdict.can_work else 'cannot'} work: {preview.verdict.reason}")
    for remark in preview.verdict.remarks:
        out.print(f"but: {remark}")


def _range(ends: tuple[float, float]) -> str:
    return "-" if math.isnan(ends[0]) else f"{ends[0]:.3f} to {ends[1]:.3f}"


def _peak(utilization: Array) -> str:
    """Return the largest utilization of the joints, and whose it is."""
    highest = utilization.max()
    return "-" if math.isnan(highest) else f"{100 * highest:.0f} % (joint {utilization.argmax() + 1})"


def _duration(seconds: float) -> str:
    return f"{seconds / 60:.0f} min" if seconds >= 120 else f"{seconds:.0f} s"
