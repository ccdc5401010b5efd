"""What the commands print and write."""

import json
import math
import re
import shlex
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

import wam_cast as wc
from wam_cast.cli import model_choice
from wam_cast.errors import MachineError
from wam_cast.learning.reference import reference_model
from wam_cast.planning.solution import SOLVERS
from wam_cast.scenario import Noise
from wam_cast.simulation.outcome import Status

COMMANDS = ("throw", "plan", "check", "generate", "fit", "map", "show")
PLAN_KEYS = {"cup", "cast", "predicted_landing", "predicted_miss", "is_feasible"}
THROW_KEYS = {"cup", "cast", "predicted_landing", "predicted_miss", "landing", "miss", "status", "is_caught"}


CAUGHT, CUP = wc.Cast(0.3, 0.6, 0.1), (0.608, 0.0)


def names(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def change_outcomes(monkeypatch, change):
    """Make every throw end as `change` has it, a function of what it was."""
    original = wc.simulate_casts

    def simulate(*given, on_outcome, **options):
        original(*given, on_outcome=lambda outcome: on_outcome(change(outcome)), **options)

    monkeypatch.setattr(wc, "simulate_casts", simulate, raising=False)


@pytest.fixture
def missed(monkeypatch):
    """Make every throw one whose ball never comes down."""
    change_outcomes(monkeypatch, nowhere)


def nowhere(outcome):
    never = {"landing": np.full(2, np.nan), "miss": math.nan, "entry_angle": math.nan}
    return replace(outcome, status=Status.NEVER_CROSSED, **never)


@pytest.fixture(scope="session")
def outcome(once):
    """Return the outcome of a cast that is caught."""
    return once("outcome", lambda: wc.simulate_cast(wc.Scenario(), CAUGHT, CUP))


@pytest.fixture
def thrown(monkeypatch, outcome):
    """Make every throw end as one that was simulated before; return the scenarios of the throws."""
    scenarios = []

    def simulate(scenario, casts, cups, *, on_outcome, **_):
        scenarios.append(scenario)
        for _ in casts:
            on_outcome(outcome)

    monkeypatch.setattr(wc, "simulate_casts", simulate, raising=False)
    return scenarios


@pytest.fixture(scope="session")
def recording(once):
    """Return a throw at the cup at 0.7 m, recorded to the end of its return."""
    plan = wc.plan_cast(reference_model(), (0.7, 0.0))
    return once("recording", lambda: wc.CastSimulator(wc.Scenario()).record(plan.cast, plan.cup))


@pytest.fixture
def recorded(monkeypatch, recording):
    """Let a throw at that cup that is to be shown be the one that was recorded before."""

    class Recorded:
        def __init__(self, robot, belief):
            assert robot == recording.scenario

        def record_sequence(self, throws, *, noise_seed, on_outcome, on_recording):
            assert throws == [wc.Throw(recording.cast, recording.cup)]
            on_recording(recording)
            on_outcome(recording.outcome)

    monkeypatch.setattr(wc, "CastSimulator", Recorded, raising=False)


# --- help


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_has_help(cli, command):
    result = cli(command, "--help")
    assert (result.code, result.err) == (0, "")
    assert f"wam-cast {command}" in result.out
    for option in ("--scenario", "--json", "--help"):
        assert option in result.out


def test_without_words_the_help_is_printed(cli):
    result = cli()
    assert (result.code, result.err) == (0, "")
    assert result.out == cli("--help").out
    for command in COMMANDS:
        assert f" {command} " in result.out


def test_the_version_is_the_packages(cli):
    assert cli("--version").out == f"wam-cast {wc.__version__}\n"


# --- plan


def test_plan_prints_the_plan_of_the_library(cli):
    result = cli("plan", "--cup", "0.75,0.1", "--json")
    assert (result.code, result.err) == (0, "")
    record = json.loads(result.out)
    plan = wc.plan_cast(reference_model(), (0.75, 0.1))
    assert record.keys() >= PLAN_KEYS
    assert wc.Cast(**record["cast"]) == plan.cast
    assert record["cup"] == [0.75, 0.1]
    assert record["predicted_landing"] == list(plan.predicted_landing)
    assert record["planner"] == "program"


def test_the_planner_is_chosen_by_name(cli):
    record = json.loads(cli("plan", "--cup", "0.75", "--planner", "gradient", "--json").out)
    assert wc.Cast(**record["cast"]) == wc.plan_cast(reference_model(), (0.75, 0), "gradient").cast
    assert record["planner"] == "gradient"


def test_one_number_is_a_cup_on_the_line_ahead_and_several_cups_are_a_list(cli):
    records = json.loads(cli("plan", "--cup", "0.75", "--cup", "-0.2,0.5", "--cup", ".6, -.25", "--json").out)
    assert [record["cup"] for record in records] == [[0.75, 0.0], [-0.2, 0.5], [0.6, -0.25]]


def test_the_table_of_plans_has_units_and_a_row_a_cup(cli):
    result = cli("plan", "--cup", "0.75", "--cup", "-0.2,0.5")
    assert (result.code, result.err) == (0, "")
    for unit in ("[m]", "[m/s]", "[s]", "[deg]", "[mm]"):
        assert unit in result.out
    rows = [line for line in result.out.splitlines() if re.search(r"\d\.\d{4}", line)]
    assert len(rows) == 2
    assert "0.7500, 0.0000" in rows[0]
    assert "-0.2000, 0.5000" in rows[1]
    assert "111.80" in rows[1]


@pytest.mark.usefixtures("thrown")
def test_a_table_fits_a_narrow_terminal(cli, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    for command in ("plan", "throw"):
        result = cli(command, "--cup", "-0.2345,-0.5432")
        assert max(map(len, result.out.splitlines())) <= 80
        assert "-0.2345, -0.5432" in result.out
        assert "…" not in result.out


@pytest.mark.parametrize("solver", SOLVERS)
def test_solvers_of_the_program_are_chosen_by_name(cli, solver):
    record = json.loads(cli("plan", "--cup", "0.75", "--solver", solver, "--json").out)
    assert record["reason"].startswith(solver.upper())
    assert record["n_solutions"] >= 1


def test_a_plan_that_is_not_expected_to_land_says_why_and_exits_with_1(cli, monkeypatch):
    real = wc.plan_cast

    def plan(model, cup, method, solver):
        return replace(real(model, cup, method, solver), is_feasible=False, reason="it gave up")

    monkeypatch.setattr(wc, "plan_cast", plan)
    result = cli("plan", "--cup", "0.75")
    assert result.code == 1
    assert "cup 0.7500, 0.0000: no cast is predicted to end in it (it gave up)" in result.out
    assert cli("plan", "--cup", "0.75", "--json").code == 1


def test_one_plan_of_several_that_is_not_expected_to_land_makes_the_code_1(cli, monkeypatch):
    real = wc.plan_cast

    def plan(model, cup, method, solver):
        return replace(real(model, cup, "gradient"), is_feasible=cup[0] < 0.7)

    monkeypatch.setattr(wc, "plan_cast", plan)
    assert cli("plan", "--cup", "0.6", "--cup", "0.75").code == 1
    assert cli("plan", "--cup", "0.6", "--cup", "0.65").code == 0


# --- throw


def test_throw_executes_the_plan(cli):
    result = cli("throw", "--cup", "0.75,0.001", "--json")  # beside the line ahead, and yet a short turn
    assert (result.code, result.err) == (0, "")
    record = json.loads(result.out)
    assert record.keys() >= THROW_KEYS
    assert set(record["cast"]) == {"distance", "speed", "wait", "bearing"}
    outcome = wc.simulate_cast(wc.Scenario(), wc.Cast(**record["cast"]), (0.75, 0.001))
    assert record["landing"] == list(outcome.landing)
    assert record["miss"] == outcome.miss < 0.01
    assert record["status"] == "caught"
    assert record["is_caught"] is True
    planned = json.loads(cli("plan", "--cup", "0.75,0.001", "--json").out)
    assert planned == {key: record[key] for key in planned}


def test_a_given_cast_is_executed_without_a_model(cli, monkeypatch):
    monkeypatch.setattr(model_choice, "scenario_and_model", None)  # not to be called
    (one, other) = json.loads(
        cli(
            *("throw", "--cup", "0.75", "--cup", "0.5,0.5", "--cast", "0.3,0.6,0.1"),
            *("--cast", "0.2,0.5,0,0.5", "--json"),
        ).out
    )
    assert one["cast"] == {"distance": 0.3, "speed": 0.6, "wait": 0.1, "bearing": 0.0}
    assert other["cast"]["bearing"] == pytest.approx(math.radians(0.5))
    assert one["predicted_landing"] is one["is_feasible"] is None
    assert one["landing"] == list(wc.simulate_cast(wc.Scenario(), wc.Cast(0.3, 0.6, 0.1), (0.75, 0.0)).landing)
    table = cli("throw", "--cup", "0.5,0.5", "--cast", "0.3,0.6,0.1")
    assert table.code == 1
    assert re.search(r"0\.5000, 0\.5000 \S+ - .* (short|long|side)", table.out)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--cast", "0.3,0.6"), "--cast '0.3,0.6' is no cast: give distance [m]"),
        (("--cast", "5,0.6,0.1"), "--cast '5,0.6,0.1' is beyond the scenario's bounds (distance 0.05 to 0.4, speed"),
        (("--cast", "0.3,0.6,1e8"), "are longer than 300 s; choose"),
        (("--cast", "0.3,0.6,0.1,0,5"), "is no cast"),
        (
            ("--cast", "0.3,-0.6,0.1"),
            "--cast '0.3,-0.6,0.1': cast: distance = 0.3 m and speed = -0.6 m/s must be positive",
        ),
        (("--cast", "0.3,0.6,0.1", "--cast", "0.3,0.6,0.1"), "2 for 1 cups; give as many --cast as --cup"),
        (("--cast", "0.3,0.6,0.1", "--train"), "leave --model, --train and --solver out"),
    ],
)
def test_a_given_cast_that_is_none_is_refused(cli, words, message):
    result = cli("throw", "--cup", "0.75", *words)
    assert (result.code, result.out) == (2, "")
    assert message in result.err
    assert result.err.count("\n") == 1


