"""`wam-cast robot`: a simulated arm that a controller in another process casts with."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import wam_cast as wc
from wam_cast.cli import model_choice, options
from wam_cast.cli.results import format_position
from wam_cast.cli.terminal import err, out, progress
from wam_cast.wire.bus import DEFAULT_URL, LcmBus

if TYPE_CHECKING:
    from wam_cast.wire.safety import Refusal
    from wam_cast.wire.stage import StageRequest


def robot(
    scenario: options.Scenario = None,
    belief: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="What its controller takes it for: where a cast starts. Default: the same."),
    ] = None,
    url: Annotated[
        str, typer.Option(metavar="URL", help="LCM's address to listen at; ttl=0 stays on this machine.")
    ] = DEFAULT_URL,
    real_time: Annotated[
        bool, typer.Option("--real-time", metavar="", help="By the clock, at the control rate. Default: in lock step.")
    ] = False,
    casts: Annotated[int | None, typer.Option(min=1, help="End after so many casts. Default: never.")] = None,
    as_json: options.AsJson = False,
) -> None:
    """Simulate an arm that `wam-cast throw --robot URL` casts with from another process, until interrupted.

    In lock step it waits for each command, and a cast is what it is in one process, to the last bit. In real time a torque acts a
    control period later, and without a command in time the arm holds its position and stops. It says which commands it refuses.
    With --json there is a line of JSON where it listens, and one for each cast.
    """
    from wam_cast.wire.simulated_arm import SimulatedArm

    setting, believed = model_choice.load_scenario(scenario), None
    if belief is not None:
        believed = model_choice.load_scenario(belief)

    def tell_refusal(refusal: Refusal) -> None:
        if arm.safety.refused[refusal.kind] == 1:  # the first of its kind in this cast
            err.print(f"refused: {refusal}")

    def tell_outcome(request: StageRequest, outcome: wc.Outcome, service: dict[str, Any]) -> None:
        if as_json:
            print(json.dumps(_record(request, outcome, service)), flush=True)
        else:
            out.print(_line(arm.n_casts + 1, request, outcome, service))

    with progress("setting up"):
        arm = SimulatedArm(
            LcmBus(url), setting, believed, is_real_time=real_time, on_refusal=tell_refusal, on_outcome=tell_outcome
        )
    mode = "real time" if real_time else "lock step"
    if as_json:
        print(json.dumps({"url": url, "mode": mode, "period": setting.controller.period}), flush=True)
    else:
        out.print(f"listening at {url}, in {mode}")
        out.print("stop with Ctrl-C")
    arm.serve(casts)


def _record(request: StageRequest, outcome: wc.Outcome, service: dict[str, Any]) -> dict[str, Any]:
    from dataclasses import asdict

    assert request.cast is not None
    told = {"status": outcome.status.value, "stop_reason": outcome.stop_reason, **service}
    return {"cast": asdict(request.cast), "cup": request.cup, **told}


def _line(number: int, request: StageRequest, outcome: wc.Outcome, service: dict[str, Any]) -> str:
    """Return what is printed of a cast."""
    cup = "no cup" if request.cup is None else f"cup {format_position(request.cup)}"
    parts = [f"cast {number}: {cup}: {outcome.status.value}"]
    if outcome.stop_reason:
        parts.append(outcome.stop_reason)
    if service["refused"]:
        parts.append("refused: " + ", ".join(f"{n} {kind}" for kind, n in service["refused"].items()))
    if service.get("n_missed"):
        late = 1e3 * service["worst_lateness"]
        parts.append(f"{service['n_missed']} of {service['n_ticks']} deadlines missed, by {late:.1f} ms at most")
    return "; ".join(parts)
