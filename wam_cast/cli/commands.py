"""The command line: a thin face over the API.

Results go to standard output, progress and messages to standard error. Exit codes: 0 done; 1 the work was done and its answer
is no; 2 the input was wrong, one line says how; 130 interrupted.
"""

from __future__ import annotations

import math
import re
import sys
import time
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

import wam_cast as wc
from wam_cast.cli import experiment, explorer, floor_map, models, output
from wam_cast.cli.output import err, out, print_json, progress
from wam_cast.errors import InputError
from wam_cast.storage.atomic import check_writable

if TYPE_CHECKING:
    from collections.abc import Callable

    from wam_cast.planning.plan import Plan
    from wam_cast.simulation.outcome import Outcome

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


class Planner(StrEnum):
    """Planners by name."""

    program = "program"
    gradient = "gradient"


class Solver(StrEnum):
    """Solvers of the program by name."""

    snopt = "snopt"
    ipopt = "ipopt"
    nlopt = "nlopt"


ScenarioOption = Annotated[
    Path | None,
    typer.Option("--scenario", metavar="FILE", help="YAML file; the reference scenario without it."),
]
JsonOption = Annotated[bool, typer.Option("--json", metavar="", help="Print the result as JSON.")]
CupOption = Annotated[
    list[str],
    typer.Option("--cup", metavar="X[,Y]", help="The cup's axis in metres; y is 0 without it. Repeatable."),
]
PlannerOption = Annotated[Planner, typer.Option("--planner", help="`gradient` is the paper's.")]
SolverOption = Annotated[Solver | None, typer.Option("--solver", help="Of the program; snopt without it.")]
ModelOption = Annotated[
    Path | None,
    typer.Option(
        "--model",
        metavar="FILE",
        help="What `wam-cast fit` wrote; its scenario holds unless --scenario names one. Without it, the scenario's own.",
    ),
]
WorkersOption = Annotated[
    int | None, typer.Option("--workers", min=1, help="Processes; one per processor without it.")
]
TrainOption = Annotated[
    bool, typer.Option("--train", metavar="", help="Make the scenario's model first if it has none.")
]


def _print_version(wanted: bool) -> None:
    if wanted:
        out.print(f"wam-cast {wc.__version__}")
        raise typer.Exit