def test_a_speed_of_nothing_that_runs_is_refused(cli):
    result = cli("throw", "--cup", "0.75", "--cast", "0.3,0.6,0.1", "--picture", "a.png", "--speed", "0.5")
    assert (result.code, result.out) == (2, "")
    assert result.err == (
        "error: --speed is how fast --replay and --animation run: give one of them, or leave --speed out\n"
    )


@pytest.mark.slow
@pytest.mark.usefixtures("thrown")
def test_negative_coordinates_need_no_quoting(cli):
    # That casts in all directions are caught is tested with the floor's map.
    records = json.loads(cli("throw", "--cup", "-0.2,0.5", "--cup", "0.5,-0.3", "--json").out)
    assert [record["cup"] for record in records] == [[-0.2, 0.5], [0.5, -0.3]]
    assert all(record["predicted_miss"] < 1e-3 for record in records)


def test_the_table_of_throws(cli):
    result = cli("throw", "--cup", "0.75")
    assert (result.code, result.err) == (0, "")
    assert "[mm]" in result.out
    assert re.search(r"0\.7500, 0\.0000 .* 0\.7\d+, -?0\.00\d\d .* \d\.\d .* caught", result.out)


@pytest.mark.slow
@pytest.mark.usefixtures("scenarios")
def test_a_ball_that_misses_gives_1_and_its_numbers(cli):
    # The paper's planner aims within a centimetre; this cup forgives half a millimetre.
    words = ("throw", "--cup", "0.65,-0.35", "--planner", "gradient", "--scenario", "narrow.yaml")
    result = cli(*words, "--json")
    record = json.loads(result.out)
    assert result.code == 1
    assert record["is_caught"] is False
    assert record["status"] != "caught"
    assert record["miss"] > 0.001
    table = cli(*words)
    assert table.code == 1
    assert record["status"] in table.out


