"""A campaign on one robot: what it learns, that it goes on as if it had never stopped, and that nothing observed is lost."""

import errno
import io
import os
import random
import re

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from wam_cast.adaptation import campaign, campaign_directory
from wam_cast.adaptation.campaign import run_campaign
from wam_cast.adaptation.campaign_directory import SCHEMA, CampaignDirectory
from wam_cast.adaptation.robot import Observation, SimulatedRobot
from wam_cast.cast import Cast
from wam_cast.errors import InputError, MachineError
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.prediction import ALONG
from wam_cast.scenario import Scenario

CUPS = [(0.75, 0.0), (0.5, 0.3)]


@pytest.fixture
def model(robots_by_formula):
    return robots_by_formula.model


def nearest_training_cast(model, radius):
    """Plan in no time: the training cast that is predicted to land nearest."""
    return model.training_casts[np.argmin(np.abs(model.training_outputs[:, ALONG] - radius))]


@pytest.fixture
def run(model, robot_by_formula, tmp_path, monkeypatch):
    """Return a function that runs a campaign on the robot by formula, planned simply, in `tmp_path / "d"`."""
    monkeypatch.setattr(campaign, "plan_cast", lambda *given: plan_cast(*given, method=nearest_training_cast))

    def campaign_of(n_casts=4, **changes):
        given = {"robot": SimulatedRobot(Scenario(), seed=3), "cups": CUPS, "directory": tmp_path / "d", **changes}
        return run_campaign(model=changes.pop("model", model), n_casts=n_casts, **given)

    return campaign_of


class Fails:
    """A robot by formula that raises an error at one of its casts."""

    def __init__(self, at, error):
        self.robot, self.at, self.error = SimulatedRobot(Scenario(), seed=3), at, error

    def cast(self, cast, cup=None):
        if self.robot.n_casts == self.at:
            raise self.error
        return self.robot.cast(cast, cup)


class Answers:
    """A robot that answers with what it is told, for the cast that was asked for where it is told none."""

    def __init__(self, **seen):
        usual = {"landing": np.array([0.7, 0.0]), "landing_std": 0.002, "is_caught": True, "status": "caught"}
        self.seen = {**usual, "limits_hit": (), **seen}

    def cast(self, cast, cup=None):
        return Observation(**{"cast": cast, **self.seen})


def same(one, other):
    pd.testing.assert_frame_equal(one.casts, other.casts, check_exact=True)
    same_belief(one.model, other.model)


def same_belief(one, other):
    for cast in one.training_casts[:3]:
        np.testing.assert_equal(one.linearize(cast)._asdict(), other.linearize(cast)._asdict())


def test_it_learns_what_the_robot_is_and_then_catches(run, monkeypatch):
    monkeypatch.setattr(campaign, "plan_cast", plan_cast)
    seen = run(6)
    miss = seen.casts["miss"]
    assert miss[0] > 0.05
    assert (miss[2:] < 0.006).all()
    assert (seen.casts["predicted_std_along"][2:] < 0.2 * seen.casts["predicted_std_along"][0]).all()
    assert seen.n_caught == seen.casts["is_caught"].sum() >= 4
    assert seen.first_caught == 1 + seen.casts["is_caught"].to_list().index(True)
    assert not seen.casts["is_feasible"][0]  # and it is cast all the same


def test_each_cast_is_planned_with_what_was_observed_before(run, model, monkeypatch):
    monkeypatch.setattr(campaign, "plan_cast", plan_cast)
    rows = run(4).casts
    assert list(zip(rows["cup_x"], rows["cup_y"], strict=True)) == CUPS * 2
    for k, row in rows.iterrows():
        before = rows[:k]
        casts = [Cast(*one) for one in before[["distance", "speed", "wait", "bearing"]].to_numpy()]
        known = model.observe(casts, before[["landing_x", "landing_y"]].to_numpy().reshape(-1, 2))
        cup = CUPS[k % 2]
        plan = plan_cast(known.toward(np.arctan2(cup[1], cup[0])), cup)
        assert plan.cast.distance == pytest.approx(row["distance"], rel=1e-9)
        assert tuple(plan.predicted_landing) == pytest.approx((row["predicted_x"], row["predicted_y"]), rel=1e-9)
        assert row["miss"] == pytest.approx(np.hypot(row["landing_x"] - cup[0], row["landing_y"] - cup[1]))


