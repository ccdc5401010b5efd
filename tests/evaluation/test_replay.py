"""The replay is one page that needs no network, and its animation is the recording."""

import base64
import math
import re
import shutil
import struct
import subprocess

import matplotlib.image
import numpy as np
import pytest

from wam_cast.errors import InputError
from wam_cast.evaluation.replay import FRAME_RATE, REST_AT_END, frame_samples, write_replay
from wam_cast.evaluation.viewer import tube

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


class MessagePack:
    """Reads what Meshcat writes: enough of https://msgpack.org for that."""

    def __init__(self, data):
        self._data, self._at = data, 0

    def _take(self, layout):
        (value,) = struct.unpack_from(">" + layout, self._data, self._at)
        self._at += struct.calcsize(layout)
        return value

    def _items(self, n):
        return [self.read() for _ in range(n)]

    def _map(self, n):
        return {self.read(): self.read() for _ in range(n)}

    def read(self):
        code = self._take("B")
        if code < 0x80:
            return code
        if code < 0x90:
            return self._map(code & 0x0F)
        if code < 0xA0:
            return self._items(code & 0x0F)
        if code < 0xC0:
            return self._take(f"{code & 0x1F}s").decode()
        if code >= 0xE0:
            return code - 0x100
        if code in (0xC0, 0xC2, 0xC3):
            return {0xC0: None, 0xC2: False, 0xC3: True}[code]
        if code in SIZED:
            kind, layout = SIZED[code]
            n = self._take(layout)
            return {"map": self._map, "list": self._items}[kind](n) if kind != "text" else self._take(f"{n}s")
        if code in NUMBERS:
            return self._take(NUMBERS[code])
        raise ValueError(f"unexpected code {code:#x}")


SIZED = {0xD9: ("text", "B"), 0xDA: ("text", "H"), 0xDB: ("text", "I")}
SIZED |= {0xDC: ("list", "H"), 0xDD: ("list", "I"), 0xDE: ("map", "H"), 0xDF: ("map", "I")}
NUMBERS = dict(zip((0xCA, 0xCB, *range(0xCC, 0xD4)), "fdBHIQbhiq", strict=True))


def read_animation(page):
    """Return {path: {property: (times, values)}} of the page's one animation, the times in frames."""
    packed = (base64.b64decode(text) for text in re.findall(r"base64,([A-Za-z0-9+/=]+)", page))
    (message,) = (data for data in packed if b"set_animation" in data[:40])
    animation = MessagePack(message).read()
    tracks = {}
    for part in animation["animations"]:
        assert part["clip"]["fps"] == FRAME_RATE
        path = part["path"].decode() if isinstance(part["path"], bytes) else part["path"]
        tracks[path] = {
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
    assert len(page.encode()) < 5e6
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


def test_animation_has_the_recorded_ball_in_every_frame(page, caught):
    _, tracks = read_animation(page)
    (ball,) = (properties for path, properties in tracks.items() if path.endswith("/ball/ball"))
    times, positions = ball[".position"]
    samples = frame_samples(caught.times)
    assert times[:-1] == list(range(len(samples)))
    np.testing.assert_allclose(positions[:-1], caught.p_WL[samples], atol=1e-6)


def test_paths_grow_with_the_frames_and_name_every_stage_that_moves(page):
    _, tracks = read_animation(page)
    pieces = {
        path: properties[".visible"] for path, properties in tracks.items() if path.startswith("/paths/")
    }
    for path, (times, values) in pieces.items():
        assert values == [False, True, True]
        assert times[1] == int(path.split("/")[-1].split("_")[0])
    for name in ("ball", "hand"):
        stages = {path.rpartition("_")[2] for path in pieces if path.startswith(f"/paths/{name}/")}
        assert {"move", "drop", "return"} <= stages


def test_page_says_what_became_of_the_cast(page, caught):
    headline = f"Cup at ({caught.cup[0]:.3f}, {caught.cup[1]:.3f}) m, caught, miss {1000 * caught.outcome.miss:.1f} mm"
    assert f"<title>{headline}</title>" in page
    assert page.count(headline) == 2


def test_frames_show_the_nearest_samples():
    times = np.arange(0, 1.0001, 0.002)
    samples = frame_samples(times)
    assert len(samples) == FRAME_RATE + 1
    assert np.max(np.abs(times[samples] - np.arange(FRAME_RATE + 1) / FRAME_RATE)) <= 0.001 + 1e-9
    assert samples[-1] == len(times) - 1


def test_tube_keeps_its_distance_from_the_path():
    angles = np.linspace(0, 1, 20)
    path = np.column_stack([np.cos(angles), np.sin(angles), 0.3 * angles])
    vertices, triangles = tube(path, 0.002)
    distances = np.linalg.norm(vertices.T.reshape(len(path), -1, 3) - path[:, None], axis=2)
    np.testing.assert_allclose(distances, 0.002)
    assert sorted(set(triangles.ravel())) == list(range(vertices.shape[1]))


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


def test_unwritable_path_is_one_line_and_leaves_nothing(landed, tmp_path):
    (tmp_path / "file").write_text("kept")
    (tmp_path / "folder.html").mkdir()
    for path in (tmp_path / "missing" / "a.html", tmp_path / "file" / "a.html", tmp_path / "folder.html"):
        with pytest.raises(InputError, match="cannot write") as raised:
            write_replay(landed, path)
        assert str(path) in str(raised.value)
        assert "\n" not in str(raised.value)
    assert sorted(file.name for file in tmp_path.rglob("*")) == ["file", "folder.html"]


@pytest.mark.skipif(BROWSER is None, reason="no Chromium or Chrome on the PATH to open the page in")
def test_browser_shows_arm_ball_and_cup(replay, tmp_path):
    picture = tmp_path / "page.png"
    options = [
        "--headless",
        "--no-sandbox",
        "--use-gl=angle",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--virtual-time-budget=9000",  # the ball is out of the cup, on its way back
        "--window-size=640,400",
        f"--user-data-dir={tmp_path / 'profile'}",
        f"--screenshot={picture}",
    ]
    subprocess.run([BROWSER, *options, replay.as_uri()], check=True, capture_output=True, timeout=60)
    red, green, blue = np.moveaxis(matplotlib.image.imread(picture)[:, :, :3], -1, 0)
    light = red + green + blue
    assert np.mean(light < 0.6) > 0.005, "the arm's dark parts"
    assert np.mean(light > 2.4) > 0.3, "background and floor"
    assert np.sum((red > 0.5) & (red > 1.8 * green) & (red > 3 * blue)) > 20, "the ball"
    assert np.sum((blue > 1.2 * red) & (blue > 0.4)) > 50, "the cup"
