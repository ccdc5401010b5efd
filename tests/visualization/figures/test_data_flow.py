"""The drawing of the project's structure: every text in its box, every arrow from one box to another."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

from wam_cast.visualization.figures.box_diagrams import ARROWS, BOXES, HEIGHT, LANES, WIDTH, draw_data_flow
from wam_cast.visualization.style import figure_style


@pytest.fixture(scope="module")
def axes():
    with figure_style():
        axes = Figure(figsize=(6.3, 3.5)).subplots()
        draw_data_flow(axes)
        return axes


def test_no_text_lies_on_another(axes, assert_apart, assert_reads_well):
    assert_apart(axes.figure)
    assert_reads_well(axes.figure)


def test_every_box_holds_its_texts(axes, texts_of):
    boxes = {text.get_text(): box for text, box in texts_of(axes.figure)}
    assert set(LANES) <= set(boxes)
    for box in BOXES:
        half = np.array([box.width, box.height]) / 2
        low, high = axes.transData.transform(np.add([box.x, box.y], [-half, half]))
        for text in filter(None, (box.name, box.detail)):
            drawn = boxes[text]
            assert np.all([drawn.x0, drawn.y0] >= low), text
            assert np.all([drawn.x1, drawn.y1] <= high), text


def on_edge(point):
    """Return the boxes on whose edge a point is."""
    found = []
    for box in BOXES:
        beyond = np.abs(np.subtract(point, (box.x, box.y))) - np.array([box.width, box.height]) / 2
        if abs(np.max(beyond)) < 1e-6:
            found.append(box.name)
    return found


def test_every_arrow_leads_from_one_box_to_another():
    ways = [(on_edge(corners[0]), on_edge(corners[-1])) for corners in ARROWS]
    assert all(len(start) == len(end) == 1 for start, end in ways), ways
    ways = {(start[0], end[0]) for start, end in ways}
    chain = [
        "scenario",
        "random casts",
        "simulation",
        "dataset",
        "model selection",
        "forward model",
        "planner",
        "plan",
    ]
    chain += ["execution", "outcome"]
    assert set(pairwise(chain)) <= ways
    assert {("cup position", "planner"), ("cup position", "execution"), ("dataset", "forward model")} <= ways


def test_boxes_are_on_the_page_and_do_not_overlap_but_for_parts():
    for number, one in enumerate(BOXES):
        assert one.width / 2 <= one.x <= WIDTH - one.width / 2
        assert one.height / 2 <= one.y <= HEIGHT - one.height / 2
        for other in BOXES[number + 1 :]:
            if one.is_part == other.is_part:
                gap = np.abs([one.x - other.x, one.y - other.y])
                gap -= np.array([one.width + other.width, one.height + other.height]) / 2
                assert np.max(gap) > 0, (one.name, other.name)
