"""How many casts are caught over a link that delays, loses and scatters messages, and in real time between two processes.

    python benchmarks/wire.py [--cups 20] [--seed 0]                 # a network with a time of its own: repeatable
    python benchmarks/wire.py --processes [--cups 100] [--seed 0]    # LCM on this machine, at 500 Hz by its clock

The delay is that of both ways together. A command acts a control period later at the earliest, so that up to 2 ms cost nothing. The
jitter is the mean of what each message takes longer, at random; the loss is the share of the messages that are lost, each way.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence

import numpy as np

from wam_cast.cli.terminal import err, out, print_table
from wam_cast.experiments.trials import draw_cups
from wam_cast.learning.reference import reference_model
from wam_cast.planning.plan import Plan, plan_cast
from wam_cast.planning.reach import Reach
from wam_cast.robot.plant import N_ARM
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.wire.arm_port import HOLD_DURATION
from wam_cast.wire.bus import LcmBus
from wam_cast.wire.lossy_link import LossyLink
from wam_cast.wire.memory_network import MemoryNetwork
from wam_cast.wire.remote_arm import RemoteArm
from wam_cast.wire.simulated_arm import SimulatedArm

LINKS = (
    *[{"delay": 1e-3 * delay} for delay in (0, 1, 2, 3, 4, 8)],
    *[{"jitter": 1e-3 * jitter} for jitter in (0.2, 0.5, 1, 2)],
    *[{"loss": loss} for loss in (0.01, 0.05, 0.1, 0.2, 0.4)],
    {"delay": 0.002, "loss": 0.01},
    {"delay": 0.001, "jitter": 0.0002, "loss": 0.01, "doubling": 0.01},
)
"""What is tried; a link is perfect but for that."""

HEADINGS = (
    "delay\n[ms]",
    "jitter\n[ms]",
    "loss\n[%]",
    "doubled\n[%]",
    "caught",
    "missed",
    "limit\nhit",
    "not\nbegun",
    "stopped",
)
MORE_HEADINGS = ("miss [mm]\nmedian, max", "travel\n[rad]")


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--cups", type=int, help="default: 20, and 100 with --processes")
    arguments.add_argument("--seed", type=int, default=0)
    arguments.add_argument("--processes", action="store_true")
    options = arguments.parse_args()
    model = reference_model()
    n_cups = options.cups or (100 if options.processes else 20)
    cups = draw_cups(Reach.of(model), n_cups, options.seed, "line")
    plans = [plan_cast(model, cup) for cup in cups]
    if options.processes:
        between_processes(plans)
    else:
        over_links(plans)


def over_links(plans: Sequence[Plan]) -> None:
    """Print a row for each link."""
    link = LossyLink()
    network = MemoryNetwork(link)
    arm = SimulatedArm(network.join(lambda: arm.work()), Scenario(), clock=network, is_real_time=True)
    controller = RemoteArm(Scenario(), network.join(), clock=network)
    rows = []
    for values in LINKS:
        for name in ("delay", "jitter", "loss", "doubling"):
            setattr(link, name, values.get(name, 0.0))
        outcomes, travels = [], [0.0]
        for plan in plans:
            outcomes.append(controller.cast(plan.cast, plan.cup))
            if outcomes[-1].status is Status.STOPPED:
                travels.append(travel_after_stop(arm))
        rows.append((*_link_cells(link), *_cells(outcomes), f"{max(travels):.3f}"))
        err.print(", ".join(rows[-1]))
    print_table(rows, (*HEADINGS, *MORE_HEADINGS))
    out.print("limit hit: such as a motor's torque; not begun: the brakes stayed closed;")
    out.print("travel: of a joint between the decision to stop and the end, at most")


def travel_after_stop(arm: SimulatedArm) -> float:
    """Return by how much a joint moved on after the arm had decided to stop [rad]."""
    log = arm.one_pass.log()
    q = log.states[log.times >= log.times[-1] - HOLD_DURATION - 0.002, :N_ARM]
    return float(np.abs(q - q[0]).max())


def _link_cells(link: LossyLink) -> tuple[str, ...]:
    return (f"{1e3 * link.delay:g}", f"{1e3 * link.jitter:g}", f"{100 * link.loss:g}", f"{100 * link.doubling:g}")


def _cells(outcomes: Sequence[Outcome]) -> tuple[str, ...]:
    """Return how many were caught, missed, met a limit, were not begun and stopped, and the misses of those that landed."""
    stopped = [one for one in outcomes if one.status is Status.STOPPED]
    not_begun = [one for one in stopped if one.end_time == 0]
    caught, limit_hit = (sum(one.status is what for one in outcomes) for what in (Status.CAUGHT, Status.LIMIT_HIT))
    missed = len(outcomes) - caught - limit_hit - len(stopped)
    misses = [1e3 * one.miss for one in outcomes if np.isfinite(one.miss)]
    counts = (caught, missed, limit_hit, len(not_begun), len(stopped) - len(not_begun))
    return (*map(str, counts), f"{np.median(misses):.2f}, {max(misses):.2f}" if misses else "-")


def between_processes(plans: Sequence[Plan]) -> None:
    """Print what became of casts whose arm is another process, and how many deadlines it missed."""
    url = f"udpm://239.255.76.67:{20000 + os.getpid() % 20000}?ttl=0"
    command = [sys.executable, "-m", "wam_cast", "robot", "--real-time", "--url", url, "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            json.loads(process.stdout.readline())
            controller = RemoteArm(Scenario(), LcmBus(url))
            outcomes, told = [], []
            for plan in plans:
                outcomes.append(controller.cast(plan.cast, plan.cup))
                told.append(json.loads(process.stdout.readline()))
        finally:
            process.terminate()
    caught, missed, limit_hit, not_begun, stopped, misses = _cells(outcomes)
    refused = sum((Counter(one["refused"]) for one in told), Counter())
    n_missed, n_ticks = (sum(one[name] for one in told) for name in ("n_missed", "n_ticks"))
    rows = [
        ("casts", str(len(plans))),
        ("caught", caught),
        ("missed", missed),
        ("met a limit of the arm, such as a motor's torque", limit_hit),
        ("not begun: the brakes stayed closed", not_begun),
        ("stopped on their way", stopped),
        ("miss [mm]: median, max", misses),
        ("samples at 500 Hz", str(n_ticks)),
        ("of them the arm's process began late", str(n_missed)),
        ("by at most [ms]", f"{max(1e3 * one['worst_lateness'] for one in told):.2f}"),
        ("commands refused", ", ".join(f"{n} {kind}" for kind, n in refused.items()) or "none"),
        ("load of the machine", f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} processors"),
    ]
    print_table(rows)


if __name__ == "__main__":
    main()
