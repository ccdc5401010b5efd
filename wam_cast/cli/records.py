"""What `--json` prints: one object for each result, in SI units."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from wam_cast.planning.plan import Plan
    from wam_cast.simulation.outcome import Outcome

Record = dict[str, Any]


def plan_record(plan: Plan) -> Record:
    """Return what `plan --json` prints of a plan."""
    return {
        "cup": list(plan.cup),
        "cast": asdict(plan.cast),
        "predicted_landing": plan.predicted_landing.tolist(),
        "predicted_miss": plan.predicted_miss,
        "predicted_std": list(plan.predicted_std),
        "predicted_entry_angle": plan.predicted_entry_angle,
        "predicted_entry_speed": plan.predicted_entry_speed,
        "predicted_slack": plan.predicted_slack,
        "predicted_peak_torque_utilization": plan.predicted_peak_torque_utilization,
        "predicted_peak_velocity_utilization": plan.predicted_peak_velocity_utilization,
        "rim_clear_probability": plan.rim_clear_probability,
        "is_feasible": plan.is_feasible,
        "planner": plan.method,
        "n_evaluations": plan.n_evaluations,
        "n_solutions": plan.n_solutions,
        "reason": plan.reason,
    }


def throw_record(plan: Plan, outcome: Outcome) -> Record:
    """Return what `throw --json` prints of a plan and its execution."""
    return {
        **plan_record(plan),
        "landing": outcome.landing.tolist(),
        "miss": outcome.miss,
        "status": outcome.status.value,
        "is_caught": outcome.is_caught,
        "entry_angle": outcome.entry_angle,
        "entry_speed": outcome.entry_speed,
        "is_slack": outcome.is_slack,
        "slack": outcome.slack,
        "peak_torque_utilization": float(np.max(outcome.peak_torque_utilization)),
        "peak_velocity_utilization": float(np.max(outcome.peak_velocity_utilization)),
        "limits_hit": list(outcome.limits_hit),
        "return_faults": list(outcome.return_faults),
    }


def print_json(record: Record | Sequence[Record]) -> None:
    """Print one object, or a list of them; what is not a number becomes null, which JSON has a word for."""

    def clean(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: clean(item) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [clean(item) for item in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    print(json.dumps(clean(record), indent=2), flush=True)
