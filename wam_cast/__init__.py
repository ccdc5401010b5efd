"""A simulated Barrett WAM learns to cast a ball on a string into a cup.

The public names are resolved when they are first used, so that importing the package loads neither Drake nor scikit-learn.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from wam_cast.version import __version__

if TYPE_CHECKING:
    from wam_cast.cast import Cast as Cast
    from wam_cast.errors import InputError as InputError
    from wam_cast.evaluation.experiment.run import reproduce as reproduce
    from wam_cast.learning.dataset import CastDataset as CastDataset
    from wam_cast.learning.dataset import generate_dataset as generate_dataset
    from wam_cast.learning.forward_model import ForwardModel as ForwardModel
    from wam_cast.learning.forward_model import reference_dataset as reference_dataset
    from wam_cast.learning.forward_model import reference_model as reference_model
    from wam_cast.learning.kernel_ridge import KernelRidge as KernelRidge
    from wam_cast.planning.plan import Plan as Plan
    from wam_cast.planning.plan import plan_cast as plan_cast
    from wam_cast.scenario import Noise as Noise
    from wam_cast.scenario import Scenario as Scenario
    from wam_cast.system.controller import CastController as CastController
    from wam_cast.system.outcome import Outcome as Outcome
    from wam_cast.system.outcome import Status as Status
    from wam_cast.system.recording import CastRecording as CastRecording
    from wam_cast.system.recording import Throw as Throw
    from wam_cast.system.simulate import simulate_cast as simulate_cast
    from wam_cast.system.simulate import simulate_casts as simulate_casts
    from wam_cast.system.simulation import CastSimulator as CastSimulator
    from wam_cast.system.station import CastStation as CastStation

_HOME = {
    "Cast": "cast",
    "CastController": "system.controller",
    "CastDataset": "learning.dataset",
    "CastRecording": "system.recording",
    "CastSimulator": "system.simulation",
    "CastStation": "system.station",
    "ForwardModel": "learning.forward_model",
    "InputError": "errors",
    "KernelRidge": "learning.kernel_ridge",
    "Noise": "scenario",
    "Outcome": "system.outcome",
    "Plan": "planning.plan",
    "Scenario": "scenario",
    "Status": "system.outcome",
    "Throw": "system.recording",
    "generate_dataset": "learning.dataset",
    "plan_cast": "planning.plan",
    "reference_dataset": "learning.forward_model",
    "reference_model": "learning.forward_model",
    "reproduce": "evaluation.experiment.run",
    "simulate_cast": "system.simulate",
    "simulate_casts": "system.simulate",
}

__all__ = [*sorted(_HOME), "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