@pytest.mark.parametrize("n_missed", [0, 1, 2])
def test_only_if_every_ball_is_caught_the_answer_is_yes(cli, monkeypatch, outcome, n_missed):
    def simulate(*_, on_outcome, **__):
        for missed in (n_missed == 2, n_missed >= 1):
            on_outcome(replace(outcome, status=Status.LONG) if missed else outcome)

    monkeypatch.setattr(wc, "simulate_casts", simulate, raising=False)
    result = cli("throw", "--cup", "0.75", "--cup", "0.5", "--json")
    assert [record["is_caught"] for record in json.loads(result.out)].count(False) == n_missed
    assert result.code == (1 if n_missed else 0)


def test_interrupted_throws_tell_what_was_finished(cli, monkeypatch, outcome):
    def simulate(*_, on_outcome, **__):
        on_outcome(outcome)
        raise KeyboardInterrupt

    monkeypatch.setattr(wc, "simulate_casts", simulate, raising=False)
    words = ("throw", "--cup", "0.75", "--cup", "0.5")
    result = cli(*words, "--json")
    assert result.code == 130
    assert "interrupted" in result.err
    (record,) = json.loads(result.out)  # a list, as of several cups
    assert record["cup"] == [0.75, 0.0]
    assert record["is_caught"]
    table = cli(*words)
    assert table.code == 130
    assert "0.7500, 0.0000" in table.out
    assert "0.5000, 0.0000" not in table.out


