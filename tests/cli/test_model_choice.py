"""Which model the command line plans with; a shipped or own one that does not serve is passed over, and the way to one is named."""

import re
import shlex

import pytest

import wam_cast as wc
from wam_cast.learning import reference
from wam_cast.visualization.interactive.explorer import Explorer


@pytest.fixture
def no_shipped_model(monkeypatch, tmp_path):
    """Leave the shipped model behind, as a change of the arm does."""
    reference.reference_model.cache_clear()
    monkeypatch.setattr(reference, "_DIRECTORY", tmp_path)
    (tmp_path / "model.npz").write_bytes(b"of another arm")
    yield
    reference.reference_model.cache_clear()


@pytest.fixture
def explored(monkeypatch):
    """Give the explorers that were run, each of which is interrupted at once; none is made."""
    made = []
    monkeypatch.setattr(Explorer, "__init__", lambda self, *args, **options: made.append((args, options)))
    monkeypatch.setattr(Explorer, "url", "http://localhost")
    monkeypatch.setattr(Explorer, "run", lambda self: None)
    return made


def named_commands(line):
    return [shlex.split(command)[1:] for command in re.findall(r"`(wam-cast .*?)`", line)]


@pytest.mark.usefixtures("no_physics", "scenarios", "no_shipped_model")
@pytest.mark.parametrize("scenario", [[], ["--scenario", "heavy.yaml"]], ids=["reference", "own"])
def test_without_the_shipped_model_the_commands_that_an_error_names_work(cli, explored, scenario):
    refused = cli("plan", "--cup", "0.7", *scenario)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert "has no model yet" in refused.err
    assert cli("show", *scenario).code == 0
    (_, forward), options = explored[0]
    assert forward is None
    assert named_commands(options["advice"]) == named_commands(refused.err)
    generate, fit = named_commands(refused.err)
    assert (cli(*generate).code, cli(*fit).code) == (0, 0)
    assert cli("plan", "--cup", "0.7", *scenario).code == 0


@pytest.mark.usefixtures("no_physics", "scenarios", "no_shipped_model")
@pytest.mark.parametrize("scenario", [[], ["--scenario", "heavy.yaml"]], ids=["reference", "own"])
def test_without_the_shipped_model_train_makes_one(cli, scenario):
    assert cli("plan", "--cup", "0.7", *scenario, "--train").code == 0
    assert cli("plan", "--cup", "0.7", *scenario).code == 0


@pytest.mark.usefixtures("no_shipped_model")
def test_what_needs_no_model_does_without_the_shipped_one(cli):
    assert cli("throw", "--cup", "0.75", "--cast", "0.30,0.60,0.10").code in (0, 1)
    assert cli("show", "--graph", "station.dot").code == 0
    assert reference.reference_model_for(wc.Scenario()) is None


@pytest.mark.slow
@pytest.mark.usefixtures("no_physics", "scenarios")
def test_an_own_model_that_does_not_serve_is_passed_over_and_train_keeps_it_beside_the_new_one(cli, folder, explored):
    words = ("plan", "--cup", "0.7", "--scenario", "heavy.yaml")
    assert cli(*words, "--train").code == 0
    (own,) = folder.glob("heavy-*.model")
    own.write_bytes(b"cut off")
    refused = cli(*words)
    assert (refused.code, refused.err.count("\n")) == (2, 1)
    assert f"model {own.name}: not a model file" in refused.err
    assert len(named_commands(refused.err)) == 2
    assert cli("show", "--scenario", "heavy.yaml").code == 0
    assert explored[0][0][1] is None
    mended = cli(*words, "--train")
    assert mended.code == 0
    assert f"it is now {own.name}.set_aside" in mended.err
    assert (folder / f"{own.name}.set_aside").read_bytes() == b"cut off"
    assert cli(*words).out == mended.out
