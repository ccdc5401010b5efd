"""A simulated Barrett WAM learns to cast a ball on a string into a cup.

The public names are resolved when they are first used, so that importing the package loads neither Drake nor scikit-learn.
"""

from __future__ import annotations

from importlib import import_module

TYPE_CHECKING = False  # type checkers take it for true; the module `typing` would take longer than all else here

if TYPE_CHECKING:
    from typing import Any

    from wam_cast.adaptation.adaptive_model import AdaptiveModel as AdaptiveModel
    from wam_cast.adaptation.robot import Observation as Observation
    from wam_cast.adaptation.robot import SimulatedRobot as SimulatedRobot
    from wam_cast.adaptation.robot_distribution import RobotDistribution as RobotDistribution
    from wam_cast.batch.derivatives import batch_derivatives as batch_derivatives
    from wam_cast.batch.engine import simulate_batch as simulate_batch
    from wam_cast.cast import Cast as Cast
    from wam_cast.errors import InputError as InputError
    from wam_cast.exchange.cast_table import MeasuredCast as MeasuredCast
    from wam_cast.exchange.cast_table import read_recording as read_recording
    from wam_cast.exchange.cast_table import write_recording as write_recording
    from wam_cast.experiments.paper.reproduce import reproduce as reproduce
    from wam_cast.experiments.preview import preview_scenario as preview_scenario
    from wam_cast.learning.dataset import CastDataset as CastDataset
    from wam_cast.learning.dataset import generate_dataset as generate_dataset
    from wam_cast.learning.forward_model import ForwardModel as ForwardModel
    from wam_cast.learning.kernel_ridge import KernelRidge as KernelRidge
    from wam_cast.learning.reference import reference_dataset as reference_dataset
    from wam_cast.learning.reference import reference_model as reference_model
    from wam_cast.planning.plan import Plan as Plan
    from wam_cast.planning.plan import plan_cast as plan_cast
    from wam_cast.planning.solution import Solution as Solution
    from wam_cast.robot.controller import ArmController as ArmController
    from wam_cast.robot.controller import CastController as CastController
    from wam_cast.robot.station import CastStation as CastStation
    from wam_cast.scenario import Noise as Noise
    from wam_cast.scenario import Scenario as Scenario
    from wam_cast.simulation.outcome import Outcome as Outcome
    from wam_cast.simulation.outcome import Status as Status
    from wam_cast.simulation.recording import CastRecording as CastRecording
    from wam_cast.simulation.recording import Throw as Throw
    from wam_cast.simulation.simulator import CastSimulator as CastSimulator
    from wam_cast.simulation.simulator import simulate_cast as simulate_cast
    from wam_cast.simulation.simulator import simulate_casts as simulate_casts
    from wam_cast.version import __version__ as __version__

_NAMES = {
    "adaptation.adaptive_model": ["AdaptiveModel"],
    "adaptation.robot": ["Observation", "SimulatedRobot"],
    "adaptation.robot_distribution": ["RobotDistribution"],
    "batch.derivatives": ["batch_derivatives"],
    "batch.engine": ["simulate_batch"],
    "cast": ["Cast"],
    "errors": ["InputError"],
    "exchange.cast_table": ["MeasuredCast", "read_recording", "write_recording"],
    "experiments.paper.reproduce": ["reproduce"],
    "experiments.preview": ["preview_scenario"],
    "learning.dataset": ["CastDataset", "generate_dataset"],
    "learning.forward_model": ["ForwardModel"],
    "learning.kernel_ridge": ["KernelRidge"],
    "learning.reference": ["reference_dataset", "reference_model"],
    "planning.plan": ["Plan", "plan_cast"],
    "planning.solution": ["Solution"],
    "robot.controller": ["ArmController", "CastController"],
    "robot.station": ["CastStation"],
    "scenario": ["Noise", "Scenario"],
    "simulation.outcome": ["Outcome", "Status"],
    "simulation.recording": ["CastRecording", "Throw"],
    "simulation.simulator": ["CastSimulator", "simulate_cast", "simulate_casts"],
}
_HOME = {name: module for module, names in _NAMES.items() for name in names}

__all__ = [*sorted(_HOME), "__version__"]


def __getattr__(name: str) -> Any:
    if name == "__version__":  # to look it up takes longer than all else here
        return import_module("wam_cast.version").__version__
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
