"""The film shows the recording, frame by frame, in time and in place."""

import io
import itertools
import math

import numpy as np
import pytest
from PIL import Image

from wam_cast.errors import InputError
from wam_cast.visualization import film as animation
from wam_cast.visualization.camera import Camera, view_rotation
from wam_cast.visualization.film import (
    FRAME_RATE,
    FRAME_SIZE,
    REST_AT_END,
    TITLE_HEIGHT,
    animation_frames,
    animation_samples,
    write_animation,
)
from wam_cast.visualization.film_strip import ELEVATION, TURN
from wam_cast.visualization.recorded import holds_ball, points_to_show
from wam_cast.visualization.style import PAPER


@pytest.fixture(scope="module")
def frames(caught, once):
    return once("frames", lambda: list(animation_frames(caught)))


@pytest.fixture(scope="module")
def gif(frames, caught, tmp_path_factory, once):
    """Return the file of the film, of frames that are rendered once for all tests."""
    path = tmp_path_factory.mktemp("film") / "cast.gif"

    def write():
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(animation, "animation_frames", lambda *_: iter(frames))
            write_animation(caught, path)
        return path.read_bytes()

    path.write_bytes(once("gif", write))
    return path


def read_gif(path):
    """Return the frames of a GIF, shape (n, height, width, 3), and how long each lasts [s]."""
    pictures, durations = [], []
    with Image.open(path) as film:
        for number in range(film.n_frames):
            film.seek(number)
            pictures.append(np.array(film.convert("RGB")))
            durations.append(film.info["duration"] / 1000)
        assert film.info["loop"] == 0
    return np.array(pictures), np.array(durations)


def verdict(recording):
    return recording.outcome.end_time


def pixel_of(recording, p_WQ):
    """Return the column and row of a point of the world in a frame."""
    rotation = view_rotation(recording.cast.bearing, TURN, ELEVATION)
    camera = Camera.framing(points_to_show(recording), rotation, FRAME_SIZE)
    return camera.project(np.atleast_2d(p_WQ))[0] + [0, TITLE_HEIGHT]


def orange(picture):
    red, green, blue = np.moveaxis(picture.astype(float), -1, 0)
    return (red > 60) & (red > 1.9 * green) & (red > 3 * blue)


def gold_share(recording, picture):
    """Return how much of the cup is gold in a frame."""
    shape = recording.scenario.cup
    rim, foot = (pixel_of(recording, [*recording.cup, height]) for height in (shape.rim_height, 0.0))
    half_width = shape.outer_radius / shape.rim_height * (foot[1] - rim[1])
    rows = slice(round(rim[1]), round(foot[1]))
    columns = slice(round(rim[0] - half_width), round(rim[0] + half_width))
    red, green, blue = np.moveaxis(picture[rows, columns].astype(float), -1, 0)
    return np.mean((red > 1.1 * green) & (red < 1.8 * green) & (green > 1.3 * blue))


@pytest.mark.slow
def test_gif_lasts_as_long_as_the_cast_to_its_verdict(gif, caught):
    pictures, durations = read_gif(gif)
    assert len(pictures) == math.ceil(verdict(caught) * FRAME_RATE) + 1
    np.testing.assert_allclose(durations[:-1], 1 / FRAME_RATE)
    assert durations[:-1].sum() == pytest.approx(verdict(caught), abs=1 / FRAME_RATE)
    assert durations[-1] == REST_AT_END
    assert gif.stat().st_size < 2.5e6


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.25, 2.0])
def test_slow_motion_has_more_frames_of_the_same_cast(caught, speed):
    normal, other = animation_samples(caught), animation_samples(caught, speed)
    assert len(other) - 1 == pytest.approx((len(normal) - 1) / speed, abs=1 + 1 / speed)
    assert (other[0], other[-1]) == (normal[0], normal[-1])
    steps = np.diff(caught.times[other[:-1]])
    np.testing.assert_allclose(steps, speed / FRAME_RATE, atol=2.1 * caught.times[1])


def test_a_speed_that_no_film_has_is_refused(caught, tmp_path):
    with pytest.raises(InputError, match=r"speed = 0 must be from 0\.05 to 10"):
        write_animation(caught, tmp_path / "a.gif", speed=0)


@pytest.mark.slow
def test_ball_is_where_the_recording_has_it(gif, caught):
    pictures, _ = read_gif(gif)
    samples = animation_samples(caught)
    np.testing.assert_allclose(caught.times[samples[:-1]], np.arange(len(samples) - 1) / FRAME_RATE, atol=1e-3)
    seen = 0
    for picture, sample in zip(pictures, samples, strict=True):
        if holds_ball(caught)[sample]:
            continue
        rows, columns = np.nonzero(orange(picture))
        middle = np.array([columns.mean(), rows.mean()])
        assert np.linalg.norm(middle - pixel_of(caught, caught.p_WL[sample])) < 2
        seen += 1
    assert seen > 15


