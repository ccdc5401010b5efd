"""What a preview says of a scenario: small scenarios that fail in each way, and those that work."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import wam_cast as wc
from wam_cast.errors import InputError
from wam_cast.experiments import preview as module
from wam_cast.experiments.preview import preview_scenario
from wam_cast.experiments.preview_verdict import Fate, fate_of, is_surely_good, verdict_of
from wam_cast.learning.dataset import simulate_row
from wam_cast.simulation.outcome import Outcome, Status

FAR = (0.35, 0.95)


def casts(fates, *, landings=FAR, limits=(), speeds=(0.3, 0.8)):
    """Return casts with these fates, evenly spread over landings and speeds; those that meet limits meet `limits`."""
    n = len(fates)
    frame = pd.DataFrame({"cast": range(n), "distance": 0.3, "fate": [fate.value for fate in fates]})
    frame["landing_along"], frame["speed"] = np.linspace(*landings, n), np.linspace(*speeds, n)
    frame["limits_hit"] = [limits if fate is Fate.LIMIT_HIT else () for fate in fates]
    return frame


def scenario(**groups):
    return wc.Scenario.from_dict(groups)


def outcome(status=Status.LANDED, *, landing=0.6, is_slack=True, limits_hit=()):
    nothing = np.zeros(7)
    return Outcome(
        status=status,
        landing=np.array([landing, 0.0]),
        landing_along=landing,
        landing_across=0.0,
        crossing_time=1.0,
        entry_velocity=np.zeros(3),
        entry_angle=0.2,
        is_slack=is_slack,
        slack=0.02,
        miss=math.nan,
        peak_torque_utilization=nothing,
        peak_velocity_utilization=nothing,
        peak_tracking_error=0.0,
        limits_hit=limits_hit,
        end_time=1.0,
    )


# --- what a cast is good for


@pytest.mark.parametrize(
    ("given", "fate"),
    [
        ({}, Fate.GOOD),
        ({"is_slack": False}, Fate.TAUT),
        ({"landing": 1.2}, Fate.HANGS),
        ({"landing": 1.2, "is_slack": False}, Fate.HANGS),
        ({"status": Status.NEVER_CROSSED}, Fate.NEVER_CROSSED),
        ({"status": Status.LIMIT_HIT}, Fate.LIMIT_HIT),
        ({"status": Status.DIVERGED, "landing": math.nan}, Fate.DIVERGED),
    ],
)
def test_the_fate_of_a_cast(given, fate):
    assert fate_of(wc.Scenario(), 0.3, outcome(**given)) is fate


# --- the verdict


def test_good_casts_make_a_scenario_that_works():
    verdict = verdict_of(wc.Scenario(), casts([Fate.GOOD] * 30))
    assert verdict.can_work
    assert verdict.reason == "30 of 30 casts (95 % interval 89 to 100 %) could be caught, from 0.350 to 0.950 m"
    assert verdict.remarks == ()


@pytest.mark.parametrize(
    ("n_good", "can_work", "n_remarks"), [(30, True, 0), (24, True, 0), (15, True, 1), (3, True, 1), (2, False, 0)]
)
def test_few_good_casts_are_remarked_on_and_too_few_are_not_enough(n_good, can_work, n_remarks):
    mixed = casts([Fate.GOOD] * n_good + [Fate.TAUT] * (30 - n_good), landings=(0.2, 1.2))
    verdict = verdict_of(wc.Scenario(), mixed)
    assert (verdict.can_work, len(verdict.remarks)) == (can_work, n_remarks)
    if not can_work:
        assert "only 2 of 30 casts could be caught; the string is taut at the landing in 28 of 30" in verdict.reason


def test_landings_in_one_place_are_not_enough():
    verdict = verdict_of(wc.Scenario(), casts([Fate.GOOD] * 30, landings=(0.60, 0.64)))
    assert not verdict.can_work
    assert "between 0.600 and 0.640 m" in verdict.reason
    assert "widen bounds.distance" in verdict.reason


def test_where_few_casts_in_one_place_are_good_it_says_what_becomes_of_the_others():
    verdict = verdict_of(wc.Scenario(), casts([Fate.GOOD] * 4 + [Fate.TAUT] * 26, landings=(0.3, 0.4)))
    assert not verdict.can_work
    assert (
        "between 0.300 and 0.310 m from the base axis; the string is taut at the landing in 26 of 30" in verdict.reason
    )


def test_one_diverged_cast_is_said_and_many_are_too_many():
    one = verdict_of(wc.Scenario(), casts([Fate.GOOD] * 29 + [Fate.DIVERGED]))
    assert one.can_work
    assert "1 of 30 casts diverged" in one.remarks[0]
    assert "bounds.speed" in one.remarks[0]
    five = verdict_of(wc.Scenario(), casts([Fate.GOOD] * 25 + [Fate.DIVERGED] * 5))
    assert not five.can_work
    assert five.reason == one.remarks[0].replace("1 of 30", "5 of 30")


def test_a_hanging_ball_says_how_long_a_string_it_needs():
    short = scenario(string={"length": 0.35})
    assert not short.tether.leaves_free(0.3, 0.7)
    verdict = verdict_of(short, casts([Fate.HANGS] * 30, landings=(0.70, 0.701)))
    assert not verdict.can_work
    assert "string.length from 0.35 to about 0.40 m" in verdict.reason
    assert "motion.drop_distance from 0.45 to about 0.50 m" in verdict.reason
    for mended in ({"string": {"length": 0.40}}, {"string": {"length": 0.35}, "motion": {"drop_distance": 0.50}}):
        assert scenario(**mended).tether.leaves_free(0.3, 0.7)


def test_a_drop_slower_than_the_fall_is_named_with_what_would_be_faster():
    slow = scenario(motion={"drop_duration": 0.8})
    reason = verdict_of(slow, casts([Fate.TAUT] * 30)).reason
    # A quintic's peak acceleration is 5.77 times distance over duration squared: 4.1 m/s^2, and gravity at 0.51 s.
    assert "at most 4.1 m/s^2" in reason
    assert "shorten motion.drop_duration from 0.8 to well below 0.51 s" in reason
    assert "m/s^2" not in verdict_of(wc.Scenario(), casts([Fate.TAUT] * 30)).reason


def test_balls_that_never_come_down_are_told_so():
    reason = verdict_of(wc.Scenario(), casts([Fate.NEVER_CROSSED] * 30)).reason
    assert "does not come down to the rim in 30 of 30: deepen motion.drop_distance" in reason


def test_limits_are_named_with_what_keeps_them():
    limits = ("joint 4 speed", "joint 2 torque")
    all_hit = verdict_of(wc.Scenario(), casts([Fate.LIMIT_HIT] * 30, limits=limits))
    assert not all_hit.can_work
    assert "joint 4 speed in 30 of 30, joint 2 torque in 30 of 30" in all_hit.reason
    assert "motion.drop_duration" in all_hit.reason
    fast_hit = verdict_of(wc.Scenario(), casts([Fate.GOOD] * 15 + [Fate.LIMIT_HIT] * 15, limits=limits))
    assert fast_hit.can_work
    assert "lower bounds.speed (below 0.56 m/s no cast met any)" in fast_hit.remarks[0]
    position = verdict_of(wc.Scenario(), casts([Fate.LIMIT_HIT] * 30, limits=("joint 4 position",)))
    assert "arm.wrist_pitch" in position.reason


def test_a_verdict_is_one_line_whatever_the_casts():
    for fate in Fate:
        verdict = verdict_of(wc.Scenario(), casts([fate] * 30, limits=("joint 1 speed",)))
        assert verdict.can_work is (fate is Fate.GOOD)
        assert "\n" not in verdict.reason
        assert "nan" not in verdict.reason


def test_only_plain_successes_end_a_preview_early():
    assert is_surely_good(casts([Fate.GOOD] * 8))
    assert not is_surely_good(casts([Fate.GOOD] * 7 + [Fate.DIVERGED]))
    assert not is_surely_good(casts([Fate.GOOD] * 5 + [Fate.TAUT] * 3))
    assert not is_surely_good(casts([Fate.GOOD] * 8, landings=(0.6, 0.62)))


# --- the preview


class FakeSimulator:
    """Answers with what is in `outcomes`, in turn and over again."""

    outcomes = (outcome(landing=0.5), outcome(landing=0.7))
    integration = SimpleNamespace(expected_step=0.002, expected_seconds=0.1)

    def __init__(self, scenario):
        self.scenario, self.n_simulated = scenario, 0

    def simulate(self, cast, *, noise_seed):
        self.n_simulated += 1
        return self.outcomes[self.n_simulated % len(self.outcomes)]


@pytest.fixture
def fake(monkeypatch):
    monkeypatch.setattr(module, "CastSimulator", FakeSimulator)
    return lambda *outcomes: monkeypatch.setattr(FakeSimulator, "outcomes", outcomes)


def test_a_preview_ends_early_only_where_the_answer_is_yes(fake):
    assert len(preview_scenario(wc.Scenario()).casts) == 30
    assert len(preview_scenario(wc.Scenario(), ends_early=True).casts) == 8
    fake(outcome(is_slack=False))
    assert len(preview_scenario(wc.Scenario(), ends_early=True).casts) == 30


def test_where_a_cast_takes_seconds_there_are_fewer(fake, monkeypatch):
    for seconds, n_casts in ((0.1, 30), (3.0, 20), (29.0, 8)):
        monkeypatch.setattr(FakeSimulator, "integration", SimpleNamespace(expected_step=1e-4, expected_seconds=seconds))
        assert len(preview_scenario(wc.Scenario()).casts) == n_casts
    assert len(preview_scenario(wc.Scenario(), 30).casts) == 30  # as asked for


def test_a_preview_is_json(fake):
    fake(outcome(Status.NEVER_CROSSED, landing=math.nan))
    preview = preview_scenario(wc.Scenario(), 5)
    record = json.loads(json.dumps(preview.record(), allow_nan=False))
    assert (record["can_work"], record["n_casts"], record["n_good"]) == (False, 5, 0)
    assert record["landings"] == record["cups"] == [None, None]
    assert record["hand_radii"] == pytest.approx([0.25, 0.60])
    assert record["hand_heights"] == pytest.approx([0.35, 0.80])
    assert record["statuses"] == record["fates"] == {"never_crossed": 5}
    assert record["generate_s"] == pytest.approx(1700 * record["cast_s"] / record["n_processors"])


@pytest.mark.parametrize("n_casts", [0, 2.5])
def test_the_number_of_casts_is_checked(n_casts):
    with pytest.raises(InputError, match="n_casts"):
        preview_scenario(wc.Scenario(), n_casts)


@pytest.mark.slow
def test_the_casts_of_a_preview_are_the_first_of_the_dataset():
    noisy = wc.Scenario(noise=wc.Noise.typical())
    preview = preview_scenario(noisy, 2)
    for row, cast in preview.casts.iterrows():
        expected = simulate_row(noisy, 0, row)
        assert {name: cast[name] for name in ("speed", "status", "landing_along", "slack")} == {
            name: expected[name] for name in ("speed", "status", "landing_along", "slack")
        }
    assert (
        preview.landings == preview.cups == (preview.casts["landing_along"].min(), preview.casts["landing_along"].max())
    )
    assert 0.1 < preview.peak_velocity_utilization.max() < 1
    assert 0 < preview.cast_time < 60


@pytest.mark.slow
@pytest.mark.parametrize(
    ("groups", "part"),
    [
        ({"string": {"length": 0.33, "n_links": 4}}, "hang in a taut string"),
        ({"motion": {"drop_duration": 0.8}}, "well below 0.51 s"),
        ({"motion": {"drop_duration": 0.25}}, "joint 4 speed in 8 of 8"),
        ({"bounds": {"distance": [0.3, 0.302], "speed": [0.5, 0.502], "wait": [0.1, 0.101]}}, "widen bounds.distance"),
    ],
)
def test_scenarios_that_cannot_work_are_found_out(groups, part):
    preview = preview_scenario(scenario(**groups), 8)
    assert not preview.verdict.can_work
    assert part in preview.verdict.reason


@pytest.mark.slow
@pytest.mark.parametrize(
    "groups",
    [
        {},
        {"controller": {"kp": 1500, "kd": 62.5}},
        {
            "cup": {"base_height": 0.4, "rim_height": 0.5},
            "arm": {"mount_height": 1.75},
            "motion": {"start_height": 1.2},
        },
        {
            "arm": {"mount": "floor", "mount_height": 0.0},
            "motion": {"start_radius": 0.40, "start_height": 0.85},
            "bounds": {"distance": [0.05, 0.33]},
        },
    ],
)
def test_scenarios_that_work_are_not_refused(groups):
    preview = preview_scenario(scenario(**groups), 8)
    assert preview.verdict.can_work
    assert preview.cups[1] - preview.cups[0] > 0.2
