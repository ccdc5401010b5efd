"""The film strip shows what was recorded, where it was, and its camera's mathematics is the renderer's."""

import dataclasses
import math
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from wam_cast.errors import InputError
from wam_cast.motion.stages import Stage
from wam_cast.perception.ball_filter import BallBelief, ObservedLanding
from wam_cast.perception.ball_observer import Look, true_cameras
from wam_cast.perception.recorded_cast import Sighting
from wam_cast.robot.plant import STRING_COLOR
from wam_cast.scenario import Cameras
from wam_cast.simulation.ball_and_cup import is_inside
from wam_cast.visualization.camera import Camera, view_rotation
from wam_cast.visualization.film_strip import (
    choose_moments,
    draw_film_strip,
    draw_frame,
    draw_sighting,
    render_frames,
    write_picture,
)
from wam_cast.visualization.picture_files import write_figure
from wam_cast.visualization.recorded import SAMPLED, finite_part, points_to_show, stage_pieces, without_turn
from wam_cast.visualization.side_view import draw_side_view, in_casting_plane

pytestmark = pytest.mark.slow


def orange(image):
    """Return where `image` has the ball's colour, lit or in shade."""
    red, green, blue = np.moveaxis(image.astype(float), -1, 0)
    return (red > 20) & (red > 1.8 * green) & (red > 3 * blue)


def middle_of(mask):
    rows, columns = np.nonzero(mask)
    return np.array([columns.mean(), rows.mean()])


@pytest.fixture(scope="module")
def frames(caught):
    return list(render_frames(caught, choose_moments(caught)))


def test_moments_follow_the_stages(caught):
    moments = choose_moments(caught)
    before = [Stage(caught.stages[max(sample - 1, 0)]) for sample in moments]
    assert before[:4] == [Stage.MOVE, Stage.MOVE, Stage.WAIT, Stage.DROP]
    assert before[5] is Stage.RETURN
    assert caught.times[moments[4]] == pytest.approx(caught.outcome.end_time)
    p_CL = caught.p_WL - [*caught.cup, caught.scenario.cup.rim_height]
    assert list(is_inside(p_CL, caught.scenario.cup)[moments]) == [False, False, False, False, True, False]


def test_frames_show_a_lit_scene_that_moves(frames):
    for frame in frames:
        assert frame.image.shape == (frame.camera.height, frame.camera.width, 3)
        assert 100 < frame.image.mean() < 240
        assert frame.image.std() > 20
    for one, next_one in pairwise(frames):
        assert np.mean(np.any(one.image != next_one.image, axis=2)) > 0.01


@pytest.mark.parametrize("name", ["caught", "missed"])
def test_ball_is_rendered_where_the_camera_projects_it(name, request):
    recording = request.getfixturevalue(name)
    samples = [0, 150, 250, 350]
    for frame in render_frames(recording, samples, size=(600, 800)):
        seen = orange(frame.image)
        expected = frame.camera.project(recording.p_WL[[frame.sample]])[0]
        assert np.linalg.norm(middle_of(seen) - expected) < 1.2
        edge = recording.p_WL[frame.sample] + [0, 0, recording.scenario.ball.radius]
        radius = np.linalg.norm(frame.camera.project(edge[None])[0] - expected)
        # The string and shading take some of the disc.
        assert 0.7 < seen.sum() / (math.pi * radius**2) < 1.15


def test_paths_so_far_end_at_the_rendered_ball_and_at_the_hand(caught, frames):
    axes = Figure().subplots()
    frame = frames[2]
    draw_frame(axes, frame, caught)
    drawn = [line.get_xydata() for line in axes.lines]
    shown = [line[np.isfinite(line).all(axis=1)] for line in drawn]
    ends = np.array([line[-1] for line in shown if len(line)])
    # The ball is left in sight, so that its path ends at its edge.
    radius = math.sqrt(np.sum(orange(frame.image)) / math.pi)
    assert np.min(np.linalg.norm(ends - middle_of(orange(frame.image)), axis=1)) == pytest.approx(radius, abs=2)
    hand = frame.camera.project(caught.p_WE[[frame.sample]])[0]
    assert np.min(np.linalg.norm(ends - hand, axis=1)) < 1e-9
    starts = frame.camera.project(np.array([caught.p_WE[0], caught.p_WL[0]]))
    np.testing.assert_allclose([line[0] for line in drawn[:2]], starts)


@pytest.mark.parametrize("bearing", [0.0, -0.7, 2.5])
def test_camera_frames_its_points_tightly_with_the_cast_to_the_right(bearing):
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (50, 3))
    camera = Camera.framing(points, view_rotation(bearing, 0.2, 0.1), (300, 500))
    np.testing.assert_allclose(camera.R_WV.T @ camera.R_WV, np.eye(3), atol=1e-12)
    assert np.linalg.det(camera.R_WV) == pytest.approx(1)
    share = (camera.project(points) + 0.5) / [300, 500]
    assert share.min() >= 0.0
    assert share.max() <= 1.0
    assert np.min([share, 1 - share]) < 0.05
    outward = np.array([math.cos(bearing), math.sin(bearing), 0.0])
    near, far = camera.project(np.array([0 * outward, 0.1 * outward]))
    assert far[0] > near[0] + 5
    low, high = camera.project(np.array([[0, 0, 0.0], [0, 0, 0.1]]))
    assert high[1] < low[1] - 5


