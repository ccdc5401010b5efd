"""Whether a scenario can work, from a few of its casts: in plain words, and if not, why and what to change."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import pandas as pd

from wam_cast.experiments.statistics import wilson_interval
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome, Status

LEAST_GOOD_SHARE = 0.1
"""Of casts that a cup could catch: with fewer a model knows too little of them."""

MOSTLY_GOOD_SHARE = 0.8
"""Below this share of good casts it is said what becomes of the others."""

LEAST_SPAN = 0.05
"""Over which the good casts must land [m], for cups to be put in more than one place."""

MOST_DIVERGED = 0.05
"""Share of diverged casts that a scenario may have."""

QUINTIC_PEAK = 10 / math.sqrt(3)
"""Peak acceleration of a quintic spline from rest to rest, by its distance over its duration squared."""

MEND_DIVERGENCE = "lower bounds.speed, or controller.kp and controller.kd, or simulation.max_step"
MEND_NEVER_CROSSED = "deepen motion.drop_distance, or lengthen string.length or motion.hold_duration"


class Fate(StrEnum):
    """What a cast is good for: the last one that applies."""

    GOOD = "good"
    """It lands with a slack string, and the ball can rest in a cup there."""
    TAUT = "taut"
    """It lands with a taut string, and would swing on."""
    HANGS = "hangs"
    """It lands where the string is too short for the ball to rest in a cup."""
    NEVER_CROSSED = "never_crossed"
    LIMIT_HIT = "limit_hit"
    DIVERGED = "diverged"


@dataclass(frozen=True)
class Verdict:
    """Whether a scenario can work, why or why not, and what else is worth a word."""

    can_work: bool
    reason: str
    remarks: tuple[str, ...] = ()


def fate_of(scenario: Scenario, distance: float, outcome: Outcome) -> Fate:
    """Return what the cast of a `distance` [m] is good for that had this outcome without a cup."""
    if outcome.status is not Status.LANDED:
        return Fate(outcome.status.value)
    if not scenario.tether.leaves_free(distance, outcome.landing_along):
        return Fate.HANGS
    return Fate.GOOD if outcome.is_slack else Fate.TAUT


def span_of(landings: pd.Series[float]) -> tuple[float, float]:
    """Return the least and the largest of some landings [m], nan if there are none."""
    return float(landings.min()), float(landings.max())


def good_landings(casts: pd.DataFrame) -> pd.Series[float]:
    """Return where the good casts land [m]."""
    return casts["landing_along"][casts["fate"] == Fate.GOOD]


def verdict_of(scenario: Scenario, casts: pd.DataFrame) -> Verdict:
    """Return the verdict on the casts of a `.Preview`."""
    n, n_good, n_diverged = len(casts), count(casts, Fate.GOOD), count(casts, Fate.DIVERGED)
    nearest, farthest = span_of(good_landings(casts))
    diverged = flaw = ""
    if n_diverged:
        diverged = f"{n_diverged} of {n} casts diverged: {MEND_DIVERGENCE}"
    if n_good < MOSTLY_GOOD_SHARE * n and n_good + n_diverged < n:
        flaw = _worst_flaw(scenario, casts)
    if wilson_interval(n_diverged, n)[0] > MOST_DIVERGED:
        return Verdict(False, diverged)
    if n_good < LEAST_GOOD_SHARE * n:
        share = "no cast" if n_good == 0 else f"only {n_good} of {n} casts"
        return Verdict(False, f"{share} could be caught; {flaw}", (diverged,) if diverged else ())
    if farthest - nearest < LEAST_SPAN:
        words = f"all casts that could be caught land between {nearest:.3f} and {farthest:.3f} m from the base axis"
        mend = flaw or "widen bounds.distance and bounds.speed"
        return Verdict(False, f"{words}; {mend}", (diverged,) if diverged else ())
    low, high = wilson_interval(n_good, n)
    share = f"{n_good} of {n} casts (95 % interval {100 * low:.0f} to {100 * high:.0f} %)"
    remarks = tuple(filter(None, (diverged, flaw)))
    return Verdict(True, f"{share} could be caught, from {nearest:.3f} to {farthest:.3f} m", remarks)


def is_surely_good(casts: pd.DataFrame) -> bool:
    """Return whether more casts would hardly change a verdict that is good."""
    n_good = count(casts, Fate.GOOD)
    nearest, farthest = span_of(good_landings(casts))
    is_mostly_good = n_good >= MOSTLY_GOOD_SHARE * len(casts) and count(casts, Fate.DIVERGED) == 0
    return is_mostly_good and farthest - nearest >= LEAST_SPAN


def count(casts: pd.DataFrame, fate: Fate) -> int:
    """Return how many casts have that fate."""
    return int((casts["fate"] == fate).sum())


def _worst_flaw(scenario: Scenario, casts: pd.DataFrame) -> str:
    """Return what is wrong with most of the casts that neither diverged nor are good, and what to change."""
    flaws = casts["fate"][~casts["fate"].isin([Fate.GOOD, Fate.DIVERGED])]
    worst = Fate(flaws.mode().iloc[0])
    match worst:
        case Fate.HANGS:
            what, how = "the ball would hang in a taut string in a cup where it lands", _mend_hanging(scenario, casts)
        case Fate.TAUT:
            what, how = "the string is taut at the landing", _mend_taut(scenario)
        case Fate.NEVER_CROSSED:
            what, how = "the ball does not come down to the rim", MEND_NEVER_CROSSED
        case _:
            what, how = "the arm meets its limits", _mend_limits(casts)
    return f"{what} in {count(casts, worst)} of {len(casts)}: {how}"


def _mend_hanging(scenario: Scenario, casts: pd.DataFrame) -> str:
    """Return by how much longer a string or deeper a drop the ball would be free where half of these casts land."""
    motion, string, tether = scenario.motion, scenario.string, scenario.tether
    hanging = casts[casts["fate"] == Fate.HANGS]
    apart = float(np.median(np.abs(motion.start_radius + hanging["distance"] - hanging["landing_along"])))
    aside = replace(tether, play=tether.play + apart)  # as if the cup were right below the hand, and so much wider
    ways = [f"lengthen string.length from {string.length:g} to about {_up(aside.least_length)} m"]
    deeper = motion.drop_distance + tether.height - aside.greatest_height
    if deeper < motion.start_height - scenario.cup.rim_height:
        ways.append(f"deepen motion.drop_distance from {motion.drop_distance:g} to about {_up(deeper)} m")
    return " or ".join(ways)


def _mend_taut(scenario: Scenario) -> str:
    motion = scenario.motion
    acceleration = QUINTIC_PEAK * motion.drop_distance / motion.drop_duration**2
    if acceleration > scenario.gravity:
        return "lengthen string.length, deepen motion.drop_distance or shorten motion.drop_duration"
    shortest = math.sqrt(QUINTIC_PEAK * motion.drop_distance / scenario.gravity)
    return (
        f"the hand goes down with at most {acceleration:.1f} m/s^2, slower than the ball falls; shorten motion.drop_duration from "
        f"{motion.drop_duration:g} to well below {shortest:.2f} s, or deepen motion.drop_distance"
    )


def _mend_limits(casts: pd.DataFrame) -> str:
    """Return which limits are met most, and what keeps them: slower moves, if slower casts do, or else a slower drop."""
    met = casts["limits_hit"].explode().dropna().value_counts()
    names = ", ".join(f"{name} in {n} of {len(casts)}" for name, n in met.head(2).items())
    if any("position" in name for name in met.index):
        return f"{names}; choose another motion.start_radius, motion.start_height or arm.wrist_pitch, or lower bounds.distance"
    slowest = casts["speed"][casts["limits_hit"].str.len() > 0].min()
    n_slower = int((casts["speed"] < slowest).sum())
    if n_slower >= LEAST_GOOD_SHARE * len(casts):
        return f"{names}; lower bounds.speed (below {slowest:.2f} m/s no cast met any)"
    return (
        f"{names}, slow casts too; lengthen motion.drop_duration or reduce motion.drop_distance, and lower bounds.speed"
    )


def _up(length: float) -> str:
    """Return a length [m] in words, rounded up to whole centimetres."""
    return f"{math.ceil(100 * length - 1e-9) / 100:.2f}"
