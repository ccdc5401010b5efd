"""`wam-cast show`: the explorer served, and used in a browser."""

import json
import math
import os
import re
import shlex
import signal
import socket
import sys
import time

import psutil
import pytest

from wam_cast.visualization.interactive.explorer import Explorer
from wam_cast.visualization.viewer import FIELD_OF_VIEW


@pytest.fixture
def interrupted(monkeypatch):
    """Interrupt each explorer as soon as it runs; give those that did."""
    explorers = []

    def run(self):
        explorers.append(self)
        raise KeyboardInterrupt

    monkeypatch.setattr(Explorer, "run", run)
    monkeypatch.setattr(os, "_exit", sys.exit)  # not at once: this process has more to do
    return explorers


def listening_addresses():
    connections = psutil.Process().net_connections("tcp")
    return {connection.laddr for connection in connections if connection.status == psutil.CONN_LISTEN}


def test_show_prints_where_the_page_is_and_serves_this_machine_alone(cli, interrupted):
    before = listening_addresses()
    result = cli("show")
    assert (result.code, result.err) == (130, "interrupted\n")
    assert interrupted[0].url in result.out
    assert "Ctrl-C" in result.out
    assert {address.ip for address in listening_addresses() - before} <= {"127.0.0.1", "::1"}


def test_show_is_served_where_it_is_told_and_says_who_can_use_it(cli, interrupted):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    result = cli("show", "--port", port, "--host", "0.0.0.0")
    assert result.err == (
        "whoever reaches this machine can use the page; leave --host out to serve this machine alone\ninterrupted\n"
    )
    assert f"http://localhost:{port} " in result.out
    assert (port, "0.0.0.0") in {(address.port, address.ip) for address in listening_addresses()}
    taken = cli("show", "--port", port, "--host", "127.0.0.1")
    assert taken.code == 2
    assert f"no page can be served at 127.0.0.1, port {port}" in taken.err


@pytest.mark.parametrize(
    "words", [("--port", "80"), ("--port", "70000"), ("--host", ""), ("--host", "no.such.invalid")]
)
def test_where_no_page_can_be_is_refused_in_one_line(cli, words):
    result = cli("show", *words)
    assert (result.code, result.out) == (2, "")
    assert len(result.err.splitlines()) == 1
    assert result.err.startswith("error: ")


@pytest.mark.slow
@pytest.mark.usefixtures("no_physics", "scenarios")
def test_a_scenario_without_a_model_is_shown_with_the_commands_that_make_one(cli, interrupted):
    show = ("show", "--scenario", "heavy.yaml", "--json")
    assert cli(*show).code == 130
    assert interrupted[0].model is None
    commands = re.findall(r"`wam-cast (.*?)`", interrupted[0].advice)
    for command in commands:
        assert cli(*shlex.split(command.replace("--casts 1700", "--casts 60"))).code == 0
    assert cli(*show).code == 130
    assert interrupted[1].prediction is not None
    (model,) = re.findall(r"--out (\S+\.model)", commands[1])
    assert cli("show", "--model", model, "--json").code == 130
    assert interrupted[2].scenario == interrupted[1].scenario
    assert cli("show", "--model", model, "--scenario", "lively.yaml").code == 2


FEWER_FRAMES = "window.requestAnimationFrame = draw => setTimeout(() => draw(performance.now()), 400)"
"""A page is drawn in software, again and again; so often is enough."""


