"""Submission: a learner's notebook, run in a process of its own, and what is to be said of its answers.

It is somebody else's program, and may write files, never end, or end the process that it runs in.
"""

from __future__ import annotations

import ast
import json
import os
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wam_cast.teaching.exercises import EXERCISES, Standing, Verdict, judged

ANSWERS = "answers.json"
"""What the process leaves in its folder."""


@dataclass(frozen=True)
class Submission:
    """The code cells of a notebook, and the exercise whose tasks' functions it has most of; none if it has none of any."""

    cells: tuple[str, ...]
    exercise: str | None

    @classmethod
    def read(cls, path: Path) -> Submission:
        """Read a notebook. Raises `ValueError` if it is none."""
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            code = [cell["source"] for cell in content["cells"] if cell["cell_type"] == "code"]
            cells = tuple(_plain("".join(source)) for source in code)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ValueError("it cannot be read as a notebook") from error
        defined = {name for cell in cells for name in _functions_of(cell)}
        found = {name: len(defined & tasks.keys()) for name, tasks in EXERCISES.items()}
        best = max(found, key=lambda name: found[name])
        return cls(cells, best if found[best] else None)

    def process(self, seed: int, folder: Path) -> subprocess.Popen[bytes]:
        """Start the process that runs it and writes what is said of its answers to a file in an empty `folder`."""
        (folder / "cells.json").write_text(json.dumps([self.exercise, self.cells, seed]))
        environment = os.environ | {"MPLBACKEND": "agg", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        command = [sys.executable, "-m", "wam_cast.teaching.submission", "cells.json", ANSWERS]
        return subprocess.Popen(
            command,
            cwd=folder,
            env=environment | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # so that what it starts ends with it
        )

    def verdicts(self, seed: int, limit: float, running: set[subprocess.Popen[bytes]]) -> list[Verdict]:
        """Run it for at most `limit` seconds, and return what is to be said of each task; its process is in `running` meanwhile."""
        assert self.exercise is not None
        with tempfile.TemporaryDirectory(prefix="wam_cast-", ignore_cleanup_errors=True) as folder:
            process = self.process(seed, Path(folder))
            running.add(process)
            words = "the notebook ended Python"
            try:
                process.wait(limit)
            except subprocess.TimeoutExpired:
                words = f"the notebook ran longer than {limit:g} s"
            finally:
                end(process)
                running.discard(process)
            try:
                said = json.loads((Path(folder) / ANSWERS).read_text(encoding="utf-8"))
                return [Verdict(task, Standing(standing), text) for task, standing, text in said]
            except (OSError, ValueError):
                return [Verdict(task, Standing.WRONG, words) for task in EXERCISES[self.exercise]]


def end(process: subprocess.Popen[bytes]) -> None:
    """End a process and all that it started."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def _plain(source: str) -> str:
    """Return a cell without the lines that only a notebook understands."""
    lines = source.split("\n")
    return "\n".join("" if line.lstrip().startswith(("%", "!")) else line for line in lines)


def _functions_of(cell: str) -> list[str]:
    try:
        tree = ast.parse(cell)
    except (SyntaxError, ValueError):
        return []
    return [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]


def _run(cells: list[str]) -> dict[str, Any]:
    """Run cells in one namespace and return it; a cell that fails ends, and the next one is run."""
    namespace: dict[str, Any] = {"__name__": "__main__"}
    for number, cell in enumerate(cells, 1):
        with suppress(Exception, SystemExit):
            exec(compile(cell, f"cell {number}", "exec"), namespace)
    return namespace


def _main(read: str, write: str) -> None:
    exercise, cells, seed = json.loads(Path(read).read_text(encoding="utf-8"))
    judges, target = EXERCISES[exercise], Path(write).resolve()
    namespace, said = _run(cells), []
    for task, judge in judges.items():
        answer = namespace.get(task)
        verdict = judged(task, judge, answer, seed) if callable(answer) else Verdict(task, Standing.NOT_YET)
        said.append((task, verdict.standing, verdict.words))
    target.write_text(json.dumps(said), encoding="utf-8")


if __name__ == "__main__":
    _main(*sys.argv[1:])