@pytest.mark.slow
def test_an_interrupted_replay_shows_what_was_recorded(cli, folder, monkeypatch):
    from wam_cast.simulation.simulator import CastSimulator

    simulate, counter = CastSimulator._simulate, count()

    def interrupted(*given):
        if next(counter) == 1:
            raise KeyboardInterrupt
        return simulate(*given)

    monkeypatch.setattr(CastSimulator, "_simulate", interrupted)
    words = ("throw", "--cup", "0.7", "--cast", "0.3,0.6,0.1", "--cup", "0.45", "--cast", "0.2,0.5,0", "--json")
    result = cli(*words, "--replay", "a.html", "--recording", "a.mcap")
    told = "interrupted: 1 of 2 casts are shown\nreplay: a.html\nrecording: a.mcap\ninterrupted\n"
    assert (result.code, result.err) == (130, told)
    assert (folder / "a.mcap").read_bytes()[1:5] == b"MCAP"
    (record,) = json.loads(result.out)
    assert record["cup"] == [0.7, 0.0]
    page = (folder / "a.html").read_text(encoding="utf-8")
    assert "Cup at (0.700, 0.000) m" in page
    assert "0.450" not in page


@pytest.mark.slow
def test_replay_of_several_cups_shows_them_all(cli, folder):
    result = cli("throw", "--cup", "0.7", "--cup", "0.45,0.05", "--replay", "a.html", "--json")
    assert (result.code, result.err) == (0, "replay: a.html\n")
    page = (folder / "a.html").read_text(encoding="utf-8")
    assert "2 of 2 cups without a reset" in page
    for place in ("1  Cup at (0.700, 0.000) m", "2  Cup at (0.450, 0.050) m"):
        assert place in page


@pytest.mark.usefixtures("thrown", "missed")
def test_what_is_not_a_number_is_null_in_json_and_a_dash_in_a_table(cli):
    result = cli("throw", "--cup", "0.75", "--json")
    record = json.loads(result.out, parse_constant=lambda word: pytest.fail(f"{word} is not JSON"))
    assert record["landing"] == [None, None]
    assert record["miss"] is record["entry_angle"] is None
    table = cli("throw", "--cup", "0.75")
    assert table.code == 1
    assert "nan" not in table.out
    assert "never_crossed" in table.out


def test_limits_that_the_arm_met_are_named(cli, monkeypatch, thrown):
    met = {"limits_hit": ("joint 4 speed", "joint 2 torque"), "return_faults": ("joint 1 speed",)}
    change_outcomes(monkeypatch, lambda outcome: replace(outcome, status=Status.LIMIT_HIT, **met))
    result = cli("throw", "--cup", "0.75")
    assert result.code == 1
    assert "cup 0.7500, 0.0000: the arm meets the limit of joint 4 speed, joint 2 torque" in result.out
    assert "cup 0.7500, 0.0000: on the way home, joint 1 speed" in result.out


@pytest.mark.slow
@pytest.mark.usefixtures("scenarios")
def test_a_cup_that_differs_in_its_contact_needs_no_model_of_its_own(cli, folder):
    plain = json.loads(cli("throw", "--cup", "0.75", "--json").out)
    lively = json.loads(cli("throw", "--cup", "0.75", "--scenario", "lively.yaml", "--json").out)
    assert lively["cast"] == plain["cast"]
    assert lively["is_caught"]
    assert not [name for name in names(folder) if name.endswith(".model")]


@pytest.fixture
def noisy(monkeypatch):
    """Return a noisy scenario that `throw` takes, and spare the casts that would train its own model."""
    scenario = wc.Scenario(noise=Noise(distance=0.003, swing=0.005))
    monkeypatch.setattr(model_choice, "scenario_and_model", lambda *_: (scenario, reference_model()))
    return scenario


