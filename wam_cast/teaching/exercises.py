"""The exercises and their tasks, and `check`, which says of an answer whether it is right, and `solved`, of several."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from types import ModuleType
from typing import Any

import numpy as np

from wam_cast.errors import InputError, checked_integer, quoted
from wam_cast.teaching.answer import Answer, Judge, NotYetError, WrongError
from wam_cast.teaching.tasks import belief_tasks, bounce_tasks, chance_tasks, hand_tasks, regression_tasks, swing_tasks

MODULES: dict[str, ModuleType] = {
    "01_hand_kinematics": hand_tasks,
    "02_flat_output": swing_tasks,
    "03_kernel_ridge": regression_tasks,
    "04_planning_under_uncertainty": chance_tasks,
    "05_contact_and_restitution": bounce_tasks,
    "06_adapting": belief_tasks,
}

EXERCISES: dict[str, dict[str, Judge]] = {
    name: {judge.__name__: judge for judge in module.TASKS} for name, module in MODULES.items()
}
"""By exercise, what judges each of its tasks, by the name of the function that is to be written."""


class Standing(StrEnum):
    """How an answer stands."""

    RIGHT = "right"
    WRONG = "wrong"
    NOT_YET = "not yet"


@dataclass(frozen=True)
class Verdict:
    """What `check` says of a task's answer: how it stands, and in words which property fails. Shown, it is one line."""

    task: str
    standing: Standing
    words: str = ""

    @property
    def is_right(self) -> bool:
        """Whether the answer is right."""
        return self.standing is Standing.RIGHT

    def __repr__(self) -> str:
        return ": ".join(filter(None, (self.task, str(self.standing), self.words)))


def check(answer: Callable[..., Any], *, seed: int = 0) -> Verdict:
    """Return whether a function solves the task of its name, tried on inputs that `seed` draws.

    Raises
    ------
    InputError
        If it is no function, or no task has its name.
    """
    judges = {task: judge for tasks in EXERCISES.values() for task, judge in tasks.items()}
    task = getattr(answer, "__name__", None)
    if not callable(answer) or task is None:
        raise InputError(f"check takes the function itself, not {quoted(answer)}: write check(name), without a call")
    if task not in judges:
        raise InputError(f"{quoted(task)} is no task's function; the tasks are: {', '.join(judges)}")
    return judged(task, judges[task], answer, checked_integer("seed", seed, 0))


def solved(*answers: Callable[..., Any]) -> bool:
    """Return whether functions solve the tasks of their names, and print those to solve first: a notebook goes on without.

    Raises
    ------
    InputError
        As `check` does.
    """
    flawed = [verdict.task for verdict in map(check, answers) if not verdict.is_right]
    if flawed:
        print(f"solve first: {', '.join(flawed)}")
    return not flawed


def judged(task: str, judge: Judge, answer: Callable[..., Any], seed: int) -> Verdict:
    """Return what a judge says of an answer, on inputs that `seed` draws for this task."""
    rng = np.random.default_rng([seed, zlib.crc32(task.encode())])
    try:
        judge(Answer(answer), rng)
    except NotYetError as error:
        return Verdict(task, Standing.NOT_YET, str(error))
    except WrongError as error:
        return Verdict(task, Standing.WRONG, str(error))
    return Verdict(task, Standing.RIGHT)
