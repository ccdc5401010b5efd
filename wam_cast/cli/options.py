"""The options that several commands share and those of `throw`, and what a cup and a cast are on the command line."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

import wam_cast as wc
from wam_cast.errors import InputError, quoted

if TYPE_CHECKING:
    from wam_cast.types import Position

AsJson = Annotated[bool, typer.Option("--json", metavar="", help="Print the result as JSON.")]
Cups = Annotated[
    list[str], typer.Option("--cup", metavar="X[,Y]", help="The cup's axis in metres; default of Y: 0. Repeatable.")
]
Belief = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="What the robot of --scenario is believed to be: what is planned and controlled with. Default: the same.",
    ),
]
GivenCasts = Annotated[
    list[str] | None,
    typer.Option(
        metavar="D,S,W[,B]",
        help="Execute this cast instead of planning: distance [m], speed [m/s], wait [s], bearing [deg]; default of B: toward "
        "the cup. Needs no model. One for each --cup.",
    ),
]
Robot = Annotated[
    str | None,
    typer.Option(
        metavar="URL",
        help="Where an arm listens that is to cast, such as `wam-cast robot` says; --scenario is then what it is believed to be.",
    ),
]
Replay = Annotated[Path | None, typer.Option(metavar="FILE.html", help="Write a replay that opens in a browser.")]
FilmStrip = Annotated[
    Path | None, typer.Option(metavar="FILE.png", help="Write a film strip of one cast (also .pdf, .svg).")
]
Film = Annotated[
    Path | None, typer.Option(metavar="FILE.gif", help="Write a film of one cast, without its return (also .mp4).")
]
Recording = Annotated[
    Path | None,
    typer.Option(metavar="FILE.mcap", help="Write a recording that Foxglove and Rerun open (needs the extra `mcap`)."),
]
Speed = Annotated[
    float,
    typer.Option(
        min=0.05,
        max=10.0,
        metavar="X",
        help="Of the replay and the film, relative to the robot's: 0.25 is slow motion.",
    ),
]
NoiseSeed = Annotated[
    int,
    typer.Option(
        min=0,
        metavar="S",
        help="Draws the scenario's noise, for the next cups with S+1, S+2 and so on. No effect without noise.",
    ),
]
Model = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="What `wam-cast fit` wrote; its scenario holds unless --scenario names one. Default: the scenario's own.",
    ),
]
Scenario = Annotated[Path | None, typer.Option(metavar="FILE", help="YAML file; default: the reference scenario.")]
Engine = Annotated[
    Literal["drake", "batch"],
    typer.Option(help="What simulates casts without a cup: drake, or many at once (needs the extra `batch`)."),
]
Train = Annotated[bool, typer.Option("--train", metavar="", help="Make the scenario's model first if it has none.")]
Force = Annotated[
    bool,
    typer.Option(
        "--force", metavar="", help="Simulate parts anew that are not what they must be; they go to DIR/set_aside."
    ),
]
# As many as `parallel.workers` allows, which `--help` does without.
Workers = Annotated[int | None, typer.Option(min=1, max=1000, help="Number of processes; default: one per processor.")]

# Their values stand in `planning.plan` too, which loads Drake: `--help` does without.
Planner = Annotated[Literal["program", "gradient"], typer.Option(help="`gradient` is the paper's.")]
Solver = Annotated[Literal["snopt", "ipopt", "nlopt"] | None, typer.Option(help="Of the program; default: snopt.")]


def parse_cast(text: str, cup: Position) -> wc.Cast:
    """Return the cast `D,S,W[,B]`, B in degrees, by default toward the cup. Raises `.InputError`."""
    from wam_cast.casting_plane import to_polar

    numbers = text.split(",")
    toward_cup = str(math.degrees(to_polar(cup)[1]))
    try:
        distance, speed, wait, bearing = map(float, [*numbers, toward_cup] if len(numbers) == 3 else numbers)
    except ValueError:
        raise InputError(
            f"--cast {quoted(text)} is no cast: give distance [m], speed [m/s], wait [s] and, if it is not toward the cup, the "
            "bearing [deg], such as --cast 0.30,0.60,0.10 or --cast 0.30,0.60,0.10,45"
        ) from None
    try:
        return wc.Cast(distance, speed, wait, math.radians(bearing))
    except InputError as error:
        raise InputError(f"--cast {quoted(text)}: {error}") from None


def parse_cup(text: str) -> Position:
    """Return world (x, y) of `X` or `X,Y`. Raises `.InputError`."""
    numbers = text.split(",")
    try:
        x, y = (float(number) for number in (numbers if len(numbers) == 2 else [*numbers, "0"]))
    except ValueError:
        raise InputError(
            f"--cup {quoted(text)} is not a position: give X or X,Y in metres, such as --cup 0.75 or --cup 0.60,-0.25"
        ) from None
    if not (math.isfinite(x) and math.isfinite(y)):
        raise InputError(f"--cup {quoted(text)} is not finite: give X or X,Y in metres, such as --cup 0.75")
    return x, y
