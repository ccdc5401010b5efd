"""A cast that a robot recorded, laid beside its simulation: how far joints, torques, ball and landing are apart, and a figure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from wam_cast.errors import InputError
from wam_cast.exchange.cast_table import MeasuredCast
from wam_cast.robot.plant import N_ARM
from wam_cast.simulation.recording import CastRecording
from wam_cast.types import Array, checks_types
from wam_cast.visualization.figures.plot_style import ABOVE, BESIDE, DARK, DOTS, MIDDLE, MM, MS, THIN_LINE, draw_legend
from wam_cast.visualization.picture_files import check_picture, write_figure
from wam_cast.visualization.style import INK, figure_style

LONGEST_GAP = 0.025
"""Between the sights above and below the rim plane that tell where the ball came down [s]: a camera of 50 Hz has shorter ones."""


@dataclass(frozen=True, eq=False)
class BesideSimulation:
    """How far a measured cast is from its simulation, at the measured samples that the simulation lasts to.

    Attributes
    ----------
    measured, simulated
        The two, the measured one cut off where the simulation begins and ends.
    q_error, torque_error
        Measured less simulated [rad], [N m], shape (n, 7) each; nan where it was not measured.
    ball_error
        The same of the ball's position in the world [m], shape (n, 3).
    landing
        World (x, y) [m] where the measured ball first came down through the rim plane, shape (2,); nan if it was not seen to. A
        ball that touched the rim before comes down where the rim sent it, where the simulated landing is that without a cup.
        See `landing_of` for what it is worth where the ball was not seen in the plane itself.
    """

    measured: MeasuredCast
    simulated: CastRecording
    q_error: Array
    torque_error: Array
    ball_error: Array
    landing: Array

    @property
    def landing_error(self) -> Array:
        """The measured landing less the simulated one [m], shape (2,), world x and y."""
        return np.asarray(self.landing - self.simulated.outcome.landing)


@checks_types
def lay_beside(measured: MeasuredCast, simulated: CastRecording) -> BesideSimulation:
    """Compare a measured cast with a simulated one, whose samples are interpolated linearly.

    Raises
    ------
    InputError
        If the two have no time in common.
    """
    times = simulated.times
    common = (measured.times >= times[0]) & (measured.times <= times[-1])
    if not common.any():
        raise InputError(
            f"the recording lasts from {measured.times[0]:g} to {measured.times[-1]:g} s, the simulation from {times[0]:g} to "
            f"{times[-1]:g} s; shift the recording's clock by `measured.shifted(seconds)`"
        )
    kept = MeasuredCast(
        *(of[common] for of in (measured.times, measured.q, measured.v, measured.torques, measured.p_WL))
    )

    def at_samples(values: Array) -> Array:
        return np.column_stack([np.interp(kept.times, times, column) for column in values.T])

    return BesideSimulation(
        measured=kept,
        simulated=simulated,
        q_error=kept.q - at_samples(simulated.states[:, :N_ARM]),
        torque_error=kept.torques - at_samples(simulated.torques),
        ball_error=kept.p_WL - at_samples(simulated.p_WL),
        landing=landing_of(kept, simulated.scenario.cup.rim_height, simulated.scenario.gravity),
    )


def landing_of(measured: MeasuredCast, height: float, gravity: float) -> Array:
    """Return world (x, y) [m], (2,), where a measured ball first comes down through the plane at `height` [m], or nan.

    Between its last sight above and the first below it falls freely, with an acceleration of `gravity` [m/s^2]. It is nan if the
    two are more than `LONGEST_GAP` apart. Within it, the ball touches the cup's wall 10 ms after the rim at the earliest in
    typical casts, which leaves an error of at most 4 mm, and of 0.2 mm where the sight below is within these 10 ms.
    """
    is_seen = np.isfinite(measured.p_WL).all(axis=1)
    times, path = measured.times[is_seen], measured.p_WL[is_seen]
    (falling,) = np.nonzero((path[:-1, 2] > height) & (path[1:, 2] <= height))
    if len(falling) == 0:
        return np.full(2, np.nan)
    (above, below), (at_above, at_below) = (of[falling[0] : falling[0] + 2] for of in (path, times))
    gap = at_below - at_above
    if gap > LONGEST_GAP:
        return np.full(2, np.nan)
    v_z = (below[2] - above[2]) / gap + gravity * gap / 2  # at the sight above, on the parabola through both
    after = (v_z + math.sqrt(v_z**2 + 2 * gravity * (above[2] - height))) / gravity
    return np.asarray(above[:2] + after / gap * (below[:2] - above[:2]))


def beside_figure(found: BesideSimulation) -> Figure:
    """Return one figure: errors of joints and torques over time, the ball's path from the side, and the landings from above."""
    with figure_style():
        figure = Figure(figsize=(9.0, 6.4), layout="constrained")
        (of_joints, of_ball), (of_torques, of_landing) = figure.subplots(2, 2)
        times = found.measured.times
        _draw_errors(of_joints, times, found.q_error * MS, "joint angle off [mrad]", has_legend=True)
        _draw_errors(of_torques, times, found.torque_error, "torque off [N m]", has_legend=False)
        _draw_paths(of_ball, found)
        _draw_landings(of_landing, found)
        return figure


