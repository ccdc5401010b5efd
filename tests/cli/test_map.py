"""`wam-cast map` as its user meets it; what it computes is tested with the map itself."""

import json
import os
import re
import shlex
import signal
import sys
import time
from dataclasses import replace
from itertools import count
from pathlib import Path

import pytest

import wam_cast as wc
from wam_cast import cli as command_line
from wam_cast.errors import InputError, MachineError
from wam_cast.experiments import floor_map, floor_picture, trials

SMALL = ("--radii", "3", "--bearings", "4")


@pytest.fixture
def noisy(folder):
    (folder / "noisy.yaml").write_text("noise: {distance: 0.003, swing: 0.005}", encoding="utf-8")
    return ("--scenario", "noisy.yaml", "--casts", "2")


@pytest.mark.usefixtures("floor_without_physics")
def test_the_table_has_units_and_a_row_a_distance_and_the_picture_is_there(cli, folder, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    result = cli("map", "--out", "map.png", *SMALL)
    assert (result.code, result.err) == (0, "planning\ncasting\n")
    assert (folder / "map.png").read_bytes().startswith(b"\x89PNG")
    lines = result.out.splitlines()
    assert max(map(len, lines)) <= 100
    assert max(len(line) for line in lines if line[0] in "│┃┏") <= 80
    assert "…" not in result.out
    for word in ("[m]", "[mm]", "[%]", "predicted", "executed", "lateral", "clear", "interval"):
        assert word in result.out
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in lines if line.startswith("│")]
    assert rows[0] == ["0.262", "-1.0 (4.0)", "3.0 (0.0)", "2.0 (0.0)", "86.9", "3/4", "30-95"]
    assert [row[-2] for row in rows] == ["3/4", "3/4", "0/4"]
    assert f"cup {rows[-1][0]}: no cast is predicted to end in it (it was told so)" in result.out
    assert lines[-2:] == ["6 of 12 caught", "the map is in map.png"]


@pytest.mark.usefixtures("floor_without_physics")
def test_json_is_the_whole_map(cli, noisy):
    result = cli("map", "--out", "map.svg", *SMALL, *noisy, "--seed", "3", "--json")
    assert result.code == 0
    record = json.loads(result.out)
    assert record.pop("picture") == "map.svg"
    size = floor_map.MapSize(3, 4, 2)
    scenario = wc.Scenario.from_yaml("noisy.yaml")
    expected = floor_map.map_floor(wc.reference_model().bound_to(scenario), size, seed=3)
    assert record == expected.record()
    assert record["is_noisy"] is True
    assert record["n_casts"] == 24
    assert record["rings"][0]["casts"][0]["along"] is None  # it never came down


@pytest.mark.slow
def test_options_arrive(cli, floor_without_physics):
    words = ("--planner", "program", "--solver", "nlopt", "--workers", "1")
    assert cli("map", "--out", "map.svg", *SMALL, *words).code == 0
    assert {planned[1:] for planned in floor_without_physics.planned} == {("program", "nlopt")}
    cli("map", "--out", "map.svg", *SMALL, "--planner", "gradient")
    assert floor_without_physics.planned[-1][1:] == ("gradient", None)


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        ((), ["--out", "wam-cast map --help"]),
        (("--out", "missing/a.png"), ["missing/a.png", "existing folder"]),
        (("--out", "."), ["cannot write .", ".pdf, .png, .svg"]),
        (("--out", "a.jpg"), ["a.jpg", ".pdf, .png, .svg"]),
        (("--out", "a"), ["suffix is missing"]),
        (("--out", "a.png", "--radii", "1"), ["--radii", "2"]),
        (("--out", "a.png", "--bearings", "1"), ["--bearings", "2"]),
        (("--out", "a.png", "--casts", "0"), ["--casts", "1"]),
        (("--out", "a.png", "--casts", "many"), ["--casts", "integer"]),
        (("--out", "a.png", "--seed", "-1"), ["--seed", "0"]),
        (("--out", "a.png", "--workers", "0"), ["--workers", "1"]),
        (("--out", "a.png", "--planner", "newton"), ["--planner", "newton"]),
        (("--out", "a.png", "--planner", "gradient", "--solver", "snopt"), ["'gradient' has none"]),
        (("--out", "a.png", "--scenario", "none.yaml"), ["none.yaml", "name a readable YAML file"]),
        (("--out", "a.png", "--model", "none.model"), ["none.model", "wam-cast fit"]),
    ],
)
def test_wrong_input_gets_one_line_before_any_work(cli, folder, words, parts):
    result = cli("map", *words)
    assert (result.code, result.out) == (2, "")
    (line,) = result.err.splitlines()
    assert line.startswith("error: ")
    for part in parts:
        assert part in line
    assert not list(folder.iterdir())


