"""`wam-cast crosscheck`: the same casts through all engines."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from wam_cast.cli import model_choice, options
from wam_cast.cli.results import print_json
from wam_cast.cli.terminal import err, out, phase_progress, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from wam_cast.crosscheck.engine_comparison import EngineComparison
    from wam_cast.crosscheck.verdict_comparison import Verdicts

HEADINGS = (
    *("landing\n[mm]", "ball's path\n[mm]", "entry speed\n[mm/s]", "entry angle\n[mrad]"),
    *("peak torque\n[%]", "peak velocity\n[%]"),
)


def crosscheck(
    casts: Annotated[int, typer.Option(min=1, max=10_000, help="How many random casts.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Draws the casts: row i of a seed is always the same.")] = 0,
    scenario: options.Scenario = None,
    cups: Annotated[
        bool, typer.Option("--cups", metavar="", help="Compare verdicts too, with cups off the landings.")
    ] = False,
    as_json: options.AsJson = False,
) -> None:
    """Simulate the same casts in Drake, in MuJoCo and by the batched engine, and tell how far they are from each other.

    MuJoCo's robot is made from the scenario's numbers alone, and its control law written for it. The answer is no if landings of
    Drake, converged, or of the batched engine differ from MuJoCo's, converged, by more than 0.01 mm at the median or 0.1 mm at
    most, or a cast ends otherwise.
    """
    from wam_cast.crosscheck.engine_comparison import compare_engines
    from wam_cast.crosscheck.verdict_comparison import compare_verdicts

    setting = model_choice.load_scenario(scenario)
    verdicts: list[Verdicts] = []
    with phase_progress() as report:
        comparison = compare_engines(setting, casts, seed, on_progress=report)
        if cups:
            verdicts = compare_verdicts(setting, casts, seed, on_progress=lambda done: report("with cups", done, casts))
    if comparison.left_out:
        err.print(f"the batched engine is left out: {comparison.left_out}")
    if as_json:
        with_cups = {"cups": [{**asdict(one), "is_same": one.is_same} for one in verdicts]} if cups else {}
        print_json({**comparison.record(), **with_cups})
    else:
        _print_comparison(comparison)
        if cups:
            _print_verdicts(verdicts)
    if not comparison.agrees:
        raise typer.Exit(1)


def _print_comparison(comparison: EngineComparison) -> None:
    from wam_cast.crosscheck.engine_comparison import BATCH, MUJOCO_CONVERGED, QUANTITIES, percentiles

    rows, remarks = [], []
    for engine in comparison.frames:
        if engine == MUJOCO_CONVERGED:
            continue
        off, n_other = comparison.differences(engine), comparison.n_other_statuses(engine)
        columns = [percentiles(scale * off[name].to_numpy()) for name, scale in QUANTITIES.items()]
        rows += [(engine, share, *(f"{column[share]:.2g}" for column in columns)) for share in columns[0]]
        if n_other:
            remarks.append(f"{engine}: {n_other} casts end otherwise; {len(off)} that land in both are compared")
    out.print("off MuJoCo, converged")
    print_table(rows, ("engine", "of casts", *HEADINGS))
    for remark in remarks:
        out.print(remark)
    n_casts = len(comparison.frames[MUJOCO_CONVERGED])
    engines = "Drake, MuJoCo and the batched engine" if BATCH in comparison.frames else "Drake and MuJoCo"
    out.print(f"the landings of {n_casts} casts {'agree' if comparison.agrees else 'do not agree'} between {engines}")


def _print_verdicts(verdicts: Sequence[Verdicts]) -> None:
    rows = []
    for offset in sorted({one.offset for one in verdicts}):
        group = [one for one in verdicts if one.offset == offset]
        caught = [sum(getattr(one, name) == "caught" for one in group) for name in ("drake", "mujoco", "mujoco_own")]
        same = [sum(getattr(one, name) == one.drake for one in group) for name in ("mujoco", "mujoco_own")]
        rows.append((f"{1e3 * offset:g}", *map(str, (len(group), *caught, *same))))
    out.print("into cups off the landing: MuJoCo by Drake's law of contact, and by its own")
    caught_by = ("caught in\nDrake", "in MuJoCo", "by its own")
    print_table(rows, ("off [mm]", "casts", *caught_by, "as in Drake:\nMuJoCo", "by its own"))
    for one in verdicts:
        if not one.is_same:
            rim = "touched the rim" if one.touched_rim else "did not touch the rim"
            out.print(
                f"cast {one.cast}, {1e3 * one.offset:g} mm off: {one.drake} in Drake, {one.mujoco} in MuJoCo, {one.mujoco_own} by "
                f"its own contact; the ball {rim}"
            )
