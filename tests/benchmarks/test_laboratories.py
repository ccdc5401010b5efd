"""The scenarios of laboratories, and the random ones: that they are what the benchmarks say, without simulating them."""

import json
from types import SimpleNamespace

import laboratories
import pytest
import random_scenarios
from laboratory_scenarios import HAND, LABORATORIES, LONG_FOREARM, Laboratory, arranged, on_stand, scenarios_of

from wam_cast.arm.arm_model import arm_model
from wam_cast.errors import InputError
from wam_cast.scenario import Arm, Scenario


def test_there_are_enough_and_each_has_its_name():
    names = [one.name for one in LABORATORIES]
    assert len(names) == len(set(names)) >= 24


@pytest.mark.parametrize("laboratory", LABORATORIES, ids=lambda one: one.name)
def test_every_scenario_can_be_said(laboratory):
    if laboratory.name == "21 g, 0.3 m, as it is":  # which shows how a scenario is refused that cannot work
        with pytest.raises(InputError, match="too short for a ball to rest in any cup"):
            scenarios_of(laboratory)
        return
    robot, belief = scenarios_of(laboratory)
    assert (robot == belief) == (laboratory.believed is None)


def test_a_motion_is_arranged_in_proportion_to_the_reference():
    scenario = Scenario.from_dict(arranged({}))
    assert scenario.motion.start_height == Scenario().motion.start_height
    assert scenario.arm.mount_height == Scenario().arm.mount_height
    assert scenario.motion.drop_distance == pytest.approx(Scenario().motion.drop_distance, rel=0.02)
    table = Scenario.from_dict(arranged({"cup": on_stand(0.3), "string": {"length": 0.3}}))
    floor = Scenario.from_dict(arranged({"string": {"length": 0.3}}))
    assert table.motion.start_height - floor.motion.start_height == pytest.approx(0.3)
    assert table.motion.drop_distance == floor.motion.drop_distance


def test_the_other_arms_are_longer_by_what_they_say():
    shipped, forearm, hand = (arm_model(Arm(**arm)) for arm in ({}, LONG_FOREARM, HAND))
    assert forearm.stretched_length - shipped.stretched_length == pytest.approx(0.08)
    assert hand.stretched_length - shipped.stretched_length == pytest.approx(0.09)
    assert list(hand.coulomb_friction / shipped.coulomb_friction) == pytest.approx([1, 1, 1, 1, 2, 2, 3])


def test_what_was_done_is_read_again(tmp_path, monkeypatch, capsys):
    laboratory = Laboratory("one", "special | words", {"string": {"length": 4.0}})
    monkeypatch.setattr(laboratories, "LABORATORIES", (laboratory,))
    out = tmp_path / "results.jsonl"
    monkeypatch.setattr("sys.argv", ["laboratories.py", "--workers", "1", "--out", str(out)])
    for _ in range(2):
        with pytest.raises(SystemExit) as ended:
            laboratories.main()
        assert ended.value.code == 0
        table = capsys.readouterr().out.splitlines()
        assert len(table) == 3
        assert table[2].startswith("| one | special / words | refused: string.length = 4 m is too long")
        monkeypatch.setattr(laboratories, "tried", None)
    assert len(out.read_text().splitlines()) == 1
    out.write_text(out.read_text() + json.dumps({"key": {}})[:5])  # what an interrupted run leaves
    with pytest.raises(SystemExit):
        laboratories.main()


def test_a_scenario_that_missed_is_told_and_fails_the_run():
    result = {
        "verdict": "some missed",
        "caught": 3,
        "cups": 5,
        "failures": {"not_settled": 2},
        "median_miss": 0.0012,
        "largest_miss": 0.03,
        "reach": (0.3, 0.9),
        "slack": 0.5,
    }
    cells = laboratories._cells(SimpleNamespace(name="a", description="b"), result)
    assert cells == ("a", "b", "3 of 5 caught (2 not_settled)", "1.2, 30.0", "0.300 to 0.900", "50%")


@pytest.mark.slow
def test_random_files_are_reproducible_and_of_every_kind(tmp_path):
    assert random_scenarios.draw(3) == random_scenarios.draw(3)
    n_read, refused = 0, []
    for seed in range(150):
        path = tmp_path / "scenario.yaml"
        path.write_text(random_scenarios.yaml.safe_dump(random_scenarios.draw(seed)), encoding="utf-8")
        try:
            Scenario.from_yaml(path)
            n_read += 1
        except InputError as error:
            assert "\n" not in str(error)
            refused.append(str(error))
    assert n_read > 60
    assert any("unknown key" in line for line in refused)
    assert any("is too long for a hand" in line for line in refused)


def test_what_a_line_is_about_comes_before_its_number():
    result = random_scenarios.Result("refused", "string.length = 4 m is too long")
    assert random_scenarios._first_words(result) == "string.length"
