"""What many robots have shown, in tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from wam_cast.adaptation.methods import ADAPTATION_METHODS
from wam_cast.experiments.frames import Result, Rows
from wam_cast.experiments.statistics import describe, wilson_interval
from wam_cast.experiments.transfer.one_robot import RobotStudy
from wam_cast.experiments.transfer.transfer_settings import BEST, CUPS, TransferSettings
from wam_cast.simulation.outcome import Status

WITHIN = (1.0, 2.0)
"""Standard deviations within which landings are counted."""


class TransferSummary(Result):
    """The tables of a run, of which the report is made.

    Attributes
    ----------
    bias
        By group, method and k: `n` plans, and the median, 95th percentile and maximum [m] of how far their casts land from the
        cup's axis without noise; of `n_never` of them the ball never came down.
    hits
        By group, method, k and cup: `n` casts with noise, `n_caught`, the rate and its 95 % interval.
    calibration
        By group and k, of the best method: which share of landings without noise is within one and two predicted standard
        deviations, along and across.
    campaigns
        A row a robot: its group and number, casts to the first catch and to the end of ten in a row, nan if it did not come to
        that.
    plans
        All plans, with group and robot.
    """

    bias: Rows
    hits: Rows
    calibration: Rows
    campaigns: Rows
    plans: Rows


def summarize(settings: TransferSettings, studies: Mapping[str, Sequence[RobotStudy]]) -> TransferSummary:
    """Return the tables of all groups' robots."""
    plans = pd.concat(
        [study.plans.assign(group=group, robot=i) for group, some in studies.items() for i, study in enumerate(some)],
        ignore_index=True,
    )
    campaigns = pd.DataFrame(
        [
            {"group": group, "robot": i, "first_catch": study.first_catch, "streak_end": study.streak_end}
            for group, some in studies.items()
            for i, study in enumerate(some)
        ]
    )
    ordered = [
        (group, method, k, of_k)
        for group in studies
        for method in ADAPTATION_METHODS
        for k in settings.ks
        if len(of_k := plans[(plans["group"] == group) & (plans["method"] == method) & (plans["k"] == k)])
    ]
    return TransferSummary(
        bias=pd.DataFrame([_bias(*one) for one in ordered]),
        hits=pd.DataFrame([row for one in ordered for row in _hits(*one)]),
        calibration=pd.DataFrame([_calibration(g, k, of_k) for g, method, k, of_k in ordered if method == BEST]),
        campaigns=campaigns.astype({"first_catch": float, "streak_end": float}),
        plans=plans,
    )


def _bias(group: str, method: str, k: int, plans: pd.DataFrame) -> dict[str, object]:
    statistics = describe(plans["bias"].to_numpy(dtype=float))
    named = {"group": group, "method": method, "k": k, "n": len(plans), "n_never": len(plans) - statistics["n"]}
    return named | {name: statistics[name] for name in ("median", "p95", "max")}


def _hits(group: str, method: str, k: int, plans: pd.DataFrame) -> list[dict[str, object]]:
    rows: list[dict[str, object]] = []
    for cup in CUPS:
        statuses = plans[f"status: {cup}"].dropna()
        if len(statuses):
            n, n_caught = len(statuses), int((statuses == Status.CAUGHT.value).sum())
            interval = wilson_interval(n_caught, n)
            named = {"group": group, "method": method, "k": k, "cup": cup, "n": n, "n_caught": n_caught}
            rows.append(named | {"rate": n_caught / n, "low": interval[0], "high": interval[1]})
    return rows


def _calibration(group: str, k: int, plans: pd.DataFrame) -> dict[str, object]:
    row: dict[str, object] = {"group": group, "k": k}
    for axis in ("along", "across"):
        errors = (plans[f"error_{axis}"] / plans[f"std_{axis}"]).dropna().abs()
        row |= {f"{axis}_within_{within:g}": float((errors <= within).mean()) for within in WITHIN}
    return row


def share_within(campaigns: pd.DataFrame, column: str, most: int) -> float:
    """Return which share of robots came to it within so many casts."""
    return float(np.mean(campaigns[column] <= most))
