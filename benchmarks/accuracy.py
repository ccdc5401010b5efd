"""How far landings are from those of an error-controlled integration, over random casts.

python benchmarks/accuracy.py [--casts 50] [--seed 2]
"""

from __future__ import annotations

import argparse

import numpy as np
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig

from wam_cast.cast import Cast
from wam_cast.cli.terminal import out, print_table
from wam_cast.generation.sampling import sample_cast
from wam_cast.motion.stages import CastMotion
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario
from wam_cast.simulation.judge import BallTrack, find_crossing
from wam_cast.simulation.simulator import CastSimulator

CONVERGED = SimulatorConfig(
    integration_scheme="runge_kutta3", accuracy=1e-6, max_step_size=0.002, use_error_control=True
)


def converged_landing(station: CastStation, simulator: Simulator, cast: Cast) -> float:
    """Return the landing's distance from the base axis [m], simulated apart from `CastSimulator`."""
    scenario, context = station.scenario, simulator.get_mutable_context()
    station.set_start(context, cast)
    simulator.Initialize()
    position, velocity = (station.diagram.GetOutputPort(f"ball_{name}") for name in ("position", "velocity"))
    times, p_WL, v_WL = [], [], []
    for t in np.arange(0.0, CastMotion(scenario, cast).stage_ends[4], 0.002):
        simulator.AdvanceTo(t)
        times.append(t)
        p_WL.append(position.Eval(context))
        v_WL.append(velocity.Eval(context))
        if p_WL[-1][2] < scenario.cup.rim_height:
            break
    crossing = find_crossing(BallTrack(np.array(times), np.array(p_WL), np.array(v_WL)), scenario.cup.rim_height)
    return np.nan if crossing is None else float(np.hypot(*crossing.p_WL[:2]))


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--casts", type=int, default=50)
    arguments.add_argument("--seed", type=int, default=2)
    options = arguments.parse_args()
    scenario = Scenario()
    station = CastStation(scenario, has_scene=False)
    simulator = Simulator(station.diagram)
    ApplySimulatorConfig(CONVERGED, simulator)
    ours = CastSimulator(scenario)
    casts = [sample_cast(scenario, options.seed, row) for row in range(options.casts)]
    differences = [
        1e3 * abs(ours.simulate(cast).landing_along - converged_landing(station, simulator, cast)) for cast in casts
    ]
    out.print(f"landing, off the converged one, {len(casts)} random casts [mm]")
    print_table([[f"{value:.4f}" for value in np.percentile(differences, [50, 95, 100])]], ["median", "P95", "max"])


if __name__ == "__main__":
    main()
