"""What the command line plans with: a scenario and its model, found or made."""

from __future__ import annotations

from pathlib import Path

import wam_cast as wc
from wam_cast.cli import long_work
from wam_cast.cli.long_work import command_line
from wam_cast.errors import InputError
from wam_cast.storage.atomic import check_writable

TRAINING_CASTS = 1700
"""As many as the paper simulated: 1300 to train with, 300 to validate, 100 to test."""


def load_scenario(path: Path | None) -> wc.Scenario:
    """Return the scenario in a file, or the reference scenario."""
    return wc.Scenario() if path is None else wc.Scenario.from_yaml(path)


def scenario_and_model(path: Path | None, model_path: Path | None, train: bool) -> tuple[wc.Scenario, wc.ForwardModel]:
    """Return what to cast in and the model to plan with, as `find` does; if there is none, make it or say how it is made."""
    scenario, model = find(path, model_path)
    if model is not None:
        return scenario, model
    assert path is not None
    if not train:
        raise InputError(
            f"scenario {path} has no model yet: {how_to_make(path, scenario)}, or add --train to do both now"
        )
    own, casts = _own_files(path, scenario)
    check_writable(own)
    long_work.generate(scenario, path, TRAINING_CASTS, 0, casts)
    return scenario, long_work.fit(casts, own, scenario)


def find(path: Path | None, model_path: Path | None) -> tuple[wc.Scenario, wc.ForwardModel | None]:
    """Return what to cast in and its model: the one named, the shipped one if it fits, the scenario's own, or none.

    The scenario's own lies beside its file.
    """
    if model_path is not None:
        model = wc.ForwardModel.load(model_path, None if path is None else load_scenario(path))
        return model.scenario, model
    scenario, reference = load_scenario(path), wc.reference_model()
    if path is None or reference.serves(scenario):
        return scenario, reference.bound_to(scenario)
    own, _ = _own_files(path, scenario)
    return scenario, wc.ForwardModel.load(own, scenario) if own.exists() else None


def how_to_make(path: Path, scenario: wc.Scenario) -> str:
    """Return the commands that make a scenario's own model, where `find` finds it."""
    own, casts = _own_files(path, scenario)
    generate = command_line("generate", scenario=path, casts=TRAINING_CASTS, out=casts)
    return f"make one with `{generate}` and then `{command_line('fit', casts, out=own)}`"


def _own_files(path: Path, scenario: wc.Scenario) -> tuple[Path, Path]:
    """Return where the own model of the scenario at `path` lies, and its dataset."""
    own = path.with_name(f"{path.stem}-{scenario.fingerprint[:8]}.model")
    return own, own.with_suffix(".casts")