@pytest.mark.slow
def test_seed_draws_the_noise(cli, monkeypatch, noisy, outcome):
    # That the next cup takes the next seed is tested with sequences.
    seeds = []

    def simulate(scenario, casts, cups, *, noise_seed, on_outcome, **_):
        assert (scenario, len(casts)) == (noisy, 2)
        seeds.append(noise_seed)
        for _ in casts:
            on_outcome(outcome)

    monkeypatch.setattr(wc, "simulate_casts", simulate, raising=False)
    words = ("throw", "--cup", "0.75", "--cup", "0.75")
    assert [cli(*words, "--seed", "4").code, cli(*words).code] == [0, 0]
    assert seeds == [4, 0]


@pytest.mark.slow
def test_without_noise_the_seed_changes_nothing(cli):
    words = ("throw", "--cup", "0.75", "--json")
    assert cli(*words, "--seed", "4") == cli(*words)


@pytest.mark.slow
@pytest.mark.usefixtures("recorded")
def test_replay_and_picture_are_written_named_and_replaced(cli, folder):
    # A replay where there was none is among several cups' above, a picture in README's lines.
    (folder / "a.html").write_text("before")
    (folder / "a.png").write_text("before")
    result = cli("throw", "--cup", "0.7", "--replay", "a.html", "--picture", "a.png", "--json")
    assert result.code == 0
    assert json.loads(result.out).keys() >= THROW_KEYS
    assert result.err == "replay: a.html\npicture: a.png\n"
    assert (folder / "a.html").read_bytes().startswith(b"<!")
    assert (folder / "a.png").read_bytes().startswith(b"\x89PNG")
    assert names(folder) == ["a.html", "a.png"]


@pytest.mark.slow
@pytest.mark.usefixtures("recorded")
@pytest.mark.parametrize(("suffix", "start"), [("gif", b"GIF89a"), ("mp4", b"\x00\x00\x00")])
def test_animation_is_written_named_and_replaced(cli, folder, monkeypatch, suffix, start):
    pictures = [np.full((20, 10, 3), shade, dtype=np.uint8) for shade in (0, 120, 240)]
    speeds = []

    def frames(_, speed):
        speeds.append(speed)
        return iter(pictures)

    monkeypatch.setattr("wam_cast.visualization.film.animation_frames", frames)
    file = folder / f"a.{suffix}"
    file.write_text("before")
    result = cli("throw", "--cup", "0.7", "--animation", file.name, "--speed", "0.5", "--json")
    assert speeds == [0.5]
    assert (result.code, result.err) == (0, f"animation: {file.name}\n")
    assert file.read_bytes().startswith(start)
    assert names(folder) == [file.name]


@pytest.mark.slow
@pytest.mark.usefixtures("recorded")
def test_an_animation_that_is_interrupted_leaves_what_was_there_and_tells_of_the_throw(cli, folder, monkeypatch):
    def frames(*_):
        yield np.zeros((20, 10, 3), dtype=np.uint8)
        raise KeyboardInterrupt

    monkeypatch.setattr("wam_cast.visualization.film.animation_frames", frames)
    (folder / "a.gif").write_text("before")
    result = cli("throw", "--cup", "0.7", "--animation", "a.gif", "--json")
    assert (result.code, result.err) == (130, "interrupted\n")
    assert json.loads(result.out)["is_caught"]
    assert names(folder) == ["a.gif"]
    assert (folder / "a.gif").read_text() == "before"


@pytest.mark.slow
@pytest.mark.usefixtures("noisy")
def test_a_recorded_throw_is_the_same_throw_of_the_same_seed(cli, monkeypatch):
    words = ("throw", "--cup", "0.7", "--json")
    plain, other = (json.loads(cli(*words, "--seed", seed).out) for seed in ("5", "0"))
    monkeypatch.setattr("wam_cast.visualization.replay.write_replay", lambda *_, **__: None)
    recorded = json.loads(cli(*words, "--seed", "5", "--replay", "a.html").out)
    assert recorded == plain != other


# --- generate and fit


@pytest.mark.usefixtures("no_physics")
def test_generate_and_fit_and_plan(cli, folder):
    result = cli("generate", "--casts", "60", "--out", "d", "--seed", "3", "--json")
    assert (result.code, result.err) == (0, "")
    record = json.loads(result.out)
    assert record["n_casts"] == sum(record["statuses"].values()) == 60
    assert (record["seed"], record["directory"], record["fingerprint"]) == (3, "d", wc.Scenario().fingerprint)
    assert len(wc.CastDataset.load("d")) == 60
    result = cli("fit", "d", "--out", "a.model", "--json")
    assert (result.code, result.err) == (0, "")
    record = json.loads(result.out)
    model = wc.ForwardModel.load("a.model")
    assert record["n_train"] == model.info.n_train == 45
    assert record["reach"] == list(model.reach)
    assert record["sigma"] == list(model.info.sigma)
    planned = json.loads(cli("plan", "--cup", "0.6", "--model", "a.model", "--json").out)
    assert wc.Cast(**planned["cast"]) == wc.plan_cast(model, (0.6, 0)).cast


