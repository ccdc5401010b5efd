"""The command line: a thin face over the API.

Results go to standard output, progress and messages to standard error. Exit codes: 0 done; 1 the work was done and its answer
is no; 2 the input was wrong, one line says how; 130 interrupted.
"""

from __future__ import annotations

import json
import math
import shlex
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table

import wam_cast as wc
from wam_cast.errors import InputError

if TYPE_CHECKING:
    from wam_cast.planning.plan import Plan
    from wam_cast.system.outcome import Outcome

TRAINING_CASTS = 1700
"""As many as the paper simulated: 1300 to train with, 300 to validate, 100 to test."""

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="A simulated Barrett WAM casts a ball on a string into a cup.",
)
err = Console(stderr=True, soft_wrap=True, highlight=False)
out = Console(soft_wrap=True, highlight=False)


class Planner(StrEnum):
    """Planners by name."""

    program = "program"
    gradient = "gradient"


ScenarioOption = Annotated[
    Path | None,
    typer.Option("--scenario", metavar="FILE", help="YAML file; the reference scenario without it."),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]
CupOption = Annotated[
    list[str],
    typer.Option("--cup", metavar="X[,Y]", help="The cup's axis [m]; y is 0 without it. Repeatable."),
]
PlannerOption = Annotated[Planner, typer.Option("--planner", help="`gradient` is the paper's.")]
ModelOption = Annotated[
    Path | None,
    typer.Option("--model", metavar="FILE", help="What `wam-cast fit` wrote; else the scenario's own."),
]
TrainOption = Annotated[bool, typer.Option("--train", help="Make the scenario's model first if it has none.")]


