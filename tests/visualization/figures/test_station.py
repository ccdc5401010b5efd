"""The drawing of the station has its connections, and one can read them."""

from itertools import combinations, pairwise

import pytest
from matplotlib.figure import Figure

from wam_cast.robot.station import CastStation
from wam_cast.scenario import Noise, Scenario
from wam_cast.visualization.figures.box_diagrams import COLUMN, columns, connections, draw_station, lay_out
from wam_cast.visualization.style import figure_style

NOISY = Scenario(noise=Noise.typical(), arm={"coulomb_friction": 1.0})


@pytest.fixture(scope="module")
def station():
    return CastStation(Scenario())


def test_connections_are_the_diagrams_without_its_logs(station):
    assert [tuple(link) for link in connections(station)] == [
        ("controller", "actuation", "hold", "u"),
        ("hold", "y", "plant", "actuation"),
        ("plant", "body_poses", "ball_tracker", "body_poses"),
        ("plant", "body_spatial_velocities", "ball_tracker", "body_spatial_velocities"),
        ("plant", "geometry_pose", "scene_graph", "plant_pose"),
        ("plant", "wam7_state", "controller", "arm_state"),
        ("scene_graph", "query", "plant", "geometry_query"),
    ]


def test_signals_run_from_column_to_column():
    links = connections(CastStation(NOISY))
    column = columns(links)
    chain = ["plant", "encoders", "controller", "torque_noise", "hold"]
    assert [column[name] for name in chain] == [0, 1, 2, 3, 4]
    assert all(column[link.target] <= column[link.source] + 1 for link in links)
    assert set(column) == {name for link in links for name in (link.source, link.target)}


@pytest.mark.parametrize("scenario", [Scenario(), NOISY])
def test_no_two_boxes_overlap(scenario):
    for one, other in combinations(lay_out(connections(CastStation(scenario))).values(), 2):
        beside = abs(one.left - other.left) > COLUMN
        above = one.top - one.height > other.top or other.top - other.height > one.top
        assert beside or above


def test_drawing_can_be_read_and_has_an_arrow_for_each_connection(station, assert_reads_well, assert_apart):
    with figure_style():
        axes = Figure(figsize=(9, 3)).subplots()
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
        axes = Figure(figsize=(15, 4)).subplots()
    draw_station(axes, CastStation(NOISY))
    upright = []
    for line in axes.lines:
        corners = line.get_xydata()
        upright += [(a[0], *sorted((a[1], b[1]))) for a, b in pairwise(corners) if a[1] != b[1]]
    for one, other in combinations(upright, 2):
        shared = min(one[2], other[2]) - max(one[1], other[1])
        assert shared <= 1e-9 or abs(one[0] - other[0]) > 0.1, "one hides the other"
