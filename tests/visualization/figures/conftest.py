"""What the tests of figures share: axes in the style, and what every figure must keep."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

from wam_cast.visualization.style import figure_style

SMALLEST_TEXT = 7.0
"""In a figure that is printed as large as it was made [pt]."""


@pytest.fixture
def axes():
    """Return axes of a figure in the style, half as wide as a page."""
    with figure_style():
        yield Figure(figsize=(3.2, 2.8)).subplots()


@pytest.fixture(scope="session")
def texts_of():
    """Return a function that draws a figure and returns its visible texts and their boxes [pixels]."""

    def texts(figure):
        figure.draw_without_rendering()
        shown = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
        ticks = {id(label) for axes in figure.axes for label in hidden_tick_labels(axes)}
        shown = [text for text in shown if id(text) not in ticks]
        return [(text, text.get_window_extent()) for text in shown]

    return texts


def hidden_tick_labels(axes):
    """Return the tick labels that belong to no tick in view, or to axes that are turned off."""
    for axis in (axes.xaxis, axes.yaxis):
        low, high = sorted(axis.get_view_interval())
        margin = 1e-9 * (high - low)
        for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
            if not (axes.axison and low - margin <= tick.get_loc() <= high + margin):
                yield from (tick.label1, tick.label2)


@pytest.fixture(scope="session")
def assert_reads_well(texts_of):
    """Return a function that checks that a figure's texts are large enough and on the canvas, and its axes have units."""

    def check(figure):
        width, height = figure.canvas.get_width_height()
        texts = texts_of(figure)
        for text, box in texts:
            assert text.get_fontsize() >= SMALLEST_TEXT, text
            assert box.x0 > -1, f"{text} is cut off"
            assert box.y0 > -1, f"{text} is cut off"
            assert box.x1 < width + 1, f"{text} is cut off"
            assert box.y1 < height + 1, f"{text} is cut off"
        for axes in figure.axes:
            labels = [axes.get_xlabel(), axes.get_ylabel()] if axes.axison else []
            for label in filter(None, labels):
                assert "[" in label, f"{label} has no unit"
                assert label.endswith("]"), f"{label} has no unit"

    return check


@pytest.fixture(scope="session")
def assert_apart(texts_of):
    """Return a function that checks that no two texts of a figure overlap."""

    def check(figure):
        texts = texts_of(figure)
        for number, (one, box) in enumerate(texts):
            for other, other_box in texts[number + 1 :]:
                assert not box.overlaps(other_box), f"{one} lies on {other}"

    return check


@pytest.fixture(scope="session")
def legend_of():
    """Return a function that returns the texts of the legend of some axes."""

    def labels(axes):
        legend = axes.get_legend()
        return [] if legend is None else [text.get_text() for text in legend.get_texts()]

    return labels


@pytest.fixture(scope="session")
def assert_hides_nothing():
    """Return a function that checks that the legend of some axes is beside them."""

    def check(axes):
        axes.figure.figure.draw_without_rendering()
        assert not axes.get_legend().get_window_extent().padded(-1).overlaps(axes.get_window_extent())

    return check


@pytest.fixture(scope="session")
def line_of():
    """Return a function that returns what is drawn under a label, shape (n, 2)."""

    def data(axes, label):
        (line,) = [line for line in axes.lines if line.get_label() == label]
        return np.asarray(line.get_xydata())

    return data
