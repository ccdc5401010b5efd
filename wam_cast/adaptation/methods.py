"""Ways to learn about an unknown robot, by name."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, get_args

from wam_cast.adaptation.adaptive_model import AdaptiveModel, believed_model
from wam_cast.adaptation.closed_form.closed_form_model import ClosedFormModel
from wam_cast.adaptation.priors.feature_priors import Affine, NoOffset, Shift, SmoothOffset
from wam_cast.adaptation.priors.offset import OffsetPrior
from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.errors import InputError, quoted
from wam_cast.planning.prediction import Predictor
from wam_cast.scenario import Scenario

AdaptationMethod = Literal["nominal", "shift", "affine", "residual", "closed form", "prior", "identification"]

ADAPTATION_METHODS: tuple[AdaptationMethod, ...] = get_args(AdaptationMethod)
"""`nominal` learns nothing. `shift`, `affine` and `residual` learn how far the believed robot's landings are off: by a number, by a
slope too, by any smooth function. `closed form` takes the point mass on a string for the believed robot, and learns a smooth
function. `prior` knows how robots differ. `identification` finds their physical parameters by simulation, which takes half a
minute a time and the batched engine."""


def adaptive_model(
    method: AdaptationMethod, robots: RobotDistribution, believed: Predictor | None = None
) -> AdaptiveModel:
    """Return what a method knows of any of the robots before its first cast.

    Parameters
    ----------
    method
        One of `ADAPTATION_METHODS`.
    robots
        What the robot may be; those that do not know how robots differ take its scale for how far.
    believed
        As for `.AdaptiveModel.from_prior`. The closed form does without.

    Raises
    ------
    InputError
        If there is no such method, or as from `.AdaptiveModel.from_prior`.
    """
    scenario = robots.believed
    prior: OffsetPrior
    match method:
        case "prior":
            return AdaptiveModel.from_prior(robots, believed)
        case "identification":
            from wam_cast.adaptation.identification import IdentifiedModel

            return IdentifiedModel.from_prior(robots, believed)
        case "closed form":
            return AdaptiveModel(_closed_form(scenario), SmoothOffset(scenario, robots.scale))
        case "nominal":
            prior = NoOffset(scenario)
        case "shift":
            prior = Shift(scenario, robots.scale)
        case "affine":
            prior = Affine(scenario, robots.scale)
        case "residual":
            prior = SmoothOffset(scenario, robots.scale)
        case _:
            raise InputError(f"method: {quoted(method)} is not known: choose {', '.join(ADAPTATION_METHODS)}")
    return AdaptiveModel(believed_model(robots, believed), prior)


@lru_cache(maxsize=2)
def _closed_form(scenario: Scenario) -> ClosedFormModel:
    """Return the model that takes seconds to make."""
    return ClosedFormModel.of(scenario)
