"""Closed forms that take a moment each: casts without physics, errors of fits that are not made, and empty figures."""

import math
import time
from functools import partial

import numpy as np

from wam_cast.generation.sampling import sample_cast
from wam_cast.learning import dataset
from wam_cast.parallel.workers import run_rows

SECONDS = 0.005
"""That a cast takes: enough to be ended in the middle of."""

LANDED = {
    "status": "landed",
    "is_slack": True,
    "slack": 0.05,
    "peak_torque_utilization": 0.5,
    "peak_velocity_utilization": 0.5,
}


def landing(cast):
    return 0.2 + cast.distance + 0.4 * cast.speed + 0.02 * math.sin(6 * cast.wait)


def row(scenario, seed, number):
    time.sleep(SECONDS)
    cast = sample_cast(scenario, seed, number)
    parameters = {"distance": cast.distance, "speed": cast.speed, "wait": cast.wait, "landing_along": landing(cast)}
    others = {name: landing(cast) / place for place, name in enumerate(dataset.SCHEMA.names, 10)}
    return others | parameters | LANDED | {"cast": number}


def execute(scenario, trials, number):
    trial = trials[number]
    return simulate_cast(scenario, trial.cast, trial.position, noise_seed=trial.noise_seed)


def simulate_cast(scenario, cast, cup, *, noise_seed, belief=None):
    from wam_cast.simulation.outcome import Outcome, Status

    time.sleep(SECONDS)
    along, across = landing(cast), 0.001 * (noise_seed % 7)
    turned = np.array(
        [[math.cos(cast.bearing), -math.sin(cast.bearing)], [math.sin(cast.bearing), math.cos(cast.bearing)]]
    )
    place = turned @ [along, across]
    miss = math.dist(place, cup)
    return Outcome(
        status=Status.CAUGHT if miss < 0.01 else Status.LONG,
        landing=place,
        landing_along=along,
        landing_across=across,
        crossing_time=1.0,
        entry_velocity=np.array([0.5, 0.0, -2.0]),
        entry_angle=0.24,
        is_slack=True,
        slack=0.05,
        miss=miss,
        peak_torque_utilization=np.zeros(7),
        peak_velocity_utilization=np.zeros(7),
        peak_tracking_error=0.0,
        limits_hit=(),
        end_time=2.0,
    )


def run_job(jobs, bounds, train, validation, seed, number):
    time.sleep(SECONDS)
    name, size, repeat = jobs[number]
    return (len(name) + repeat) / size


def draw_figures(names, findings, folder, executor):
    return run_rows(partial(draw, names, folder), range(len(names)), executor)


def draw(names, folder, number):
    from matplotlib.figure import Figure

    from wam_cast.visualization.picture_files import write_figure

    name = names[number]
    for suffix in ("png", "pdf"):
        write_figure(Figure(figsize=(2, 1)), folder / f"{name}.{suffix}")
    return name
