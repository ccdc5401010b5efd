"""What takes long: under a progress bar, and when it is interrupted, with the command that goes on."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import wam_cast as wc
from wam_cast.cli.terminal import err, phase_progress, progress
from wam_cast.errors import InputError
from wam_cast.storage.atomic import check_writable

if TYPE_CHECKING:
    from wam_cast.experiments.paper.findings import Findings


def generate(
    scenario: wc.Scenario,
    scenario_path: Path | None,
    n_casts: int,
    seed: int,
    directory: Path,
    workers: int | None = None,
    scheduler: str | None = None,
) -> wc.CastDataset:
    """Generate a dataset."""
    done = 0
    with progress("simulating casts", n_casts) as advance, _executor(scheduler) as executor:

        def report(n_done: int, _n_casts: int) -> None:
            nonlocal done
            done = n_done
            advance(n_done)

        try:
            return wc.generate_dataset(
                scenario, n_casts, seed, executor=executor, n_workers=workers, directory=directory, on_progress=report
            )
        except KeyboardInterrupt:
            command = command_line(
                "generate",
                casts=n_casts,
                seed=seed,
                out=directory,
                scenario=scenario_path,
                workers=workers,
                scheduler=scheduler,
            )
            err.print(
                f"{done} of {n_casts} casts were simulated; finished parts are kept in {directory}. Go on with: {command}"
            )
            raise


def fit(dataset: Path, file: Path, scenario: wc.Scenario | None) -> wc.ForwardModel:
    """Fit a model to a stored dataset and store it; by default for the dataset's own scenario."""
    check_writable(file)
    data = wc.CastDataset.load(dataset, scenario)
    with progress("fitting"):
        model = wc.ForwardModel.fit(data)
    model.save(file)
    return model


def reproduce(scenario: wc.Scenario, scenario_path: Path | None, directory: Path, seed: int, quick: bool) -> Findings:
    """Run or finish the paper's experiment."""
    with phase_progress() as report:
        try:
            return wc.reproduce(scenario, directory, seed=seed, quick=quick, on_progress=report)
        except KeyboardInterrupt:
            command = command_line("reproduce", seed=seed, out=directory, scenario=scenario_path, quick=quick)
            err.print(f"what is finished is kept in {directory}. Go on with: {command}")
            raise


def command_line(command: str, *arguments: object, **options: object) -> str:
    """Return a line of `wam-cast` for a shell; options that are None or False are left out, and True is a flag."""
    words = ["wam-cast", command, *map(str, arguments)]
    for name, value in options.items():
        if value is not None and value is not False:
            words += [f"--{name}"] if value is True else [f"--{name}", str(value)]
    return shlex.join(words)


@contextmanager
def _executor(scheduler: str | None) -> Iterator[Any]:
    """Give an executor on a Dask cluster, or none for this machine's processes."""
    if scheduler is None:
        yield None
        return
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler needs Dask: pip install 'wam-cast[distributed]'") from None
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"--scheduler {scheduler}: no Dask scheduler answers there ({error})") from None
    with client:
        yield client.get_executor()
