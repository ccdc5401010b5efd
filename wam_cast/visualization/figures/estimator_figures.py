"""Estimators compared by their errors: over their hyperparameters, the number of training casts, and with each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.markers import CARETDOWN
from matplotlib.ticker import MaxNLocator

from wam_cast.types import Array
from wam_cast.visualization.figures.plot_style import (
    ABOVE,
    BESIDE,
    CHOSEN_LINE,
    CM,
    DARK,
    OTHER_CHOSEN_LINE,
    PAPER_MARK,
    curve_styles,
    draw_legend,
    mark_log_axis,
    use_log_axes,
)
from wam_cast.visualization.style import INK

PAPER_N_TRAIN, PAPER_DEGREE = 1300, 12
"""Casts that the paper's model learned from, and the degree of its best polynomial."""

SMALLEST_RMSE = 1e-4
"""Smaller errors only get a mark [m]: with as many terms as casts they vanish, and would stretch the axis without end."""

APART = 1.03
"""Each curve is drawn at this many times the number of casts of the one before it, so that their bars do not hide each other."""

DESCENT: Any = {"color": INK, "linewidth": 0.7, "markersize": 4.0, "markerfacecolor": "white", "markeredgewidth": 0.7}


def draw_error_curve(
    axes: Axes,
    x: Array,
    curves: Mapping[str, Array],
    *,
    xlabel: str,
    descents: Sequence[tuple[Array, Array]] = (),
    chosen: Mapping[str, float] | None = None,
) -> None:
    """Draw errors over a hyperparameter, both on logarithmic axes: figure 5 of the paper.

    Parameters
    ----------
    x
        The hyperparameter, shape (n,), positive.
    curves
        By name, the RMSE [m] at each `x`, shape (n,); nan where there is none.
    xlabel
        What `x` is, with its unit.
    descents
        The steps of each descent: the hyperparameter and the RMSE [m] at each, both of shape (n_steps,).
    chosen
        By what it was chosen by, the hyperparameter that was chosen, two of them at most; or none.
    """
    for name, style in curve_styles(curves).items():
        axes.plot(x, curves[name] * CM, label=name, **(style | {"marker": ""}))
    for number, (steps, rmse) in enumerate(descents):
        label = ("descents" if len(descents) > 1 else "descent") if number == 0 else "_"
        axes.plot(steps, rmse * CM, "o-", label=label, **DESCENT)
    for (name, value), line in zip((chosen or {}).items(), (CHOSEN_LINE, OTHER_CHOSEN_LINE), strict=False):
        axes.axvline(value, label=f"chosen by {name}: {value:.3g}", **line)
    use_log_axes(axes)
    axes.set(xlabel=xlabel, ylabel="RMSE [cm]")
    draw_legend(axes, **ABOVE)


@dataclass(frozen=True, eq=False)
class LearningCurve:
    """RMSE [m] over the number of training casts, each of shape (n,): the median of several draws, and their range."""

    median: Array
    low: Array
    high: Array


def draw_learning_curves(
    axes: Axes, n_train: Array, curves: Mapping[str, LearningCurve], *, ylabel: str, paper: float | None = None
) -> None:
    """Draw errors over the number of training casts, both on logarithmic axes, with a bar for the range of each.

    The curves, by name, stand slightly beside each other, the middle one at the numbers of casts `n_train`, shape (n,); they
    may hold nan. `ylabel` says what the errors are, with their unit, which is cm; `paper` is the paper's test RMSE [m] with its
    number of training casts, or none.
    """
    for number, (name, style) in enumerate(curve_styles(curves).items()):
        curve, x = curves[name], n_train * APART ** (number - (len(curves) - 1) / 2)
        axes.vlines(x, curve.low * CM, curve.high * CM, color=style["color"], linewidth=0.9, alpha=0.8)
        axes.plot(x, curve.median * CM, label=name, linewidth=1.2, markersize=4.0, **style)
    _draw_papers(axes, PAPER_N_TRAIN, paper)
    use_log_axes(axes)
    axes.grid(axis="y")
    axes.set(xlabel="number of training casts [1]", ylabel=ylabel)
    draw_legend(axes, **BESIDE)


def draw_polynomials(axes: Axes, degrees: Array, curves: Mapping[str, Array], *, paper: float | None = None) -> None:
    """Draw the errors of polynomials over their degree; errors below `SMALLEST_RMSE` are marked at the lower edge.

    `curves` are, by name, the RMSE [m] at each of the `degrees`, all of shape (n,); they may hold nan. `paper` is the paper's
    test RMSE [m] at its best degree, or none.
    """
    styles = curve_styles(curves)
    for name, curve in curves.items():
        axes.plot(degrees, np.where(curve < SMALLEST_RMSE, np.nan, curve) * CM, label=name, **styles[name])
    _draw_papers(axes, PAPER_DEGREE, paper)
    axes.set_yscale("log")
    for name, curve in curves.items():
        below = degrees[curve < SMALLEST_RMSE]
        if len(below):
            axes.set_ylim(SMALLEST_RMSE * CM, max(axes.get_ylim()[1], 10 * SMALLEST_RMSE * CM))
            mark = styles[name] | {"marker": CARETDOWN, "markersize": 6, "linestyle": "none"}
            label, edge = f"{name}, below {SMALLEST_RMSE * CM:g} cm", axes.get_xaxis_transform()
            axes.plot(below, np.zeros(len(below)), transform=edge, label=label, **mark)
    mark_log_axis(axes.yaxis)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.grid(axis="y")
    axes.set(xlabel="degree of the polynomial [1]", ylabel="RMSE [cm]")
    draw_legend(axes, **BESIDE)


def _draw_papers(axes: Axes, x: float, rmse: float | None) -> None:
    """Mark the paper's test RMSE [m], if it is given."""
    if rmse is not None:
        axes.plot(x, rmse * CM, label=f"paper, test: {rmse * CM:.3g} cm", **PAPER_MARK)


def draw_comparison(
    axes: Axes, names: Sequence[str], rmse: Array, low: Array, high: Array, *, paper: Mapping[str, float] | None = None
) -> None:
    """Draw test errors one below the other, on a logarithmic axis, with their values at the right.

    Parameters
    ----------
    names
        Of what is compared, from top to bottom.
    rmse, low, high
        Test RMSE and the ends of its interval [m], each of shape (n,); nan where there is none.
    paper
        By name, the paper's RMSE [m], or none.
    """
    rows = np.arange(len(names))
    axes.hlines(rows, low * CM, high * CM, color=DARK, linewidth=2.2, alpha=0.45)
    axes.plot(rmse * CM, rows, "o", color=DARK, label="test RMSE and interval")
    beside: Any = {"xycoords": axes.get_yaxis_transform(), "va": "center", "annotation_clip": False}
    for row, value in enumerate(rmse * CM):
        text = f"{value:#.3g} cm".replace(". ", " ") if np.isfinite(value) else "none"
        axes.annotate(text, (1.02, row), fontsize="small", **beside)
    theirs = {name: value for name, value in (paper or {}).items() if name in names}
    if theirs:
        at = [names.index(name) for name in theirs]
        axes.plot(np.array(list(theirs.values())) * CM, at, label="paper", zorder=3, **PAPER_MARK)
    axes.set_xscale("log")
    mark_log_axis(axes.xaxis)
    axes.set_yticks(rows, names)
    axes.grid(axis="x")
    axes.set(ylim=(len(names) - 0.5, -0.5), xlabel="test RMSE [cm]")
    draw_legend(axes, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