def interrupt_at(monkeypatch, n_casts):
    """Interrupt a map at so many casts; return the real thing."""
    simulate, counter = trials.simulate_cast, count()

    def interrupted(*given, **options):
        if next(counter) == n_casts:
            raise KeyboardInterrupt
        return simulate(*given, **options)

    monkeypatch.setattr(trials, "simulate_cast", interrupted)
    return simulate


@pytest.mark.slow
def test_an_interrupted_map_goes_on_to_the_same_map(cli, folder, noisy, monkeypatch, floor_without_physics):
    words = (*SMALL, *noisy, "--seed", "3", "--json")
    whole = json.loads(cli("map", "--out", "whole.png", *words).out)
    assert sorted(path.name for path in folder.iterdir()) == ["noisy.yaml", "whole.png"]
    simulate = interrupt_at(monkeypatch, 17)
    result = cli("map", "--out", "a b.png", *words)
    assert (result.code, result.out) == (130, "")
    *_, line, last = result.err.splitlines()
    assert last == "interrupted"
    said, command = line.split(" Go on with: wam-cast ")
    assert said == "finished casts are kept in a b.png.unfinished."
    assert not (folder / "a b.png").exists()

    monkeypatch.setattr(trials, "simulate_cast", simulate)
    floor_without_physics.cast.clear()
    again = cli(*shlex.split(command), "--json")
    assert again.code == 0
    assert len(floor_without_physics.cast) == 14  # of 24, ten were finished
    assert json.loads(again.out) == whole | {"picture": "a b.png"}
    assert (folder / "a b.png").read_bytes() == (folder / "whole.png").read_bytes()
    assert not (folder / "a b.png.unfinished").exists()


def test_another_map_does_not_go_on_with_what_is_kept(cli, folder, noisy, monkeypatch, floor_without_physics):
    simulate = interrupt_at(monkeypatch, 11)
    assert cli("map", "--out", "map.png", *SMALL, *noisy).code == 130
    monkeypatch.setattr(trials, "simulate_cast", simulate)
    for words, said in (
        ((*SMALL, *noisy, "--seed", "1"), "another seed (0, not 1)"),
        ((*SMALL, *noisy[:2], "--casts", "3"), "another n_casts (2, not 3)"),
        (SMALL, "another scenario.noise.distance (0.003, not 0.0)"),
        ((*SMALL, *noisy, "--planner", "gradient"), "another planner ('program', not 'gradient')"),
    ):
        result = cli("map", "--out", "map.png", *words)
        assert (result.code, result.out) == (2, "")
        assert f"map.png.unfinished holds a map of the floor with {said}" in result.err
    plan_cast = floor_map.plan_cast
    monkeypatch.setattr(floor_map, "plan_cast", lambda *given: replace(plan_cast(*given), predicted_miss=0.002))
    assert "with another model or solver ('" in cli("map", "--out", "map.png", *SMALL, *noisy).err


@pytest.mark.slow
@pytest.mark.usefixtures("floor_without_physics")
def test_a_damaged_part_of_a_map_is_cast_again(cli, folder, monkeypatch):
    whole = cli("map", "--out", "whole.png", *SMALL)
    simulate = interrupt_at(monkeypatch, 11)
    assert cli("map", "--out", "map.png", *SMALL).code == 130
    monkeypatch.setattr(trials, "simulate_cast", simulate)
    (part,) = (folder / "map.png.unfinished" / "phases").iterdir()
    part.write_text(part.read_text().replace("caught", "landed"))
    again = cli("map", "--out", "map.png", *SMALL)
    assert again.out == whole.out.replace("whole.png", "map.png")


@pytest.mark.usefixtures("floor_without_physics")
def test_a_map_that_the_machine_ends_says_how_to_go_on(cli, folder, monkeypatch):
    def fail(*_, **__):
        raise MachineError("row 3: its process died 4 times")

    interrupt_at(monkeypatch, 11)
    assert cli("map", "--out", "map.png", *SMALL).code == 130
    monkeypatch.setattr(trials, "simulate_cast", fail)
    result = cli("map", "--out", "map.png", *SMALL)
    assert (result.code, result.out) == (2, "")
    *_, line, last = result.err.splitlines()
    assert "Go on with: wam-cast map --out map.png --radii 3 --bearings 4" in line
    assert last == "error: row 3: its process died 4 times"


