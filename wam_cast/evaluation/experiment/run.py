"""The experiment from its casts to its report, phase by phase."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from wam_cast.evaluation.experiment.comparison import compare
from wam_cast.evaluation.experiment.execution import Thrower, execute_plans
from wam_cast.evaluation.experiment.findings import PLANNERS, Findings
from wam_cast.evaluation.experiment.landing_map import map_landings
from wam_cast.evaluation.experiment.learning_curves import learn_with_fewer_casts
from wam_cast.evaluation.experiment.noise import study_noise
from wam_cast.evaluation.experiment.report import write_report
from wam_cast.evaluation.experiment.results import (
    Chosen,
    Comparison,
    Executions,
    LandingMap,
    LearningCurves,
    Noise,
    Result,
    Samples,
    Selection,
    floats,
    maybe_floats,
)
from wam_cast.evaluation.experiment.selection import select_models
from wam_cast.evaluation.experiment.settings import OnProgress, Settings
from wam_cast.evaluation.experiment.store import RunDirectory
from wam_cast.learning.dataset import CastDataset, generate_dataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.parts import Parts, split_casts
from wam_cast.learning.workers import Workers
from wam_cast.scenario import Scenario

Progress = Callable[[str, int, int], None]
"""Takes a phase's title, how much of it is done, and how much there is."""

R = TypeVar("R", bound=Result)


def reproduce(
    scenario: Scenario,
    directory: str | Path,
    *,
    seed: int = 0,
    quick: bool = False,
    on_progress: Progress | None = None,
) -> Findings:
    """Run the experiment of the paper's Section 3, and write its report.

    A run that was interrupted goes on where it stopped. A script must call this under `if __name__ == "__main__":`, since
    worker processes import it.

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
    on_progress
        Called as work is done.

    Raises
    ------
    InputError
        If the directory holds something else or a run with other settings, or the scenario cannot be simulated or learned.
    """
    settings = Settings.of(scenario, seed, quick)
    store = RunDirectory(directory, settings)
    # One thread for each process, which also makes ill-conditioned sums the same whatever the number of processors.
    with Workers() as workers, threadpool_limits(1):
        run = _Run(settings, store, workers, on_progress or (lambda _title, _done, _n: None))
        findings = run.findings()
        run.report(findings)
    return findings


class _Run:
    """The phases, each of them done now or read from an earlier run."""

    def __init__(
        self, settings: Settings, directory: RunDirectory, workers: Workers, on_progress: Progress
    ) -> None:
        self._settings, self._directory, self._workers = settings, directory, workers
        self._on_progress = on_progress

    def findings(self) -> Findings:
        settings, scenario = self._settings, self._settings.scenario
        samples = self._phase("casts", Samples, self._sample)
        selection = self._phase(
            "model selection", Selection, lambda r: select_models(scenario, self._parts, r)
        )
        comparison = self._phase(
            "comparison", Comparison, lambda r: compare(scenario, self._parts, selection, settings.seed, r)
        )
        learning_curves = self._phase(
            "learning curves",
            LearningCurves,
            lambda r: learn_with_fewer_casts(
                scenario, self._parts, settings.seed, settings.n_repeats, self._workers, r
            ),
        )
        chosen = selection.per_parameter

        landing_map = self._phase("landing map", LandingMap, lambda _: map_landings(self._model(chosen)))
        executions = self._phase("execution", Executions, lambda r: self._execute(chosen, r)).planners
        self._phase("noisy casts", Samples, self._sample_with_noise)
        noise = self._phase(
            "noise",
            Noise,
            lambda r: study_noise(settings, self._casts, self._noisy_casts, chosen, self._workers, r),
        )
        return Findings(
            settings, samples, selection, comparison, learning_curves, landing_map, executions, noise
        )

    def report(self, findings: Findings) -> None:
        def report(done: int, n: int) -> None:
            self._on_progress("figures and report", done, n)

        write_report(findings, self._directory, self._workers, report)

    def _phase(self, title: str, kind: type[R], compute: Callable[[OnProgress], R]) -> R:
        def report(done: int, n: int) -> None:
            self._on_progress(title, done, n)

        name = title.replace(" ", "-")
        return self._directory.phase(name, kind, lambda: compute(report))

    @cached_property
    def _casts(self) -> CastDataset:
        return CastDataset.load(self._directory.casts, self._settings.scenario)

    @cached_property
    def _noisy_casts(self) -> CastDataset:
        return CastDataset.load(self._directory.noisy_casts, self._settings.noisy_scenario)

    @property
    def _parts(self) -> Parts:
        return split_casts(self._casts)

    def _model(self, chosen: Chosen) -> ForwardModel:
        return ForwardModel.from_hyperparameters(self._casts, chosen.sigma, chosen.regularization)

    def _execute(self, chosen: Chosen, report: OnProgress) -> Executions:
        model = self._model(chosen)
        throwers = [Thrower(planner, planner, model) for planner in PLANNERS]
        settings = self._settings
        found = execute_plans(
            settings.scenario, throwers, settings.n_cups, workers=self._workers, report=report
        )
        return Executions(planners=found)

    def _sample(self, report: OnProgress) -> Samples:
        return self._generate(self._settings.scenario, self._directory.casts, report)

    def _sample_with_noise(self, report: OnProgress) -> Samples:
        return self._generate(self._settings.noisy_scenario, self._directory.noisy_casts, report)

    def _generate(self, scenario: Scenario, directory: Path, report: OnProgress) -> Samples:
        settings = self._settings
        data = generate_dataset(
            scenario,
            settings.n_casts,
            settings.seed,
            executor=self._workers,
            directory=directory,
            on_progress=report,
        )
        return describe_samples(data)


def describe_samples(data: CastDataset) -> Samples:
    """Return counts of a dataset, and its training casts."""
    train, validation, test = data.split()
    frame = data.frame.iloc[train]
    landing = frame["landing_along"].to_numpy(dtype=float)
    return Samples(
        statuses={str(status): int(n) for status, n in data.frame["status"].value_counts().items()},
        n_train=len(train),
        n_validation=len(validation),
        n_test=len(test),
        distance=floats(frame["distance"]),
        speed=floats(frame["speed"]),
        wait=floats(frame["wait"]),
        landing_along=maybe_floats(landing),
        landing_std=float(np.nanstd(landing)),
        largest_across=float(np.nanmax(np.abs(frame["landing_across"].to_numpy(dtype=float)))),
    )
