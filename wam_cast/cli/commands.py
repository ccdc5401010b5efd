"""The commands of `wam-cast`: a thin face over the API.

Results go to standard output, progress and messages to standard error. Exit codes: 0 done; 1 the work was done and its answer
is no; 2 the input was wrong or the machine failed, one line says how; 130 interrupted, 141 nobody reads on.
"""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

import wam_cast as wc
from wam_cast.cli import model_choice, options, results
from wam_cast.cli.check import print_preview, require_workable
from wam_cast.cli.options import parse_cup
from wam_cast.cli.results import Executed, plan_record, print_json, throw_record
from wam_cast.cli.terminal import HELP_STYLE, err, out, phase_progress, progress
from wam_cast.cli.work.campaigning import learn
from wam_cast.cli.work.crosschecking import crosscheck
from wam_cast.cli.work.mapping import map_
from wam_cast.cli.work.marking import grade
from wam_cast.cli.work.output_files import ThrowFiles
from wam_cast.cli.work.serving import robot
from wam_cast.cli.work.throwing import check_remote, execute, execute_remotely, given_throws, make_plans
from wam_cast.cli.work.transferring import transfer
from wam_cast.errors import InputError

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=HELP_STYLE)


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
    cup: options.Cups,
    scenario: options.Scenario = None,
    belief: options.Belief = None,
    model: options.Model = None,
    planner: options.Planner = "program",
    solver: options.Solver = None,
    train: options.Train = False,
    cast: options.GivenCasts = None,
    replay: options.Replay = None,
    picture: options.FilmStrip = None,
    animation: options.Film = None,
    robot: options.Robot = None,
    recording: options.Recording = None,
    speed: options.Speed = 1.0,
    seed: options.NoiseSeed = 0,
    as_json: options.AsJson = False,
) -> None:
    """Plan a cast for each cup, execute them after each other in simulation, and report what became of the ball.

    Between two cups the arm lifts the ball out of the first, lets it hang at rest and turns to the second. With --cast nothing is
    planned. If it is interrupted, the casts that are finished are reported, and shown by --replay. With --robot another process has
    the arm, and each cast starts from rest at home.
    """
    cups = [parse_cup(text) for text in cup]
    files = ThrowFiles(replay, picture, animation, recording, speed)
    files.check(len(cups))
    if robot is not None:
        check_remote(robot, belief, files)
    plans: Sequence[wc.Plan | None] = [None] * len(cups)
    truth = None if belief is None else model_choice.load_scenario(scenario)
    if cast:
        if model is not None or train or solver is not None:
            raise InputError(
                "--cast is executed as given: leave --model, --train and --solver out, which serve to plan one"
            )
        setting = model_choice.load_scenario(belief or scenario)
        throws = given_throws(setting, cast, cups)
    else:
        setting, forward = model_choice.scenario_and_model(belief or scenario, model, train)
        made = make_plans(forward, cups, planner, solver)
        plans, throws = made, [wc.Throw(plan.cast, plan.cup) for plan in made]
    outcomes: list[wc.Outcome] = []
    try:
        with progress("casting", len(throws)) as advance:

            def note(outcome: wc.Outcome) -> None:
                outcomes.append(outcome)
                advance(len(outcomes))

            if robot is None:
                execute(truth or setting, setting, throws, plans, seed, files, note)
            else:
                execute_remotely(robot, setting, throws, seed, note)
    finally:
        # What was finished is told even if the rest is interrupted.
        executed = [Executed(*one) for one in zip(throws, plans, outcomes, strict=False)]
        if executed and as_json:
            records = [throw_record(one, robot) for one in executed]
            print_json(records if len(throws) > 1 else records[0])
        elif executed:
            results.print_throws(executed)
    if not all(outcome.is_caught for outcome in outcomes):
        raise typer.Exit(1)


@app.command()
def plan(
    cup: options.Cups,
    scenario: options.Scenario = None,
    model: options.Model = None,
    planner: options.Planner = "program",
    solver: options.Solver = None,
    train: options.Train = False,
    as_json: options.AsJson = False,
) -> None:
    """Plan a cast for each cup, without executing it."""
    cups = [parse_cup(text) for text in cup]
    _, forward = model_choice.scenario_and_model(scenario, model, train)
    plans = make_plans(forward, cups, planner, solver)
    if as_json:
        records = [plan_record(one) for one in plans]
        print_json(records if len(plans) > 1 else records[0])
    else:
        results.print_plans(plans)
    if not all(one.is_feasible for one in plans):
        raise typer.Exit(1)


@app.command()
def check(
    scenario: options.Scenario = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE.png", help="Write a side view of it (also .pdf, .svg).")
    ] = None,
    as_json: options.AsJson = False,
) -> None:
    """Simulate a few random casts of a scenario, and say whether it can work before a model is made: a few seconds.

    It needs no model. `generate`, `reproduce` and --train ask the same first.
    """
    if picture is not None:
        from wam_cast.visualization.picture_files import check_picture

        check_picture(picture)
    with progress("checking the scenario"):
        preview = wc.preview_scenario(model_choice.load_scenario(scenario))
    if as_json:
        file = {} if picture is None else {"picture": str(picture)}
        print_json({**preview.record(model_choice.TRAINING_CASTS), **file})
    else:
        print_preview(preview, model_choice.TRAINING_CASTS)
    if picture is not None:
        from wam_cast.experiments.preview_picture import write_preview_picture

        write_preview_picture(preview, picture)
        if not as_json:
            out.print(f"the picture is in {picture}")
    if not preview.verdict.can_work:
        raise typer.Exit(1)


