"""Whether any scenario diverges, how far landings are from converged ones, and what casts cost, over the documented ranges.

Scenarios are drawn at random: string 0.2 to 1.5 m, 1 to 40 links, ball 2 to 200 g, string 0.5 to 20 g, bending damping over two
decades, the gains K_p and K_d a quarter to four times. The hand is as high as the string asks for, the mount as far above it as the
reference's; scenarios that are refused are counted and drawn anew. Each cast runs at the default accuracy and once more at a tenth
of it in steps of at most half the size. A hand that vibrates against its motors' limits magnifies every error, so landings are
compared where the arm kept its limits.

    python benchmarks/integration.py [--scenarios 60] [--casts 2] [--seed 0]
"""

from __future__ import annotations

import argparse
import itertools
import math
import os
import time
from typing import Any, NamedTuple

# One core: the numerical libraries' threads must not help. It counts only before they are loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np

from wam_cast.cli.terminal import err, out, print_table
from wam_cast.errors import InputError
from wam_cast.generation.sampling import sample_cast
from wam_cast.scenario import Scenario
from wam_cast.simulation import contact_free
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.simulation.simulator import CastSimulator

REFERENCE = Scenario()


def draw_scenario(seed: int, number: int) -> Scenario:
    """Return a scenario over the documented ranges: always the same one of a seed."""
    rng = np.random.default_rng([seed, number])

    def draw(lowest: float, highest: float) -> float:
        return float(np.exp(rng.uniform(math.log(lowest), math.log(highest))))

    length = float(rng.uniform(0.2, 1.5))
    motion, cup = REFERENCE.motion, REFERENCE.cup
    start_height = length + REFERENCE.ball.radius + cup.rim_height + 0.06
    drop = min(motion.drop_distance, 0.75 * length)
    values: dict[str, Any] = {
        "string": {
            "length": length,
            "n_links": min(round(draw(0.5, 40.5)) or 1, 40),
            "mass": draw(0.0005, 0.020),
            "bending_damping": REFERENCE.string.bending_damping * draw(0.1, 10),
        },
        "ball": {"mass": draw(0.002, 0.200)},
        "controller": {"kp": REFERENCE.controller.kp * draw(0.25, 4), "kd": REFERENCE.controller.kd * draw(0.25, 4)},
        "arm": {"mount_height": REFERENCE.arm.mount_height - motion.start_height + start_height},
        "motion": {
            "start_height": start_height,
            "drop_distance": drop,
            "drop_duration": motion.drop_duration * math.sqrt(drop / motion.drop_distance),
        },
    }
    return Scenario.from_dict(values)


class Run(NamedTuple):
    """The outcomes of a scenario's casts, and the processor time of each [s]."""

    outcomes: list[Outcome]
    seconds: float


def run(scenario: Scenario, accuracy: float, seed: int, n_casts: int) -> Run:
    """Simulate the casts of `seed`."""
    default, contact_free.ACCURACY = contact_free.ACCURACY, accuracy
    simulator = CastSimulator(scenario)
    start = time.process_time()
    outcomes = [simulator.simulate(sample_cast(scenario, seed, row)) for row in range(n_casts)]
    seconds = (time.process_time() - start) / n_casts
    contact_free.ACCURACY = default
    return Run(outcomes, seconds)


def n_diverged(outcomes: list[Outcome]) -> int:
    """Return how many casts diverged."""
    return sum(outcome.status is Status.DIVERGED for outcome in outcomes)


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--scenarios", type=int, default=60)
    arguments.add_argument("--casts", type=int, default=2)
    arguments.add_argument("--seed", type=int, default=0)
    options = arguments.parse_args()
    rows = []
    differences: list[float] = []
    totals = np.zeros(3)
    refused = 0
    for number in itertools.count():
        if len(rows) == options.scenarios:
            break
        try:
            scenario = draw_scenario(options.seed, number)
            CastSimulator(scenario)
        except InputError as error:  # unstable gains, or a string too short for a ball to rest in a cup
            refused += 1
            err.print(str(error))
            continue
        finer = scenario.model_copy(
            update={"simulation": scenario.simulation.model_copy(update={"max_step": scenario.simulation.max_step / 2})}
        )
        ours = run(scenario, contact_free.ACCURACY, options.seed, options.casts)
        exact = run(finer, contact_free.ACCURACY / 10, options.seed, options.casts)
        off = [
            1e3 * float(np.linalg.norm(a.landing - b.landing))
            for a, b in zip(ours.outcomes, exact.outcomes, strict=True)
            if a.status is b.status is Status.LANDED
        ]
        differences += off
        diverged = n_diverged(ours.outcomes), n_diverged(exact.outcomes)
        totals += [
            *diverged,
            sum(a.status is not b.status for a, b in zip(*(r.outcomes for r in (ours, exact)), strict=True)),
        ]
        string, gains, integration = scenario.string, scenario.controller, CastSimulator(scenario).integration
        rows.append(
            (
                f"{string.n_links}",
                f"{string.length:.2f}",
                f"{1e3 * string.mass:.1f}",
                f"{1e3 * scenario.ball.mass:.0f}",
                f"{string.bending_damping / REFERENCE.string.bending_damping:.2f}",
                f"{gains.kp / REFERENCE.controller.kp:.2f}",
                f"{gains.kd / REFERENCE.controller.kd:.2f}",
                integration.method,
                f"{len(off)}",
                *(f"{n}" for n in diverged),
                f"{max(off):.4f}" if off else "-",
                f"{ours.seconds:.2f}",
                f"{integration.expected_seconds:.2f}",
            )
        )
    out.print(f"{options.scenarios} random scenarios, {options.casts} casts each; {refused} others were refused")
    headings = ["links", "string\n[m]", "string\n[g]", "ball\n[g]", "damping\nx", "K_p\nx", "K_d\nx", "method"]
    headings += ["kept\nlimits", "diverged", "finer", "largest\n[mm]", "s a cast", "expected"]
    print_table(rows, headings)
    n_casts = options.scenarios * options.casts
    out.print(
        f"of {n_casts} casts {totals[0]:.0f} diverged, {totals[1]:.0f} of the finer ones; "
        f"{totals[2]:.0f} end otherwise when they are finer"
    )
    median, p95, largest = np.percentile(differences, [50, 95, 100])
    out.print(
        f"landings of {len(differences)} casts, off the finer ones: median {median:.4f}, P95 {p95:.4f}, max {largest:.4f} mm"
    )


if __name__ == "__main__":
    main()
