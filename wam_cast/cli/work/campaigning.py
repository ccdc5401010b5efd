"""`wam-cast learn`: a campaign on one robot, cast by cast."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

import wam_cast as wc
from wam_cast.cli import model_choice, options
from wam_cast.cli.options import parse_cup
from wam_cast.cli.results import format_position, print_json
from wam_cast.cli.terminal import GrowingTable, out, progress

if TYPE_CHECKING:
    from wam_cast.adaptation.campaign import Campaign
    from wam_cast.adaptation.campaign_directory import Row

# Its values stand in `adaptation.methods` too, which loads Drake: `--help` does without.
Method = Annotated[
    Literal["prior", "identification", "residual", "affine", "shift", "closed form", "nominal"],
    typer.Option(
        help="How it learns: `prior` knows how robots differ; `identification` finds physical parameters, in half a minute a cast; "
        "the next three learn how far the landings are off, by a smooth function, by one with slopes, by a number; `closed form` "
        "is `residual` on a point mass; `nominal` learns nothing."
    ),
]

Observe = Annotated[
    Literal["direct", "camera"],
    typer.Option(
        help="How the landing is known: `direct` measures it, to 2 mm in x and in y; `camera` looks with the cameras of the "
        "robot's file, with two if it has none, which takes seconds a cast."
    ),
]

COLUMNS = {
    "cast": 4,
    "cup\n[m]": 16,
    "predicted\nmiss [mm]": 11,
    "observed\nlanding [m]": 16,
    "miss\n[mm]": 6,
    "status": 13,
}
"""Headings of the table, and how wide its columns are."""


def learn(
    robot: Annotated[
        Path, typer.Option(metavar="FILE", help="YAML file of the robot that casts; nothing else is told of it.")
    ],
    cup: options.Cups,
    directory: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Where each cast is kept; a campaign goes on there.")
    ],
    casts: Annotated[int, typer.Option(min=1, help="How many in all; several cups are cast at in turn.")] = 10,
    scenario: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="What the robot is believed to be; default: the reference scenario, with the robot's noise.",
        ),
    ] = None,
    method: Method = "prior",
    observe: Observe = "direct",
    model: options.Model = None,
    train: options.Train = False,
    seed: Annotated[int, typer.Option(min=0, help="Draws the robot's noise, and that of what is observed.")] = 0,
    as_json: options.AsJson = False,
) -> None:
    """Let a robot cast that is not what it is believed to be, and learn from each cast before the next one is planned.

    The robot is simulated, and only answers where the ball was seen to land and whether the cup caught it. Each cast is kept before
    anything else is done: an interrupted campaign goes on when it is started again, and further with more --casts. The answer is no
    if no cast was caught.
    """
    from wam_cast.adaptation.campaign import run_campaign
    from wam_cast.adaptation.campaign_directory import CampaignDirectory
    from wam_cast.adaptation.methods import adaptive_model
    from wam_cast.adaptation.robot import SimulatedRobot
    from wam_cast.adaptation.robot_distribution import RobotDistribution

    cups = [parse_cup(text) for text in cup]
    truth = wc.Scenario.from_yaml(robot)
    CampaignDirectory.is_begun(directory)
    belief, forward = model_choice.scenario_and_model(scenario, model, train)
    if scenario is model is None:
        belief = belief.model_copy(update={"noise": truth.noise})
        forward = forward.bound_to(belief)
    with progress("learning what robots like it do"):
        before = adaptive_model(method, RobotDistribution(belief), forward)
    rows: list[Row] = []
    table = None if as_json else GrowingTable(COLUMNS)

    def note(row: Row) -> None:
        rows.append(row)
        if table is not None:
            table.add(*_cells(row))

    command = model_choice.command_line(
        "learn",
        robot=robot,
        cup=cup,
        casts=casts,
        out=directory,
        scenario=scenario,
        method=method,
        observe=observe,
        model=model,
        seed=seed,
    )
    with model_choice.telling_how_to_go_on(command, lambda: f"{len(rows)} of {casts} casts are kept in {directory}"):
        campaign = run_campaign(
            SimulatedRobot(truth, belief, seed=seed, observe=observe),
            before,
            cups,
            casts,
            directory,
            settings={"robot": truth.model_dump(mode="json"), "method": method, "observe": observe, "seed": seed},
            on_cast=note,
        )
    if as_json:
        summary = {"n_caught": campaign.n_caught, "first_caught": campaign.first_caught}
        given = {"directory": str(directory), "method": method, "observe": observe, "seed": seed}
        print_json({**given, **summary, "casts": [_record(row) for row in rows]})
    else:
        _print_summary(campaign, rows, f"; see that the cameras of {robot} look there" if observe == "camera" else "")
    if not campaign.n_caught:
        raise typer.Exit(1)


def _cells(row: Row) -> list[str]:
    has_landed = math.isfinite(row["miss"])
    return [
        str(row["number"]),
        format_position((row["cup_x"], row["cup_y"])),
        f"{1e3 * _predicted_miss(row):.1f} ({1e3 * row['predicted_std_along']:.1f})",
        format_position((row["landing_x"], row["landing_y"])) if has_landed else "-",
        f"{1e3 * row['miss']:.1f}" if has_landed else "-",
        row["status"],
    ]


def _print_summary(campaign: Campaign, rows: list[Row], advice: str) -> None:
    """Print what a table has no room for, with `advice` if no landing was seen, and how many casts were caught."""
    out.print("in brackets: predictive standard deviation along the casting plane")
    for row in rows:
        if row["limits_hit"]:
            out.print(f"cast {row['number']}: the arm met the limit of {', '.join(row['limits_hit'])}")
    for row in {(row["cup_x"], row["cup_y"]): row for row in rows}.values():  # the last for each cup
        if not row["is_feasible"]:
            cup = format_position((row["cup_x"], row["cup_y"]))
            out.print(f"cup {cup}: the last cast was not predicted to end in it for sure ({row['reason']})")
    if not any(math.isfinite(row["miss"]) for row in rows):
        out.print(f"no landing was seen in any cast, so that nothing was learned{advice}")
    first = "" if campaign.first_caught is None else f", the first of them cast {campaign.first_caught}"
    out.print(f"{campaign.n_caught} of {len(rows)} caught{first}")


def _record(row: Row) -> dict[str, Any]:
    """Return what `learn --json` prints of a cast; keys that `throw --json` has too mean the same."""
    return {
        "number": row["number"],
        "cup": [row["cup_x"], row["cup_y"]],
        "cast": {name: row[name] for name in ("distance", "speed", "wait", "bearing")},
        "predicted_landing": [row["predicted_x"], row["predicted_y"]],
        "predicted_miss": _predicted_miss(row),
        "predicted_std": [row["predicted_std_along"], row["predicted_std_across"]],
        "is_feasible": row["is_feasible"],
        "reason": row["reason"],
        "landing": [row["landing_x"], row["landing_y"]],
        "landing_std": row["landing_std"],
        "miss": row["miss"],
        "status": row["status"],
        "is_caught": row["is_caught"],
        "limits_hit": row["limits_hit"],
    }


def _predicted_miss(row: Row) -> float:
    return math.dist((row["predicted_x"], row["predicted_y"]), (row["cup_x"], row["cup_y"]))