@pytest.mark.parametrize("name", ["caught", "missed", "landed"])
def test_whole_cast_is_in_the_picture(name, request):
    recording = request.getfixturevalue(name)
    (frame,) = render_frames(recording, [0], size=(60, 80))
    pixels = frame.camera.project(points_to_show(recording))
    assert pixels.min() >= -0.5
    assert np.all(pixels.max(axis=0) <= [59.5, 79.5])


def test_stage_pieces_join_and_cover_the_recording(caught):
    pieces = stage_pieces(caught.stages)
    assert [stage for stage, _ in pieces] == list(Stage)[1:]  # it has nothing to turn
    assert pieces[0][1].start == 0
    assert pieces[-1][1].stop == len(caught.stages)
    for (_, one), (_, next_one) in pairwise(pieces):
        assert one.stop == next_one.start + 1


def test_side_view_draws_the_recorded_paths_in_the_casting_plane(missed):
    missed = without_turn(missed)
    axes = Figure().subplots()
    draw_side_view(axes, missed, [0, 100], predicted_landing=np.array([0.5, -0.39]))
    drawn = np.vstack([line.get_xydata() for line in axes.lines])
    ball = in_casting_plane(missed.p_WL, missed.cast.bearing)
    assert np.min(np.linalg.norm(drawn - ball[-1], axis=1)) < 1e-12
    assert np.min(np.linalg.norm(drawn - ball[300], axis=1)) < 1e-12
    # The bearing turns the cast only, so that the ball stays as far out as the plane says.
    np.testing.assert_allclose(ball[0, 0], missed.scenario.motion.start_radius, atol=3e-4)
    cup = axes.patches[0].get_xy()
    assert np.ptp(cup[:, 0]) == pytest.approx(2 * missed.scenario.cup.outer_radius)
    assert np.ptp(cup[:, 1]) == pytest.approx(missed.scenario.cup.rim_height)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert {"move", "wait", "drop", "hold", "return", "ball", "hand", "landing", "landing, predicted"} <= set(labels)


def test_moments_at_which_the_ball_is_in_one_place_share_a_marker(caught):
    axes = Figure().subplots()
    draw_side_view(axes, caught, [0, 150, len(caught.times) - 1])
    place = in_casting_plane(caught.p_WL[[0, 150]], 0.0)
    numbers = {text.get_text(): text.xy for text in axes.texts}
    assert list(numbers) == ["1, 3", "2"]
    np.testing.assert_allclose(list(numbers.values()), place)


def test_string_below_the_floor_is_drawn_lying_on_it(caught):
    after = int(np.searchsorted(caught.times, caught.outcome.end_time + 0.3))
    (frame,) = render_frames(caught, [after])
    below = frame.string[:, 2] < 0
    assert np.any(below)
    axes = Figure().subplots()
    draw_frame(axes, frame, caught)
    (lying,) = (line.get_xydata() for line in axes.lines if line.get_color() == STRING_COLOR)
    on_floor = frame.string * [1, 1, 0]
    np.testing.assert_allclose(lying[below], frame.camera.project(on_floor[below]))
    aloft = ~(below | np.roll(below, 1) | np.roll(below, -1))
    assert np.all(np.isnan(lying[aloft]))
    from_ball = np.linalg.norm(frame.string[-1] - caught.p_WL[after])
    assert from_ball == pytest.approx(caught.scenario.ball.radius, abs=1e-9)


def test_cast_that_diverges_in_its_turn_has_a_start_and_an_end(caught):
    samples = {name: getattr(caught, name)[:50] for name in SAMPLED}
    broken = dataclasses.replace(caught, **samples | {"stages": np.full(50, Stage.TURN)})
    assert choose_moments(broken)[0] == 0
    assert choose_moments(broken)[-1] == 49


@pytest.mark.parametrize("end", [0.2, 0.85, 1.0])
def test_nothing_is_cut_off_however_far_the_ball_rolls(caught, end):
    p_WL = caught.p_WL.copy()
    p_WL[-1] = end, 0.0, 0.02
    figure = draw_film_strip(dataclasses.replace(caught, p_WL=p_WL))
    FigureCanvasAgg(figure).draw()
    for axes in figure.axes:
        box = axes.get_tightbbox()
        assert figure.bbox.x0 <= box.x0
        assert box.x1 <= figure.bbox.x1
        assert figure.bbox.y0 <= box.y0
        assert box.y1 <= figure.bbox.y1


