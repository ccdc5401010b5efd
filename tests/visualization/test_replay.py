"""The replay is one page that needs no network, and its animation is the recording."""

import base64
import io
import itertools
import json
import math
import re

import matplotlib.image
import msgpack
import numpy as np
import pytest

from wam_cast.errors import InputError
from wam_cast.motion.stages import Stage
from wam_cast.visualization.recorded import describe_all, frame_moments, holds_ball
from wam_cast.visualization.replay import FRAME_RATE, REST_AT_END, TOLERANCE, key_frames, replay_page, write_replay
from wam_cast.visualization.viewer import N_SIDES, RING_SPACING, ring_points, tube


def read_animation(page):
    """Return {path: {property: (times, values)}} of the page's one animation, the times in frames."""
    packed = (base64.b64decode(text) for text in re.findall(r"base64,([A-Za-z0-9+/=]+)", page))
    (message,) = (data for data in packed if b"set_animation" in data[:40])
    animation = msgpack.unpackb(message)
    tracks = {}
    for part in animation["animations"]:
        assert part["clip"]["fps"] == FRAME_RATE
        tracks[part["path"]] = {
            track["name"]: ([key["time"] for key in track["keys"]], [key["value"] for key in track["keys"]])
            for track in part["clip"]["tracks"]
        }
    return animation["options"], tracks


@pytest.fixture(scope="module")
def replay(caught, tmp_path_factory):
    path = tmp_path_factory.mktemp("replay") / "cast.html"
    write_replay(caught, path)
    return path


@pytest.fixture(scope="module")
def page(replay):
    return replay.read_text(encoding="utf-8")


def test_page_is_small_and_fetches_nothing(page):
    assert len(page.encode()) < 3e6
    assert not re.search(r"""(src|srcset)\s*=\s*["'](https?:)?//""", page)
    assert not re.search(r"<link\b|@import\b", page)
    assert not re.search(r"""(fetch|import|importScripts|WebSocket)\(\s*["'`](https?|wss?):""", page)


def test_animation_repeats_and_all_of_it_ends_together(page, caught):
    options, tracks = read_animation(page)
    assert options["play"] is True
    assert options["repetitions"] > 1000
    end = math.ceil(caught.times[-1] * FRAME_RATE - 1e-6) + round(REST_AT_END * FRAME_RATE)
    last = {times[-1] for properties in tracks.values() for times, _ in properties.values()}
    assert last == {end}


def frame_values(track, n_frames):
    """Return the value in each frame, shape (n_frames, m), of a track that moves straight from one stored frame to the next."""
    times, values = track
    return np.column_stack([np.interp(np.arange(n_frames), times, column) for column in np.transpose(values)])


def only(tracks, ending):
    (properties,) = (properties for path, properties in tracks.items() if path.endswith(ending))
    return properties


def test_animation_has_the_recorded_ball_in_every_frame_and_stores_few(page, caught):
    _, tracks = read_animation(page)
    samples = [sample for _, sample in frame_moments([caught], FRAME_RATE)]
    shown = frame_values(only(tracks, "/ball/ball")[".position"], len(samples))
    error = np.linalg.norm(shown - caught.p_WL[samples], axis=1)
    assert error.max() <= TOLERANCE + 1e-6
    assert len(only(tracks, "/ball/ball")[".position"][0]) < len(samples) / 4


def cup_heights(page, n_frames):
    _, tracks = read_animation(page)
    return [frame_values(only(tracks, name)[".position"], n_frames)[:, 2] for name in ("/cup/cup", "/lit_cup/lit_cup")]


def test_cup_is_lit_while_it_holds_the_ball(page, caught):
    samples = [sample for _, sample in frame_moments([caught], FRAME_RATE)]
    dark, lit = cup_heights(page, len(samples))
    holds = holds_ball(caught)[samples]
    height = caught.scenario.cup.rim_height
    assert 0.1 < holds.mean() < 0.9
    np.testing.assert_allclose(lit[holds], height)
    np.testing.assert_allclose(dark[~holds], height)
    assert max(lit[~holds].max(), dark[holds].max()) < -0.5


