"""The explorer's page, served until interrupted."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from wam_cast.cli import model_choice
from wam_cast.cli.records import print_json
from wam_cast.cli.terminal import err, out, progress


def explore(scenario_path: Path | None, model_path: Path | None, as_json: bool) -> None:
    """Serve the explorer's page, and print where, until interrupted."""
    from wam_cast.visualization.interactive.explorer import Explorer

    with progress("setting up"):
        scenario, model = model_choice.find(scenario_path, model_path)
        advice = {}
        if model is None and scenario_path is not None:
            advice = {"advice": f"{model_choice.how_to_make(scenario_path, scenario)}, and start again"}
        explorer = Explorer(scenario, model, **advice)
    if as_json:
        print_json({"url": explorer.url})
    else:
        out.print(f"{explorer.url} is a page to explore casts: its sliders and buttons are under Open Controls")
        out.print("stop with Ctrl-C")
    try:
        explorer.run()
    except KeyboardInterrupt:
        err.print("interrupted")
        leave(130)


def leave(code: int) -> None:
    """End the process at once: at its regular end Meshcat would wait for browsers that loaded the page a while ago."""
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
