"""How fast planners come to know unknown robots: misses and hit rates over practice, and casts to a streak."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

from wam_cast.types import Array
from wam_cast.visualization.figures.plot_style import MM, PERCENT, curve_styles
from wam_cast.visualization.style import INK

Curve = tuple[Array, Array]

HALF_SPREAD = 0.12
"""By how much the curves of a hit rate are drawn apart, in steps of practice."""


def draw_bias(axes: Axes, curves: Mapping[str, Curve], *, title: str) -> None:
    """Draw how far plans land from the cup's middle without noise, over practice casts, a curve a method.

    Parameters
    ----------
    curves
        By method: practice casts, and the 95th percentile of the misses [m], each of shape (n,).
    """
    ks = _all_ks(curves)
    styles = curve_styles(curves)
    for name, (k, miss) in curves.items():
        axes.plot(_steps(ks, k), MM * miss, label=name, markersize=4, linewidth=1.2, **styles[name])
    axes.set(yscale="log", title=title, ylabel="95 % of biases below [mm]")
    axes.set_yticks(ticks := [2, 5, 10, 20, 50], [str(tick) for tick in ticks])
    axes.minorticks_off()
    _label_steps(axes, ks)


def draw_hit_rates(axes: Axes, curves: Mapping[str, Array], *, title: str) -> None:
    """Draw hit rates over practice casts, a curve a cup, with their intervals.

    Parameters
    ----------
    curves
        By cup: practice casts, the rate, and the lower and upper end of its interval, shape (4, n).
    """
    ks = np.unique(np.concatenate([curve[0] for curve in curves.values()]))
    styles = curve_styles(curves)
    for number, (name, (k, rate, low, high)) in enumerate(curves.items()):
        x = _steps(ks, k) + HALF_SPREAD * (number - (len(curves) - 1) / 2)
        errors = PERCENT * np.vstack([rate - low, high - rate])
        axes.errorbar(x, PERCENT * rate, errors, label=name, markersize=4, linewidth=1.2, capsize=2, **styles[name])
    axes.set(title=title, ylabel="hit rate [%]")
    _label_steps(axes, ks)


def draw_campaigns(axes: Axes, first_catch: Array, streak_end: Array, *, title: str) -> None:
    """Draw which share of the robots has made its first catch, and ten in a row, after so many casts.

    Parameters
    ----------
    first_catch, streak_end
        Casts of each robot up to there, shape (n,); nan if it did not come to that.
    """
    most = int(np.nanmax([*streak_end, *first_catch, 12])) + 1
    casts = np.arange(most + 1)
    for (name, style), values in zip(
        curve_styles(["first catch", "ten in a row"]).items(), (first_catch, streak_end), strict=True
    ):
        share = [np.mean(values <= n) for n in casts]
        look = {key: style[key] for key in ("color", "linestyle")}
        axes.step(casts, PERCENT * np.array(share), where="post", label=name, linewidth=1.4, **look)
    axes.axvline(12, color=INK, linewidth=0.8, linestyle=(0, (1, 2)))
    axes.set(title=title, xlabel="casts at one cup", ylabel="robots [%]", xlim=(0, most), ylim=(0, 103))


def _all_ks(curves: Mapping[str, Curve]) -> Array:
    return np.unique(np.concatenate([k for k, _ in curves.values()]))


def _steps(ks: Array, k: Array) -> Array:
    """Return where practice casts stand on an axis on which all that were tried are evenly apart."""
    return np.searchsorted(ks, k).astype(float)


def _label_steps(axes: Axes, ks: Array) -> None:
    axes.set_xticks(range(len(ks)), [f"{k:g}" for k in ks])
    axes.set(xlabel="practice casts", xlim=(-0.4, len(ks) - 0.6))
