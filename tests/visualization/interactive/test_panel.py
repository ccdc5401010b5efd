"""Panel: what a page's readers do is told in SI units; what the program shows is not."""

import msgpack
import pytest

from wam_cast.visualization.interactive.panel import Panel, Slider
from wam_cast.visualization.viewer import open_meshcat


@pytest.fixture
def meshcat():
    return open_meshcat()


@pytest.fixture
def panel(meshcat):
    sliders = {"wait": Slider("wait [s]", 0.0, 0.5, 0.001), "turn": Slider("turn [deg]", -90, 90, 0.1, 100.0)}
    return Panel(meshcat, sliders, {"go": "KeyG", "stop": "KeyS"})


@pytest.fixture
def browse(meshcat):
    """Return a function that sends what a browser sends."""

    def send(**message):
        meshcat._InjectWebsocketMessage(message=msgpack.packb(message))

    return send


def test_moved_sliders_are_told_once_in_si_units(panel, browse):
    assert panel.moved() == {}
    browse(type="slider", name="turn [deg]", value=30.0)
    assert panel.moved() == {"turn": pytest.approx(0.3)}
    assert panel.moved() == {}


def test_what_is_shown_was_not_moved_even_if_it_comes_back_rounded(meshcat, panel, browse):
    panel.show({"wait": 0.12345, "turn": 0.5})
    assert meshcat.GetSliderValue("wait [s]") == pytest.approx(0.123)
    assert meshcat.GetSliderValue("turn [deg]") == pytest.approx(50)
    assert panel.moved() == {}
    browse(type="slider", name="wait [s]", value=0.1230000001)
    assert panel.moved() == {}
    browse(type="slider", name="wait [s]", value=0.124)
    assert panel.moved() == {"wait": pytest.approx(0.124)}


def test_what_does_not_fit_on_a_slider_is_shown_at_its_end_and_was_not_moved(meshcat, panel):
    panel.show({"wait": 2.0})
    assert meshcat.GetSliderValue("wait [s]") == 0.5
    assert panel.moved() == {}


def test_a_button_that_was_pressed_several_times_counts_once(panel, browse):
    assert panel.pressed() == []
    for _ in range(3):
        browse(type="button", name="stop")
    assert panel.pressed() == ["stop"]
    assert panel.pressed() == []


def test_there_is_one_caption_and_nothing_in_it_ends_the_string_that_holds_it(meshcat, panel):
    own = set(meshcat.GetButtonNames())
    for text in ("first", "it's C:\\users\nand more", "it's C:\\users\nand more", "last"):
        panel.caption = text
        assert panel.caption == text
        (name,) = set(meshcat.GetButtonNames()) - own
        assert not set("'\\\n") & set(name)
    assert "last" in name
    assert panel.pressed() == []
