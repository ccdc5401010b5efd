"""A campaign on one robot: plan a cast, make it, observe where the ball landed, adapt, and plan the next."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import astuple, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from wam_cast.adaptation.adaptive_model import AdaptiveModel
from wam_cast.adaptation.campaign_directory import EXECUTED, MOST_CASTS, SCHEMA, CampaignDirectory, Row
from wam_cast.adaptation.robot import Observation, Robot, SimulatedRobot
from wam_cast.cast import Cast, checked_cup
from wam_cast.errors import InputError, MachineError, checked_integer, quoted, shortened
from wam_cast.planning.free_ball import describe_unreached
from wam_cast.planning.plan import Plan, plan_cast
from wam_cast.planning.reach import Reach, checked_polar
from wam_cast.types import Position, checks_types


@dataclass(frozen=True, eq=False)
class Campaign:
    """What a campaign has seen, and the model that has learned from it.

    Attributes
    ----------
    model
        What is believed after the last cast.
    casts
        A row a cast, in order:

        ::

            number                              from 1 on
            cup_x, cup_y                        world (x, y) of the cup's axis [m]
            distance, speed, wait, bearing      of the cast that was made [m], [m/s], [s], [rad]
            predicted_x, predicted_y            world (x, y) where the plan expected the ball [m]
            predicted_std_along, ..._across     its standard deviations, see `Plan.predicted_std` [m]
            is_feasible, reason                 of the plan
            executed_distance, ..._speed, ..._wait      as the arm's encoders saw it, nan if they did not
            landing_x, landing_y, landing_std   what was observed [m], see `.Observation`
            miss                                distance of the observed landing from the cup's axis [m]
            is_caught, status, limits_hit       what was observed
    """

    model: AdaptiveModel
    casts: pd.DataFrame

    @property
    def n_caught(self) -> int:
        """How many casts were caught."""
        return int((self.casts["is_caught"] == True).sum())  # noqa: E712 - None where nobody saw

    @property
    def first_caught(self) -> int | None:
        """Number of the first cast that was caught, None if none was."""
        caught = self.casts.loc[self.casts["is_caught"] == True, "number"]  # noqa: E712
        return None if caught.empty else int(caught.iloc[0])


@checks_types
def run_campaign(
    robot: Robot,
    model: AdaptiveModel,
    cups: Sequence[Position],
    n_casts: int,
    directory: str | Path | None = None,
    *,
    settings: Mapping[str, Any] | None = None,
    on_cast: Callable[[Row], object] = lambda _: None,
) -> Campaign:
    """Let a robot cast, and learn from each cast before the next one is planned.

    A cast whose plan is not feasible is made too, since the robot answers it: the row says so.

    Parameters
    ----------
    robot
        What casts. A `.SimulatedRobot` counts its casts from the campaign's first one, so that one that goes on casts as if it had
        never stopped.
    model
        What is believed of it before the first cast.
    cups
        World (x, y) of each [m]; they are cast at in turn.
    n_casts
        In all, those in the log included.
    directory
        Where each cast is kept before anything else is done. A campaign that stopped goes on there. By default nothing is kept.
    settings
        What must be the same for a campaign to go on, besides the cups and the believed scenario, such as the robot's name; goes to
        JSON.
    on_cast
        Called with the row of each cast, those in the log first.

    Raises
    ------
    InputError
        If a cup is out of reach, or the directory holds something else, a campaign of other settings or of more casts, a damaged
        log, is in use or cannot be written; before any cast.
    MachineError
        If the robot raises an error: with what it was. Casts before it are kept.
    """
    places = _checked_cups(cups, model)
    n_casts = checked_integer("n_casts", n_casts, 1)
    if n_casts > MOST_CASTS:
        raise InputError(f"n_casts = {n_casts} must be at most {MOST_CASTS}")
    store = None if directory is None else CampaignDirectory(directory)
    with store or nullcontext():
        rows = [] if store is None else store.open(_settings(model, settings or {}), places, model.scenario.bounds)
        if len(rows) > n_casts:
            raise InputError(f"{directory} holds a campaign of {len(rows)} casts; ask for as many, not {n_casts}")
        if isinstance(robot, SimulatedRobot):
            robot = robot.after(len(rows))
        for row in rows:
            model = _learned(model, row)
            on_cast(row)
        for number in range(len(rows) + 1, n_casts + 1):
            cup = places[(number - 1) % len(places)]
            plan = plan_cast(model, cup)
            if store is not None:
                store.keep(rows)  # a disk that is full is told before a cast is lost to it
            rows.append(_row(number, plan, _cast(robot, plan, number)))
            if store is not None:
                _keep(store, rows)
            model = _learned(model, rows[-1])
            on_cast(rows[-1])
    return Campaign(model, pd.DataFrame(rows, columns=SCHEMA.names))


def _checked_cups(cups: Sequence[Position], model: AdaptiveModel) -> list[Position]:
    places = [checked_cup(cup) for cup in cups]
    if not places:
        raise InputError("cups = [] must have one cup at least")
    for cup in places:
        checked_polar(Reach.of(model), cup, partial(describe_unreached, model))
    return places


def _settings(model: AdaptiveModel, settings: Mapping[str, Any]) -> dict[str, Any]:
    scenario = model.scenario
    return {**settings, "scenario": scenario.model_dump(mode="json"), "fingerprint": scenario.fingerprint}


def _cast(robot: Robot, plan: Plan, number: int) -> Observation:
    """Let the robot cast. Whatever it raises but our own errors is its fault, and ends the campaign in one line."""
    try:
        return robot.cast(plan.cast, plan.cup)
    except (InputError, MachineError):
        raise
    except Exception as error:
        raise MachineError(
            f"the robot failed at cast {number} ({type(error).__name__}: {shortened(error)}); see to it, and start the campaign "
            "again"
        ) from error


def _row(number: int, plan: Plan, seen: Observation) -> Row:
    """Return a row of the log. Raises `.InputError` if what the robot answered is no observation."""
    try:
        landing_x, landing_y = (float(value) for value in seen.landing)
        values = {
            **dict(zip(("distance", "speed", "wait", "bearing"), astuple(seen.cast), strict=True)),
            **dict(zip(("predicted_x", "predicted_y"), map(float, plan.predicted_landing), strict=True)),
            "predicted_std_along": plan.predicted_std.along,
            "predicted_std_across": plan.predicted_std.across,
            "is_feasible": plan.is_feasible,
            "reason": plan.reason,
            **dict(zip(EXECUTED, _executed(seen), strict=True)),
            "landing_x": landing_x,
            "landing_y": landing_y,
            "landing_std": float(seen.landing_std),
            "miss": math.dist((landing_x, landing_y), plan.cup),
            "is_caught": None if seen.is_caught is None else bool(seen.is_caught),
            "status": str(seen.status),
            "limits_hit": [str(limit) for limit in seen.limits_hit],
        }
        is_sound = not (math.isinf(landing_x) or math.isinf(landing_y)) and 0 <= values["landing_std"] < math.inf
    except (AttributeError, TypeError, ValueError):
        is_sound = False
    if not is_sound:
        raise InputError(
            f"cast {number}: the robot answered {quoted(seen)}; it must be an Observation: its cast, a landing of two numbers, "
            "a standard deviation from 0 on, is_caught, status and limits_hit"
        )
    return {"number": number, "cup_x": plan.cup[0], "cup_y": plan.cup[1], **values}


def _executed(seen: Observation) -> tuple[float, float, float]:
    """Return distance, speed and wait as the encoders saw them, nan if they did not."""
    made = seen.executed
    return (math.nan,) * 3 if made is None else (float(made.distance), float(made.speed), float(made.wait))


def _keep(store: CampaignDirectory, rows: list[Row]) -> None:
    """Write the log with its last row; an interruption waits until it is written."""
    interruption = None
    while True:
        try:
            store.keep(rows)
        except KeyboardInterrupt as error:
            interruption = error
        except InputError as error:
            last = rows[-1]
            raise InputError(
                f"cast {last['number']} could not be kept: it landed at {last['landing_x']:.4f}, {last['landing_y']:.4f}, "
                f"{last['status']}; {error}"
            ) from None
        else:
            break
    if interruption is not None:
        raise interruption


def _learned(model: AdaptiveModel, row: Row) -> AdaptiveModel:
    """Return the model that has learned from a row too."""
    casts = [
        Cast.from_array(np.array([row[name] for name in names]), row["bearing"])
        for names in (("distance", "speed", "wait"), EXECUTED)
        if not math.isnan(row[names[0]])
    ]
    landing, executed = np.array([row["landing_x"], row["landing_y"]]), casts[1] if len(casts) == 2 else None
    seen = Observation(
        casts[0], landing, row["landing_std"], row["is_caught"], row["status"], tuple(row["limits_hit"]), executed
    )
    return model.learn([seen])