@app.command()
def throw(
    cup: CupOption,
    scenario: ScenarioOption = None,
    model: ModelOption = None,
    planner: PlannerOption = Planner.program,
    train: TrainOption = False,
    replay: Annotated[
        Path | None, typer.Option(metavar="FILE.html", help="Write a replay that opens in a browser.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Write a film strip (also .pdf, .svg).")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a cast for each cup, execute it in simulation, and report what became of the ball."""
    cups = [_parse_cup(text) for text in cup]
    files = {"--replay": replay, "--picture": picture}
    if len(cups) > 1 and any(files.values()):
        raise InputError(
            f"{next(k for k, v in files.items() if v)} shows one cast: give one --cup, not {len(cups)}"
        )
    setting = _scenario(scenario)
    forward = _model(setting, scenario, model, train)
    plans = [wc.plan_cast(forward, position, planner.value) for position in cups]
    outcomes = []
    for plan in plans:
        if replay or picture:
            outcomes.append(_record(setting, plan, replay, picture))
        else:
            outcomes.append(wc.simulate_cast(setting, plan.cast, plan.cup))
    if as_json:
        _print_json([_throw_record(plan, outcome) for plan, outcome in zip(plans, outcomes, strict=True)])
    else:
        _print_throws(plans, outcomes)
    if not all(outcome.is_caught for outcome in outcomes):
        raise typer.Exit(1)


@app.command()
def plan(
    cup: CupOption,
    scenario: ScenarioOption = None,
    model: ModelOption = None,
    planner: PlannerOption = Planner.program,
    train: TrainOption = False,
    as_json: JsonOption = False,
) -> None:
    """Plan a cast for each cup, without executing it."""
    cups = [_parse_cup(text) for text in cup]
    forward = _model(_scenario(scenario), scenario, model, train)
    plans = [wc.plan_cast(forward, position, planner.value) for position in cups]
    if as_json:
        _print_json([_plan_record(one) for one in plans])
    else:
        _print_plans(plans)
    if not all(one.is_feasible for one in plans):
        raise typer.Exit(1)


@app.command()
def generate(
    directory: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where the dataset goes.")],
    casts: Annotated[int, typer.Option(min=1, help="How many casts to simulate.")] = TRAINING_CASTS,
    seed: Annotated[
        int, typer.Option(min=0, help="Draws the casts: row i of a seed is the same for ever.")
    ] = 0,
    scenario: ScenarioOption = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes; one per processor without it.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Of a Dask scheduler whose workers simulate instead."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Simulate random casts and store them; an interrupted run goes on when it is started again."""
    if workers is not None and scheduler is not None:
        raise InputError("--workers and --scheduler exclude each other: a scheduler brings its own workers")
    started = time.perf_counter()
    data = _generate(_scenario(scenario), scenario, casts, seed, directory, workers, scheduler)
    counts = data.frame["status"].value_counts().to_dict()
    record = {
        "directory": str(directory),
        "n_casts": len(data.frame),
        "seed": seed,
        "fingerprint": data.scenario.fingerprint,
        "statuses": counts,
        "wall_s": time.perf_counter() - started,
    }
    if as_json:
        _print_json([record])
    else:
        statuses = ", ".join(f"{count} {status}" for status, count in counts.items())
        out.print(f"{len(data.frame)} casts in {directory} ({statuses}), {record['wall_s']:.1f} s")


@app.command()
def fit(
    dataset: Annotated[Path, typer.Argument(metavar="DIR", help="What `wam-cast generate` wrote.")],
    file: Annotated[Path, typer.Option("--out", metavar="FILE", help="Where the model goes.")],
    scenario: ScenarioOption = None,
    as_json: JsonOption = False,
) -> None:
    """Fit a forward model to a dataset."""
    model = _fit(dataset, file, None if scenario is None else _scenario(scenario))
    if as_json:
        _print_json([{"model": str(file), "reach": model.reach, **asdict(model.info)}])
        return
    info = model.info
    table = _table("training casts", "sigma", "validation RMSE", "test RMSE", "reach")
    nearest, farthest = model.reach
    table.add_row(
        str(info.n_train),
        f"{info.sigma:.3f}",
        f"{1e2 * info.validation_rmse:.2f} cm",
        f"{1e2 * info.test_rmse:.2f} cm",
        f"{nearest:.3f} to {farthest:.3f} m",
    )
    out.print(table)


@app.command()
def show(
    scenario: ScenarioOption = None,
    graph: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a drawing of the diagram (.svg, .png, .pdf, .dot) instead."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show the robot and one cast in the browser, until interrupted."""
    setting = _scenario(scenario)
    if graph is not None:
        from wam_cast.evaluation.diagram import write_graph

        write_graph(wc.CastStation(setting), graph)
        _print_json([{"graph": str(graph)}]) if as_json else out.print(f"the diagram is in {graph}")
        return
    _show(setting, as_json)


def main() -> None:
    """Run the command line; errors of the user's become one line and exit code 2."""
    try:
        code = app(standalone_mode=False)
        sys.exit(code if isinstance(code, int) else 0)
    except InputError as error:
        _fail(str(error))
    except typer.TyperException as error:
        _fail(error.format_message())
    except (KeyboardInterrupt, typer.Abort):
        err.print("interrupted")
        sys.exit(130)


def _fail(message: str) -> None:
    # One line whatever the message holds, and nothing of it taken for markup.
    err.print(f"error: {' '.join(message.split())}", markup=False)
    sys.exit(2)


def _parse_cup(text: str) -> tuple[float, float]:
    """Return world (x, y) of `X` or `X,Y`."""
    numbers = text.split(",")
    try:
        x, y = (float(number) for number in (numbers if len(numbers) == 2 else [*numbers, "0"]))
    except ValueError:
        raise InputError(
            f"--cup {text!r} is not a position: give X or X,Y in metres, such as --cup 0.75 or --cup 0.60,-0.25"
        ) from None
    if not (math.isfinite(x) and math.isfinite(y)):
        raise InputError(f"--cup {text!r} is not finite: give X or X,Y in metres, such as --cup 0.75")
    return x, y


def _scenario(path: Path | None) -> wc.Scenario:
    return wc.Scenario() if path is None else wc.Scenario.from_yaml(path)


def _model(
    scenario: wc.Scenario, scenario_path: Path | None, path: Path | None, train: bool
) -> wc.ForwardModel:
    """Return the model to plan with: the one named, the shipped one if it fits, or the scenario's own beside its file."""
    if path is not None:
        return wc.ForwardModel.load(path, scenario)
    if scenario.fingerprint == wc.Scenario().fingerprint:
        return wc.reference_model()
    assert scenario_path is not None
    own = scenario_path.with_name(f"{scenario_path.stem}-{scenario.fingerprint[:8]}.model")
    casts = own.with_suffix(".casts")
    if own.exists():
        return wc.ForwardModel.load(own, scenario)
    if not train:
        first = [
            "generate",
            "--scenario",
            str(scenario_path),
            "--casts",
            str(TRAINING_CASTS),
            "--out",
            str(casts),
        ]
        second = ["fit", str(casts), "--out", str(own)]
        raise InputError(
            f"scenario {scenario_path} has no model yet: make one with `wam-cast {shlex.join(first)}` and then "
            f"`wam-cast {shlex.join(second)}`, or add --train to do both now"
        )
    _generate(scenario, scenario_path, TRAINING_CASTS, 0, casts, None, None)
    return _fit(casts, own, scenario)


def _generate(
    scenario: wc.Scenario,
    scenario_path: Path | None,
    n_casts: int,
    seed: int,
    directory: Path,
    workers: int | None,
    scheduler: str | None,
) -> wc.CastDataset:
    """Generate a dataset under a progress bar; when interrupted, say how to go on."""
    done = 0
    with _progress("simulating casts", n_casts) as advance, _executor(scheduler) as executor:

        def report(n_done: int, _n_casts: int) -> None:
            nonlocal done
            done = n_done
            advance(n_done)

        try:
            return wc.generate_dataset(
                scenario,
                n_casts,
                seed,
                executor=executor,
                n_workers=workers,
                directory=directory,
                on_progress=report,
            )
        except KeyboardInterrupt:
            command = ["generate", "--casts", str(n_casts), "--seed", str(seed), "--out", str(directory)]
            if scenario_path is not None:
                command += ["--scenario", str(scenario_path)]
            err.print(
                f"{done} of {n_casts} casts were simulated; finished parts are kept in {directory}. "
                f"Go on with: wam-cast {shlex.join(command)}",
                markup=False,
            )
            raise


def _fit(dataset: Path, file: Path, scenario: wc.Scenario | None) -> wc.ForwardModel:
    data = wc.CastDataset.load(dataset, scenario)
    with _progress("fitting", None):
        model = wc.ForwardModel.fit(data)
    model.save(file)
    return model


@contextmanager
def _executor(scheduler: str | None) -> Iterator[Any]:
    """Give an executor on a Dask cluster, or none for this machine's processes."""
    if scheduler is None:
        yield None
        return
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler needs Dask: pip install 'wam-cast[distributed]'") from None
    try:
        client = Client(scheduler, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"--scheduler {scheduler}: no Dask scheduler answers there ({error})") from None
    with client:
        yield client.get_executor()


@contextmanager
def _progress(what: str, total: int | None) -> Iterator[Any]:
    """Show progress on standard error; give the function that takes how much is done."""
    columns = [SpinnerColumn(), TextColumn("{task.description}")]
    if total is not None:
        columns += [BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()]
    with Progress(*columns, console=err, transient=True) as progress:
        task = progress.add_task(what, total=total)
        yield lambda done: progress.update(task, completed=done)


def _record(scenario: wc.Scenario, plan: Plan, replay: Path | None, picture: Path | None) -> Outcome:
    """Execute a plan to the end of the return and write what was asked for."""
    from wam_cast.evaluation.filmstrip import write_picture
    from wam_cast.evaluation.replay import write_replay

    recording = wc.CastSimulator(scenario).record(plan.cast, plan.cup)
    if replay is not None:
        write_replay(recording, replay, plan.predicted_landing)
        err.print(f"replay: {replay}", markup=False)
    if picture is not None:
        write_picture(recording, picture, plan.predicted_landing)
        err.print(f"picture: {picture}", markup=False)
    return recording.outcome


def _show(scenario: wc.Scenario, as_json: bool) -> None:
    """Play one cast of middling parameters in the browser, over and over, until interrupted."""
    from wam_cast.evaluation.replay import open_replay

    simulator = wc.CastSimulator(scenario)
    bounds = scenario.bounds
    cast = wc.Cast(sum(bounds.distance) / 2, sum(bounds.speed) / 2, sum(bounds.wait) / 2)
    landing = simulator.simulate(cast).landing
    if not math.isfinite(landing[0]):
        raise InputError(
            "scenario: its middling cast never comes down to the rim plane, there is nothing to show"
        )
    meshcat = open_replay(simulator.record(cast, (float(landing[0]), float(landing[1]))))
    url = meshcat.web_url()
    _print_json([{"url": url}]) if as_json else out.print(f"{url} shows one cast; stop with Ctrl-C")
    while True:
        time.sleep(1)


def _plan_record(plan: Plan) -> dict[str, Any]:
    return {
        "cup": list(plan.cup),
        "cast": asdict(plan.cast),
        "predicted_landing": plan.predicted_landing.tolist(),
        "predicted_miss": plan.predicted_miss,
        "predicted_entry_angle": plan.predicted_entry_angle,
        "is_feasible": plan.is_feasible,
        "planner": plan.method,
        "n_evaluations": plan.n_evaluations,
        "reason": plan.reason,
    }


def _throw_record(plan: Plan, outcome: Outcome) -> dict[str, Any]:
    return {
        **_plan_record(plan),
        "landing": outcome.landing.tolist(),
        "miss": outcome.miss,
        "status": outcome.status.value,
        "is_caught": outcome.is_caught,
        "entry_angle": outcome.entry_angle,
        "entry_speed": outcome.entry_speed,
        "is_slack": outcome.is_slack,
        "peak_load": float(outcome.peak_load.max()),
        "peak_speed": float(outcome.peak_speed.max()),
        "limits_hit": list(outcome.limits_hit),
    }


def _print_json(records: list[dict[str, Any]]) -> None:
    """Print one object, or a list of several; what is not a number becomes null, which JSON has a word for."""

    def clean(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: clean(item) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [clean(item) for item in value]
        return None if isinstance(value, float) and not math.isfinite(value) else value

    print(json.dumps(clean(records[0] if len(records) == 1 else records), indent=2))


def _table(*headings: str) -> Table:
    table = Table()
    for heading in headings:
        table.add_column(heading, no_wrap=True)
    return table


def _position(xy: Any) -> str:
    # Adding 0 turns a rounded -0 into 0.
    return ", ".join(f"{round(value, 4) + 0:.4f}" for value in xy)


def _print_throws(plans: list[Plan], outcomes: list[Outcome]) -> None:
    table = _table("cup [m]", "predicted [m]", "executed [m]", "miss [mm]", "status")
    for plan, outcome in zip(plans, outcomes, strict=True):
        table.add_row(
            _position(plan.cup),
            _position(plan.predicted_landing),
            _position(outcome.landing),
            f"{1e3 * outcome.miss:.1f}",
            outcome.status.value,
        )
    out.print(table)
    for plan, outcome in zip(plans, outcomes, strict=True):
        if not plan.is_feasible:
            out.print(f"cup {_position(plan.cup)}: no cast is predicted to land in it ({plan.reason})")
        if outcome.limits_hit:
            out.print(f"cup {_position(plan.cup)}: the arm exceeds {', '.join(outcome.limits_hit)}")


def _print_plans(plans: list[Plan]) -> None:
    table = Table(
        "cup [m]", "distance [m]", "speed [m/s]", "wait [s]", "bearing [deg]", "predicted miss", "reason"
    )
    for plan in plans:
        cast = plan.cast
        table.add_row(
            _position(plan.cup),
            f"{cast.distance:.4f}",
            f"{cast.speed:.4f}",
            f"{cast.wait:.4f}",
            f"{math.degrees(cast.bearing):.2f}",
            f"{1e3 * plan.predicted_miss:.1f}",
        )
    out.print(table)