@app.command()
def generate(
    directory: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where the dataset goes.")],
    casts: Annotated[int, typer.Option(min=1, help="How many casts to simulate.")] = model_choice.TRAINING_CASTS,
    seed: Annotated[int, typer.Option(min=0, help="Draws the casts: row i of a seed is always the same.")] = 0,
    scenario: options.Scenario = None,
    workers: options.Workers = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Of a Dask scheduler whose workers simulate instead.")
    ] = None,
    engine: options.Engine = "drake",
    force: options.Force = False,
    as_json: options.AsJson = False,
) -> None:
    """Simulate random casts and store them; an interrupted run goes on when it is started again."""
    from wam_cast.learning.parts import describe_failed_casts

    if workers is not None and scheduler is not None:
        raise InputError("--workers and --scheduler exclude each other: a scheduler brings its own workers")
    started = time.perf_counter()
    data = model_choice.generate(scenario, casts, seed, directory, workers, scheduler, force, engine)
    seconds = time.perf_counter() - started
    for line in describe_failed_casts(data):
        err.print(line)
    if as_json:
        print_json(results.dataset_record(data, directory, seconds))
    else:
        results.print_dataset(data, directory, seconds)


@app.command()
def fit(
    dataset: Annotated[Path, typer.Argument(metavar="DIR", help="What `wam-cast generate` wrote.")],
    file: Annotated[Path, typer.Option("--out", metavar="FILE", help="Where the model goes.")],
    scenario: Annotated[
        Path | None, typer.Option(metavar="FILE", help="YAML file; default: the scenario stored with the dataset.")
    ] = None,
    as_json: options.AsJson = False,
) -> None:
    """Fit a forward model to a dataset."""
    model, data = model_choice.fit(dataset, file, None if scenario is None else model_choice.load_scenario(scenario))
    if as_json:
        print_json(results.fit_record(model, data, file))
    else:
        results.print_fit(model)


@app.command()
def reproduce(
    directory: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where the report goes.")],
    seed: Annotated[int, typer.Option(min=0, help="Draws all that is random.")] = 0,
    quick: Annotated[bool, typer.Option("--quick", metavar="", help="With a tenth of the data.")] = False,
    scenario: options.Scenario = None,
    workers: options.Workers = None,
    engine: options.Engine = "drake",
    as_json: options.AsJson = False,
) -> None:
    """Run the paper's experiment and write its report; an interrupted run goes on when it is started again."""
    from wam_cast.generation.engines import checked_engine
    from wam_cast.storage.run_directory import RunDirectory

    setting = model_choice.load_scenario(scenario)
    checked_engine(engine, setting, has_own_controller=False)
    require_workable(setting, scenario, RunDirectory, directory)
    command = model_choice.command_line(
        "reproduce",
        seed=seed,
        out=directory,
        scenario=scenario,
        workers=workers,
        engine=None if engine == "drake" else engine,
        quick=quick,
    )
    with (
        phase_progress() as report,
        model_choice.telling_how_to_go_on(command, lambda: f"what is finished is kept in {directory}"),
    ):
        findings = wc.reproduce(
            setting, directory, seed=seed, quick=quick, engine=engine, n_workers=workers, on_progress=report
        )
    if as_json:
        print_json({"directory": str(directory), **findings.summary()})
    else:
        results.print_findings(findings, directory)


app.command("map")(map_)
app.command()(crosscheck)
app.command()(learn)
app.command()(transfer)
app.command()(robot)
app.command()(grade)


@app.command()
def show(
    scenario: options.Scenario = None,
    model: options.Model = None,
    graph: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a drawing of the diagram (.svg, .png, .pdf, .dot) instead."),
    ] = None,
    host: Annotated[
        str, typer.Option(metavar="HOST", help="Who is served: localhost, this machine alone; *, whoever reaches it.")
    ] = "localhost",
    port: Annotated[int, typer.Option(metavar="N", help="Of the page, from 1024 to 65535; 0: a free one.")] = 0,
    as_json: options.AsJson = False,
) -> None:
    """Explore casts in the browser, with sliders for the cast and the cup, until interrupted.

    It shows where the ball is predicted to land, executes what is chosen, and plans. A scenario without a model is explored
    without predictions. The page has no password: for a browser on another machine, forward the port (ssh -L 7000:localhost:7000,
    with --port 7000) rather than open it to all with --host.
    """
    if graph is not None:
        from wam_cast.visualization.diagram import check_graph, write_graph

        check_graph(graph)
        setting = model_choice.load_scenario(scenario) if model is None else model_choice.find(scenario, model).scenario
        write_graph(wc.CastStation(setting), graph)
        if as_json:
            print_json({"graph": str(graph)})
        else:
            out.print(f"the diagram is in {graph}")
        return
    from wam_cast.visualization.interactive.explorer import Explorer
    from wam_cast.visualization.viewer import is_loopback

    with progress("setting up"):
        setting, forward, _ = model_choice.find(scenario, model)
        advice = {}
        if forward is None:
            advice = {"advice": f"{model_choice.how_to_make(scenario, setting)}, and start again"}
        explorer = Explorer(setting, forward, **advice, host=host, port=port)
    if as_json:
        print_json({"url": explorer.url})
    else:
        out.print(f"{explorer.url} is a page to explore casts: its sliders and buttons are under Open Controls")
        out.print("stop with Ctrl-C")
    if not is_loopback(host):
        err.print("whoever reaches this machine can use the page; leave --host out to serve this machine alone")
    try:
        explorer.run()
    except KeyboardInterrupt:
        err.print("interrupted")
        os._exit(130)  # at its regular end Meshcat would wait for browsers that loaded the page a while ago
