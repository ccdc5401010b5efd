"""Grading: a folder of submissions, each run and judged by what is checked in the notebooks too."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from wam_cast.errors import InputError, checked_integer, is_finite, quoted, spelled_out
from wam_cast.parallel.workers import checked_n_workers
from wam_cast.teaching.exercises import Standing, Verdict
from wam_cast.teaching.submission import Submission, end

LIMIT = 120.0
"""Time that a notebook may take [s]."""


class Mark(NamedTuple):
    """What is said of one task in one submission; of a notebook that is none of an exercise, exercise and task are empty."""

    submission: str
    """Path of the notebook within the folder, without its suffix; letters that cannot be printed are escapes."""
    exercise: str
    task: str
    standing: str
    words: str


def find_submissions(folder: str | Path) -> list[Path]:
    """Return the notebooks in a folder and the folders in it, in order; not those in hidden folders, where Jupyter keeps copies.

    Raises
    ------
    InputError
        If there is no such folder, or no notebook in it.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder} is no folder: give the one that holds the submitted notebooks")
    every = sorted(path for path in folder.rglob("*.ipynb") if path.is_file())
    found = [path for path in every if not _is_hidden(path.relative_to(folder))]
    if not found:
        raise InputError(
            f"{folder} holds no notebook (*.ipynb), nor do the folders in it: collect the submissions there"
        )
    return found


def grade(folder: str | Path, *, seed: int = 0, limit: float = LIMIT, n_workers: int | None = None) -> pd.DataFrame:
    """Return a row for each task of each submitted notebook in a folder, with the columns of `Mark`.

    The notebooks are run: whoever wrote them may do on this machine what you may.

    Parameters
    ----------
    folder
        Where the notebooks are, in folders of their own or not.
    seed
        Draws the inputs on which answers are tried. The notebooks' own checks have 0.
    limit
        Time that a notebook may take [s].
    n_workers
        How many are run at a time; by default one per processor.

    Raises
    ------
    InputError
        If there is nothing to grade, a number is out of range, or IPython is not installed.
    """
    marks = grading(find_submissions(folder), Path(folder), seed=seed, limit=limit, n_workers=n_workers)
    return pd.DataFrame([mark for some in marks for mark in some], columns=Mark._fields)


def grading(
    notebooks: list[Path], folder: Path, *, seed: int = 0, limit: float = LIMIT, n_workers: int | None = None
) -> Iterator[list[Mark]]:
    """Give the marks of each notebook in `folder`, in order, as they come; what still runs when it is closed is ended."""
    if find_spec("IPython") is None:
        raise InputError('IPython runs the notebooks, and is not installed; pip install "wam_cast[notebooks]"')
    seed = checked_integer("seed", seed, 0)
    if not is_finite(limit) or limit <= 0:
        raise InputError(f"limit = {quoted(limit)} must be a time above 0 s")
    return _grading(notebooks, folder, seed, float(limit), checked_n_workers(n_workers))


def _grading(notebooks: list[Path], folder: Path, seed: int, limit: float, n_workers: int) -> Iterator[list[Mark]]:
    running: set[subprocess.Popen[bytes]] = set()
    pool = ThreadPoolExecutor(n_workers)
    try:
        yield from pool.map(partial(_marks, folder=folder, seed=seed, limit=limit, running=running), notebooks)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        for process in list(running):
            end(process)
        pool.shutdown()


def _marks(path: Path, *, folder: Path, seed: int, limit: float, running: set[subprocess.Popen[bytes]]) -> list[Mark]:
    name = _as_line(path.relative_to(folder).with_suffix("").as_posix())
    try:
        submission = Submission.read(path)
    except ValueError as error:
        return [Mark(name, "", "", Standing.WRONG, str(error))]
    if submission.exercise is None:
        return [Mark(name, "", "", Standing.WRONG, "it has no function of any exercise")]
    verdicts = submission.verdicts(seed, limit, running)
    return [Mark(name, submission.exercise, *_told(verdict)) for verdict in verdicts]


def _told(verdict: Verdict) -> tuple[str, str, str]:
    return verdict.task, str(verdict.standing), _as_line(verdict.words)


def _as_line(text: str) -> str:
    """Return a text of learners, who may name files and raise errors in any letters, as one line that any table can hold."""
    return spelled_out(text).replace("\n", "\\n")


def _is_hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)