@pytest.mark.slow
def test_cup_is_lit_from_the_frame_on_in_which_the_ball_is_in_it(gif, caught):
    pictures, _ = read_gif(gif)
    gold = np.array([gold_share(caught, picture) for picture in pictures])
    holds = holds_ball(caught)[animation_samples(caught)]
    assert 2 < holds.sum() < len(holds) - 10
    assert gold[holds].min() > 0.4
    assert gold[~holds].max() < 0.1


@pytest.mark.slow
def test_titles_name_stage_and_time_and_nothing_is_clipped(frames):
    paper = np.round(255 * np.array(PAPER))
    written = [np.any(np.abs(frame[:TITLE_HEIGHT].astype(float) - paper) > 3, axis=2) for frame in frames]
    for text in written:
        rows, columns = np.nonzero(text)
        assert rows.min() >= 3
        assert rows.max() <= TITLE_HEIGHT - 4
        assert columns.min() >= 8
        assert columns.max() < FRAME_SIZE[0] - 8
        assert columns[columns < 240].size
        assert columns[columns > 240].size
    # The stage stays for a while, the time never; what became of the ball is told at the end alone.
    assert all(np.any(one != next_one) for one, next_one in itertools.pairwise(written))
    middle = slice(200, 280)
    assert written[-1][:, middle].any()
    assert not any(text[:, middle].any() for text in written[:-1])


@pytest.mark.slow
def test_paths_grow_behind_ball_and_hand(frames, caught):
    samples = animation_samples(caught)
    before = np.searchsorted(samples, 150)  # the ball has left this place, 0.3 s on
    column, row = pixel_of(caught, caught.p_WL[150]).round().astype(int)
    place = (slice(row - 3, row + 4), slice(column - 3, column + 4))
    assert orange(frames[before][place]).any()
    later = frames[before + 10][place].astype(float)
    # White beside the line, on a greyer floor, and the dark of a move.
    assert later.max(axis=(0, 1)).min() > 210 > np.median(later)
    assert later.min(axis=(0, 1)).max() < 130


@pytest.mark.slow
def test_cup_of_a_miss_is_never_lit(missed, monkeypatch):
    monkeypatch.setattr(animation, "FRAME_RATE", 4)
    pictures = list(animation_frames(missed))
    assert len(pictures) > 15
    assert max(gold_share(missed, picture) for picture in pictures) < 0.1


@pytest.mark.slow
def test_mp4_plays_what_the_gif_shows(frames, caught, tmp_path, monkeypatch):
    av = pytest.importorskip("av")
    monkeypatch.setattr(animation, "animation_frames", lambda *_: iter(frames))
    path = tmp_path / "cast.mp4"
    write_animation(caught, path)
    with av.open(io.BytesIO(path.read_bytes())) as film:
        (stream,) = film.streams
        assert stream.average_rate == FRAME_RATE
        pictures = [picture.to_ndarray(format="rgb24") for picture in film.decode(stream)]
    n_rest = round(REST_AT_END * FRAME_RATE)
    assert len(pictures) == len(frames) + n_rest
    expected = [*frames, *[frames[-1]] * n_rest]
    for picture, frame in zip(pictures, expected, strict=True):
        assert np.mean(np.abs(picture.astype(float) - frame)) < 4


def test_film_of_a_cast_without_a_cup_goes_to_the_landing(landed):
    samples = animation_samples(landed)
    assert samples[-1] == len(landed.times) - 1


def test_mp4_without_what_writes_it_is_refused_with_what_to_install(landed, tmp_path, monkeypatch):
    monkeypatch.setattr(animation, "find_spec", lambda _: None)
    with pytest.raises(InputError, match=r"cast\.mp4: .* pip install 'wam-cast\[animation\]', .*\.gif") as raised:
        write_animation(landed, tmp_path / "cast.mp4")
    assert "\n" not in str(raised.value)
    assert list(tmp_path.iterdir()) == []
    animation.check_animation(tmp_path / "cast.gif")


@pytest.mark.parametrize("name", ["cast.png", "cast"])
def test_unknown_suffix_is_refused_with_what_is_allowed(name, landed, tmp_path):
    with pytest.raises(InputError, match=r"\.gif, \.mp4"):
        write_animation(landed, tmp_path / name)
    assert list(tmp_path.iterdir()) == []
