"""The reachable region: what is in it, and the nearest position for a cup that is not."""

import math

import numpy as np
import pytest

from wam_cast.arm.arm_model import arm_model
from wam_cast.casting_plane import from_polar, to_polar
from wam_cast.errors import InputError
from wam_cast.planning.reach import BEARING_MARGIN, Reach, checked_polar
from wam_cast.scenario import Arm

REACH = Reach(0.26311, 0.98584, math.radians(-148.4), math.radians(148.4))


def cups_out_of_reach():
    """Return cups in all directions: too near, too far, between joint 1's stops, and two of it at once."""
    rng = np.random.default_rng(0)
    random = [from_polar(d, b) for d, b in zip(rng.uniform(0, 3, 600), rng.uniform(-np.pi, np.pi, 600), strict=True)]
    nearby = [
        from_polar(d, b)
        for d in (1e-9, 0.2631, 0.985841, 50.0)
        for b in np.radians([-180, -148.4001, -90, 0, 17, 148.4001, 180])
    ]
    ends = [from_polar(d, b) for d in (REACH.nearest, REACH.farthest) for b in (-2.6, 2.7, math.pi)]
    axis = [(0.0, 0.0), (-0.0, 0.0), (-0.0, -0.0)]
    return [cup for cup in [*random, *nearby, *ends, *axis] if not REACH.has(cup)]


CUPS = cups_out_of_reach()


def refusal(cup, reach=REACH):
    with pytest.raises(InputError) as caught:
        checked_polar(reach, cup)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def named_position(line):
    return tuple(float(number) for number in line.split("; the nearest is ")[1].split(","))


def test_the_region_lies_between_the_models_distances_and_joint_1s_stops(make_model):
    reach = Reach.of(make_model(reach=(0.3, 0.9)))
    assert (reach.nearest, reach.farthest) == (0.3, 0.9)
    low, high = arm_model(Arm()).bearing_limits
    assert (reach.lowest, reach.highest) == (low + BEARING_MARGIN, high - BEARING_MARGIN)


@pytest.mark.parametrize("distance", [0.2631, 0.26312, 0.5, 0.98583, 0.98585])
@pytest.mark.parametrize("bearing_deg", [-179.9, -148.5, -148.3, 0.0, 90.0, 148.3, 148.5])
def test_a_cup_is_within_reach_if_its_distance_and_its_bearing_are(distance, bearing_deg):
    is_within = 0.26311 <= distance <= 0.98584 and abs(bearing_deg) <= 148.4
    assert REACH.has(from_polar(distance, math.radians(bearing_deg))) is is_within


def test_what_is_within_reach_passes_with_its_distance_and_bearing():
    assert checked_polar(REACH, from_polar(0.7, -2.5)) == pytest.approx((0.7, -2.5), abs=1e-15)


@pytest.mark.parametrize("position", [(0.0, 0.0), (-0.0, 0.0), (-0.0, -0.0)])
def test_the_base_axis_itself_lies_ahead(position):
    assert to_polar(position) == (0.0, 0.0)
    assert named_position(refusal(position)) == (0.264, 0.0)


def test_the_position_that_the_error_names_is_accepted():
    assert len(CUPS) > 400
    for cup in CUPS:
        checked_polar(REACH, named_position(refusal(cup)))


def test_no_position_within_reach_is_nearer_than_the_one_named():
    distances = np.linspace(REACH.nearest, REACH.farthest, 41)
    bearings = np.linspace(REACH.lowest, REACH.highest, 301)
    grid = np.stack([np.outer(distances, f(bearings)) for f in (np.cos, np.sin)], axis=-1).reshape(-1, 2)
    for cup in CUPS:
        named, exact = math.dist(REACH.nearest_position(cup), cup), math.dist(REACH._nearest_of_all(cup), cup)
        assert exact <= np.linalg.norm(grid - cup, axis=1).min() + 1e-12, cup
        assert exact <= named + 1e-12 < exact + 0.0021, cup


def test_the_named_position_can_be_pasted():
    line = refusal((1.2, 0.3))
    assert line == (
        "cup = (1.2, 0.3) is 1.237 m from the base axis, out of reach: choose a distance from 0.264 to 0.985 m; "
        "the nearest is 0.956,0.24"
    )
    assert refusal((0.1, -0.0)).endswith("the nearest is 0.264,0.0")


def test_the_error_says_all_that_is_wrong_at_once():
    too_far, behind, both = refusal((1.2, 0.3)), refusal((-0.7, 0.01)), refusal((-1.2, 0.01))
    assert "out of reach" in too_far
    assert "joint 1" not in too_far
    assert "joint 1 cannot turn: choose one from -148.4 to 148.4 degrees" in behind
    assert "out of reach" not in behind
    assert "1.2 m from the base axis, out of reach" in both
    assert "and at a bearing of 179.5 degrees" in both


def test_from_behind_the_way_is_to_the_nearer_edge():
    x, y = REACH.nearest_position((-0.7, 0.05))
    assert math.degrees(math.atan2(y, x)) == pytest.approx(148.4, abs=0.2)
    assert np.dot(np.subtract((-0.7, 0.05), (x, y)), (x, y)) == pytest.approx(0.0, abs=2e-3)  # a right angle


def test_a_region_too_thin_for_whole_millimetres_is_named_all_the_same():
    thin = Reach(0.30021, 0.30024, -1.0, 1.0)
    assert named_position(refusal((0.5, 0.0), thin)) == pytest.approx((0.30024, 0.0))
