"""What one run of the experiment depends on."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from wam_cast.errors import checked_integer
from wam_cast.planning.plan import METHODS, Method
from wam_cast.scenario import Noise, Scenario
from wam_cast.storage.manifest import current_versions

OnProgress = Callable[[int, int], None]
"""Takes how much of a phase is done, and how much there is."""

PAPERS_PLANNER: Method = "gradient"

PLANNERS: tuple[Method, ...] = (PAPERS_PLANNER, *(planner for planner in METHODS if planner != PAPERS_PLANNER))
"""The paper's first."""


FULL = {"n_casts": 1700, "n_cups": 100, "n_repeats": 8}
QUICK = {"n_casts": 170, "n_cups": 10, "n_repeats": 3}


@dataclass(frozen=True)
class Settings:
    """One run of the experiment.

    Attributes
    ----------
    scenario
        Without noise.
    noise
        Of the section on casts that do not repeat.
    seed
        Draws the casts, the subsets of the learning curves, the starts of the neural network, and the noise.
    n_casts
        Split 1300 : 300 : 100 into training, validation and test casts.
    n_cups
        Evenly over the line that can be reached.
    n_repeats
        Random subsets of each size in the learning curves.
    is_quick
        Whether it has a tenth of the data.
    engine
        What simulates the training casts, see `.generate_dataset`.
    """

    scenario: Scenario
    noise: Noise
    seed: int
    n_casts: int
    n_cups: int
    n_repeats: int
    is_quick: bool
    engine: str = "drake"

    @classmethod
    def of(cls, scenario: Scenario, seed: int, quick: bool, engine: str = "drake") -> Settings:
        """Return the settings of a full run, or of a quick one with a tenth of the data.

        The experiment is about casts that repeat exactly; a scenario's own noise is kept for the section on noise.
        """
        seed = checked_integer("seed", seed, 0)
        noise = scenario.noise if scenario.noise.is_on else Noise.typical()
        clean = scenario.model_copy(update={"noise": Noise()})
        return cls(clean, noise, seed, **(QUICK if quick else FULL), is_quick=quick, engine=engine)

    @property
    def versions(self) -> dict[str, str]:
        """Of the software that numbers come from."""
        return current_versions() | {package: version(package) for package in ("scipy", "scikit-learn")}

    def command(self, directory: Path) -> str:
        """Return the command line of the run in `directory`; its scenario is there too."""
        words = ["wam-cast", "reproduce", "--seed", str(self.seed), "--out", str(directory)]
        if self.own_scenario != Scenario():
            words += ["--scenario", str(directory / "scenario.yaml")]
        if self.engine != "drake":
            words += ["--engine", self.engine]
        if self.is_quick:
            words.append("--quick")
        return shlex.join(words)

    @property
    def own_scenario(self) -> Scenario:
        """What the run was asked for: with the noise of its section, unless that is the typical one."""
        return self.scenario if self.noise == Noise.typical() else self.noisy_scenario

    @property
    def noisy_scenario(self) -> Scenario:
        """The scenario with its noise on."""
        return self.scenario.model_copy(update={"noise": self.noise})

    @property
    def identity(self) -> dict[str, object]:
        """What must be the same for a run to go on where another one stopped: all that its numbers depend on.

        Of the software that is the versions, not the text of its files: a comment changes no number.
        """
        return {
            "scenario": self.scenario.model_dump(mode="json"),
            "fingerprint": self.scenario.fingerprint,
            "noise": self.noise.model_dump(mode="json"),
            "engine": self.engine,
            "seed": self.seed,
            "n_casts": self.n_casts,
            "n_cups": self.n_cups,
            "n_repeats": self.n_repeats,
            "versions": self.versions,
        }