def test_cup_of_a_miss_is_never_lit(missed):
    n_frames = len(frame_moments([missed], FRAME_RATE))
    dark, lit = cup_heights(replay_page(missed), n_frames)
    assert lit.max() < -0.5
    np.testing.assert_allclose(dark, missed.scenario.cup.rim_height)


def test_paths_come_with_their_stage_and_go_with_the_next_cast(caught):
    page = replay_page([caught, caught])
    _, tracks = read_animation(page)
    end = round(caught.times[-1] * FRAME_RATE)
    growth = json.loads(re.search(r"growth = (.*?);\n", page).group(1))
    assert {f"/{path}" for path in growth} == {path for path in tracks if path.startswith("/paths/")}
    starts = {stage: int(np.argmax(caught.stages == stage)) for stage in Stage}
    for path, frames in growth.items():
        _, point, name = path.split("/")
        number, stage = name.split("_")
        first = starts[Stage[stage.upper()]] * caught.times[1] * FRAME_RATE + int(number) * end
        assert frames[0] == pytest.approx(first, abs=1 + int(number))
        assert frames == sorted(frames)
        times, shown = tracks[f"/{path}"][".visible"]
        at = dict(zip(times, shown, strict=True))
        assert at[frames[0]] is True
        assert at[times[-1]] is (number == "1")
        if number == "0":
            assert at[end + 1] is False
    for point in ("ball", "hand"):
        assert {f"paths/{point}/0_{stage}" for stage in ("move", "drop", "return")} <= set(growth)


def test_page_says_what_became_of_the_cast(page, caught):
    headline = f"Cup at ({caught.cup[0]:.3f}, {caught.cup[1]:.3f}) m, caught, miss {1000 * caught.outcome.miss:.1f} mm"
    assert f"<title>{headline}</title>" in page
    assert page.count(headline) == 2
    for stage in ("move", "wait", "drop", "hold", "return"):
        assert f'data-stage="{stage}"' in page


def test_key_frames_leave_out_what_straight_lines_show():
    time = np.linspace(0, 1, 201)
    positions = np.zeros((201, 2, 3))
    positions[:, 0, 0] = 3 * time
    assert key_frames(positions, 1e-9) == [0, 200]
    positions[:, 1, 2] = np.where(time < 0.5, 0.0, 1.0)
    assert key_frames(positions, 1e-9) == [0, 99, 100, 200]
    positions[:, 1, 2] = np.sin(6 * time)
    kept = key_frames(positions, 1e-3)
    assert 10 < len(kept) < 80
    shown = np.interp(np.arange(201), kept, positions[kept, 1, 2])
    assert 1e-4 < np.max(np.abs(shown - positions[:, 1, 2])) <= 1e-3


def test_rings_are_evenly_spaced_along_the_path_and_reach_its_ends():
    x = np.linspace(0, 1, 2000) ** 3
    rings = ring_points(np.column_stack([x, 0 * x, 0 * x]))
    assert (rings[0], rings[-1]) == (0, 1999)
    np.testing.assert_allclose(np.diff(x[rings])[:-1], RING_SPACING, atol=0.002)


def test_tube_keeps_its_distance_from_the_path():
    angles = np.linspace(0, 1, 20)
    path = np.column_stack([np.cos(angles), np.sin(angles), 0.3 * angles])
    vertices, triangles = tube(path, 0.002)
    distances = np.linalg.norm(vertices.T.reshape(len(path), -1, 3) - path[:, None], axis=2)
    np.testing.assert_allclose(distances, 0.002)
    assert sorted(set(triangles.ravel())) == list(range(vertices.shape[1]))
    # The first of them make the tube up to a point of the path, and nothing beyond it.
    part = triangles[:, : 2 * N_SIDES * 7]
    assert sorted(set(part.ravel())) == list(range(8 * N_SIDES))


