"""What notebooks embed shows in a browser without a network, and a Meshcat that cannot be opened is no error."""

import gc
import html
import re
import socket
import subprocess
import sys
from base64 import b64decode
from io import BytesIO

import matplotlib.image
import matplotlib.pyplot as plt
import pytest
from IPython.core.formatters import DisplayFormatter
from ipywidgets import IntSlider

from wam_cast.errors import InputError
from wam_cast.visualization import notebook, replay
from wam_cast.visualization.notebook import EmbeddedPage, embed, explore, open_viewer, show_replay
from wam_cast.visualization.viewer import open_meshcat


def test_embedded_page_is_the_page_whatever_is_in_it():
    page = '<p class="a" title=\'b\'>1 < 2 & "3"</p><script>if (1 && 2) {}</script></iframe>'
    shown = EmbeddedPage(page, 300)._repr_html_()
    (inside,) = re.findall(r'srcdoc="([^"]*)"', shown)
    assert html.unescape(inside) == page
    assert 'height="300"' in shown


def test_pictures_follow_their_sliders_and_are_closed():
    drawn = []

    def draw(width, height):
        drawn.append((width, height))
        return plt.figure(figsize=(width, height), dpi=100)

    width, height = IntSlider(3), IntSlider(2)
    shown = explore(draw, width=width, height=height)
    width.value = 5
    assert drawn == [(3, 2), (5, 2)]
    assert matplotlib.image.imread(BytesIO(shown.picture.value)).shape == (200, 500, 4)
    assert shown.sliders == (width, height)
    assert plt.get_fignums() == []


def test_sliders_without_a_kernel_leave_the_picture_as_they_last_made_it():
    size = IntSlider(2)
    shown = explore(lambda size: plt.figure(figsize=(size, size), dpi=100), size=size)
    size.value = 3
    bundle = DisplayFormatter().format(shown)[0]
    assert "application/vnd.jupyter.widget-view+json" in bundle
    picture = matplotlib.image.imread(BytesIO(b64decode(bundle["image/png"])))
    assert picture.shape == (300, 300, 4)


def test_viewer_says_where_it_is(capsys):
    meshcat = open_viewer()
    assert meshcat.web_url() in capsys.readouterr().out


def test_without_a_port_there_is_no_viewer_but_a_sentence(monkeypatch, capsys):
    def fail():
        raise InputError("no page can be served")

    monkeypatch.setattr(notebook, "open_meshcat", fail)
    assert open_viewer() is None
    printed = capsys.readouterr()
    assert "No port could be opened" in printed.out
    assert printed.err == ""


def test_embedded_meshcat_fetches_nothing():
    meshcat = notebook.open_meshcat()
    page = embed(meshcat).page
    assert page.startswith("<!DOCTYPE html>")
    assert not re.search(r"""(src|srcset)\s*=\s*["'](https?:)?//""", page)


def test_replay_leaves_no_meshcat_for_the_garbage_collector(landed, monkeypatch):
    ports = []

    def noticed():
        meshcat = open_meshcat()
        ports.append(meshcat.port())
        return meshcat

    monkeypatch.setattr(replay, "open_meshcat", noticed)
    gc.disable()
    try:
        show_replay(landed)
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("localhost", *ports), timeout=5)
    finally:
        gc.enable()


FORGOTTEN = """
import gc, threading
gc.disable()
import wam_cast as wc
from wam_cast.visualization.interactive.explorer import Explorer
from wam_cast.visualization.interactive.joint_sliders import JointSliders
from wam_cast.visualization.notebook import open_viewer
JointSliders(open_viewer(), wc.Scenario())
Explorer()
collector = threading.Thread(target=gc.collect)
collector.start()
collector.join()
print("alive")
"""


@pytest.mark.slow
def test_what_a_notebook_forgets_may_be_collected_in_another_thread():
    found = subprocess.run([sys.executable, "-c", FORGOTTEN], capture_output=True, text=True, check=False)
    assert found.stdout.splitlines()[-1:] == ["alive"], found.stderr


@pytest.mark.slow
def test_replay_plays_inside_a_page_without_a_network(browser, landed, tmp_path):
    path = tmp_path / "notebook.html"
    path.write_text(f"<!DOCTYPE html><body>{show_replay(landed, height=300)._repr_html_()}</body>")
    context = browser.new_context(offline=True, viewport={"width": 500, "height": 330})
    page, errors = context.new_page(), []
    page.on("pageerror", lambda error: errors.append(error))
    page.goto(path.as_uri(), timeout=60_000)
    frame = page.frames[1]
    frame.wait_for_selector("canvas", timeout=60_000)
    frame.wait_for_function(VISIBLE_PATHS + " > 0", timeout=60_000)
    context.close()
    assert errors == []


VISIBLE_PATHS = """
Array.from(viewer.scene_tree.find(["paths", "ball"]).object.children).filter(piece => piece.visible).length
""".strip()
"""How much of the ball's path is shown; at the start nothing is."""
