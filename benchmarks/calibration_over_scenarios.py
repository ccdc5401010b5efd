"""Whether two predictive standard deviations hold 95 % of fresh casts, for each of many scenarios drawn at random.

    python benchmarks/calibration_over_scenarios.py [--scenarios 24] [--casts 250] [--fresh 150] [--seed 1]

String (of 12 links at most: more take long), ball and gains are drawn over the documented range, the heights and the drop are made
to fit. Prints a line a scenario: the model's errors, the share of fresh casts within two standard deviations, of all and of the
third of which the model is most sure (among these a planner chooses), and quantiles of the error by the standard deviation. A
scenario without a model is a line, too.
One core needs about a minute for each scenario.
"""

from __future__ import annotations

import argparse
import math
import sys
from functools import partial

import numpy as np

from wam_cast.cast import PARAMETERS
from wam_cast.cli.terminal import out
from wam_cast.errors import InputError
from wam_cast.experiments.statistics import rmse
from wam_cast.learning.dataset import generate_dataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.parallel.workers import Workers
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.scenario import Scenario
from wam_cast.types import Array

MOST_LINKS = 12
"""More take too long for this."""


def draw_scenario(seed: int) -> Scenario:
    """Return a scenario drawn over the documented range, with heights to fit its string."""
    rng = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(math.log(low), math.log(high))))

    length, usual = float(rng.uniform(0.2, 1.5)), Scenario()
    start_height = length + 0.2
    return Scenario.from_dict(
        {
            "arm": {"mount_height": start_height + usual.arm.mount_height - usual.motion.start_height},
            "string": {
                "length": length,
                "n_links": int(rng.integers(1, MOST_LINKS + 1)),
                "mass": between(0.0005, 0.020),
                "bending_damping": usual.string.bending_damping * between(0.1, 10),
                "hook_damping": usual.string.hook_damping * between(0.1, 10),
            },
            "ball": {"mass": between(0.002, 0.200)},
            "controller": {"kp": usual.controller.kp * between(0.25, 4), "kd": usual.controller.kd * between(0.25, 4)},
            "motion": {
                "start_height": start_height,
                "drop_distance": min(usual.motion.drop_distance, 0.66 * (start_height - usual.cup.rim_height)),
            },
        }
    )


def errors_of_fresh_casts(
    scenario: Scenario, n_casts: int, n_fresh: int, engine: str, workers: Workers
) -> tuple[Array, Array]:
    """Fit a model to a dataset; return the errors and predictive standard deviations [m] of casts of another seed."""
    generate = partial(generate_dataset, scenario, engine=engine, executor=workers)
    model = ForwardModel.fit(generate(n_casts, seed=0))
    frame = generate(n_fresh, seed=1).frame.dropna(subset=list(OUTPUTS))
    casts = frame[list(PARAMETERS)].to_numpy(dtype=float)
    errors = model.predict(casts)[:, 0] - frame["landing_along"].to_numpy(dtype=float)
    return errors, model.uncertainty.std(casts)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--scenarios", type=int, default=24)
    arguments.add_argument("--casts", type=int, default=250)
    arguments.add_argument("--fresh", type=int, default=150)
    arguments.add_argument("--seed", type=int, default=1)
    arguments.add_argument(
        "--engine", default="drake", help="drake or batch, which compiles anew for each number of links"
    )
    arguments.add_argument("--workers", type=int, help="default: one for each processor")
    options = arguments.parse_args()
    covered: list[float] = []
    out.print("seed, string (length, mass, links), ball: RMSE, within 2 std, of the surest third, |z| at 50, 95, 99 %")
    with Workers(options.workers) as workers:
        for seed in range(options.seed, options.seed + options.scenarios):
            scenario = draw_scenario(seed)
            string, ball = scenario.string, scenario.ball
            name = f"{seed}, {string.length:.2f} m {1e3 * string.mass:.1f} g {string.n_links}, {1e3 * ball.mass:.1f} g"
            try:
                errors, std = errors_of_fresh_casts(scenario, options.casts, options.fresh, options.engine, workers)
            except InputError as error:
                out.print(f"{name}: no model: {error}")
                continue
            z = np.abs(errors) / std
            covered.append(float(np.mean(z <= 2)))
            surest = np.mean(z[std <= np.quantile(std, 1 / 3)] <= 2)
            quantiles = " ".join(f"{value:.2f}" for value in np.quantile(z, (0.5, 0.95, 0.99)))
            out.print(f"{name}: {1e3 * rmse(errors):.2f} mm, {covered[-1]:.1%}, {surest:.0%}, {quantiles}")
    if covered:
        n_right = sum(share >= 0.90 for share in covered)
        out.print(f"{n_right} of {len(covered)} within 90 to 100 %, {np.mean(covered):.1%} on average")
        sys.exit(0 if n_right == len(covered) else 1)


if __name__ == "__main__":
    main()