def test_replay_of_a_miss_without_a_cup_replaces_what_was_there_and_prints_nothing(landed, tmp_path, capfd):
    path = tmp_path / "cast.html"
    for content in ("old", None):
        if content:
            path.write_text(content)
        write_replay(landed, path)
        assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert [file.name for file in tmp_path.iterdir()] == ["cast.html"]
    printed = capfd.readouterr()
    assert printed.out == ""
    assert "listening" not in printed.err


def test_each_recording_has_its_predicted_landing(landed):
    with pytest.raises(InputError, match=r"predicted_landings: 2 for 1 recordings"):
        replay_page(landed, np.array([0.75, 0.0]))


@pytest.mark.parametrize("speed", [0, -1, 11, float("nan"), "fast"])
def test_a_speed_that_no_replay_has_is_refused(landed, speed):
    with pytest.raises(InputError, match=r"speed = .* must be from 0.05 to 10"):
        replay_page(landed, speed=speed)


def test_page_offers_speeds_and_begins_with_the_one_that_was_asked_for(landed):
    for speed, offered in ((1.0, ["0.1", "0.25", "0.5", "1", "2"]), (0.3, ["0.1", "0.25", "0.3", "0.5", "1", "2"])):
        options = re.findall(r'<option value="([\d.]+)"( selected)?>', replay_page(landed, speed=speed))
        assert [value for value, _ in options] == offered
        assert [value for value, is_chosen in options if is_chosen] == [f"{speed:g}"]


def test_unwritable_path_is_one_line_and_leaves_nothing(landed, tmp_path):
    (tmp_path / "file").write_text("kept")
    (tmp_path / "folder.html").mkdir()
    for path in (tmp_path / "missing" / "a.html", tmp_path / "file" / "a.html", tmp_path / "folder.html"):
        with pytest.raises(InputError, match="cannot write") as raised:
            write_replay(landed, path)
        assert str(path) in str(raised.value)
        assert "\n" not in str(raised.value)
    assert sorted(file.name for file in tmp_path.rglob("*")) == ["file", "folder.html"]


FEWER_FRAMES = "window.requestAnimationFrame = draw => setTimeout(() => draw(performance.now()), 200)"
"""A page is drawn in software, again and again; so often is enough."""


class Player:
    """The replay of a file in a browser without a network."""

    def __init__(self, browser, file, size=(640, 400)):
        width, height = size
        self.context = browser.new_context(offline=True, viewport={"width": width, "height": height})
        self.context.add_init_script(FEWER_FRAMES)
        self.page = self.context.new_page()
        self.page.set_default_timeout(30_000)
        self.requests, self.complaints = [], []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.goto(file.as_uri())
        self.page.wait_for_function("Number(document.querySelector('#player [type=range]').max) > 1")

    def wind(self, time):
        """Move the slider to `time` and wait until it is shown."""
        slider = self.page.locator("#player [type=range]")
        slider.evaluate("(it, time) => { it.value = time; it.dispatchEvent(new Event('input')) }", time)
        # Two frames on, the scene has been drawn.
        self.page.evaluate("() => new Promise(d => requestAnimationFrame(() => requestAnimationFrame(() => d())))")

    def resize(self, width, height):
        """Give it a window of another size and wait until all is in its new place."""
        self.page.set_viewport_size({"width": width, "height": height})
        self.page.wait_for_function(
            """() => { const box = document.querySelector("#meshcat-pane").getBoundingClientRect();
                       return Math.abs(viewer.camera.aspect - box.width / box.height) < 1e-2 }"""
        )

    def text(self, selector):
        return self.page.locator(selector).inner_text()

    def time(self):
        return float(self.page.locator("#player [type=range]").input_value())

    def picture(self):
        png = self.page.locator("#meshcat-pane").screenshot(timeout=60_000)
        return matplotlib.image.imread(io.BytesIO(png))[:, :, :3]


