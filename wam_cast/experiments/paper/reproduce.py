"""The experiment from its casts to its report, phase by phase."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import TypeVar

import pandas as pd
from threadpoolctl import threadpool_limits

from wam_cast.experiments.frames import Rows
from wam_cast.experiments.paper.comparison import Comparison, compare
from wam_cast.experiments.paper.findings import Findings, Samples, describe_samples
from wam_cast.experiments.paper.landing_map import LandingMap, map_landings
from wam_cast.experiments.paper.learning_curves import LearningCurves, learn_with_fewer_casts
from wam_cast.experiments.paper.noise_study import NoiseStudy, study_noise
from wam_cast.experiments.paper.report import write_report
from wam_cast.experiments.paper.report_figures import CAPTIONS, draw_figures
from wam_cast.experiments.paper.selection import Chosen, Selection, select_models
from wam_cast.experiments.paper.settings import PLANNERS, OnProgress, Settings
from wam_cast.experiments.trials import Thrower, line_of_cups, plan_and_execute
from wam_cast.generation.engines import checked_engine
from wam_cast.learning.dataset import CastDataset, generate_dataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.parts import Parts, split_casts
from wam_cast.parallel.workers import Workers, checked_n_workers
from wam_cast.scenario import Scenario
from wam_cast.storage.run_directory import RunDirectory
from wam_cast.types import checks_types
from wam_cast.visualization.scene import CastScene

Progress = Callable[[str, int, int], None]
"""Takes a phase's title, how much of it is done, and how much there is."""

R = TypeVar("R")


@checks_types
def reproduce(
    scenario: Scenario,
    directory: str | Path,
    *,
    seed: int = 0,
    quick: bool = False,
    engine: str = "drake",
    executor: Executor | None = None,
    n_workers: int | None = None,
    on_progress: Progress | None = None,
) -> Findings:
    """Run the experiment of the paper's Section 3, and write its report.

    A run that was interrupted goes on where it stopped.

    Parameters
    ----------
    scenario
        What is cast. Its noise, if it is on, serves the section on noise; without it that section takes typical noise.
    directory
        Where everything goes: `report.md`, `report.html`, `results.json`, `figures/`, and what is needed to go on.
    seed
        Draws all that is random.
    quick
        With a tenth of the data.
    engine
        Simulates the training casts, as for `.generate_dataset`; what is executed for a cup is Drake's.
    executor
        Runs what can run in parallel, as for `.generate_dataset`: by default processes on this machine. Its workers must share the
        file system, since they draw the figures too.
    n_workers
        Number of these processes without an executor, by default one for each processor.
    on_progress
        Called as work is done.

    Raises
    ------
    InputError
        If the seed is no integer from 0 on or the number of processes none from 1 on, the directory holds something else or a run
        with other settings or is in use, or the scenario cannot be drawn, simulated or learned.
    """
    settings = Settings.of(scenario, seed, quick, checked_engine(engine, scenario, has_own_controller=False))
    checked_n_workers(n_workers)
    CastScene(scenario, None, light_bearing=0.0)  # that it can be drawn: the figures come last
    report = on_progress or (lambda _title, _done, _n: None)
    # One thread for each process, which also makes ill-conditioned sums the same whatever the number of processors.
    store = RunDirectory(directory, settings.identity, settings.own_scenario)
    with store, Workers(n_workers) as workers, threadpool_limits(1):
        findings = _Run(settings, store, executor or workers, report).findings()
        with store.timed("figures"):
            report("figures", 0, len(CAPTIONS))
            for done, _ in enumerate(draw_figures(findings, store.folder("figures"), executor or workers), 1):
                report("figures", done, len(CAPTIONS))
        write_report(findings, store)
    return findings


@dataclass(frozen=True)
class _Run:
    """The phases, each of them done now or read from an earlier run."""

    settings: Settings
    directory: RunDirectory
    executor: Executor | Workers
    report: Progress

    def findings(self) -> Findings:
        settings, scenario, seed, executor = self.settings, self.settings.scenario, self.settings.seed, self.executor
        samples = self._phase("casts", Samples, lambda _: describe_samples(self._casts, self._parts))
        selection = self._phase("model selection", Selection, lambda r: select_models(scenario, self._parts, r))
        chosen = selection.per_parameter
        comparison = self._phase("comparison", Comparison, lambda r: compare(scenario, self._parts, selection, seed, r))
        learning_curves = self._phase(
            "learning curves",
            LearningCurves,
            lambda r: learn_with_fewer_casts(scenario, self._parts, seed, settings.n_repeats, executor, r),
        )
        landing_map = self._phase("landing map", LandingMap, lambda r: map_landings(self._model(chosen), r))
        executions = self._phase("execution", Rows, lambda r: self._execute(chosen, r))
        noise = self._phase(
            "noise", NoiseStudy, lambda r: study_noise(settings, self._casts, self._noisy_casts, chosen, executor, r)
        )
        return Findings(settings, samples, selection, comparison, learning_curves, landing_map, executions, noise)

    def _phase(self, title: str, kind: type[R], compute: Callable[[OnProgress], R]) -> R:
        return self.directory.phase(title.replace(" ", "-"), kind, lambda: compute(partial(self.report, title)))

    @cached_property
    def _casts(self) -> CastDataset:
        return self._generate(self.settings.scenario, self.directory.casts, "casts")

    @cached_property
    def _noisy_casts(self) -> CastDataset:
        return self._generate(self.settings.noisy_scenario, self.directory.noisy_casts, "noisy casts")

    @cached_property
    def _parts(self) -> Parts:
        # One split for all phases: its test part opens once.
        return split_casts(self._casts)

    def _generate(self, scenario: Scenario, directory: Path, title: str) -> CastDataset:
        """Return the dataset in `directory`; what is missing of it is simulated."""
        report = partial(self.report, title)
        n_casts, seed = self.settings.n_casts, self.settings.seed
        return generate_dataset(
            scenario,
            n_casts,
            seed,
            engine=self.settings.engine,
            executor=self.executor,
            directory=directory,
            on_progress=report,
        )

    def _model(self, chosen: Chosen) -> ForwardModel:
        return ForwardModel.from_hyperparameters(self._casts, chosen.sigma, chosen.regularization)

    def _execute(self, chosen: Chosen, report: OnProgress) -> pd.DataFrame:
        model, settings = self._model(chosen), self.settings
        cups = line_of_cups(model, settings.n_cups)
        throwers = [Thrower(planner, planner, model, cups) for planner in PLANNERS]
        return plan_and_execute(settings.scenario, throwers, executor=self.executor, report=report)
