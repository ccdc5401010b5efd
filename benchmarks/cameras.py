"""How well cameras see where the ball lands, whether their standard deviation holds, and what it costs to learn from them.

    python benchmarks/cameras.py [--casts 50] [--robots 8] [--throws 5] [--seed 0]
                                  [--picture FILE] [--views FILE]

First, a robot with the noise that is to be expected of a real arm casts into random cups, and both cameras look. The same pictures
serve one camera alone, fewer of them, and cameras that stand elsewhere than they are taken to. Then robots that nobody told about
cast at one cup, and learn from the true landings, from landings measured to 2 mm, or from what the cameras saw; the misses are the
true ones.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console
from rich.progress import track
from scipy.spatial.transform import Rotation

from wam_cast.adaptation.adaptive_model import AdaptiveModel
from wam_cast.adaptation.campaign import run_campaign
from wam_cast.adaptation.robot import SimulatedRobot
from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.cli.terminal import print_table
from wam_cast.experiments.statistics import coverage
from wam_cast.learning.reference import reference_model
from wam_cast.perception.ball_filter import BallBelief, BallFilter, ObservedLanding
from wam_cast.perception.ball_observer import believed_cameras
from wam_cast.perception.pinhole import Camera
from wam_cast.perception.recorded_cast import Sighting, observe_cast
from wam_cast.planning.plan import plan_cast
from wam_cast.scenario import Cameras, Noise, Scenario
from wam_cast.simulation.recording import CastRecording
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array
from wam_cast.visualization.figures.model_figures import draw_calibration
from wam_cast.visualization.film_strip import draw_sighting
from wam_cast.visualization.picture_files import check_picture, write_figure
from wam_cast.visualization.style import figure_style, picture_style

SCENARIO = Scenario(noise=Noise.typical(), cameras=Cameras(number=2))
BEARINGS = 0.5
"""Cups are so far to either side at most [rad]."""

SHARES = np.linspace(0.05, 0.95, 19)

CUP = (0.70, 0.0)
"""That unknown robots cast at."""


def watched(n_casts: int, seed: int) -> list[tuple[CastRecording, Sighting]]:
    """Return recordings of casts into random cups, and what the cameras saw of those that came down."""
    model, simulator = reference_model().bound_to(SCENARIO), CastSimulator(SCENARIO)
    rng, seen = np.random.default_rng([seed, 20261129]), []
    for number in track(range(n_casts), "casts", console=Console(stderr=True), transient=True):
        radius, bearing = rng.uniform(*model.reach), rng.uniform(-BEARINGS, BEARINGS)
        cup = (radius * math.cos(bearing), radius * math.sin(bearing))
        noise_seed = 1000 * seed + number
        recording = simulator.record(plan_cast(model, cup).cast, cup, noise_seed=noise_seed, returns=False)
        seen.append((recording, observe_cast(recording, noise_seed=noise_seed)))
    return seen


def again(
    sighting: Sighting,
    which: Sequence[int] = (0, 1),
    every: int = 1,
    share: float = 1.0,
    move: Callable[[Camera], Camera] = lambda camera: camera,
) -> ObservedLanding | None:
    """Return where the ball is seen to land by some of the cameras, in every so-manieth picture, or a share of them."""
    cameras = [move(camera) for camera in np.array(believed_cameras(SCENARIO.cameras), dtype=object)[list(which)]]
    ball_filter, belief = BallFilter(SCENARIO, cameras, every / SCENARIO.cameras.frame_rate), BallBelief()
    rng = np.random.default_rng(len(sighting.looks))
    for look in sighting.looks[(len(sighting.looks) - 1) % every :: every]:
        lost = rng.random(len(which)) >= share
        detections = np.where(lost[:, np.newaxis], np.nan, look.detections[list(which)])
        belief = ball_filter.after(belief, detections, look.hand)
    if not belief.is_down:  # it comes down between the last picture and the next
        hand, period = sighting.looks[-1].hand, every / SCENARIO.cameras.frame_rate
        later = np.concatenate([hand[:3] + period * hand[3:], hand[3:]])
        belief = ball_filter.after(belief, np.full((len(which), 4), np.nan), later)
    return belief.landing


def turned(camera: Camera) -> Camera:
    """Return a camera that is taken to look a milliradian farther to its right than it does."""
    return replace(camera, R_WV=camera.R_WV @ Rotation.from_rotvec([0.0, 0.001, 0.0]).as_matrix())


WAYS: dict[str, Callable[[Sighting], ObservedLanding | None]] = {
    "two cameras": lambda sighting: sighting.landing,
    "two, at 30 Hz": lambda sighting: again(sighting, every=2),
    "two, half of their pictures lost": lambda sighting: again(sighting, share=0.5),
    "the first alone": lambda sighting: again(sighting, [0]),
    "the second alone": lambda sighting: again(sighting, [1]),
    "two, both 1 mrad off": lambda sighting: again(sighting, move=turned),
}


def errors_of(seen: list[tuple[CastRecording, Sighting]], way: str) -> tuple[Array, Array]:
    """Return the errors of the observed landings, shape (n, 2) [m], and their standard deviations, (n,) [m]."""
    pairs = [(recording.outcome.landing, WAYS[way](sighting)) for recording, sighting in seen]
    found = [(one.position - truth, one.std) for truth, one in pairs if one is not None and np.isfinite(truth).all()]
    return np.array([error for error, _ in found]).reshape(-1, 2), np.array([std for _, std in found])


def print_errors(seen: list[tuple[CastRecording, Sighting]]) -> None:
    rows = []
    n_landed = sum(np.isfinite(recording.outcome.landing).all() for recording, _ in seen)
    for way in WAYS:
        errors, stds = errors_of(seen, way)
        distances, normalized = 1e3 * np.linalg.norm(errors, axis=1), np.abs(errors) / stds[:, np.newaxis]
        rows.append(
            (
                way,
                f"{len(errors)} of {n_landed}",
                ", ".join(f"{value:.2f}" for value in (*np.percentile(distances, (50, 95)), distances.max())),
                f"{1e3 * np.sqrt(np.mean(stds**2)):.2f}",
                f"{np.mean(normalized <= 1):.0%}, {np.mean(normalized <= 2):.0%}",
                f"{np.sqrt(np.mean(normalized**2)):.2f}",
            )
        )
    print_table(rows, ("", "seen", "error: median, P95, max [mm]", "std [mm]", "within 1, 2 std", "RMS error by std"))


def draw_reliability(seen: list[tuple[CastRecording, Sighting]], path: Path) -> None:
    curves = {}
    for way in ("two cameras", "the first alone"):
        errors, stds = errors_of(seen, way)
        curves[way] = coverage(errors.ravel(), np.repeat(stds, 2), SHARES)
    with figure_style():
        figure = Figure(figsize=(5.2, 3.4), layout="constrained")
        draw_calibration(figure.subplots(), SHARES, curves)
        write_figure(figure, path, dpi=150)


class Watched(SimulatedRobot):
    """A robot that keeps what became of its casts in truth."""

    def __init__(self, *given, **options) -> None:
        super().__init__(*given, **options)
        self.outcomes = []

    def _seen(self, *given):
        outcome, landing, std = super()._seen(*given)
        self.outcomes.append(outcome)
        return outcome, landing, std


SOURCES = {
    "the truth": {"landing_std": 0.0},
    "measured to 2 mm": {"landing_std": 0.002},
    "two cameras": {"observe": "camera"},
}


def print_learning(n_robots: int, n_throws: int, seed: int) -> None:
    robots = RobotDistribution(Scenario(noise=Noise.typical()))
    prior = AdaptiveModel.from_prior(robots)
    misses = {name: np.full((n_robots, n_throws), np.nan) for name in SOURCES}
    caught = dict.fromkeys(SOURCES, 0)
    each = [(number, name) for number in range(n_robots) for name in SOURCES]
    for number, name in track(each, "robots", console=Console(stderr=True), transient=True):
        robot = Watched(robots.draw(1000 * seed + number), robots.believed, seed=number, **SOURCES[name])
        run_campaign(robot, prior, [CUP], n_throws)
        misses[name][number] = [1e3 * one.miss for one in robot.outcomes]
        caught[name] += sum(one.is_caught for one in robot.outcomes[1:])
    rows = []
    for name, miss in misses.items():
        more = miss[:, 1:] - misses["the truth"][:, 1:]
        rows.append(
            (
                name,
                ", ".join(f"{value:.1f}" for value in np.nanmean(miss, axis=0)),
                f"{np.nanmean(miss[:, 1:]):.1f}",
                f"{np.nanmean(more):+.1f} ± {np.nanstd(more) / math.sqrt(np.isfinite(more).sum()):.1f}",
                f"{caught[name]} of {n_robots * (n_throws - 1)}",
            )
        )
    headings = (
        "learned from",
        "mean true miss, cast by cast [mm]",
        "from the second on",
        "more than by the truth",
        "caught",
    )
    print_table(rows, headings)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--casts", type=int, default=50, help="that are looked at; 0: none")
    arguments.add_argument("--robots", type=int, default=8, help="that learn; 0: none")
    arguments.add_argument("--throws", type=int, default=5, help="of each robot")
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--picture", type=Path, metavar="FILE", help="write the reliability diagram there")
    arguments.add_argument(
        "--views", type=Path, metavar="FILE", help="write what the cameras saw of the first cast there"
    )
    options = arguments.parse_args()
    for path in filter(None, (options.picture, options.views)):
        check_picture(path)
    if options.casts:
        seen = watched(options.casts, options.seed)
        print_errors(seen)
        if options.picture is not None:
            draw_reliability(seen, options.picture)
        if options.views is not None:
            with picture_style():
                write_figure(draw_sighting(*seen[0]), options.views)
    if options.robots:
        print_learning(options.robots, options.throws, options.seed)


if __name__ == "__main__":
    main()