@pytest.fixture(scope="module")
def player(browser, replay):
    it = Player(browser, replay)
    yield it
    it.context.close()


def where(mask):
    rows, columns = np.nonzero(mask)
    return np.array([columns.mean(), rows.mean()])


def ball_in(picture):
    red, green, blue = np.moveaxis(picture, -1, 0)
    return (red > 0.45) & (red > 1.9 * green) & (red > 3 * blue)


def gold_in(picture):
    red, green, blue = np.moveaxis(picture, -1, 0)
    return (red > 0.5) & (green > 0.6 * red) & (blue < 0.6 * red)


def blue_in(picture):
    red, _, blue = np.moveaxis(picture, -1, 0)
    return (blue > 1.2 * red) & (blue > 0.4)


@pytest.mark.slow
def test_browser_plays_it_without_a_network_and_without_complaint(player, replay):
    player.page.reload()
    player.page.wait_for_function("Number(document.querySelector('#player [type=range]').value) > 0.2")
    assert player.text("#player button") == "Pause"
    player.page.locator("#player button").click()
    player.page.wait_for_function("document.querySelector('#player button').textContent == 'Play'")
    stopped = player.time()
    player.page.wait_for_timeout(300)
    assert player.time() == stopped
    player.page.locator("#player button").click()
    player.page.wait_for_function(f"Number(document.querySelector('#player [type=range]').value) > {stopped} + 0.2")
    assert {url for url in player.requests if not url.startswith("data:")} == {replay.as_uri()}
    assert player.complaints == []


