"""`wam-cast transfer`: the experiment on robots that nobody told it about."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from wam_cast.cli import model_choice, options
from wam_cast.cli.results import print_json
from wam_cast.cli.terminal import out, phase_progress, print_table

if TYPE_CHECKING:
    from wam_cast.experiments.transfer.transfer_summary import TransferSummary


def transfer(
    directory: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where the report goes.")],
    seed: Annotated[int, typer.Option(min=0, help="Draws the robots, the cups and the noise.")] = 0,
    quick: Annotated[
        bool, typer.Option("--quick", metavar="", help="With two robots of each group and 4 cups.")
    ] = False,
    robots: Annotated[
        int | None,
        typer.Option(min=1, max=10_000, help="In each of three groups; default 30. A run goes on to more of them."),
    ] = None,
    cups: Annotated[int | None, typer.Option(min=2, max=1000, help="For each robot; default 20.")] = None,
    scenario: options.Scenario = None,
    model: options.Model = None,
    train: options.Train = False,
    workers: options.Workers = None,
    engine: options.Engine = "drake",
    as_json: options.AsJson = False,
) -> None:
    """Cast with robots that differ from what is believed, adapt to each, and write a report.

    Robots are drawn within documented ranges, within twice these, and beyond. All ways to adapt are compared after 0 to 20 practice
    casts. An interrupted run goes on, robot by robot, when it is started again.
    """
    from wam_cast.experiments.transfer.transfer import TransferDirectory
    from wam_cast.experiments.transfer.transfer import transfer as run
    from wam_cast.generation.engines import checked_engine

    belief, forward = model_choice.scenario_and_model(scenario, model, train)
    checked_engine(engine, belief, has_own_controller=False)
    TransferDirectory.is_begun(directory)
    command = model_choice.command_line(
        "transfer",
        seed=seed,
        out=directory,
        robots=robots,
        cups=cups,
        scenario=scenario,
        model=model,
        workers=workers,
        engine=None if engine == "drake" else engine,
        quick=quick,
    )
    with (
        phase_progress() as report,
        model_choice.telling_how_to_go_on(command, lambda: f"what is finished is kept in {directory}"),
    ):
        summary = run(
            belief,
            directory,
            seed,
            quick=quick,
            n_robots=robots,
            n_cups=cups,
            believed=forward,
            engine=engine,
            n_workers=workers,
            on_progress=report,
        )
    if as_json:
        tables = {
            name: getattr(summary, name).to_dict("records") for name in ("bias", "hits", "calibration", "campaigns")
        }
        print_json({"directory": str(directory), **tables})
    else:
        _print_summary(summary, directory)


def _print_summary(summary: TransferSummary, directory: Path) -> None:
    """Print what the best method came to."""
    from wam_cast.experiments.transfer.transfer_settings import BEST, CUPS

    best = summary.bias[summary.bias["method"] == BEST].merge(
        summary.hits[summary.hits["cup"] == next(iter(CUPS))], on=["group", "method", "k"], suffixes=("", "_tried")
    )
    rows = [
        [
            row["group"],
            str(row["k"]),
            *(f"{1e3 * row[name]:.1f}" for name in ("median", "p95", "max")),
            f"{row['n_caught']} of {row['n_tried']}",
        ]
        for row in best.to_dict("records")
    ]
    print_table(
        rows, ["robots", "practice\ncasts", "bias [mm]\nmedian", "bias [mm]\n95 %", "bias [mm]\nlargest", "caught"]
    )
    out.print("bias: how far a cast lands from the cup's middle without noise")
    out.print(f"report: {directory / 'report.html'}")
