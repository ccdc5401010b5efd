"""The forward model against its data: what it learned from, what it predicts, where it errs, and whether it knows by how much."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from wam_cast.types import Array
from wam_cast.visualization.figures.plot_style import (
    ABOVE,
    BESIDE,
    CHOSEN_LINE,
    DARK,
    DOTS,
    GREY,
    MM,
    MS,
    PERCENT,
    THIN_LINE,
    curve_styles,
    draw_legend,
    mark_log_axis,
    use_log_axes,
)
from wam_cast.visualization.style import INK

N_BINS = 20
"""Of a histogram."""

FILL = (0.62, 0.66, 0.80)
"""Of a histogram's bars."""

SMALLEST_DOT, LARGEST_DOT = 1.0, 36.0
"""Area of the dots of the smallest and the largest residual [pt^2]."""

N_DECADES_SHOWN = 3.0
"""Residuals that are smaller than the largest by more than this all look alike."""


def draw_histogram(
    axes: Axes, values: Array, *, label: str, scale: float = 1.0, bounds: tuple[float, float] | None = None
) -> None:
    """Draw how many casts have which value: figure 4 of the paper.

    Parameters
    ----------
    values
        One a cast, in SI units, shape (n,); the legend counts those that are nan.
    label
        What they are, and the unit in which they are shown, such as `distance [cm]`.
    scale
        How many of this unit make one SI unit, such as 100.
    bounds
        The scenario's limits in SI units, to be marked, or none.
    """
    known = values[np.isfinite(values)] * scale
    limits = np.array([] if bounds is None else bounds, dtype=float) * scale
    edges = np.histogram_bin_edges(np.concatenate([known, limits]), bins=N_BINS)
    axes.hist(known, bins=list(edges), facecolor=FILL, edgecolor=DARK)
    for limit, name in zip(limits, ("bounds", "_"), strict=False):
        axes.axvline(limit, label=name, **CHOSEN_LINE)
    n_unknown = len(values) - len(known)
    if n_unknown:
        axes.plot([], [], " ", label=f"{n_unknown} of {len(values)} casts have no value")
    axes.set(xlabel=label, ylabel="number of casts [1]")
    draw_legend(axes, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)


def draw_parity(axes: Axes, measured: Array, predicted: Array) -> None:
    """Draw predicted over measured landings [m], both of shape (n,), and where they would be equal."""
    axes.axline((0, 0), slope=1, label="equal", **THIN_LINE)
    axes.plot(measured, predicted, label="casts", **DOTS)
    known = np.concatenate([measured, predicted])
    known = known[np.isfinite(known)]
    if len(known):
        margin = 0.04 * (np.ptp(known) or 1.0)
        limits = (known.min() - margin, known.max() + margin)
        axes.set(xlim=limits, ylim=limits)
    axes.set(aspect="equal", xlabel="measured landing [m]", ylabel="predicted landing [m]")
    draw_legend(axes)


def draw_residuals(axes: Axes, predicted: Array, residuals: Array) -> None:
    """Draw residuals over predicted landings [m], both of shape (n,)."""
    axes.axhline(0.0, **THIN_LINE)
    axes.plot(predicted, residuals * MM, label="casts", **DOTS)
    axes.set(xlabel="predicted landing [m]", ylabel="residual [mm]")


def draw_residual_map(axes: Axes, x: Array, y: Array, residuals: Array, *, xlabel: str, ylabel: str) -> None:
    """Draw each cast as a dot, the larger and darker the farther the model is off, and a colour bar beside the axes.

    Parameters
    ----------
    x, y
        Two parameters of the casts, each of shape (n,), in the units that the labels name.
    residuals
        Of the model [m], of either sign, shape (n,); nan for casts that never landed.
    xlabel, ylabel
        What the parameters are, with their units.
    """
    sizes = np.abs(residuals) * MM
    known = np.isfinite(sizes)
    largest = max(np.max(sizes[known], initial=0.0), 1e-6)
    smallest = max(np.min(sizes[known], initial=largest), largest * 10**-N_DECADES_SHOWN)
    norm = LogNorm(min(smallest, 0.5 * largest), largest, clip=True)
    order = np.flatnonzero(known)[np.argsort(sizes[known])]  # the worst on top
    shares = np.asarray(norm(sizes[order])) ** 3  # most are small
    look: Any = {"cmap": "viridis_r", "norm": norm, "linewidths": 0.3, "edgecolors": "white"}
    areas = SMALLEST_DOT + (LARGEST_DOT - SMALLEST_DOT) * shares
    dots = axes.scatter(x[order], y[order], s=areas, c=sizes[order], **look)
    if not known.all():
        axes.plot(x[~known], y[~known], "x", color=GREY, label="never landed")
        draw_legend(axes, **ABOVE)
    bar = axes.figure.colorbar(dots, ax=axes, label="|residual| [mm]")
    mark_log_axis(bar.ax.yaxis)
    axes.set(xlabel=xlabel, ylabel=ylabel)


def draw_shortest_move(axes: Axes, duration: float) -> None:
    """Draw the line of moves that last `duration` [s] into axes of distance [m] and mean speed [m/s], as far as these reach."""
    distance = np.array(axes.get_xlim())
    label = f"move lasts {duration * MS:.0f} ms"
    line: Any = {"color": INK, "linewidth": 1.0, "linestyle": (0, (6, 3))}
    axes.plot(distance, distance / duration, label=label, scalex=False, scaley=False, **line)
    draw_legend(axes, **ABOVE)


def draw_calibration(axes: Axes, nominal: Array, empirical: Mapping[str, Array]) -> None:
    """Draw which share of the casts lies within the central intervals that should hold a given share.

    `nominal` are the shares that they should hold, shape (n,), from 0 to 1, `empirical`, by name, those that they hold.
    """
    axes.plot([0, 100], [0, 100], label="calibrated", **THIN_LINE)
    for name, style in curve_styles(empirical).items():
        axes.plot(nominal * PERCENT, empirical[name] * PERCENT, label=name, clip_on=False, **style)
    axes.set(xlim=(0, 100), ylim=(0, 100), aspect="equal")
    axes.set(xlabel="interval should hold [%]", ylabel="interval holds [%]")
    axes.annotate("cautious", (0.04, 0.93), xycoords="axes fraction", fontsize="small", va="top")
    axes.annotate("overconfident", (0.96, 0.07), xycoords="axes fraction", fontsize="small", ha="right")
    draw_legend(axes, **BESIDE)


def draw_errors(axes: Axes, std: Array, errors: Array) -> None:
    """Draw each cast's error over its predicted standard deviation [m], both of shape (n,), on logarithmic axes."""
    axes.plot(std * MM, np.abs(errors) * MM, label="casts", **DOTS)
    for number, label, dashes in ((1, "1 standard deviation", "-"), (2, "2 standard deviations", "--")):
        axes.axline((1, number), (10, 10 * number), label=label, linestyle=dashes, **THIN_LINE)
    use_log_axes(axes)
    axes.set(xlabel="predicted standard deviation [mm]", ylabel="|error| [mm]")
    draw_legend(axes, **ABOVE)
