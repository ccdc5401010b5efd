"""How the error falls with the number of casts to learn from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import (
    BESIDE,
    CM,
    PAPER_MARK,
    curve_looks,
    draw_legend,
    mark_log_axis,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes


PAPER_N_TRAIN = 1300
"""Casts that the paper's model learned from."""

APART = 1.03
"""Each curve is drawn at this many times the number of casts of the one before it, so that their bars do not hide each other."""

LINE: Any = {"linewidth": 1.2, "markersize": 4.0}


@dataclass(frozen=True, eq=False)
class LearningCurve:
    """RMSE [m] over the number of training casts, each of shape (n,): the median of several draws, and their range."""

    median: Array
    low: Array
    high: Array


def draw_learning_curves(
    axes: Axes,
    n_train: Array,
    curves: Mapping[str, LearningCurve],
    *,
    ylabel: str,
    paper: float | None = None,
) -> None:
    """Draw errors over the number of training casts, both on logarithmic axes, with a bar for the range of each.

    The curves stand slightly beside each other, the middle one at the numbers of casts.

    Parameters
    ----------
    axes
        Where to draw.
    n_train
        Numbers of training casts, shape (n,).
    curves
        By name; may hold nan.
    ylabel
        What the errors are, with their unit, which is cm.
    paper
        The paper's test RMSE [m] with its number of training casts, or none.
    """
    for number, (name, look) in enumerate(curve_looks(curves).items()):
        curve, x = curves[name], n_train * APART ** (number - (len(curves) - 1) / 2)
        axes.vlines(x, curve.low * CM, curve.high * CM, color=look["color"], linewidth=0.9, alpha=0.8)
        axes.plot(x, curve.median * CM, label=name, **(look | LINE))
    if paper is not None:
        axes.plot(PAPER_N_TRAIN, paper * CM, label=f"paper, test: {paper * CM:.3g} cm", **PAPER_MARK)
    axes.set_xscale("log")
    axes.set_yscale("log")
    mark_log_axis(axes.xaxis)
    mark_log_axis(axes.yaxis)
    axes.grid(axis="y")
    axes.set_xlabel("number of training casts [1]")
    axes.set_ylabel(ylabel)
    draw_legend(axes, **BESIDE)
