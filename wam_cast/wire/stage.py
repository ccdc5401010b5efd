"""What no arm knows: where the cup is put, that a cast is to be made, and what became of the ball; asked and answered as JSON.

With a simulated arm its own process answers; with a real one, whoever puts the cup there and looks where the ball went. A
question is repeated until it is answered, and has a number, so that no message that is lost or doubled matters. What comes is
checked against the types here; fields that another version has besides are left out.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Annotated, Any, Literal, Self, get_type_hints

import numpy as np
from pydantic import AfterValidator, Field, TypeAdapter, ValidationError, create_model

from wam_cast.cast import Cast, checked_cup
from wam_cast.errors import describe_validation
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.types import Array, Position
from wam_cast.wire.messages import MessageError

REQUEST_CHANNEL, REPLY_CHANNEL = "WAM_STAGE_REQUEST", "WAM_STAGE_REPLY"

ARRAYS = {"landing": 2, "entry_velocity": 3, "peak_torque_utilization": 7, "peak_velocity_utilization": 7}
"""Attributes of an outcome that are arrays, and how long they are."""

MOST_BYTES = 65_536
"""Of a question or an answer, tens of times what any has."""

State = Literal["ready", "busy", "casting", "done", "refused"]


@dataclass(frozen=True)
class StageRequest:
    """A question to the arm's side.

    Attributes
    ----------
    number
        By which its reply is known: one of its own for each controller and question.
    robot
        Which run of the arm's process is asked, empty in the first question: one that was restarted shall not begin a cast anew.
    cast, cup, noise_seed
        What is to be cast, none if it is only asked who is there; the world (x, y) [m] of the cup's axis, none without a cup;
        what draws the scenario's noise.
    """

    number: str
    robot: str = ""
    cast: Cast | None = None
    cup: Annotated[Position, AfterValidator(checked_cup)] | None = None
    noise_seed: Annotated[int, Field(ge=0)] = 0

    def encode(self) -> bytes:
        """Return it in JSON."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the question in some bytes. Raises `.MessageError` if there is none."""
        question: Self = _decoded(_QUESTION, data, "question")
        return question


@dataclass(frozen=True)
class StageReply:
    """What the arm's side answers.

    Attributes
    ----------
    number
        Of the question.
    robot
        Which run of the arm's process answers.
    state
        `ready`, `busy` with another's cast, `casting`, `done`, or `refused`.
    period, is_real_time
        Between two samples [s]; whether the arm's clock runs by itself, or waits for each command.
    detail
        Why it was refused.
    outcome
        Of the cast that is done, as `outcome_record` has it.
    service
        What the arm's side counted meanwhile: see `.SimulatedArm`.
    """

    number: str
    robot: str
    state: State
    period: Annotated[float, Field(gt=0, allow_inf_nan=False)]
    is_real_time: bool
    detail: str = ""
    outcome: dict[str, Any] | None = None
    service: dict[str, Any] | None = None

    def encode(self) -> bytes:
        """Return it in JSON."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """Return the reply in some bytes. Raises `.MessageError` if there is none."""
        reply: Self = _decoded(_REPLY, data, "reply")
        return reply


_QUESTION, _REPLY = TypeAdapter(StageRequest), TypeAdapter(StageReply)


def _decoded(kind: TypeAdapter[Any], data: bytes, name: str) -> Any:
    if len(data) > MOST_BYTES:
        raise MessageError(f"no {name}: {len(data)} bytes, where {MOST_BYTES} are the most")
    try:
        return kind.validate_json(data, strict=True)
    except ValidationError as error:
        raise MessageError(f"no {name}: {describe_validation(error)}") from None


_TYPES = get_type_hints(Outcome) | {
    name: Annotated[list[float], Field(min_length=n, max_length=n)] for name, n in ARRAYS.items()
}
_OutcomeRecord: Any = create_model("_OutcomeRecord", **{field.name: _TYPES[field.name] for field in fields(Outcome)})


def outcome_record(outcome: Outcome) -> dict[str, Any]:
    """Return an outcome as JSON has it, each number to its last bit; nan is what Python's JSON writes for it."""
    record = asdict(outcome)
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in record.items()}


def outcome_of(record: Mapping[str, Any]) -> Outcome:
    """Return the outcome in a record. Raises `.MessageError` if it is none."""
    try:
        values = dict(_OutcomeRecord.model_validate(record))
    except ValidationError as error:
        raise MessageError(f"no outcome: {describe_validation(error)}") from None
    return Outcome(**values | {name: np.array(values[name]) for name in ARRAYS})


def seen_outcome(status: Status, landing: Array, **known: Any) -> Outcome:
    """Return the outcome of a cast that was watched: its status, the landing [m], (2,), and what else is known; the rest is nan."""
    numbers = (
        "landing_along",
        "landing_across",
        "crossing_time",
        "entry_angle",
        "slack",
        "miss",
        "peak_tracking_error",
    )
    unknown: dict[str, Any] = {
        **dict.fromkeys((*numbers, "end_time"), math.nan),
        **{name: np.full(n, math.nan) for name, n in ARRAYS.items()},
    }
    return Outcome(**{**unknown, "is_slack": False, "limits_hit": (), **known, "status": status, "landing": landing})


def stopped_outcome(reason: str, end_time: float) -> Outcome:
    """Return the outcome of a cast that the arm's side stopped at a time [s]; of what became of the ball it says nothing."""
    return seen_outcome(Status.STOPPED, np.full(2, math.nan), end_time=end_time, stop_reason=reason)