def test_the_log_is_the_campaign(run, tmp_path):
    seen = run(3)
    log = pd.read_parquet(tmp_path / "d" / "log.parquet")
    assert list(log) == SCHEMA.names == list(seen.casts)
    numbers = log.select_dtypes("number").columns
    pd.testing.assert_frame_equal(log[numbers], seen.casts[numbers], check_exact=True)
    assert sorted(path.name for path in (tmp_path / "d").iterdir()) == [".lock", "campaign.json", "log.parquet"]


@pytest.mark.slow
def test_a_robot_of_drake_goes_on_as_if_it_had_not_stopped_and_is_caught(model, tmp_path):
    truth = Scenario.from_dict(
        {"string": {"length": 0.59}, "arm": {"coulomb_friction": 0.3}, "noise": {"distance": 0.002}}
    )

    def run(n_casts, directory=None):
        return run_campaign(SimulatedRobot(truth, Scenario(), seed=4), model, CUPS[:1], n_casts, directory)

    whole = run(4)
    run(2, tmp_path / "d")
    same(run(4, tmp_path / "d"), whole)
    assert whole.casts["is_caught"].to_list()[1:] == [True] * 3


@pytest.mark.parametrize("stop", [1, 3])
def test_one_that_stopped_goes_on_as_if_it_had_not(run, tmp_path, robot_by_formula, stop):
    whole = run(4, directory=None)
    robot_by_formula.clear()

    def interrupt(row):
        if row["number"] == stop:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(4, on_cast=interrupt)
    told = []
    same(run(4, on_cast=told.append), whole)
    assert len(robot_by_formula) == 4  # none was cast twice
    assert [row["number"] for row in told] == [1, 2, 3, 4]
    same(run(4), whole)  # which is finished
    assert len(robot_by_formula) == 4


def test_it_goes_on_further(run):
    same((run(2), run(4))[1], run(4, directory=None))


def test_the_log_is_written_before_anything_is_learned(run, monkeypatch, tmp_path):
    def killed(*_):
        raise SystemExit

    with monkeypatch.context() as patch, pytest.raises(SystemExit):
        patch.setattr(campaign, "_learned", killed)
        run(2)
    assert len(pd.read_parquet(tmp_path / "d" / "log.parquet")) == 1
    same(run(2), run(2, directory=None))


def test_an_interruption_amid_the_writing_waits_for_it(run, monkeypatch, tmp_path):
    write, interrupted = campaign_directory.write_part, []

    def interrupt_twice(path, table):
        if len(table) == 2 and len(interrupted) < 2:
            interrupted.append(path)
            raise KeyboardInterrupt
        write(path, table)

    monkeypatch.setattr(campaign_directory, "write_part", interrupt_twice)
    with pytest.raises(KeyboardInterrupt):
        run(4)
    assert len(interrupted) == 2
    assert len(pd.read_parquet(tmp_path / "d" / "log.parquet")) == 2


def test_a_full_disk_is_told_before_a_cast_and_with_the_cast_that_met_it(run, monkeypatch, robot_by_formula, tmp_path):
    write = campaign_directory.write_part

    def full_from(n_rows):
        def full(path, table):
            if len(table) >= n_rows:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            write(path, table)

        return full

    monkeypatch.setattr(campaign_directory, "write_part", full_from(0))
    with pytest.raises(InputError, match="cannot be written"):
        run(2)
    assert not robot_by_formula
    monkeypatch.setattr(campaign_directory, "write_part", full_from(2))
    with pytest.raises(
        InputError, match=r"cast 2 could not be kept: it landed at 0\.\d{4}, 0\.\d{4}, \w+; campaign .*No space"
    ):
        run(2)
    assert len(pd.read_parquet(tmp_path / "d" / "log.parquet")) == 1


