"""Casts of a dataset that failed: how many, whether they are learned from, and what would mend them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wam_cast.planning.prediction import OUTPUTS

if TYPE_CHECKING:
    from wam_cast.learning.dataset import CastDataset

REMEDIES = {
    "diverged": "the simulation diverged; choose lower controller.kp and kd, or a shorter simulation.max_step",
    "never_crossed": (
        "the ball never came down to the rim; choose a longer motion.drop_distance or string.length, or a lower "
        "cup.rim_height"
    ),
    "limit_hit": (
        "the arm met a limit; choose a longer motion.drop_duration, a lower bounds.speed, or lower controller.kp and kd"
    ),
}
"""By `.Status`, what happened and what would mend it."""


def failed_casts(data: CastDataset) -> dict[str, dict[str, int]]:
    """Return, by the status of casts that failed, how many there are (`casts`) and how many of them are learned from (`learned`).

    Whatever landed is learned from; a cast that met a limit counts as one that the arm cannot do.
    """
    frame = data.frame
    is_learned = frame[list(OUTPUTS)].notna().all(axis=1)
    failed = {status: (frame["status"] == status).to_numpy() for status in REMEDIES}
    return {
        status: {"casts": int(rows.sum()), "learned": int(is_learned[rows].sum())}
        for status, rows in failed.items()
        if rows.any()
    }


def describe_failed_casts(data: CastDataset) -> list[str]:
    """Return a line for each kind of failed casts: how many, whether they are learned from, and what would mend them."""
    lines = []
    for status, counts in failed_casts(data).items():
        n, n_learned = counts["casts"], counts["learned"]
        learned = f"{n_learned} of them landed and are learned from" if n_learned else "not learned from"
        lines.append(f"{n} of {len(data)} casts {status} ({learned}): {REMEDIES[status]}")
    return lines
