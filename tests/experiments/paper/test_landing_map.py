"""The map of landings: which axis is which."""

import numpy as np

import wam_cast as wc
from wam_cast.cast import Cast, cast_bounds, is_allowed
from wam_cast.experiments.paper.landing_map import map_landings


class Linear:
    """A model whose landing tells its cast."""

    scenario = wc.Scenario()

    def predict(self, casts):
        along = casts @ [1.0, 10.0, 100.0]
        return np.column_stack([along, np.full(len(casts), np.nan), np.full(len(casts), np.nan)])


def test_landings_are_by_wait_speed_and_distance():
    steps = []
    found = map_landings(Linear(), lambda *step: steps.append(step))
    lower, upper = cast_bounds(Linear.scenario)
    axes = [np.array(axis) for axis in (found.distance, found.speed, found.waits)]
    for axis, low, high in zip(axes, lower, upper, strict=True):
        np.testing.assert_allclose((axis[0], axis[-1]), (low, high))
        np.testing.assert_allclose(np.diff(axis), axis[1] - axis[0])
    distance, speed, waits = axes
    expected = distance + 10 * speed[:, np.newaxis] + 100 * waits[:, np.newaxis, np.newaxis]
    np.testing.assert_allclose(found.landing, expected, rtol=1e-12)
    for i, j in ((0, -1), (-1, 0), (5, 30), (30, 5)):
        cast = Cast(distance[j], speed[i], waits[0]).to_array()
        assert found.is_allowed[i][j] == is_allowed(Linear.scenario, cast)
    assert not found.is_allowed[-1][0]
    assert found.is_allowed[0][-1]
    assert steps == [(0, 1), (1, 1)]