@pytest.mark.usefixtures("floor_without_physics")
def test_a_map_that_finds_no_room_says_what_is_kept_and_how_to_go_on(cli, folder, monkeypatch):
    def full(*_):
        raise InputError("map.png cannot be written (No space left on device)")

    with monkeypatch.context() as patch:
        patch.setattr(floor_picture, "write_floor_picture", full)
        result = cli("map", "--out", "map.png", *SMALL)
        other = cli("map", "--out", "map.png", *SMALL, "--seed", "1")
    assert result.code == other.code == 2
    *_, line, last = result.err.splitlines()
    said, command = line.split(" Go on with: wam-cast ")
    assert said == "finished casts are kept in map.png.unfinished."
    assert last == "error: map.png cannot be written (No space left on device)"
    assert "another seed (0, not 1)" in other.err
    assert "Go on with" not in other.err  # by which they could not
    assert cli(*shlex.split(command)).code == 0
    assert not (folder / "map.png.unfinished").exists()


@pytest.mark.usefixtures("floor_without_physics")
def test_a_map_that_finds_no_room_for_its_first_casts_leaves_nothing_behind(cli, folder, monkeypatch):
    def full(*_):
        raise InputError("map.png.unfinished cannot be written (No space left on device)")

    monkeypatch.setattr(floor_map.UnfinishedMap, "keep", full)
    assert cli("map", "--out", "map.png", *SMALL).err.count("\n") == 3  # what it does, twice, and the error
    assert not list(folder.iterdir())


@pytest.mark.usefixtures("floor_without_physics")
def test_an_interruption_before_anything_is_finished_leaves_nothing_behind(cli, folder, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(trials, "simulate_cast", interrupted)
    result = cli("map", "--out", "map.png", *SMALL)
    assert (result.code, result.out) == (130, "")
    assert result.err.splitlines()[-1] == "interrupted"
    assert not list(folder.iterdir())


@pytest.mark.usefixtures("floor_without_physics")
def test_a_map_that_is_terminated_keeps_its_casts_says_how_to_go_on_and_ends_by_the_signal(cli, monkeypatch):
    simulate, counter, ended = trials.simulate_cast, count(), []

    def terminated(*given, **options):
        if next(counter) == 11:
            signal.raise_signal(signal.SIGTERM)
        return simulate(*given, **options)

    monkeypatch.setattr(trials, "simulate_cast", terminated)
    monkeypatch.setattr(command_line, "_end_by", lambda number: ended.append(number) or sys.exit(-number))
    result = cli("map", "--out", "map.png", *SMALL)
    assert ended == [signal.SIGTERM]
    *_, line, last = result.err.splitlines()
    assert line.startswith("finished casts are kept in map.png.unfinished. Go on with: wam-cast map")
    assert last == "terminated"
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    assert cli(*shlex.split(line.split("Go on with: wam-cast ")[1])).code == 0


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_amid_the_casts_shows_nothing_of_the_inside(start, folder, small_program):
    words = "map --radii 2 --bearings 400 --planner gradient --workers 2 --out map.png"
    running = start(*words.split(), program=small_program)
    assert [running.stderr.readline() for _ in range(2)] == ["planning\n", "casting\n"]
    while not list(folder.glob("map.png.unfinished/phases/*.json")):  # workers start, then casts fly
        assert running.poll() is None, running.communicate()
        time.sleep(0.05)
    os.killpg(running.pid, signal.SIGINT)
    out, err = running.communicate(timeout=60)
    assert (running.returncode, out) == (130, "ready\n")
    assert re.fullmatch(r"finished casts are kept in map\.png\.unfinished\. Go on with: .*\ninterrupted\n", err)
    assert not (folder / "map.png").exists()


@pytest.mark.usefixtures("floor_without_physics")
@pytest.mark.parametrize(
    ("place", "said"),
    [
        (lambda path: path.symlink_to("precious"), "is a link"),
        (lambda path: path.symlink_to(path.name), "is a link"),
        (Path.touch, "Not a directory"),
        (lambda path: (path.mkdir(), (path / "thesis.tex").touch()), "holds thesis.tex and no map"),
    ],
    ids=["link", "loop", "file", "another's"],
)
def test_what_is_in_the_place_of_unfinished_casts_is_left_alone_before_the_work(cli, folder, place, said):
    (folder / "precious").mkdir()
    place(folder / "map.png.unfinished")
    result = cli("map", "--out", "map.png", *SMALL)
    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
    assert said in result.err
    assert sorted(path.name for path in folder.iterdir()) == ["map.png.unfinished", "precious"]


@pytest.mark.usefixtures("floor_without_physics")
def test_a_name_that_leaves_no_room_for_unfinished_casts_is_refused(cli):
    result = cli("map", "--out", f"{'x' * 250}.png", *SMALL)
    assert (result.code, result.out, result.err.count("\n")) == (2, "", 1)
    assert "name too long" in result.err
