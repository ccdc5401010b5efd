"""Figure 4 of the paper: how parameters and landings of the training casts are distributed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from wam_cast.types import Array
from wam_cast.visualization.figures.looks import CHOSEN_LINE, DARK, draw_legend

if TYPE_CHECKING:
    from matplotlib.axes import Axes


N_BINS = 20

FILL = (0.62, 0.66, 0.80)


def draw_histogram(
    axes: Axes,
    values: Array,
    *,
    label: str,
    scale: float = 1.0,
    bounds: tuple[float, float] | None = None,
) -> None:
    """Draw how many casts have which value.

    Parameters
    ----------
    axes
        Where to draw.
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
    axes.set_xlabel(label)
    axes.set_ylabel("number of casts [1]")
    draw_legend(axes, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
