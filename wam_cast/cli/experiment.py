"""The paper's experiment from the command line."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import wam_cast as wc
from wam_cast.cli.models import load_scenario
from wam_cast.cli.output import err, phase_progress

if TYPE_CHECKING:
    from wam_cast.experiments.paper.findings import Findings


def run_experiment(scenario_path: Path | None, directory: Path, seed: int, quick: bool) -> Findings:
    """Run or finish the experiment under a progress bar for each phase; when interrupted, say how to go on."""
    scenario = load_scenario(scenario_path)
    with phase_progress() as report:
        try:
            return wc.reproduce(scenario, directory, seed=seed, quick=quick, on_progress=report)
        except KeyboardInterrupt:
            command = ["reproduce", "--seed", str(seed), "--out", str(directory)]
            if scenario_path is not None:
                command += ["--scenario", str(scenario_path)]
            if quick:
                command.append("--quick")
            err.print(f"what is finished is kept in {directory}. Go on with: wam-cast {shlex.join(command)}")
            raise
