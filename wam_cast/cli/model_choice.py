"""What the command line plans with: a scenario and its model, found or made; and how both, with a dataset, are made."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import NamedTuple

import wam_cast as wc
from wam_cast.cli.check import require_workable
from wam_cast.cli.terminal import err, progress
from wam_cast.controller_names import DEFAULT_CONTROLLER
from wam_cast.errors import InputError, MachineError
from wam_cast.parallel.cluster import dask_executor
from wam_cast.storage.atomic import check_writable

TRAINING_CASTS = 1700
"""As many as the paper simulated: 1300 to train with, 300 to validate, 100 to test."""


def load_scenario(path: Path | None) -> wc.Scenario:
    """Return the scenario in a file, or the reference scenario."""
    return wc.Scenario() if path is None else wc.Scenario.from_yaml(path)


def scenario_and_model(path: Path | None, model_path: Path | None, train: bool) -> tuple[wc.Scenario, wc.ForwardModel]:
    """Return what to cast in and the model to plan with, as `find` does; if there is none, make it or say how it is made."""
    scenario, model, flaw = find(path, model_path)
    if model is not None:
        return scenario, model
    if not train:
        raise InputError(f"{flaw}; {how_to_make(path, scenario)}, or add --train to do both now")
    own, casts = _own_files(path, scenario)
    check_writable(own)
    generate(path, TRAINING_CASTS, 0, casts)
    if os.path.exists(own):  # noqa: PTH110 -- a name may be too long
        aside = own.replace(own.with_name(f"{own.name}.set_aside"))
        err.print(f"{flaw}; it is now {aside}")
    model, _ = fit(casts, own, scenario)
    return scenario, model


class Found(NamedTuple):
    """What `find` found."""

    scenario: wc.Scenario
    model: wc.ForwardModel | None
    flaw: str = ""
    """Why there is no model."""


def find(path: Path | None, model_path: Path | None) -> Found:
    """Return what to cast in and its model: the one named, the shipped one if it fits, the scenario's own, or none.

    The scenario's own lies beside its file, that of the reference scenario in this folder. What does not serve is passed over,
    unless it was named. A model of another controller's casts is refused: the command line has one controller.
    """
    from wam_cast.learning.reference import reference_model_for

    if model_path is not None:
        named = wc.ForwardModel.load(model_path, None if path is None else load_scenario(path), DEFAULT_CONTROLLER)
        return Found(named.scenario, named)
    scenario = load_scenario(path)
    model = reference_model_for(scenario)
    if model is not None:
        return Found(scenario, model)
    own, _ = _own_files(path, scenario)
    if not os.path.exists(own):  # noqa: PTH110 -- a name may be too long
        name = "the arm as it is now" if path is None else f"scenario {path}"
        return Found(scenario, None, f"{name} has no model yet")
    try:
        return Found(scenario, wc.ForwardModel.load(own, scenario, DEFAULT_CONTROLLER))
    except InputError as error:
        return Found(scenario, None, str(error))


def how_to_make(path: Path | None, scenario: wc.Scenario) -> str:
    """Return the commands that make a scenario's own model, where `find` finds it."""
    own, casts = _own_files(path, scenario)
    make = command_line("generate", scenario=path, casts=TRAINING_CASTS, out=casts)
    return f"make one with `{make}` and then `{command_line('fit', casts, out=own)}`"


def generate(
    scenario: Path | None,
    casts: int,
    seed: int,
    out: Path,
    workers: int | None = None,
    scheduler: str | None = None,
    force: bool = False,
    engine: str = "drake",
) -> wc.CastDataset:
    """Generate a dataset of the scenario in a file if it can work; if that is interrupted, say how to go on."""
    from wam_cast.generation.engines import checked_engine
    from wam_cast.storage.dataset_directory import DatasetDirectory

    setting, done = load_scenario(scenario), 0
    checked_engine(engine, setting, has_own_controller=False)
    require_workable(setting, scenario, DatasetDirectory, out)
    cluster = nullcontext() if scheduler is None else dask_executor(scheduler, err.print)
    with progress("simulating casts", casts) as advance:

        def report(n_done: int, _: int) -> None:
            nonlocal done
            done = n_done
            advance(n_done)

        command = command_line(
            "generate",
            casts=casts,
            seed=seed,
            out=out,
            scenario=scenario,
            workers=workers,
            scheduler=scheduler,
            engine=None if engine == "drake" else engine,
        )
        with (
            telling_how_to_go_on(
                command, lambda: f"{done} of {casts} casts were simulated; finished parts are kept in {out}"
            ),
            cluster as executor,
        ):
            return wc.generate_dataset(
                setting,
                casts,
                seed,
                engine=engine,
                executor=executor,
                n_workers=workers,
                directory=out,
                force=force,
                on_progress=report,
            )


def fit(dataset: Path, file: Path, scenario: wc.Scenario | None) -> tuple[wc.ForwardModel, wc.CastDataset]:
    """Fit a model to a stored dataset and store it; by default for the dataset's own scenario. Say which casts failed."""
    from wam_cast.learning.parts import describe_failed_casts
    from wam_cast.storage.dataset_directory import DatasetDirectory

    check_writable(file)
    DatasetDirectory(dataset).check_not_own(file)
    data = wc.CastDataset.load(dataset, scenario)
    for line in describe_failed_casts(data):
        err.print(line)
    with progress("fitting"):
        model = wc.ForwardModel.fit(data)
    if model.info.n_landmarks is not None:
        err.print(
            f"{model.info.n_train} training casts are too many for exact kernel ridge regression: "
            f"approximated, with the kernel at {model.info.n_landmarks} of them"
        )
    model.save(file)
    return model, data


def command_line(command: str, *arguments: object, **options: object) -> str:
    """Return a line of `wam-cast` for a shell; options that are None or False are left out, True is a flag, a list repeats one."""
    words = ["wam-cast", command, *map(str, arguments)]
    for name, values in options.items():
        for value in values if isinstance(values, list) else [values]:
            if value is not None and value is not False:
                words += [f"--{name}"] if value is True else [f"--{name}", str(value)]
    return shlex.join(words)


@contextmanager
def telling_how_to_go_on(command: str, kept: Callable[[], str]) -> Iterator[None]:
    """Say what is kept, in words, and that `command` goes on, if the context is interrupted or the machine fails."""
    try:
        yield
    except (KeyboardInterrupt, MachineError):
        err.print(f"{kept()}. Go on with: {command}")
        raise


def _own_files(path: Path | None, scenario: wc.Scenario) -> tuple[Path, Path]:
    """Return where the own model of the scenario at `path` lies, and its dataset; of the reference scenario in this folder."""
    path = Path("reference.yaml") if path is None else path
    own = path.with_name(f"{path.stem}-{scenario.fingerprint[:8]}.model")
    return own, own.with_suffix(".casts")