def test_film_strip_of_a_cast_without_a_cup_has_the_frames_that_it_reached(landed):
    figure = draw_film_strip(landed)
    titles = [axes.get_title() for axes in figure.axes if axes.images]
    assert [title.split()[1].rstrip(",") for title in titles] == ["start", "move", "wait", "drop"]


def test_film_strip_names_cup_status_and_misses(caught):
    text = draw_film_strip(caught, predicted_landing=np.add(caught.cup, [0.003, 0.004])).get_suptitle()
    assert f"({caught.cup[0]:.3f}, {caught.cup[1]:.3f}) m" in text
    assert "caught" in text
    assert "predicted miss 5.0 mm" in text


def test_what_is_no_longer_finite_is_left_out(caught):
    p_WL = caught.p_WL.copy()
    p_WL[300:] = np.nan
    part = finite_part(dataclasses.replace(caught, p_WL=p_WL))
    assert len(part.times) == len(part.stages) == len(part.states) == 300
    assert max(choose_moments(part)) < 300


@pytest.mark.parametrize("name", ["cast.gif", "cast"])
def test_unknown_suffix_is_refused_with_what_is_allowed(name, caught, tmp_path):
    with pytest.raises(InputError, match=r"\.pdf, \.png, \.svg"):
        write_picture(caught, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_picture_is_written_and_replaced(landed, tmp_path):
    path = tmp_path / "cast.PNG"
    path.write_text("old")
    write_picture(landed, path)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert [file.name for file in tmp_path.iterdir()] == ["cast.PNG"]


@pytest.mark.parametrize(("suffix", "start"), [("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG")])
def test_suffix_decides_the_format(suffix, start, tmp_path):
    figure = Figure(figsize=(1, 1))
    write_figure(figure, tmp_path / f"figure.{suffix}")
    assert (tmp_path / f"figure.{suffix}").read_bytes().startswith(start)


def test_unwritable_picture_is_one_line_and_leaves_nothing(tmp_path):
    for path in (tmp_path / "missing" / "cast.png", tmp_path / "folder.png"):
        (tmp_path / "folder.png").mkdir(exist_ok=True)
        with pytest.raises(InputError, match="cannot write") as raised:
            write_figure(Figure(), path)
        assert str(path) in str(raised.value)
        assert "\n" not in str(raised.value)
    assert [file.name for file in tmp_path.iterdir()] == ["folder.png"]


@pytest.fixture(scope="module")
def sighting(caught):
    """Return the recording with two small cameras, and what they would see of it if they were perfect."""
    scenario = caught.scenario.model_copy(update={"cameras": Cameras(number=2, width=160, height=120)})
    recording = dataclasses.replace(caught, scenario=scenario)
    landed = int(np.argmin(np.abs(caught.times - caught.outcome.crossing_time)))
    landing, looks = ObservedLanding(caught.outcome.landing + np.array([0.001, 0.0]), 4e-6 * np.eye(2)), []
    for sample in range(landed - 60, landed + 1, 10):
        p_WL = caught.p_WL[sample]
        found = [[*camera.project(p_WL[np.newaxis])[0], 0.0, 5.0] for camera in true_cameras(scenario.cameras)]
        is_down = sample == landed
        belief = BallBelief(np.r_[p_WL, np.zeros(4)], landing=landing if is_down else None, is_down=is_down)
        looks.append(Look(caught.times[sample], np.array(found), np.zeros(6), belief))
    return recording, Sighting(tuple(looks))


def test_a_sighting_shows_the_ball_where_it_was_found_and_says_how_exact_it_is(sighting):
    recording, seen = sighting
    figure = draw_sighting(recording, seen)
    assert figure.get_suptitle() == "Observed landing: 1.00 mm off, standard deviation 2.00 mm in x and in y"
    *views, side = figure.axes
    for number, view in enumerate(views):
        (dots,) = view.lines
        image = view.images[0].get_array()
        assert image.shape == (120, 160, 3)
        np.testing.assert_allclose(dots.get_xydata() + 0.5, [look.detections[number, :2] for look in seen.looks])
        # The scene is as in the last picture before the ball was down: the ball is drawn around the dot of that picture.
        assert np.linalg.norm(middle_of(orange(image)) - dots.get_xydata()[-2]) < 1.5
    truth, path, _, cross = side.lines
    assert np.interp(path.get_xdata()[:-1], *truth.get_data()) == pytest.approx(path.get_ydata()[:-1], abs=1.0)
    assert cross.get_ydata() == [1000 * recording.scenario.cup.rim_height]


def test_a_ball_that_nobody_saw_land_has_no_cross(sighting):
    recording, seen = sighting
    figure = draw_sighting(recording, Sighting(seen.looks[:-1]))
    assert figure.get_suptitle() == "The ball was not seen to land"
    assert len(figure.axes[-1].lines) == 3
