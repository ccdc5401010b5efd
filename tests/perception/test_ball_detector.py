"""Where the ball is in a picture: against balls that are drawn exactly."""

import math
from dataclasses import astuple

import numpy as np
import pytest

from wam_cast.perception.ball_detector import detect_ball, redness


def pixels(image):
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("centre", [(28.0, 20.0), (24.77, 21.15)])
@pytest.mark.parametrize("shade", [lambda x, y: 1.0, lambda x, y: 0.6 - 0.35 * y, lambda x, y: 0.5 + 0.4 * x])
def test_the_centre_is_found_to_hundredths_of_a_pixel_whatever_the_light(draw_ball, centre, shade):
    found = detect_ball(pixels(draw_ball(centre, shade=shade)))
    np.testing.assert_allclose((found.column, found.row), centre, atol=0.04)
    assert found.radius == pytest.approx(7.0, rel=0.02)
    assert found.std == 0.0


def test_the_centre_of_a_blurred_ball_is_the_middle_of_its_way_and_its_radius_is_kept(draw_ball):
    blurred = np.mean([draw_ball((28.0 + 0.5 * i, 20.0 + 0.75 * i)) for i in range(-4, 5)], axis=0)
    found = detect_ball(pixels(blurred))
    np.testing.assert_allclose((found.column, found.row), (28.0, 20.0), atol=0.05)
    assert found.radius == pytest.approx(7.0, rel=0.05)


def test_the_standard_deviation_is_that_of_centres_under_noise(draw_ball):
    clean, rng = draw_ball((28.2, 19.7)), np.random.default_rng(0)
    found = [detect_ball(pixels(clean + 0.02 * 255 * rng.standard_normal(clean.shape)), 0.02) for _ in range(100)]
    centres = np.array([(one.column, one.row) for one in found])
    assert centres.std(axis=0) == pytest.approx(np.mean([one.std for one in found]), rel=0.35)
    np.testing.assert_allclose(centres.mean(axis=0), (28.2, 19.7), atol=0.05)


@pytest.mark.parametrize("picture", ["empty", "cut off", "tiny"])
def test_what_is_not_there_cut_off_or_tiny_is_not_seen(draw_ball, picture):
    image = {
        "empty": draw_ball((28.0, 20.0), hidden=lambda x, y: True),
        "cut off": draw_ball((3.0, 20.0)),
        "tiny": draw_ball((28.0, 20.0), radius=1.4),
    }[picture]
    assert all(math.isnan(value) for value in astuple(detect_ball(pixels(image))))


def test_a_ball_that_something_hides_in_part_looks_narrow(draw_ball):
    found = detect_ball(pixels(draw_ball((28.0, 20.0), hidden=lambda x, y: y < -0.1)))
    assert found.radius < 0.7 * 7.0


def test_the_largest_of_two_patches_is_the_ball(draw_ball):
    image = draw_ball((28.0, 20.0))
    small = draw_ball((12.0, 8.0), radius=3.0)
    both = np.where(redness(small)[..., np.newaxis] > 0.03, small, image)
    found = detect_ball(pixels(both))
    np.testing.assert_allclose((found.column, found.row), (28.0, 20.0), atol=0.02)


def test_light_and_shade_keep_redness_and_grey_has_none():
    colour = np.array([[[200.0, 80.0, 10.0], [100.0, 40.0, 5.0], [90.0, 90.0, 90.0], [4.0, 2.0, 0.0]]])
    np.testing.assert_allclose(redness(colour), [[190 / 290, 190 / 290, 0.0, 0.0]])
