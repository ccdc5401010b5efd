"""What one run of the experiment on unknown robots depends on."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from wam_cast.adaptation.methods import ADAPTATION_METHODS, AdaptationMethod
from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.errors import checked_integer
from wam_cast.scenario import Noise, Scenario
from wam_cast.storage.manifest import current_versions

BEST: AdaptationMethod = "prior"
"""The method that all cups and all casts are about; the others are compared on some of them."""

CUPS: dict[str, dict[str, float]] = {
    "30 mm, nearly inelastic": {},
    "30 mm, lively": {"restitution": 0.6},
    "25 mm, nearly inelastic": {"inner_radius": 0.025},
}
"""Cups by name: what of them differs from the believed one. Casts are planned for the first."""

MAIN_KS = (0, 5, 10)
"""Practice casts after which the best method is tried on all cups, and from 5 on with all of `CUPS`; otherwise on those that all
methods are compared on, in the first."""

OUT_OF_RANGE: dict[str, dict[str, float]] = {
    "string 10 % shorter": {"string.length": 0.9},
    "string 8 % longer": {"string.length": 1.08},
    "half the ball": {"ball.mass": 0.5},
    "twice the ball": {"ball.mass": 2.0},
    "half the gains": {"controller.kp": 0.5, "controller.kd": 0.5},
}
"""Robots that no range holds: factors of what is believed, by name. A string that is 10 % longer hangs below the rim."""

MOST_ROBOTS, MOST_CUPS = 10_000, 1000
"""In a group, and for each robot: the streams of their noise are numbered so that no more of them are each other's."""

FULL = {"n_robots": 30, "n_cups": 20, "n_compared_cups": 2, "ks": (0, 1, 2, 5, 10, 20), "longest_campaign": 30}
QUICK = {"n_robots": 2, "n_cups": 4, "n_compared_cups": 2, "ks": (0, 2, 5), "longest_campaign": 15}


@dataclass(frozen=True)
class Group:
    """Robots of one kind, and what is known of them.

    Attributes
    ----------
    name
        Of the group.
    kinds
        Robot i is drawn from `kinds[i % len(kinds)]`.
    expected
        The distribution whose prior is known; it need not be that of the robots.
    """

    name: str
    kinds: tuple[RobotDistribution, ...]
    expected: RobotDistribution

    def draw(self, number: int, seed: int) -> Scenario:
        """Return robot `number` of the group: the truth about it."""
        return self.kinds[number % len(self.kinds)].draw(seed)


@dataclass(frozen=True)
class TransferSettings:
    """One run.

    Attributes
    ----------
    scenario
        What is believed of all robots, with noise.
    seed
        Draws the robots, the cups and the noise.
    n_robots
        In each group.
    n_cups
        For each robot, on the line y = 0: a cast in another direction, in which the arm turns first, takes several times as long to
        simulate.
    n_compared_cups
        Of these, on which all methods are compared.
    ks
        After how many practice casts plans are made, ascending.
    longest_campaign
        Casts at one cup at most, in search of ten catches in a row.
    engine
        What simulates casts without a cup and without noise: `drake` or `batch`.
    is_quick
        Whether it is a small run.
    """

    scenario: Scenario
    seed: int
    n_robots: int
    n_cups: int
    n_compared_cups: int
    ks: tuple[int, ...]
    longest_campaign: int
    engine: str
    is_quick: bool

    @classmethod
    def of(
        cls,
        scenario: Scenario,
        seed: int,
        quick: bool,
        engine: str = "drake",
        n_robots: int | None = None,
        n_cups: int | None = None,
    ) -> TransferSettings:
        """Return the settings of a full run, or of a quick one, with as many robots and cups as asked for.

        A scenario without noise gets that of a typical arm. Raises `.InputError` if a number is no integer or out of range.
        """
        seed = checked_integer("seed", seed, 0)
        sizes: dict[str, Any] = dict(QUICK if quick else FULL)
        if n_robots is not None:
            sizes["n_robots"] = checked_integer("n_robots", n_robots, 1, MOST_ROBOTS)
        if n_cups is not None:
            sizes["n_cups"] = checked_integer("n_cups", n_cups, sizes["n_compared_cups"], MOST_CUPS)
        noisy = scenario if scenario.noise.is_on else scenario.model_copy(update={"noise": Noise.typical()})
        return cls(noisy, seed, **sizes, engine=engine, is_quick=quick)

    @property
    def methods(self) -> tuple[AdaptationMethod, ...]:
        """That are compared: all but identification, which takes half a minute for each robot and each k."""
        return tuple(method for method in ADAPTATION_METHODS if method != "identification")

    @property
    def groups(self) -> tuple[Group, ...]:
        """Within the ranges, within twice the ranges, and out of range with the prior of the first."""
        once = RobotDistribution(self.scenario)
        twice = once.scaled(2.0)
        beyond = tuple(once.without(*shifts).shifted(shifts) for shifts in OUT_OF_RANGE.values())
        return Group("x1", (once,), once), Group("x2", (twice,), twice), Group("out of range", beyond, once)

    def command(self, directory: Path) -> str:
        """Return the command line of the run in `directory`; its scenario is there too."""
        words = ["wam-cast", "transfer", "--seed", str(self.seed), "--out", str(directory)]
        if self.scenario != Scenario(noise=Noise.typical()):
            words += ["--scenario", str(directory / "scenario.yaml")]
        if self.engine != "drake":
            words += ["--engine", self.engine]
        usual = QUICK if self.is_quick else FULL
        for option, name in (("--robots", "n_robots"), ("--cups", "n_cups")):
            if getattr(self, name) != usual[name]:
                words += [option, str(getattr(self, name))]
        return shlex.join([*words, "--quick"] if self.is_quick else words)

    @property
    def identity(self) -> dict[str, object]:
        """What must be the same for a run to go on where another one stopped.

        How many robots there are is none of it: each is by itself, and a run may go on to more of them.
        """
        return {
            "scenario": self.scenario.model_dump(mode="json"),
            "fingerprint": self.scenario.fingerprint,
            "engine": self.engine,
            "seed": self.seed,
            "n_cups": self.n_cups,
            "n_compared_cups": self.n_compared_cups,
            "ks": list(self.ks),
            "longest_campaign": self.longest_campaign,
            "versions": current_versions() | {package: version(package) for package in ("scipy", "scikit-learn")},
        }