def test_a_fault_of_the_robot_ends_it_and_what_was_observed_is_kept(run, tmp_path):
    with pytest.raises(MachineError, match=r"failed at cast 3 \(OSError: CAN bus off\)") as raised:
        run(4, robot=Fails(2, OSError("CAN bus off")))
    assert isinstance(raised.value.__cause__, OSError)
    assert len(pd.read_parquet(tmp_path / "d" / "log.parquet")) == 2
    same(run(4), run(4, directory=None))


def test_a_ball_that_never_came_down_is_a_row_and_teaches_nothing(run, tmp_path):
    lost = {"landing": [np.nan, np.nan], "is_caught": None, "status": "never_crossed", "limits_hit": ["joint 4 speed"]}
    for _ in range(2):  # observed, and read from the log
        seen = run(1, robot=Answers(**lost))
        assert seen.model.n_observed == 0
        (row,) = seen.casts.to_dict("records")
        assert (row["is_caught"], row["status"], row["limits_hit"]) == (None, "never_crossed", ["joint 4 speed"])
        assert np.isnan([row["landing_x"], row["landing_y"], row["miss"]]).all()
        assert (seen.n_caught, seen.first_caught) == (0, None)


def test_what_is_learned_is_of_the_cast_that_was_made(run, model):
    made = Cast(0.2, 0.5, 0.3, 0.1)
    seen = run(1, robot=Answers(cast=made))
    same_belief(seen.model, model.observe([made], [[0.7, 0.0]]))


@pytest.mark.parametrize(
    "wrong",
    [
        {"landing": None},
        {"landing": [0.7]},
        {"landing": [0.7, 0.0, 0.1]},
        {"landing": [0.7, np.inf]},
        {"landing": "ab"},
        {"landing_std": -0.001},
        {"landing_std": np.nan},
        {"cast": (0.3, 0.6, 0.1)},
        {"limits_hit": None},
    ],
    ids=str,
)
def test_an_answer_that_is_no_observation_is_refused(run, wrong):
    with pytest.raises(InputError, match="cast 1: the robot answered Observation"):
        run(2, robot=Answers(**wrong))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"cups": CUPS[:1]}, r"another cups"),
        ({"settings": {"robot": "WAM 2"}}, r"another robot \(None, not 'WAM 2'\)"),
        ({"n_casts": 1}, "holds a campaign of 2 casts; ask for as many, not 1"),
        ({"cups": []}, "one cup at least"),
        ({"cups": [(0.75, 0.0), (3.0, 0.0)]}, "out of reach"),
        ({"cups": (0.75, 0.0)}, "must be the pair"),
        ({"n_casts": 0}, "n_casts = 0"),
        ({"n_casts": 10**6}, "at most 10000"),
        ({"settings": {"robot": object()}}, "settings: "),
        ({"robot": 3}, "robot = 3 must be a Robot"),
    ],
)
def test_other_work_is_refused_and_changes_nothing(run, tmp_path, robot_by_formula, changes, said):
    run(2)
    before = {path.name: path.read_bytes() for path in (tmp_path / "d").iterdir()}
    with pytest.raises(InputError, match=said):
        run(**{"n_casts": 2, **changes})
    assert {path.name: path.read_bytes() for path in (tmp_path / "d").iterdir()} == before
    assert len(robot_by_formula) == 2


def test_another_belief_is_refused(run, model, monkeypatch):
    run(1)
    monkeypatch.setattr(type(model), "scenario", Scenario.from_dict({"ball": {"mass": 0.04}}))
    with pytest.raises(InputError, match=r"another scenario\.ball\.mass \(0\.03, not 0\.04\)"):
        run(1)


