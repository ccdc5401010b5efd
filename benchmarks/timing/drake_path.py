"""What a cast by Drake costs: of its plant's steps alone, and with a cup of a free one."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator

from timing.clock import N_ROUNDS, ratio, seconds_by_round
from wam_cast.cast import Cast
from wam_cast.cli.terminal import out, print_table
from wam_cast.robot.drake_types import evaluate
from wam_cast.robot.plant import fill_plant
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Cup, Scenario
from wam_cast.simulation.integration import ACCURACY, EXPLICIT, begin_integration
from wam_cast.simulation.sampled_loop import SampledLoop
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.types import Array

PLANT, FREE = "the plant alone, for as long", "free, up to the landing"


def plant_stepper(scenario: Scenario) -> Callable[[float], None]:
    """Return what steps the plant alone up to a time [s]: no controller, log or poll, and the first torque all along."""
    station = CastStation(scenario, has_scene=False)
    at_start = station.diagram.CreateDefaultContext()
    torque: Array = evaluate(station.hold.get_output_port(), station.hold.GetMyContextFromRoot(at_start))
    state = station.plant.GetPositionsAndVelocities(station.plant.GetMyContextFromRoot(at_start))
    plant = MultibodyPlant(time_step=0.0)
    fill_plant(plant, scenario)
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    plant.get_actuation_input_port().FixValue(context, torque)

    def step(end: float) -> None:
        context.SetTime(0.0)
        plant.SetPositionsAndVelocities(context, state)
        begin_integration(simulator, EXPLICIT, scenario.simulation.max_step, ACCURACY)
        simulator.Initialize()
        simulator.AdvanceTo(end, interruptible=False)

    return step


def sampling_seconds(simulate: Callable[[int], object], n: int) -> float:
    """Return the mean time a cast spends on what is done at samples, most of it the law [s], of each the best of three."""
    original, spent = SampledLoop._sample, 0.0

    def timed(self: SampledLoop, arm_state: Array) -> None:
        nonlocal spent
        start = time.process_time()
        original(self, arm_state)
        spent += time.process_time() - start

    SampledLoop._sample = timed
    best = np.full(n, np.inf)
    for _ in range(N_ROUNDS):
        for i in range(n):
            spent = 0.0
            simulate(i)
            best[i] = min(best[i], spent)
    SampledLoop._sample = original
    return float(best.mean())


def print_drake_path(casts: Sequence[Cast]) -> None:
    """Print what casts cost, as ratios, and what part of a free one is Python."""
    scenario = Scenario()
    simulator = CastSimulator(scenario)
    outcomes = [simulator.simulate(cast) for cast in casts]
    cups = [(float(outcome.landing[0]), float(outcome.landing[1])) for outcome in outcomes]
    flight_time = sum(outcome.end_time for outcome in outcomes) / len(outcomes)
    step_plant = plant_stepper(scenario)
    runs: dict[str, Callable[[int], object]] = {
        PLANT: lambda i: step_plant(outcomes[i].end_time),
        FREE: lambda i: simulator.simulate(casts[i]),
    }
    for name, restitution in (("nearly inelastic", 0.25), ("lively", 0.6)):
        with_cup = CastSimulator(Scenario(cup=Cup(restitution=restitution)))
        runs[f"into a {name} cup, until the ball rests"] = lambda i, one=with_cup: one.simulate(casts[i], cups[i])
    seconds = seconds_by_round(runs, len(casts))
    out.print(f"Drake: {len(casts)} random casts, {flight_time:.2f} s each, one core")
    rows = []
    for name, one in seconds.items():
        ratios = (ratio(one, seconds[base]) for base in (PLANT, FREE))
        rows.append((name, f"{1e3 * one.min():.1f}", f"{1 / one.min():.1f}", *ratios))
    print_table(rows, ["cast", "ms a cast", "casts a second", "of the plant alone", "of a free cast"])
    share = sampling_seconds(runs[FREE], len(casts)) / seconds[FREE].min()
    out.print(f"of a free cast: the law and what else is done at samples {share:.0%}")
