"""The tether: closed forms of what the string lets the ball do, and the scenarios that it refuses."""

import math
import re

import numpy as np
import pytest

from wam_cast.errors import InputError
from wam_cast.scenario import Scenario
from wam_cast.tether import LOOSE_MARGIN, Tether, lifting_share

UPRIGHT = Tether(start_radius=0.2, height=0.3, play=0.01, length=0.5, margin=0.0)
"""Its string is the hypotenuse of a triangle of 0.3 and 0.4 m."""


def random_tethers(n=300, seed=0):
    rng = np.random.default_rng(seed)
    for _ in range(n):
        length = rng.uniform(0.2, 1.5)
        yield Tether(
            rng.uniform(0.1, 0.4), rng.uniform(0, 1) * length, rng.uniform(0, 0.05), length, rng.uniform(0, 0.05)
        )


def random_scenario_values(n=400, seed=1):
    """Yield values of scenarios over what laboratories have, many of them with a string that is too short."""
    rng = np.random.default_rng(seed)
    for _ in range(n):
        rim, radius, start = rng.uniform(0.06, 0.4), rng.uniform(0.01, 0.033), rng.uniform(0.6, 1.2)
        yield {
            "string": {"length": rng.uniform(0.2, 0.7), "mass": rng.uniform(0.0005, 0.02)},
            "ball": {"mass": rng.uniform(0.002, 0.2), "radius": radius},
            "cup": {"rim_height": rim, "inner_radius": radius + rng.uniform(0.002, 0.03)},
            "motion": {"start_height": start, "drop_distance": rng.uniform(0.2, 0.9) * (start - rim)},
        }


# --- closed forms


def test_the_span_is_the_other_leg_of_a_right_triangle_less_the_balls_play():
    assert UPRIGHT.span == pytest.approx(0.4 - 0.01)
    assert UPRIGHT.distances(0.7) == pytest.approx((0.7 - 0.2 - 0.39, 0.7 - 0.2 + 0.39))


def test_the_least_length_and_the_greatest_height_are_those_of_a_cup_right_below():
    assert UPRIGHT.least_length == pytest.approx(math.hypot(0.3, 0.01))
    assert UPRIGHT.greatest_height == pytest.approx(math.sqrt(0.5**2 - 0.01**2))


def test_a_string_that_does_not_reach_straight_down_frees_no_ball():
    short = Tether(0.2, 0.3, 0.01, length=0.299, margin=0.0)
    assert short.span == -math.inf
    assert not short.leaves_free(np.linspace(0, 1, 50), 0.6).any()
    least, greatest = short.distances(0.6)
    assert least > greatest


def test_at_the_ends_of_the_interval_the_string_spans_to_the_balls_farthest_place():
    for tether in random_tethers():
        if tether.span < 0:
            continue
        for distance in tether.distances(0.8):
            far = abs(tether.start_radius + distance - 0.8) + tether.play
            assert math.hypot(far, tether.height) == pytest.approx((1 - tether.margin) * tether.length, rel=1e-9)


def test_a_cast_leaves_the_ball_free_exactly_within_the_interval():
    n_free = 0
    for tether in random_tethers():
        least, greatest = tether.distances(0.8)
        distances = np.linspace(-1, 2, 301)
        free = tether.leaves_free(distances, 0.8)
        np.testing.assert_array_equal(free, (distances >= least - 1e-6) & (distances <= greatest + 1e-6))
        n_free += free.any()
    assert n_free > 100


def test_a_longer_string_a_deeper_hand_and_less_play_only_widen_the_interval():
    for one in random_tethers():
        for other in (
            Tether(one.start_radius, one.height, one.play, 1.01 * one.length, one.margin),
            Tether(one.start_radius, 0.99 * one.height, one.play, one.length, one.margin),
            Tether(one.start_radius, one.height, 0.99 * one.play, one.length, one.margin),
        ):
            assert other.span >= one.span


# --- a string that weighs something


def slack_share_of_lifting_catenary(string_mass, ball_mass):
    """Return the largest share by which a catenary is slack whose lower end pulls up with the ball's weight: by quadrature."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    along, weights = (nodes + 1) / 2, weights / 2
    up = ball_mass + string_mass * along
    shares = []
    for horizontal in np.geomspace(0.05, 20, 400) * (ball_mass + string_mass):
        tension = np.hypot(horizontal, up)
        chord = math.hypot(np.sum(weights * horizontal / tension), np.sum(weights * up / tension))
        shares.append(1 - chord)
    return max(shares)


@pytest.mark.parametrize("ratio", [0.02, 0.1, 1.0, 3.0, 10.0])
def test_the_strings_weight_lifts_a_ball_before_it_is_straight(ratio):
    exact, closed = slack_share_of_lifting_catenary(ratio, 1.0), lifting_share(ratio, 1.0)
    # The closed form holds for a string that is almost straight.
    assert closed == pytest.approx(exact, rel=0.05 if ratio <= 0.1 else 0.35)


def test_the_reference_string_is_too_light_to_matter():
    assert lifting_share(0.003, 0.030) < 1e-4
    assert Scenario().tether.margin == pytest.approx(LOOSE_MARGIN, abs=1e-4)


# --- scenarios


def test_the_reference_tether_is_that_of_its_numbers():
    tether = Scenario().tether
    assert tether.height == pytest.approx(0.80 - 0.45 - 0.006 - 0.020)
    assert (tether.start_radius, tether.length) == (0.20, 0.60)
    assert tether.play == pytest.approx(0.010)


def test_a_string_too_short_for_any_cup_is_refused_with_what_mends_it():
    values = {"string": {"length": 0.30}, "ball": {"mass": 0.021}}
    with pytest.raises(InputError) as caught:
        Scenario.from_dict(values)
    assert str(caught.value) == (
        "string.length = 0.3 m is too short for a ball to rest in any cup: it would hang in a taut string, since after the drop "
        "the hand is 0.324 m above where it is to rest; choose a string.length of at least 0.328 m, or a motion.drop_distance "
        "of at least 0.478 m, or a motion.start_height of at most 0.772 m"
    )


def test_each_remedy_that_a_refusal_names_mends_the_scenario_to_the_millimetre():
    n_named = dict.fromkeys(("string.length", "motion.drop_distance", "motion.start_height"), 0)
    for values in random_scenario_values():
        try:
            Scenario.from_dict(values)
        except InputError as error:
            line = str(error)
        else:
            continue
        if "rest in any cup" not in line:
            continue
        assert "\n" not in line
        remedies = re.findall(r"(\w+)\.(\w+) of at (least|most) ([\d.]+) m", line)
        assert remedies or "lower cup.rim_height" in line
        for group, name, side, text in remedies:
            n_named[f"{group}.{name}"] += 1
            value, beyond = float(text), 0.0011 if side == "most" else -0.0011
            mended = values | {group: values[group] | {name: value}}
            assert Scenario.from_dict(mended).tether.span >= 0, line
            with pytest.raises(InputError, match="rest in any cup"):
                Scenario.from_dict(values | {group: values[group] | {name: value + beyond}})
    assert min(n_named.values()) > 10, n_named


def test_every_scenario_that_is_accepted_has_a_cup_that_can_be_served():
    n_accepted = 0
    for values in random_scenario_values():
        try:
            tether = Scenario.from_dict(values).tether
        except InputError:
            continue
        n_accepted += 1
        assert tether.leaves_free(0.3, tether.start_radius + 0.3)  # right below the hand
    assert n_accepted > 50