@app.callback(help="A simulated Barrett WAM casts a ball on a string into a cup.")
def _common(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    pass


@app.command()
def throw(
    cup: CupOption,
    scenario: ScenarioOption = None,
    model: ModelOption = None,
    planner: PlannerOption = Planner.program,
    solver: SolverOption = None,
    train: TrainOption = False,
    replay: Annotated[
        Path | None, typer.Option(metavar="FILE.html", help="Write a replay that opens in a browser.")
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(metavar="FILE.png", help="Write a film strip of one cast (also .pdf, .svg)."),
    ] = None,
    animation: Annotated[
        Path | None,
        typer.Option(metavar="FILE.gif", help="Write a film of one cast, without its return (also .mp4)."),
    ] = None,
    seed: Annotated[
        int,
        typer.Option(
            min=0,
            metavar="S",
            help="Draws the scenario's noise, for the next cups with S+1, S+2 and so on. No effect without noise.",
        ),
    ] = 0,
    as_json: JsonOption = False,
) -> None:
    """Plan a cast for each cup, execute them after each other in simulation, and report what became of the ball.

    Between two cups the arm lifts the ball out of the first, lets it hang at rest and turns to the second.
    """
    cups = [_parse_cup(text) for text in cup]
    files = Files(replay, picture, animation)
    _check_outputs(len(cups), files)
    setting, forward = models.scenario_and_model(scenario, model, train)
    plans = _plans(forward, cups, planner, solver)
    outcomes: list[Outcome] = []
    try:
        with progress("casting", len(plans)) as advance:

            def note(outcome: Outcome) -> None:
                outcomes.append(outcome)
                advance(len(outcomes))

            _execute(setting, plans, seed, files, note)
    finally:
        # What was finished is told even if the rest is interrupted.
        if outcomes:
            output.print_throws(plans, outcomes, as_json)
    if not all(outcome.is_caught for outcome in outcomes):
        raise typer.Exit(1)


@app.command()
def plan(
    cup: CupOption,
    scenario: ScenarioOption = None,
    model: ModelOption = None,
    planner: PlannerOption = Planner.program,
    solver: SolverOption = None,
    train: TrainOption = False,
    as_json: JsonOption = False,
) -> None:
    """Plan a cast for each cup, without executing it."""
    cups = [_parse_cup(text) for text in cup]
    _, forward = models.scenario_and_model(scenario, model, train)
    plans = _plans(forward, cups, planner, solver)
    if as_json:
        print_json([output.plan_record(one) for one in plans])
    else:
        output.print_plans(plans)
    if not all(one.is_feasible for one in plans):
        raise typer.Exit(1)


@app.command()
def generate(
    directory: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where the dataset goes.")],
    casts: Annotated[int, typer.Option(min=1, help="How many casts to simulate.")] = models.TRAINING_CASTS,
    seed: Annotated[
        int, typer.Option(min=0, help="Draws the casts: row i of a seed is the same for ever.")
    ] = 0,
    scenario: ScenarioOption = None,
    workers: WorkersOption = None,
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
    data = models.generate(
        models.load_scenario(scenario), scenario, casts, seed, directory, workers, scheduler
    )
    counts = data.frame["status"].value_counts().to_dict()
    record = {
        "directory": str(directory),
        "n_casts": len(data),
        "seed": seed,
        "fingerprint": data.scenario.fingerprint,
        "statuses": counts,
        "wall_s": time.perf_counter() - started,
    }
    if as_json:
        print_json([record])
    else:
        statuses = ", ".join(f"{count} {status}" for status, count in counts.items())
        out.print(f"{len(data)} casts in {directory} ({statuses}), {record['wall_s']:.1f} s")


@app.command()
def fit(
    dataset: Annotated[Path, typer.Argument(metavar="DIR", help="What `wam-cast generate` wrote.")],
    file: Annotated[Path, typer.Option("--out", metavar="FILE", help="Where the model goes.")],
    scenario: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="YAML file; the scenario stored with the dataset without it."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Fit a forward model to a dataset."""
    model = models.fit(dataset, file, scenario)
    if as_json:
        print_json([{"model": str(file), "reach": model.reach, **asdict(model.info)}])
    else:
        output.print_fit(model)


@app.command()
def reproduce(
    directory: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where the report goes.")],
    seed: Annotated[int, typer.Option(min=0, help="Draws all that is random.")] = 0,
    quick: Annotated[bool, typer.Option("--quick", metavar="", help="With a tenth of the data.")] = False,
    scenario: ScenarioOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the paper's experiment and write its report; an interrupted run goes on when it is started again."""
    findings = experiment.run_experiment(scenario, directory, seed, quick)
    if as_json:
        print_json([{"directory": str(directory), **findings.summary()}])
    else:
        output.print_findings(findings, directory)


@app.command("map")
def map_(
    picture: Annotated[
        Path, typer.Option("--out", metavar="FILE.png", help="Where the figure goes (also .pdf, .svg).")
    ],
    radii: Annotated[int, typer.Option(min=2, help="How many distances from the base axis.")] = 12,
    bearings: Annotated[int, typer.Option(min=2, help="How many cups at each of them.")] = 9,
    casts: Annotated[
        int, typer.Option(min=1, help="How many for each cup. Without noise all would be alike: one is cast.")
    ] = 1,
    scenario: ScenarioOption = None,
    model: ModelOption = None,
    planner: PlannerOption = Planner.program,
    solver: SolverOption = None,
    train: TrainOption = False,
    seed: Annotated[int, typer.Option(min=0, help="Draws the scenario's noise.")] = 0,
    workers: WorkersOption = None,
    as_json: JsonOption = False,
) -> None:
    """Plan and execute casts for cups all over the reachable floor, and draw it as a map.

    The work is done when the map is drawn: the exit code is 0 whatever became of the balls.
    """
    from wam_cast.experiments.floor_map import MapSize

    floor_map.check_picture(picture)
    _, forward = models.scenario_and_model(scenario, model, train)
    size = MapSize(radii, bearings, casts)
    floor = floor_map.make_map(
        forward, size, picture, planner.value, None if solver is None else solver.value, seed, workers
    )
    if as_json:
        print_json([{"picture": str(picture), **floor.record()}])
    else:
        output.print_map(floor, picture)


@app.command()
def show(
    scenario: ScenarioOption = None,
    model: ModelOption = None,
    graph: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a drawing of the diagram (.svg, .png, .pdf, .dot) instead."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Explore casts in the browser, with sliders for the cast and the cup, until interrupted.

    It shows where the ball is predicted to land, executes what is chosen, and plans. A scenario without a model is explored
    without predictions.
    """
    if graph is None:
        explorer.explore(scenario, model, as_json)
        return
    from wam_cast.visualization.diagram import write_graph

    setting = models.load_scenario(scenario) if model is None else models.find(scenario, model)[0]
    write_graph(wc.CastStation(setting), graph)
    if as_json:
        print_json([{"graph": str(graph)}])
    else:
        out.print(f"the diagram is in {graph}")


def main() -> None:
    """Run the command line; errors of the user's become one line and exit code 2."""
    try:
        code = app(sys.argv[1:] or ["--help"], prog_name="wam-cast", standalone_mode=False)
    except InputError as error:
        _fail(str(error))
    except (KeyboardInterrupt, typer.Abort):
        code = 130
    except Exception as error:
        # Typer's own errors of usage; their common base has another home from version to version.
        if not hasattr(error, "format_message"):
            raise
        context = getattr(error, "ctx", None)
        command = "wam-cast" if context is None else context.command_path
        message = error.format_message().replace("Value error, ", "").rstrip(".")
        if re.search(r"option: -[\d.]", message):
            message += " (a cup is one word: --cup 0.60,-0.25)"
        _fail(f"{message[:1].lower()}{message[1:]}; see `{command} --help`")
    if code == 130:
        err.print("interrupted")
    sys.exit(code if isinstance(code, int) else 0)


def _fail(message: str) -> None:
    err.print(f"error: {' '.join(message.split())}")  # one line, whatever the message holds
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


def _plans(
    model: wc.ForwardModel, cups: list[tuple[float, float]], planner: Planner, solver: Solver | None
) -> list[Plan]:
    plans = []
    with progress("planning", len(cups)) as advance:
        for done, cup in enumerate(cups, 1):
            plans.append(wc.plan_cast(model, cup, planner.value, None if solver is None else solver.value))
            advance(done)
    return plans


@dataclass(frozen=True)
class Files:
    """What `throw` is to write, each a path or none."""

    replay: Path | None
    picture: Path | None
    animation: Path | None


def _check_outputs(n_cups: int, files: Files) -> None:
    """Refuse, before any work is done, what `throw` could not write after it."""
    from wam_cast.visualization.picture_files import picture_format

    for option, path in (("--picture", files.picture), ("--animation", files.animation)):
        if path is not None and n_cups > 1:
            raise InputError(f"{option} shows one cast: give one --cup, not {n_cups}")
    for path in (files.replay, files.picture, files.animation):
        if path is not None:
            check_writable(path)
    if files.replay is not None and files.replay.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"--replay {files.replay} is a web page: choose a name that ends in .html")
    if files.picture is not None:
        picture_format(files.picture)
    if files.animation is not None:
        from wam_cast.visualization.film import check_animation

        check_animation(files.animation)


def _execute(
    scenario: wc.Scenario,
    plans: list[Plan],
    seed: int,
    files: Files,
    on_outcome: Callable[[Outcome], None],
) -> None:
    """Execute plans after each other; if it is to be shown, to the end of the last return, and write what was asked for."""
    if files == Files(None, None, None):
        casts, cups = [plan.cast for plan in plans], [plan.cup for plan in plans]
        wc.simulate_casts(scenario, casts, cups, noise_seed=seed, on_outcome=on_outcome)
        return
    throws = [wc.Throw(plan.cast, plan.cup) for plan in plans]
    simulator = wc.CastSimulator(scenario)
    recordings = simulator.record_sequence(throws, noise_seed=seed, on_outcome=on_outcome)
    if files.replay is not None:
        from wam_cast.visualization.replay import write_replay

        write_replay(recordings, files.replay, [plan.predicted_landing for plan in plans])
        err.print(f"replay: {files.replay}")
    if files.picture is not None:
        from wam_cast.visualization.film_strip import write_picture

        write_picture(recordings[0], files.picture, plans[0].predicted_landing)
        err.print(f"picture: {files.picture}")
    if files.animation is not None:
        from wam_cast.visualization.film import write_animation

        write_animation(recordings[0], files.animation)
        err.print(f"animation: {files.animation}")