def test_two_at_once_are_refused(run, tmp_path):
    def again(_):
        with pytest.raises(InputError, match="another run is at work there"):
            run(2)

    run(1, on_cast=again)


def test_something_elses_directory_is_left_alone(run, tmp_path):
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "thesis.tex").touch()
    with pytest.raises(InputError, match=r"holds thesis\.tex and no campaign"):
        run(1)
    assert [path.name for path in (tmp_path / "d").iterdir()] == ["thesis.tex"]


@pytest.mark.parametrize("name", ["log.parquet", "campaign.json"])
def test_a_damaged_file_is_refused_by_name_or_was_not_changed_and_is_never_overwritten(run, tmp_path, name):
    whole, path, rng, n_refused = run(3), tmp_path / "d" / name, random.Random(1), 0
    content = path.read_bytes()
    for length in (0, 4, len(content) // 2, *[len(content)] * 20):
        damaged = bytearray(content[:length])
        if length == len(content):
            damaged[rng.randrange(length)] ^= 1 << rng.randrange(8)
        path.write_bytes(damaged)
        try:
            same(run(3), whole)
        except InputError as error:
            n_refused += 1
            assert name in str(error) or "with another" in str(error)
            assert path.read_bytes() == damaged
        path.write_bytes(content)
    assert n_refused > 8


@pytest.mark.parametrize("name", ["log.parquet", "campaign.json"])
def test_a_folder_in_the_place_of_a_file_is_said_in_words(run, tmp_path, name):
    run(1)
    path = tmp_path / "d" / name
    path.unlink()
    path.mkdir()
    with pytest.raises(InputError, match=re.escape(name)) as caught:
        run(2)
    assert "(Is a directory); restore it" in str(caught.value)
    assert "Errno" not in str(caught.value)


@pytest.mark.parametrize(
    ("column", "value", "said"),
    [
        ("number", 7, "7, where 2 belongs"),
        ("cup_x", 0.6, "0.6, where 0.5, as in the command, belongs"),
        ("speed", -1.0, "-1.0, where a number from 1e-06 to 10 belongs"),
        ("wait", np.nan, "nan, where a number from 0 to 10"),
        ("wait", 50.0, "50.0, where a number from 0 to 10"),
        ("predicted_x", 1e308, "1e+308, where a number from -1000 to 1000"),
        ("predicted_std_along", -1.0, "-1.0, where a number from 0 to 1000"),
        ("executed_distance", 1e9, "1000000000.0, where a number from 1e-06 to 100 "),
        ("executed_distance", np.nan, "where nan, as in the others of the move, belongs"),
        ("executed_speed", np.nan, "nan, where a number belongs"),
        ("executed_speed", 1e-4, "0.0001, where one by which the cast takes 300 s at most belongs"),
        ("landing_x", 0.1, "where the distance from landing to cup, "),
        ("landing_x", np.inf, "inf, where a number from -1000 to 1000"),
        ("landing_x", 1e300, "1e+300, where a number from -1000 to 1000"),
        ("landing_std", -1.0, "-1.0, where a number from 0 to 1 "),
        ("landing_std", 1e300, "1e+300, where a number from 0 to 1 "),
        ("landing_std", 3.0, "3.0, where a number from 0 to 1 belongs"),
        ("miss", -5.0, "-5.0, where the distance from landing to cup, "),
        ("miss", np.nan, "nan, where the distance from landing to cup, "),
        ("is_caught", True, "True, where False, as its status long says, belongs"),
        ("is_feasible", None, "None, where a value belongs"),
        ("reason", "a\x1b[31mb", "where a word of letters that can be printed belongs"),
        ("status", None, "None, where a value belongs"),
        ("status", "", "'', where a word"),
        ("status", "\x1b[31mnonsense", "where a word of letters that can be printed belongs"),
        ("status", "a" * 2000, "where a word"),
        ("limits_hit", [None], "[None], where a list of limits, such as ['joint 4 speed'], belongs"),
        ("limits_hit", None, "None, where a value belongs"),
    ],
)
def test_an_edited_log_is_refused_before_any_cast_and_stays(run, tmp_path, robot_by_formula, column, value, said):
    run(3)
    path = tmp_path / "d" / "log.parquet"
    rows = pq.read_table(path).to_pylist()
    assert rows[1]["status"] == "long"
    rows[1][column] = value
    pq.write_table(pa.Table.from_pylist(rows, SCHEMA), path)
    before = path.read_bytes()
    with pytest.raises(InputError) as raised:
        run(4)
    named = "miss" if (column, value) == ("landing_x", 0.1) else column
    named = "executed_speed" if column == "executed_distance" and np.isnan(value) else named
    line = str(raised.value)
    assert f"log.parquet: column {named} of cast 2 is " in line
    assert said in line
    assert line.endswith("; restore it, or choose another directory (--out)")
    assert (path.read_bytes(), len(robot_by_formula)) == (before, 3)


def test_what_the_log_could_not_be_read_with_is_not_written_and_the_cast_is_told(run, tmp_path):
    said = r"cast 2 could not be kept: it landed at 0\.7000, 0\.0000, .*column status of cast 2 is .*robot answers"
    run(1)
    before = (tmp_path / "d" / "log.parquet").read_bytes()
    with pytest.raises(InputError, match=said):
        run(2, robot=Answers(status="\x1b[31m", is_caught=None))
    assert pq.read_table(tmp_path / "d" / "log.parquet").num_rows == 1
    assert pd.read_parquet(io.BytesIO(before)).equals(pd.read_parquet(tmp_path / "d" / "log.parquet"))


@pytest.mark.parametrize("n_more", [0, 1])
def test_columns_that_are_not_ours_are_kept_and_new_casts_have_none_there(run, tmp_path, n_more):
    run(2)
    path = tmp_path / "d" / "log.parquet"
    table = pq.read_table(path).append_column("mine", [["a", "b"]]).append_column("room", [[12, None]])
    pq.write_table(table, path)
    run(2)  # nothing is cast
    for n_casts in range(3, 4 + n_more):
        run(n_casts)  # and then one run after the other
    log = pq.read_table(path)
    assert log.column_names == [*SCHEMA.names, "mine", "room"]
    assert log["mine"].to_pylist() == ["a", "b", *[None] * (1 + n_more)]
    assert log["room"].to_pylist() == [12, *[None] * (2 + n_more)]
    same(run(3 + n_more), run(3 + n_more, directory=None))


@pytest.mark.parametrize(
    "odd",
    [
        {"status": "missed", "is_caught": False},
        {"status": "hit the table", "is_caught": None, "limits_hit": ["a word of our own"]},
        {"status": "limit_hit", "is_caught": True},
        {"landing": [-40.0, 60.0], "landing_std": 1.0, "is_caught": False, "status": "long"},
        {"landing": [np.nan, np.nan], "is_caught": True},
        {"cast": Cast(3.0, 6.0, 8.0, -3.0), "executed": Cast(30.0, 60.0, 80.0)},
    ],
    ids=str,
)
def test_what_a_laboratory_may_see_is_kept_and_read_again(run, odd):
    same(run(1, robot=Answers(**odd)), run(1))


def test_a_log_that_pandas_wrote_anew_is_the_same(run, tmp_path):
    whole = run(3)
    pd.read_parquet(tmp_path / "d" / "log.parquet").to_parquet(tmp_path / "d" / "log.parquet")
    same(run(3), whole)


def test_every_version_that_worked_on_it_is_told(run, tmp_path, monkeypatch):
    run(1)
    monkeypatch.setattr(campaign_directory, "current_versions", lambda: {"wam_cast": "99"})
    run(2)
    run(3)
    *_, last = versions = CampaignDirectory(tmp_path / "d")._read_manifest().versions
    assert (len(versions), last) == (2, {"wam_cast": "99"})
