"""How far the batched engine's landings are from Drake's, over the casts' whole volume, with and without noise.

    python benchmarks/engine_agreement.py [--casts 1000] [--seed 1]

Drake's own steps are error-controlled; in equal ones it integrates as the batched engine does.
"""

from __future__ import annotations

import argparse
from unittest.mock import patch

import jax
import numpy as np
from pydrake.systems.analysis import ResetIntegratorFromFlags

from wam_cast.batch import engine
from wam_cast.cast import Cast, cast_bounds, is_allowed
from wam_cast.cli.terminal import out, print_table
from wam_cast.generation.sampling import sample_cast
from wam_cast.scenario import Noise, Scenario
from wam_cast.simulation import station_loop
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array

LANDING = ["landing_along", "landing_across"]


def drawn(scenario: Scenario, n: int, seed: int) -> Array:
    """Return casts of the bounds' whole volume, its corners first."""
    corners = np.array(np.meshgrid(*np.transpose(cast_bounds(scenario)))).reshape(3, -1).T
    corners = corners[is_allowed(scenario, corners)]
    return np.vstack([corners, *(sample_cast(scenario, seed, i).to_array() for i in range(n - len(corners)))])[:n]


def begin_in_equal_steps(simulator: object, method: str, max_step: float, _accuracy: float) -> None:
    """Let Drake integrate as the batched engine does."""
    ResetIntegratorFromFlags(simulator, method, max_step)
    simulator.get_mutable_integrator().set_fixed_step_mode(True)


def by_drake(scenario: Scenario, casts: Array) -> Array:
    """Return landings along and across [m], (n, 2); cast i has the noise seed i."""
    simulator = CastSimulator(scenario)
    told = (simulator.simulate(Cast(*cast), noise_seed=i) for i, cast in enumerate(casts))
    return np.array([[one.landing_along, one.landing_across] for one in told])


def print_agreement(scenario: Scenario, n: int, seed: int) -> None:
    """Print how far landings are from Drake's, with and without noise."""
    rows = []
    quiet = Noise.typical().model_copy(update={"encoder_counts": 0})
    noises = {"none": Noise(), "typical without encoders": quiet, "typical": Noise.typical()}
    for name, noise in noises.items():
        noisy = scenario.model_copy(update={"noise": noise})
        casts = drawn(noisy, n, seed)
        own = by_drake(noisy, casts)
        with patch.object(station_loop, "begin_integration", begin_in_equal_steps):
            equal = by_drake(noisy, casts)
        for precision in ("float64", "float32"):
            batch = engine.simulate_batch(noisy, casts, range(n), precision)[LANDING].to_numpy()
            for steps, drake in (("equal", equal), ("its own", own)):
                off = 1e3 * np.linalg.norm(batch - drake, axis=1)
                rows.append(
                    (name, steps, precision, *(f"{value:.2g}" for value in np.nanpercentile(off, [50, 95, 100])))
                )
    print_table(rows, ["noise", "Drake's steps", "precision", "median mm", "P95 mm", "largest mm"])


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--casts", type=int, default=1000)
    arguments.add_argument("--seed", type=int, default=1)
    options = arguments.parse_args()
    out.print(f"{options.casts} casts (seed {options.seed}), JAX {jax.__version__} on {jax.devices()[0].device_kind}")
    print_agreement(Scenario(), options.casts, options.seed)


if __name__ == "__main__":
    main()