@pytest.mark.slow
def test_browser_names_the_stage_and_its_time(player, caught):
    for stage in (Stage.MOVE, Stage.WAIT, Stage.DROP, Stage.HOLD, Stage.RETURN):
        inside = np.flatnonzero(caught.stages == stage)
        time = round(float(caught.times[inside[len(inside) // 2]]), 2)
        player.wind(time)
        assert player.text("#caption .now") == stage.name.lower()
        assert player.text("#player output") == f"{stage.name.lower()} {time:.2f} s"


@pytest.mark.slow
def test_browser_marks_the_cast_that_runs_among_several(browser, caught, missed, tmp_path):
    path = tmp_path / "casts.html"
    write_replay([caught, missed], path)
    player = Player(browser, path)
    _, *lines = describe_all([caught, missed], [None, None])
    first_end = float(caught.times[-1])
    shown = []
    for time in (0.5, first_end - 0.1, first_end + 0.1, first_end + missed.times[-1], 0.5):
        player.wind(round(float(time), 2))
        bold = player.page.evaluate(
            """() => [...document.querySelectorAll("#caption .detail")]
                .filter(line => Number(getComputedStyle(line).fontWeight) > 500).map(line => line.textContent)"""
        )
        place = player.page.evaluate("[viewer.camera.position.x, viewer.camera.position.z]")
        shown.append((bold, math.atan2(-place[1], place[0])))
    player.context.close()
    assert [bold for bold, _ in shown] == [[lines[number]] for number in (0, 0, 1, 1, 0)]
    # The camera goes with the cast, about the base axis.
    angles = [angle for _, angle in shown]
    assert angles[0] == pytest.approx(angles[1]) == pytest.approx(angles[4])
    assert angles[3] - angles[0] == pytest.approx(missed.cast.bearing, abs=1e-3)


@pytest.mark.slow
def test_browser_shows_arm_moving_ball_and_a_cup_that_is_lit_when_the_ball_is_in(player, caught):
    player.wind(0.0)
    before = player.picture()
    light = before.sum(axis=2)
    assert np.mean(light < 0.6) > 0.005, "the arm's dark parts"
    assert np.mean(light > 2.4) > 0.3, "background and floor"
    assert ball_in(before).sum() > 20
    assert blue_in(before).sum() > 50
    assert gold_in(before).sum() < 10  # pixels in which ball and string mix
    player.wind(float(caught.times[np.argmax(caught.stages == Stage.DROP)]))
    assert np.linalg.norm(where(ball_in(player.picture())) - where(ball_in(before))) > 20, "the ball moves"
    player.wind(float(caught.times[np.argmax(caught.stages == Stage.RETURN)]))
    held, cup = player.picture(), blue_in(before)
    assert gold_in(held)[cup].mean() > 0.5
    assert blue_in(held)[cup].mean() < 0.1


@pytest.mark.slow
def test_browser_plays_the_cast_and_leaves_turn_and_return_out_until_it_is_asked_for_them(player, caught):
    hold_end = float(caught.times[np.argmax(caught.stages == Stage.RETURN)])
    page, value = player.page, "Number(document.querySelector('#player [type=range]').value)"
    page.reload()
    page.wait_for_function(f"{value} > 0.1")
    page.keyboard.press("Space")
    page.wait_for_function("document.querySelector('#player button').textContent == 'Play'")
    player.wind(hold_end - 0.2)
    page.keyboard.press("Space")
    page.wait_for_function(f"{value} < 0.5")  # it begins anew
    page.locator("#player [type=checkbox]").check()
    player.wind(hold_end - 0.2)
    page.locator("#player select").select_option("0.25")
    page.locator("#player button").click()
    page.wait_for_function(f"{value} > {hold_end + 0.1}")
    assert page.evaluate("viewer.animator.mixer.timeScale") == 0.25
    page.locator("#player [type=checkbox]").uncheck()
    player.wind(hold_end + 0.2)  # who winds into it sees it
    page.locator("#player button").click()
    page.wait_for_function(f"{value} > {hold_end + 0.3}")
    page.locator("#player select").select_option("1")
    page.keyboard.press("Escape")


@pytest.mark.slow
def test_browser_draws_the_paths_up_to_the_ball(player, caught):
    reached = []
    for time in (0.3, 1.0, 9.0):
        player.wind(time)
        reached.append(
            player.page.evaluate(
                """() => ["move", "wait", "drop", "return"].map(stage => {
                    const tube = viewer.scene_tree.find(["paths", "ball", "0_" + stage, "<object>"]).object;
                    return tube.geometry.drawRange.count / tube.geometry.index.count })"""
            )
        )
    early, middle, late = reached
    assert 0 < early[0] < 1
    assert early[1:] == [0, 0, 0]
    assert middle[:2] == [1, 1]
    assert late[:3] == [1, 1, 1]
    assert 0.3 < late[3] < 1


@pytest.mark.slow
def test_caption_arm_and_player_have_places_of_their_own_in_windows_of_any_shape(player):
    player.resize(844, 390)
    player.page.reload()
    player.page.wait_for_function("Number(document.querySelector('#player [type=range]').max) > 1")
    check_places(player, 844, 390)
    for size in ((1280, 720), (390, 844), (300, 844), (640, 400)):
        player.resize(*size)
        check_places(player, *size)


def check_places(player, width, height):
    boxes = [player.page.locator(name).bounding_box() for name in ("#caption", "#meshcat-pane", "#player")]
    player.wind(0.0)
    picture = player.picture()
    assert boxes[0]["y"] == 0
    assert [box["width"] for box in boxes] == [width] * 3
    for upper, lower in itertools.pairwise(boxes):
        assert upper["y"] + upper["height"] == pytest.approx(lower["y"], abs=1)
    assert boxes[2]["y"] + boxes[2]["height"] == pytest.approx(height, abs=1)
    assert boxes[1]["height"] > 0.6 * height
    # Nothing but background and floor at the edges: arm and cup are in sight, and as large as fits.
    assert blue_in(picture).sum() > 50
    seen = (picture.sum(axis=2) < 0.9) | ball_in(picture) | blue_in(picture)
    for edge in (seen[:2], seen[:, :2], seen[:, -2:]):
        assert not np.any(edge)
    rows, columns = np.nonzero(seen)
    assert max(np.ptp(rows) / picture.shape[0], np.ptp(columns) / picture.shape[1]) > 0.75