@pytest.mark.usefixtures("no_physics")
def test_tables_of_generate_and_fit(cli):
    result = cli("generate", "--casts", "60", "--out", "[red]d")
    assert re.fullmatch(r"60 casts in \[red\]d \(60 landed\), \d+\.\d s\n", result.out)
    result = cli("fit", "[red]d", "--out", "a.model")
    assert result.code == 0
    for part in (
        "training",
        "45",
        "ARD length scales",
        "lambda",
        "leave-one-out RMSE [mm]",
        "test RMSE [mm]",
        "[m]",
        " to ",
    ):
        assert part in result.out


@pytest.mark.usefixtures("no_physics")
def test_fit_says_that_it_approximates(cli, monkeypatch):
    from wam_cast.learning import kernel_fit

    monkeypatch.setattr(kernel_fit, "MOST_EXACT_CASTS", 40)
    monkeypatch.setattr(kernel_fit, "N_LANDMARKS", 30)
    assert cli("generate", "--casts", "60", "--out", "d").code == 0
    result = cli("fit", "d", "--out", "a.model", "--json")
    assert result.err == (
        "45 training casts are too many for exact kernel ridge regression: approximated, with the kernel at 30 of them\n"
    )
    assert json.loads(result.out)["n_landmarks"] == 30
    assert "30 of them, an approximation" in cli("fit", "d", "--out", "a.model").out


@pytest.mark.slow
@pytest.mark.usefixtures("no_physics")
def test_a_second_run_adds_to_a_dataset_and_replaces_a_model(cli, folder):
    for n_casts in (60, 60, 90):
        assert cli("generate", "--casts", n_casts, "--out", "d").code == 0
        assert cli("fit", "d", "--out", "a.model").code == 0
        assert len(wc.CastDataset.load("d")) == n_casts
    assert wc.ForwardModel.load("a.model").info.n_train == 68
    assert [name for name in names(folder) if "part" not in name and ".lock" not in name] == [
        "a.model",
        "d/manifest.json",
        "d/scenario.yaml",
    ]


# --- a scenario's own model


@pytest.mark.usefixtures("no_physics", "scenarios")
def test_train_makes_the_model_that_later_runs_use(cli, folder, monkeypatch):
    words = ("plan", "--cup", "0.6", "--scenario", "heavy.yaml", "--json")
    first = cli(*words, "--train")
    assert (first.code, first.err) == (0, "")
    stem = f"heavy-{wc.Scenario.from_yaml('heavy.yaml').fingerprint[:8]}"
    assert f"{stem}.model" in names(folder)
    assert f"{stem}.casts/manifest.json" in names(folder)
    monkeypatch.setattr(model_choice, "generate", None)  # not to be called
    assert cli(*words).out == first.out
    assert cli(*words, "--train").out == first.out
    # Another value is another scenario, which has no model yet.
    (folder / "heavy.yaml").write_text("ball: {mass: 0.05}")
    assert "has no model yet" in cli(*words).err


@pytest.mark.usefixtures("no_physics", "scenarios")
def test_the_commands_that_an_error_names_work(cli):
    (cli_error,) = cli("plan", "--cup", "0.6", "--scenario", "heavy.yaml").err.splitlines()
    commands = re.findall(r"`wam-cast (.*?)`", cli_error)
    assert len(commands) == 2
    for command in commands:
        assert cli(*shlex.split(command)).code == 0
    assert cli("plan", "--cup", "0.6", "--scenario", "heavy.yaml").code == 0


@pytest.mark.usefixtures("no_physics", "scenarios")
def test_a_model_brings_its_scenario(cli, thrown):
    assert cli("generate", "--casts", "60", "--out", "d", "--scenario", "heavy.yaml").code == 0
    assert cli("fit", "d", "--out", "a.model").code == 0
    alone = cli("plan", "--cup", "0.6", "--model", "a.model", "--json")
    assert alone.code == 0
    named = cli("plan", "--cup", "0.6", "--model", "a.model", "--scenario", "heavy.yaml", "--json")
    assert named.out == alone.out
    cli("throw", "--cup", "0.6", "--model", "a.model")
    assert thrown == [wc.Scenario.from_yaml("heavy.yaml")]


