"""Submission: a learner's notebook, run in a process of its own, and what is to be said of its answers.

It is somebody else's program, and may write files, never end, or end the process that it runs in. IPython runs its cells, as it
does in Jupyter: whatever is right there is right here.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from wam_cast.teaching.answer import described
from wam_cast.teaching.exercises import EXERCISES, Standing, Verdict, judged
from wam_cast.text_file import read_text

LARGEST_NOTEBOOK = 50_000_000
"""Bytes: what pictures in outputs may come to."""

LARGEST_ANSWERS = 100_000
"""Bytes: a line for each of a few tasks."""

BINDING = re.compile(r"^(?:async +)?def +(\w+)|^(\w+) *=(?!=)", re.MULTILINE)
"""A name that a cell gives to a function, also where the cell as a whole is no Python."""


@dataclass(frozen=True)
class Submission:
    """The code cells of a notebook, and the exercise whose tasks' functions it has most of; none if it has none of any."""

    cells: tuple[str, ...]
    exercise: str | None

    @classmethod
    def read(cls, path: Path) -> Submission:
        """Read a notebook. Raises `ValueError` if it is none."""
        try:
            content = json.loads(read_text(path, LARGEST_NOTEBOOK))
            code = [cell["source"] for cell in content["cells"] if cell["cell_type"] == "code"]
            cells = tuple("".join(source).encode(errors="replace").decode() for source in code)
        except OSError as error:
            reason = (error.strerror or "no file that can be read").lower()
            raise ValueError(f"it cannot be read as a notebook: {reason}") from error
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise ValueError("it cannot be read as a notebook") from error
        defined = {name for cell in cells for name in _names_in(cell)}
        found = {name: len(defined & tasks.keys()) for name, tasks in EXERCISES.items()}
        best = max(found, key=lambda name: found[name])
        return cls(cells, best if found[best] else None)

    def process(self, seed: int, folder: Path, answers: IO[bytes]) -> subprocess.Popen[bytes]:
        """Start the process that runs it in an empty `folder`, and writes what is said of its answers to an open file."""
        (folder / "cells.json").write_text(json.dumps([self.exercise, self.cells, seed]))
        environment = {
            "MPLBACKEND": "agg",
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
            "IPYTHONDIR": str(folder / ".ipython"),  # nobody's startup files
            "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
        }
        return subprocess.Popen(
            [sys.executable, "-m", "wam_cast.teaching.submission", "cells.json"],
            cwd=folder,
            env=os.environ | environment,
            stdin=subprocess.DEVNULL,
            stdout=answers,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # so that what it starts ends with it
        )

    def verdicts(self, seed: int, limit: float, running: set[subprocess.Popen[bytes]]) -> list[Verdict]:
        """Run it for at most `limit` seconds, and return what is to be said of each task; its process is in `running` meanwhile."""
        assert self.exercise is not None
        with (
            tempfile.TemporaryDirectory(prefix="wam_cast-", ignore_cleanup_errors=True) as folder,
            tempfile.TemporaryFile() as answers,
        ):
            process = self.process(seed, Path(folder), answers)
            running.add(process)
            words = "the notebook ended Python"
            try:
                process.wait(limit)
            except subprocess.TimeoutExpired:
                words = f"the notebook ran longer than {limit:g} s"
            finally:
                end(process)
                running.discard(process)
            answers.seek(0)
            try:
                said = json.loads(answers.read(LARGEST_ANSWERS))
                return [Verdict(str(task), Standing(standing), str(text)) for task, standing, text in said]
            except (ValueError, TypeError, RecursionError):  # the notebook may have written there too
                return [Verdict(task, Standing.WRONG, words) for task in EXERCISES[self.exercise]]


def end(process: subprocess.Popen[bytes]) -> None:
    """End a process and all that it started."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _names_in(cell: str) -> set[str]:
    return {of_function or of_value for of_function, of_value in BINDING.findall(cell)}


def _run(cells: list[str]) -> tuple[dict[str, Any], dict[str, str]]:
    """Run cells in one namespace, the next one after a failure too; return it, and why cells failed, by the names they bind."""
    from IPython.core.interactiveshell import InteractiveShell
    from traitlets.config import Config

    shell: Any = InteractiveShell.instance(config=Config(HistoryManager={"enabled": False}))
    failures: dict[str, str] = {}
    for cell in cells:
        result = shell.run_cell(cell)
        if error := result.error_before_exec or result.error_in_exec:
            failures |= dict.fromkeys(_names_in(cell), described(error))
    return shell.user_ns, failures


def _main(read: str) -> None:
    exercise, cells, seed = json.loads(Path(read).read_text(encoding="utf-8"))
    judges, said = EXERCISES[exercise], []
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as answers:
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), 1)  # what cells print is no answer
        namespace, failures = _run(cells)
        for task, judge in judges.items():
            answer = namespace.get(task)
            verdict = judged(task, judge, answer, seed) if callable(answer) else Verdict(task, Standing.NOT_YET)
            if verdict.standing is Standing.NOT_YET and task in failures:
                verdict = Verdict(task, Standing.WRONG, failures[task])
            said.append((task, verdict.standing, verdict.words))
        json.dump(said, answers)


if __name__ == "__main__":
    _main(*sys.argv[1:])