class Page:
    """The explorer's page in a browser, used as its reader does."""

    def __init__(self, browser, url):
        self.errors = []
        self._page = browser.new_page(viewport={"width": 640, "height": 480})
        self._page.add_init_script(FEWER_FRAMES)
        self._page.on("pageerror", lambda error: self.errors.append(error))
        self._page.goto(url)
        self.wait_for("cup at")
        self._page.locator(".close-button", has_text="Open Controls").click()

    def wait_for(self, words, seconds=120):
        """Wait until the caption has `words`, and return it."""
        caption = self._page.locator(".caption", has_text=words).last  # for a moment there is the one before too
        caption.wait_for(timeout=1000 * seconds)
        return caption.inner_text()

    def row(self, name):
        label = self._page.locator(".property-name").get_by_text(name, exact=True)
        return self._page.locator(".dg li.cr").filter(has=label)

    def drag(self, slider, start, end):
        """Drag a slider from one share of its width to another."""
        box = self.row(slider).locator(".slider").bounding_box()
        y = box["y"] + box["height"] / 2
        self._page.mouse.move(box["x"] + start * box["width"], y)
        self._page.mouse.down()
        for share in (start, (start + end) / 2, end):
            self._page.mouse.move(box["x"] + share * box["width"], y)
        self._page.mouse.up()

    def value(self, slider):
        return float(self.row(slider).locator("input").input_value())

    def press(self, button):
        self.row(button).click()

    def ask(self, script, path):
        """Return what `script`, a function of an object and its visibility, says of that at `path`; None if there is none."""
        return self._page.evaluate(
            """([script, path]) => {
                let node = viewer.scene_tree, visible = true;
                for (const name of path.split("/")) {
                    node = node.children[name];
                    if (!node) return null;
                    visible = visible && node.object.visible;
                }
                return eval(script)(node.object, visible);
            }""",
            [script, path],
        )

    def position(self, marker):
        """Return world (x, y) of a marker that can be seen."""
        return self.ask("(o, visible) => visible ? [o.position.x, o.position.y] : null", f"explorer/{marker}")

    def color(self, path):
        return self.ask("(o) => o.material.color.getHexString()", f"explorer/{path}/<object>")

    def ball(self):
        """Return world (x, y) of the ball."""
        return self.ask("(o) => [o.position.x, o.position.y]", "drake/visualizer/ball/ball")

    def shrink(self, width, height):
        """Give the page a window of another size; return the boxes of caption and controls, and the camera's field of view."""
        self._page.set_viewport_size({"width": width, "height": height})
        self._page.wait_for_function(f"Math.abs(viewer.camera.aspect - {width / height}) < 1e-2")
        self._page.evaluate("() => new Promise(d => requestAnimationFrame(() => requestAnimationFrame(() => d())))")
        boxes = [self._page.locator(name).last.bounding_box() for name in (".caption", ".dg.main > ul")]
        return *boxes, self._page.evaluate("viewer.camera.fov")

    def close(self):
        assert not self.errors
        self._page.close()


def url_of(process):
    text = ""
    while not text.endswith("}\n"):
        line = process.stdout.readline()
        assert line, process.stderr.read()
        text += line
    return json.loads(text)["url"]


def interrupt(process):
    os.killpg(process.pid, signal.SIGINT)
    out, err = process.communicate(timeout=20)
    assert (process.returncode, out, err) == (130, "", "interrupted\n")


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_explorer_in_browsers_that_come_and_go(browser, start):
    process = start("show", "--json")
    url = url_of(process)
    page, other = Page(browser, url), Page(browser, url)
    before = page.position("predicted")
    assert page.position("executed") is None

    page.drag("wait [s]", 0.5, 0.75)
    assert page.value("wait [s]") == pytest.approx(0.375, abs=0.02)
    page.drag("bearing [deg]", 0.5, 0.6)
    wait_until(lambda: abs(page.position("predicted")[1] - before[1]) > 0.1)
    wait_until(lambda: other.value("wait [s]") == page.value("wait [s]"))

    page.press("plan for the cup [P]")
    page.wait_for("Planned")
    assert page.value("bearing [deg]") == pytest.approx(0.0, abs=0.05)
    # On a phone nothing covers the controls, and the scene is seen between them and the caption, in all its width.
    caption, controls, field_of_view = other.shrink(380, 800)
    assert (caption["x"], controls["x"]) == (0, 0)
    assert (caption["width"], controls["width"]) == (380, 380)
    assert caption["y"] - (controls["y"] + controls["height"]) > 0.3 * 800
    assert math.tan(math.radians(field_of_view) / 2) * 380 / 800 == pytest.approx(math.tan(FIELD_OF_VIEW / 2), rel=1e-3)
    other.close()
    page.press("cast [C]")
    assert "miss 0." in page.wait_for("Caught")
    predicted, executed = page.position("predicted"), page.position("executed")
    assert executed == pytest.approx(predicted, abs=1e-3)
    assert page.color("predicted/rim") != page.color("executed/rim")
    colors = {page.color(f"path/{stage}") for stage in ("move", "wait", "drop")}
    assert len(colors) == 3
    assert None not in colors
    # The replay shows the path, and ends with the ball in the cup.
    wait_until(lambda: page.ask("(o, visible) => visible", "explorer/path/drop"))
    wait_until(lambda: math.dist(page.ball(), executed) < 0.02)

    # A slider amid the simulation, or the replay: what is cast gives way to it.
    page.press("cast [C]")
    time.sleep(0.5)
    page.drag("distance [m]", 0.5, 0.9)
    page.wait_for(", miss")
    time.sleep(3)  # as long as the replay would last
    assert page.ball() == pytest.approx([0.2, 0.0], abs=0.005)

    # It outlives all its browsers.
    page.close()
    assert process.poll() is None
    page = Page(browser, url)
    page.press("cast [C]")
    time.sleep(0.5)
    interrupt(process)
    page.close()


def wait_until(condition, seconds=60):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.1)