@pytest.mark.usefixtures("no_physics", "scenarios")
def test_train_is_of_no_consequence_where_there_is_a_model(cli, folder):
    before = names(folder)
    assert cli("plan", "--cup", "0.75", "--train").out == cli("plan", "--cup", "0.75").out
    assert cli("plan", "--cup", "0.75", "--scenario", "lively.yaml", "--train").code == 0
    assert names(folder) == before


@pytest.mark.usefixtures("no_physics", "scenarios")
def test_an_interrupted_generation_says_how_to_go_on(cli, folder, monkeypatch):
    from wam_cast.learning import dataset

    row = dataset.simulate_row

    def interrupt(scenario, seed, number):
        if number == 70:
            raise KeyboardInterrupt
        return row(scenario, seed, number)

    words = ("generate", "--casts", "120", "--seed", "2", "--out", "a b", "--scenario", "heavy.yaml")
    with monkeypatch.context() as patched:
        patched.setattr(dataset, "simulate_row", interrupt)
        result = cli(*words, "--workers", "2")
    assert (result.code, result.out) == (130, "")
    assert "120 casts were simulated; finished parts are kept in a b" in result.err
    command = result.err.split("Go on with: wam-cast ")[1].splitlines()[0]
    assert "--workers 2" in command
    assert cli(*shlex.split(command)).code == 0
    assert cli(*words[:-3], "whole", *words[-2:]).code == 0
    for part in ("part-00000", "part-00001", "part-00002"):
        here, there = (folder / name / "casts" / f"{part}.parquet" for name in ("a b", "whole"))
        assert here.read_bytes() == there.read_bytes()


@pytest.mark.slow
def test_a_generation_that_the_machine_ends_says_how_to_go_on(cli, folder, monkeypatch):
    def fail(*_, **__):
        raise MachineError("row 3: its process died 4 times")

    monkeypatch.setattr(model_choice, "require_workable", lambda *_: None)
    monkeypatch.setattr(wc, "generate_dataset", fail)
    result = cli("generate", "--casts", "40", "--seed", "2", "--out", "d")
    assert (result.code, result.out) == (2, "")
    first, last = result.err.splitlines()
    assert (
        first
        == "0 of 40 casts were simulated; finished parts are kept in d. Go on with: wam-cast generate --casts 40 --seed 2 --out d"
    )
    assert last == "error: row 3: its process died 4 times"


# --- show


def test_show_writes_the_diagram(cli, folder):
    result = cli("show", "--graph", "a.dot")
    assert (result.code, result.out, result.err) == (0, "the diagram is in a.dot\n", "")
    assert (folder / "a.dot").read_text().startswith("digraph")
    (folder / "a.dot").write_text("before")
    assert json.loads(cli("show", "--graph", "a.dot", "--json").out) == {"graph": "a.dot"}
    assert (folder / "a.dot").read_text().startswith("digraph")
    assert names(folder) == ["a.dot"]


@pytest.mark.slow
def test_throw_plans_with_what_is_believed_and_executes_on_the_robot(cli, folder):
    (folder / "truth.yaml").write_text("string: {length: 0.605}\narm: {mass_scale: 1.02}\n", encoding="utf-8")
    (folder / "belief.yaml").write_text("{}\n", encoding="utf-8")
    result = cli("throw", "--cup", "0.7", "--scenario", "truth.yaml", "--belief", "belief.yaml", "--json")
    record = json.loads(result.out)
    plan = wc.plan_cast(reference_model(), (0.7, 0.0))
    truth = wc.Scenario.from_dict({"string": {"length": 0.605}, "arm": {"mass_scale": 1.02}})
    outcome = wc.simulate_cast(truth, plan.cast, plan.cup, belief=wc.Scenario())
    assert record["predicted_miss"] == plan.predicted_miss
    np.testing.assert_array_equal(record["landing"], outcome.landing)
    assert record["miss"] > 10 * record["predicted_miss"]
    refused = cli("plan", "--cup", "0.7", "--scenario", "truth.yaml")
    assert (refused.code, "no model yet" in refused.err) == (2, True)
