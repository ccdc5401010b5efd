"""Standard output for results, standard error for messages and progress; nothing printed there steers the terminal."""

from __future__ import annotations

import io
import logging
import os
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Literal

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from wam_cast.errors import spelled_out


class Terminal(Console):
    """A console on which what cannot be printed is spelled out, such as the escapes and the stray bytes of a file's name."""

    def render_str(self, text: str, **options: Any) -> Text:
        """Return the text as Rich prints it."""
        return super().render_str(spelled_out(text), **options)


# A terminal that does not know its width says 0, and Rich would print nothing.
if not os.environ.get("COLUMNS", "80").strip("0"):
    del os.environ["COLUMNS"]

# Nothing is taken for markup: [m] is a unit, and any name may be a file's.
out = Terminal(soft_wrap=True, highlight=False, markup=False, emoji=False)
err = Terminal(stderr=True, soft_wrap=True, highlight=False, markup=False, emoji=False)


HELP_STYLE: Literal["rich"] | None = "rich" if shutil.get_terminal_size().columns >= 60 else None
"""Of Typer: on narrower terminals Rich cuts words of the help off."""


class _Messages(logging.Handler):
    """Prints what the package logs."""

    def emit(self, record: logging.LogRecord) -> None:
        err.print(record.getMessage())


def prepare_streams() -> None:
    """Make standard streams that can be written whatever was handed to the process, and print there what the package logs."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:  # closed: the next file would get its number, and what Drake prints
            setattr(sys, name, open(os.devnull, mode))  # noqa: PTH123, SIM115 - it stays open, as streams do
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # letters that the terminal does not have
    logger = logging.getLogger("wam_cast")
    if not logger.handlers:
        logger.addHandler(_Messages())


def give_up_lost_streams() -> None:
    """Let what standard streams still hold and cannot write go nowhere, lest Python complain of it in the end."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def print_table(rows: Sequence[Sequence[str]], headings: Sequence[str] = ()) -> None:
    """Print a table if the terminal is wide enough for it, else a line for each value; no digit is cut off.

    Without `headings` the first value of each row names the second.
    """
    table = Table(*headings, show_header=bool(headings))
    for row in rows:
        table.add_row(*row)
    if out.measure(table, options=out.options.update(max_width=sys.maxsize)).maximum <= out.width:
        out.print(table)
        return
    for row in rows:
        for name, value in zip(headings, row, strict=True) if headings else [row]:
            out.print(f"{' '.join(name.split())}: {value}")
        if headings:
            out.print()


class GrowingTable:
    """A table whose rows are printed as they come; if the terminal is too narrow for it, a line for each value.

    Parameters
    ----------
    widths
        Of the columns [letters], by their headings, which may have two lines.
    """

    def __init__(self, widths: Mapping[str, int]) -> None:
        self._widths = dict(widths)
        self._is_table = sum(self._widths.values()) + len(GAP) * (len(self._widths) - 1) <= out.width
        self._is_begun = False

    def add(self, *values: str) -> None:
        """Print a row, the first one below the headings: where none comes, nothing is printed."""
        if not self._is_table:
            for heading, value in zip(self._widths, values, strict=True):
                out.print(f"{' '.join(heading.split())}: {value}")
            out.print()
            return
        if not self._is_begun:
            headings = [f"{heading}\n".split("\n")[:2] for heading in self._widths]
            for line in zip(*headings, strict=True):
                self._print_line(line)
            self._is_begun = True
        self._print_line(values)

    def _print_line(self, values: Sequence[str]) -> None:
        cells = [value.ljust(width) for value, width in zip(values, self._widths.values(), strict=True)]
        out.print(GAP.join(cells).rstrip())


GAP = "  "
"""Between two columns of a table that grows."""


@contextmanager
def progress(what: str, total: int | None = None) -> Iterator[Callable[[int], None]]:
    """Show progress on standard error if that is a terminal; give the function that takes how much is done."""
    columns = [SpinnerColumn(), TextColumn("{task.description}")]
    if total is not None:
        columns += [BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()]
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        task = bar.add_task(what, total=total)
        yield lambda done: bar.update(task, completed=done)


@contextmanager
def phase_progress() -> Iterator[Callable[[str, int, int], None]]:
    """Show a bar for each phase, with its time left; give the function that takes title, how much is done, and how much there is.

    If standard error is no terminal, a line tells that a phase begins.
    """
    columns = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()]
    columns += [TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn()]
    with Progress(*columns, console=err, disable=not err.is_terminal) as bar:
        tasks: dict[str, TaskID] = {}

        def report(title: str, done: int, total: int) -> None:
            if title not in tasks:
                tasks[title] = bar.add_task(title, total=total)
                if not err.is_terminal:
                    err.print(title)
            bar.update(tasks[title], completed=done, total=total)

        yield report
