"""How the error falls with the number of casts to learn from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wam_cast.evaluation.figures.looks import CM, PAPER_MARK, curve_looks, draw_legend, mark_log_axis

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes

Array = NDArray[np.float64]

PAPER_N_TRAIN = 1300
"""Casts that the paper's model learned from."""


@dataclass(frozen=True, eq=False)
class LearningCurve:
    """RMSE [m] over the number of training casts, each of shape (n,): the median of several draws, and a band about it."""

    median: Array
    low: Array
    high: Array


def draw_learning_curves(
    axes: Axes,
    n_train: Array,
    curves: Mapping[str, LearningCurve],
    *,
    paper: float | None = None,
) -> None:
    """Draw errors over the number of training casts, both on logarithmic axes.

    Parameters
    ----------
    axes
        Where to draw.
    n_train
        Numbers of training casts, shape (n,).
    curves
        By name; may hold nan.
    paper
        The paper's test RMSE [m] with its number of training casts, or none.
    """
    for name, look in curve_looks(curves).items():
        curve = curves[name]
        axes.fill_between(
            n_train, curve.low * CM, curve.high * CM, color=look["color"], alpha=0.13, linewidth=0
        )
        axes.plot(n_train, curve.median * CM, label=name, **look)
    if paper is not None:
        axes.plot(PAPER_N_TRAIN, paper * CM, label=f"paper: {paper * CM:.3g} cm", **PAPER_MARK)
    axes.set_xscale("log")
    axes.set_yscale("log")
    mark_log_axis(axes.xaxis)
    mark_log_axis(axes.yaxis)
    axes.grid(axis="y")
    axes.set_xlabel("number of training casts [1]")
    axes.set_ylabel("RMSE [cm]")
    draw_legend(axes)
