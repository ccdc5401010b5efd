"""The experiment on robots that nobody told it about, robot by robot."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from wam_cast.adaptation.adaptive_model import AdaptiveModel
from wam_cast.adaptation.methods import AdaptationMethod, adaptive_model
from wam_cast.adaptation.practice import choose_practice
from wam_cast.cast import Cast
from wam_cast.experiments.transfer.one_robot import RobotStudy, UnknownRobot
from wam_cast.experiments.transfer.transfer_report import write_report
from wam_cast.experiments.transfer.transfer_settings import BEST, Group, TransferSettings
from wam_cast.experiments.transfer.transfer_summary import TransferSummary, summarize
from wam_cast.generation.engines import checked_engine
from wam_cast.learning.reference import reference_model_for
from wam_cast.parallel.seeds import Purpose, derived_seed
from wam_cast.parallel.workers import Workers, checked_n_workers, run_rows
from wam_cast.planning.prediction import Predictor
from wam_cast.scenario import Scenario
from wam_cast.storage.run_directory import RunDirectory
from wam_cast.types import checks_types

OnProgress = Callable[[str, int, int], None]
"""Takes what is being done, how much of it is done, and how much there is."""


N_RADII = 9
"""Cups on the line for which practice casts are chosen."""


class TransferDirectory(RunDirectory):
    """Where a run is kept, robot by robot."""

    kind = "run of the experiment on unknown robots"


@checks_types
def transfer(
    scenario: Scenario,
    directory: str | Path,
    seed: int = 0,
    *,
    quick: bool = False,
    n_robots: int | None = None,
    n_cups: int | None = None,
    believed: Predictor | None = None,
    engine: str = "drake",
    executor: Executor | None = None,
    n_workers: int | None = None,
    on_progress: OnProgress = lambda *_: None,
) -> TransferSummary:
    """Let unknown robots cast, adapt to them, and write a report. A run that was interrupted goes on where it stopped.

    Parameters
    ----------
    scenario
        What is believed of all robots.
    directory
        Where everything goes: `report.md`, `report.html`, `results.json`, `figures/`, and what is needed to go on.
    seed
        Draws all that is random.
    quick
        With two robots of each group and four cups, in place of 30 and 20.
    n_robots, n_cups
        Other numbers of these, 10,000 and 1000 at most. A run goes on to more robots, not to other cups.
    believed
        The forward model of the believed robot; by default the shipped one.
    engine
        Simulates casts without a cup and without noise, as for `.generate_dataset`; what is executed for a cup is Drake's.
    executor, n_workers
        Run the robots, as for `.run_rows`.
    on_progress
        Called as work is done.

    Raises
    ------
    InputError
        If an argument is not as described, there is no forward model of the scenario, or the directory holds something else or a
        run with other settings or is in use.
    """
    settings = TransferSettings.of(
        scenario, seed, quick, checked_engine(engine, scenario, has_own_controller=False), n_robots, n_cups
    )
    checked_n_workers(n_workers)
    believed = believed or reference_model_for(settings.scenario)
    store = TransferDirectory(directory, settings.identity, settings.scenario)
    with store, Workers(n_workers) as workers, threadpool_limits(1):
        studies = _studies(settings, believed, store, executor or workers, on_progress)
        summary = summarize(settings, studies)
        write_report(summary, settings, store)
    return summary


@dataclass(frozen=True)
class _Knowledge:
    """What is known of the robots of a group."""

    settings: TransferSettings
    group: Group
    models: dict[AdaptationMethod, AdaptiveModel]
    practice: list[Cast]

    @classmethod
    def of(cls, settings: TransferSettings, group: Group, believed: Predictor | None) -> _Knowledge:
        models = {method: adaptive_model(method, group.expected, believed) for method in settings.methods}
        cups = [(float(radius), 0.0) for radius in np.linspace(*models[BEST].reach, N_RADII)]
        return cls(settings, group, models, choose_practice(models[BEST], max(settings.ks), cups))

    def study(self, number: int) -> RobotStudy:
        """Return what is found of one of the group's robots."""
        truth = self.group.draw(number, derived_seed(self.settings.seed, Purpose.ROBOTS, number))
        return UnknownRobot(self.settings, truth, number, self.models, self.practice).study()


def _studies(
    settings: TransferSettings,
    believed: Predictor | None,
    store: RunDirectory,
    executor: Executor | Workers,
    on_progress: OnProgress,
) -> dict[str, list[RobotStudy]]:
    """Return the studies of all robots by group: those that are stored, and the others, which are stored, in turn of each group."""
    groups = settings.groups
    each = [(group, number) for number in range(settings.n_robots) for group in groups]
    names = [f"{group.name.replace(' ', '-')}-{number:03d}" for group, number in each]
    found = [store.found(name, RobotStudy) for name in names]
    todo = [row for row, one in enumerate(found) if one is None]
    on_progress("what is known", 0, len(groups))
    asked = {each[row][0].name for row in todo}
    known: dict[str, _Knowledge] = {}
    for group in groups:
        if group.name in asked:
            same = next((one for one in known.values() if one.group.expected is group.expected), None)
            known[group.name] = replace(same, group=group) if same else _Knowledge.of(settings, group, believed)
    done = len(found) - len(todo)
    on_progress("robots", done, len(found))
    with closing(run_rows(partial(_study, known, each), todo, executor)) as studies:
        for row, study in zip(todo, studies, strict=True):
            store.keep(names[row], RobotStudy, study)
            found[row] = study
            done += 1
            on_progress("robots", done, len(found))
    return {
        group.name: [study for (of, _), study in zip(each, found, strict=True) if of is group and study is not None]
        for group in groups
    }


def _study(known: dict[str, _Knowledge], each: list[tuple[Group, int]], row: int) -> RobotStudy:
    group, number = each[row]
    return known[group.name].study(number)
