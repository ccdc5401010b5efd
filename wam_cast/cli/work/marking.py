"""`wam-cast grade`: what is right in a folder of submitted notebooks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from wam_cast.cli import options
from wam_cast.cli.results import print_json
from wam_cast.cli.terminal import err, print_table, progress
from wam_cast.errors import InputError

if TYPE_CHECKING:
    from wam_cast.teaching.grading import Mark

RIGHT = "right"
"""As `teaching.exercises.Standing` has it, which loads NumPy: `--help` does without."""


def grade(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="Holds the submitted notebooks, in folders of their own or not.")
    ],
    table: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.csv", help="Write a row for each task, with what is wrong.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Draws the inputs on which answers are tried.")] = 0,
    limit: Annotated[float, typer.Option(min=1.0, metavar="S", help="Seconds that a notebook may take.")] = 120.0,
    workers: Annotated[
        int | None, typer.Option(min=1, help="How many notebooks at a time; default: one per processor.")
    ] = None,
    as_json: options.AsJson = False,
) -> None:
    """Run the notebooks that a class has submitted, and say which tasks of the exercises they solve.

    The exit code is 0 if all of them are solved, else 1. Notebooks are programs: they may do on this machine what you may.
    """
    from wam_cast.storage.atomic import check_writable
    from wam_cast.teaching.grading import find_submissions, grading

    if table is not None:
        if table.suffix.lower() != ".csv":
            raise InputError(f"--out {table} is a table: choose a name that ends in .csv")
        check_writable(table)
    notebooks = find_submissions(directory)
    marks: list[Mark] = []
    try:
        with progress("grading", len(notebooks)) as advance:
            grades = grading(notebooks, directory, seed=seed, limit=limit, n_workers=workers)
            for done, some in enumerate(grades, 1):
                marks += some
                advance(done)
    finally:
        # What was finished is told even if the rest is interrupted.
        if marks:
            _tell(marks, table, as_json=as_json)
    if any(mark.standing != RIGHT for mark in marks):
        raise typer.Exit(1)


class _Line(NamedTuple):
    submission: str
    exercise: str
    right: str
    first_to_mend: str


def _tell(marks: list[Mark], table: Path | None, *, as_json: bool) -> None:
    if table is not None:
        import pandas as pd

        from wam_cast.storage.atomic import write_file

        write_file(table, pd.DataFrame(marks).to_csv(index=False).encode())
    if as_json:
        print_json([mark._asdict() for mark in marks])
        return
    lines = []
    for name in dict.fromkeys(mark.submission for mark in marks):
        own = [mark for mark in marks if mark.submission == name]
        flawed = [mark for mark in own if mark.standing != RIGHT]
        first = ": ".join(filter(None, (flawed[0].task, flawed[0].standing, flawed[0].words))) if flawed else ""
        lines.append(_Line(name, own[0].exercise, f"{len(own) - len(flawed)} of {len(own)}", first))
    print_table(lines, ("submission", "exercise", "right", "first to mend"))
    if table is not None:
        err.print(f"a row for each task: {table}")
