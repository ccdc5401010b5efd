"""The drawings of the project and of the station: every text in its box, every arrow from one box to another."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

from wam_cast.robot.station import CastStation
from wam_cast.scenario import Noise, Scenario
from wam_cast.visualization.figures.box_diagrams import (
    ARROWS,
    BOXES,
    COLUMN,
    HEIGHT,
    LANES,
    WIDTH,
    columns,
    connections,
    draw_data_flow,
    draw_station,
    lay_out,
)
from wam_cast.visualization.style import figure_style

# --- data flow


@pytest.fixture(scope="module")
def data_flow():
    with figure_style():
        axes = Figure(figsize=(6.3, 3.5)).subplots()
        draw_data_flow(axes)
        return axes


def test_no_text_lies_on_another(data_flow, assert_apart, assert_reads_well):
    assert_apart(data_flow.figure)
    assert_reads_well(data_flow.figure)


def test_every_box_holds_its_texts(data_flow, texts_of):
    boxes = {text.get_text(): box for text, box in texts_of(data_flow.figure)}
    assert set(LANES) <= set(boxes)
    for box in BOXES:
        half = np.array([box.width, box.height]) / 2
        low, high = data_flow.transData.transform(np.add([box.x, box.y], [-half, half]))
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
    chain = ["scenario", "random casts", "simulation", "dataset", "model selection", "forward model", "planner", "plan"]
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


# --- station

NOISY = Scenario(
    noise=Noise.typical(),
    arm={"coulomb_friction": 1.0, "knee_speed": 0.7},
    controller={"delay": 1, "kp": 3000, "kd": 125},
)


@pytest.fixture(scope="module")
def station():
    return CastStation(Scenario())


def test_connections_are_the_diagrams_without_its_logs(station):
    assert [tuple(link) for link in connections(station)] == [
        ("controller", "actuation", "motors", "commanded"),
        ("hold", "y0", "plant", "actuation"),
        ("motors", "torque", "hold", "u0"),
        ("plant", "body_poses", "ball_tracker", "body_poses"),
        ("plant", "body_spatial_velocities", "ball_tracker", "body_spatial_velocities"),
        ("plant", "geometry_pose", "scene_graph", "plant_pose"),
        ("plant", "wam7_state", "controller", "arm_state"),
        ("scene_graph", "query", "plant", "geometry_query"),
    ]


def test_signals_run_from_column_to_column():
    links = connections(CastStation(NOISY))
    column = columns(links)
    chain = ["plant", "encoders", "controller", "delay", "torque_noise", "motors", "hold"]
    assert [column[name] for name in chain] == [0, 1, 2, 3, 4, 5, 6]
    forward = [link for link in links if link.target != "plant"]
    assert all(column[link.target] > column[link.source] for link in forward)
    assert set(column) == {name for link in links for name in (link.source, link.target)}


@pytest.mark.parametrize("scenario", [Scenario(), NOISY])
def test_no_two_boxes_overlap(scenario):
    for one, other in combinations(lay_out(connections(CastStation(scenario))).values(), 2):
        beside = abs(one.left - other.left) > COLUMN
        above = one.top - one.height > other.top or other.top - other.height > one.top
        assert beside or above


def test_drawing_can_be_read_and_has_an_arrow_for_each_connection(station, assert_reads_well, assert_apart):
    with figure_style():
        axes = Figure(figsize=(12, 3)).subplots()
        draw_station(axes, station)
    assert_reads_well(axes.figure)
    assert_apart(axes.figure)
    links = connections(station)
    boxes = lay_out(links)
    for link in links:
        target = boxes[link.target]
        end = target.left, target.port_height(target.inputs.index(link.input))
        assert [getattr(text, "xy", None) for text in axes.texts].count(end) == 1


def test_connections_that_run_side_by_side_are_apart():
    with figure_style():
        axes = Figure(figsize=(20, 4)).subplots()
    draw_station(axes, CastStation(NOISY))
    upright = []
    for line in axes.lines:
        corners = line.get_xydata()
        upright += [(a[0], *sorted((a[1], b[1]))) for a, b in pairwise(corners) if a[1] != b[1]]
    for one, other in combinations(upright, 2):
        shared = min(one[2], other[2]) - max(one[1], other[1])
        assert shared <= 1e-9 or abs(one[0] - other[0]) > 0.1, "one hides the other"