def write_beside_figure(found: BesideSimulation, path: str | Path) -> None:
    """Write `beside_figure` to `path` as PDF, PNG or SVG by its suffix. Raises `.InputError` if it cannot be written."""
    check_picture(path)
    write_figure(beside_figure(found), path)


def _draw_errors(axes: Axes, times: Array, errors: Array, label: str, *, has_legend: bool) -> None:
    axes.axhline(0.0, **THIN_LINE)
    for joint, error in enumerate(errors.T, 1):
        if np.isfinite(error).any():
            axes.plot(times, error, linewidth=1.0, label=f"joint {joint}")
    axes.set(xlabel="time [s]", ylabel=f"{label}\nmeasured less simulated")
    if has_legend:
        draw_legend(axes, ncols=4, **ABOVE)


def _draw_paths(axes: Axes, found: BesideSimulation) -> None:
    bearing, shape = found.simulated.cast.bearing, found.simulated.scenario.cup

    def from_the_side(p_WL: Array) -> tuple[Array, Array]:
        return _to_plane(p_WL, bearing)[:, 0], p_WL[:, 2]

    axes.axhline(shape.rim_height, **THIN_LINE)
    axes.plot(*from_the_side(found.simulated.p_WL), color=DARK, linewidth=1.2, label="simulated")
    axes.plot(*from_the_side(found.measured.p_WL), **(DOTS | {"color": MIDDLE, "markersize": 2}), label="measured")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="along the casting plane [m]", ylabel="height of the ball [m]")
    draw_legend(axes, ncols=2, **ABOVE)


def _draw_landings(axes: Axes, found: BesideSimulation) -> None:
    """Draw the landings about the cup, without one about the simulated landing: the casting plane runs to the right."""
    simulated, bearing = found.simulated, found.simulated.cast.bearing
    middle = simulated.outcome.landing if simulated.cup is None else np.array(simulated.cup)
    if simulated.cup is not None:
        axes.add_patch(
            Circle((0, 0), simulated.scenario.cup.inner_radius * MM, fill=False, edgecolor=INK, label="cup's rim")
        )
    marks = (("simulated", simulated.outcome.landing, "o", DARK), ("measured", found.landing, "X", MIDDLE))
    for name, landing, marker, color in marks:
        off = _to_plane((landing - middle)[np.newaxis], bearing)[0] * MM
        if np.isfinite(off).all():
            axes.plot(
                *off, marker=marker, color=color, linestyle="none", label=f"{name}: {off[0]:.1f}, {off[1]:.1f} mm"
            )
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="landing off, along [mm]", ylabel="landing off, across [mm]")
    draw_legend(axes, **BESIDE)


def _to_plane(p_WQ: Array, bearing: float) -> Array:
    """Return points' world (x, y), the first two of (n, 2) or (n, 3) [m], along and across the casting plane of a bearing [rad]."""
    c, s = math.cos(bearing), math.sin(bearing)
    return np.asarray(p_WQ[:, :2] @ np.array([[c, -s], [s, c]]))
