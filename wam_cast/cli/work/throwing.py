"""What `throw` and `plan` do: casts for cups, planned or given, and their execution."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import wam_cast as wc
from wam_cast.cli import options
from wam_cast.cli.options import parse_cast
from wam_cast.cli.terminal import err, progress
from wam_cast.cli.work.output_files import ThrowFiles
from wam_cast.errors import InputError, quoted

if TYPE_CHECKING:
    from wam_cast.types import Position


def make_plans(
    model: wc.ForwardModel, cups: list[Position], planner: options.Planner, solver: options.Solver
) -> list[wc.Plan]:
    """Plan a cast for each cup."""
    plans = []
    with progress("planning", len(cups)) as advance:
        for done, cup in enumerate(cups, 1):
            plans.append(wc.plan_cast(model, cup, planner, solver))
            advance(done)
    return plans


def given_throws(scenario: wc.Scenario, casts: list[str], cups: list[Position]) -> list[wc.Throw]:
    """Return the casts that `--cast` gives, each with its cup. Raises `.InputError`."""
    from wam_cast.cast import is_allowed

    if len(casts) != len(cups):
        raise InputError(f"--cast: {len(casts)} for {len(cups)} cups; give as many --cast as --cup, in the same order")
    throws = [wc.Throw(parse_cast(text, cup), cup) for text, cup in zip(casts, cups, strict=True)]
    for text, throw in zip(casts, throws, strict=True):
        if not is_allowed(scenario, throw.cast.to_array()):
            bounds = ", ".join(f"{name} {low:g} to {high:g}" for name, (low, high) in scenario.bounds)
            raise InputError(
                f"--cast {quoted(text)} is beyond the scenario's bounds ({bounds}; a move of "
                f"{scenario.motion.min_move_duration:g} s at least); choose another, or widen the scenario's"
            )
    return throws


def execute(
    robot: wc.Scenario,
    belief: wc.Scenario,
    throws: list[wc.Throw],
    plans: Sequence[wc.Plan | None],
    seed: int,
    files: ThrowFiles,
    on_outcome: Callable[[wc.Outcome], None],
) -> None:
    """Execute casts after each other; if it is to be shown, to the end of the last return, and write what is wanted.

    If that is interrupted, write what was recorded of it.
    """
    if files.is_any_wanted:
        files.check_scene(robot)
        simulator, recordings = wc.CastSimulator(robot, belief), list[wc.CastRecording]()
        landings = [None if plan is None else plan.predicted_landing for plan in plans]
        try:
            simulator.record_sequence(throws, noise_seed=seed, on_outcome=on_outcome, on_recording=recordings.append)
        except KeyboardInterrupt:
            if recordings:
                err.print(f"interrupted: {len(recordings)} of {len(throws)} casts are shown")
                files.write(recordings, landings[: len(recordings)])
            raise
        files.write(recordings, landings)
    else:
        casts, cups = [throw.cast for throw in throws], [throw.cup for throw in throws]
        wc.simulate_casts(robot, casts, cups, belief=belief, noise_seed=seed, on_outcome=on_outcome)


def check_remote(url: str, belief: Path | None, files: ThrowFiles) -> None:
    """Raise `.InputError` if an arm elsewhere cannot do what is asked for, before anything is planned."""
    from wam_cast.wire.bus import check_url

    check_url(url)
    if belief is not None:
        raise InputError(
            "--belief: what the robot is its own side knows; leave --belief out, and name what it is believed to be with --scenario"
        )
    if files.is_any_wanted:
        raise InputError(
            "--replay, --picture, --animation and --recording show what is simulated in this process, and --robot is another; "
            "leave them out"
        )


def execute_remotely(
    url: str, belief: wc.Scenario, throws: list[wc.Throw], seed: int, on_outcome: Callable[[wc.Outcome], None]
) -> None:
    """Have the arm at an address execute casts, each from rest at home."""
    from wam_cast.wire.bus import LcmBus
    from wam_cast.wire.remote_arm import RemoteArm

    arm = RemoteArm(belief, LcmBus(url))
    for i, throw in enumerate(throws):
        on_outcome(arm.cast(throw.cast, throw.cup, noise_seed=seed + i))
