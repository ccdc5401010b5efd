"""Searches of a cast that see nothing but misses, on misses with a closed form."""

import sys
import warnings

import cmaes
import numpy as np
import pytest
from planners.black_box import FAILED, SEARCHES, cast_at, grid_shape, search_cast

from wam_cast.cast import cast_bounds, is_allowed
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario

pytestmark = pytest.mark.slow

ALL = pytest.mark.parametrize("method", SEARCHES)
RANDOM = pytest.mark.parametrize("method", ["cma-es", "bayesian"])

LOWER, UPPER = cast_bounds(Scenario())

# Most of the box of these bounds is too fast for its distance, and below 0.06 m all of it.
CUT = Scenario.from_dict({"bounds": {"distance": [0.05, 0.12], "speed": [0.3, 0.85]}})


class Asked:
    """An objective that remembers the casts it was asked about."""

    def __init__(self, miss, scenario=None):
        self.miss, self.scenario = miss, scenario or Scenario()
        self.casts = np.empty((0, 3))

    def __call__(self, casts):
        assert casts.ndim == 2
        self.casts = np.vstack([self.casts, casts])
        return self.miss(casts)


def distance_from(best):
    """Return a function of casts: how far they are from `best` in the parameters scaled to the unit cube."""
    return lambda casts: np.linalg.norm((casts - best) / (UPPER - LOWER), axis=1)


def search(method, budget, miss, scenario=None, seed=0):
    asked = Asked(miss, scenario)
    return search_cast(method, asked.scenario, asked, budget, seed=seed), asked


# --- what is found


@pytest.mark.parametrize(
    ("method", "budget", "tolerance"), [("grid", 1000, 0.09), ("cma-es", 200, 0.01), ("bayesian", 15, 0.15)]
)
def test_the_least_of_a_known_function_is_found(method, budget, tolerance):
    best = LOWER + (UPPER - LOWER) * [0.6, 0.3, 0.7]
    found, _ = search(method, budget, distance_from(best))
    assert found.miss < tolerance
    assert found.miss == pytest.approx(distance_from(best)(found.parameters[np.newaxis])[0])


@ALL
def test_a_least_beyond_what_is_allowed_is_found_at_its_edge(method):
    # Distance less 0.2 speed falls until the move would be too short.
    budget = {"grid": 64, "cma-es": 64, "bayesian": 11}[method]
    found, _ = search(method, budget, lambda casts: casts[:, 0] - 0.2 * casts[:, 1], CUT)
    assert 0 <= found.miss < 0.01


@ALL
def test_the_trace_is_the_least_miss_so_far(method):
    found, asked = search(method, 10, distance_from(LOWER))
    misses = distance_from(LOWER)(asked.casts)
    np.testing.assert_array_equal(found.trace, np.minimum.accumulate(misses))
    np.testing.assert_array_equal(found.parameters, asked.casts[np.argmin(misses)])
    assert found.n_evaluations == len(asked.casts)


# --- what is evaluated


@ALL
@pytest.mark.parametrize("scenario", [Scenario(), CUT], ids=["reference", "cut"])
def test_bounds_and_the_shortest_move_are_kept_at_every_evaluation(method, scenario):
    # Less is better for distance and wait, more for speed: right into the corner that the shortest duration cuts off.
    _, asked = search(method, 10, lambda casts: casts @ [1.0, -1.0, 1.0], scenario)
    assert np.all(is_allowed(scenario, asked.casts))


def test_the_unit_cube_is_all_that_is_allowed():
    assert cast_at(Scenario(), np.zeros(3)) == pytest.approx(LOWER)
    assert cast_at(Scenario(), np.ones(3)) == pytest.approx(UPPER)
    assert cast_at(CUT, np.zeros(3)) == pytest.approx([0.06, 0.3, 0.0])
    assert cast_at(CUT, np.ones(3)) == pytest.approx([0.12, 0.6, 0.5])
    # Halfway up the speeds that 0.09 m leave: up to 0.45 m/s.
    assert cast_at(CUT, np.full(3, 0.5)) == pytest.approx([0.09, 0.375, 0.25])


def test_cma_es_draws_anew_what_is_out_of_bounds():
    _, asked = search("cma-es", 35, lambda casts: casts @ [1.0, 1.0, 1.0])
    assert not np.any((asked.casts == LOWER) | (asked.casts == UPPER))


@RANDOM
@pytest.mark.parametrize("budget", [1, 5, 10])
def test_the_budget_is_used_and_not_exceeded(method, budget):
    found, asked = search(method, budget, distance_from(LOWER))
    assert len(asked.casts) == found.n_evaluations == budget


@pytest.mark.parametrize("budget", [1, 2, 7, 26, 27, 100])
def test_a_grid_does_not_exceed_the_budget(budget):
    found, asked = search("grid", budget, distance_from(LOWER))
    assert len(asked.casts) == found.n_evaluations == np.prod(grid_shape(budget)) <= budget
    assert len(np.unique(asked.casts, axis=0)) == len(asked.casts)


def test_grids_are_as_large_as_the_budget_allows():
    assert [grid_shape(budget) for budget in (1, 2, 27, 30, 95, 120)] == [
        (1, 1, 1),
        (1, 1, 2),
        (3, 3, 3),
        (3, 3, 3),
        (3, 5, 6),
        (4, 5, 6),
    ]


def test_a_grid_is_regular():
    _, asked = search("grid", 24, distance_from(LOWER))
    assert grid_shape(24) == (2, 3, 4)
    distance, speed, wait = (np.unique(asked.casts[:, i].round(9)) for i in range(3))
    np.testing.assert_allclose(distance, LOWER[0] + (UPPER - LOWER)[0] * np.array([0.25, 0.75]))
    np.testing.assert_allclose(wait, np.array([1, 3, 5]) / 12)
    # At 0.3125 m all speeds are allowed, at 0.1375 m none beyond 0.6875 m/s.
    expected = [0.21 + (top - 0.21) * np.array([1, 3, 5, 7]) / 8 for top in (0.6875, 0.85)]
    np.testing.assert_allclose(speed, np.sort(np.concatenate(expected)))


def test_cma_es_starts_again_somewhere_else_when_it_has_converged(monkeypatch):
    starts = []

    class Impatient(cmaes.CMA):
        def __init__(self, mean, *args, **options):
            starts.append(mean.copy())
            super().__init__(mean, *args, **options)

        def should_stop(self):
            return self.generation == 3

    monkeypatch.setattr(cmaes, "CMA", Impatient)
    _, asked = search("cma-es", 50, distance_from(LOWER))
    assert len(asked.casts) == 50  # 3 generations of 7, as many again, and what is left
    assert starts[0] == pytest.approx([0.5, 0.5, 0.5])
    assert len(np.unique(starts, axis=0)) == 3
    assert np.all((np.array(starts) >= 0) & (np.array(starts) <= 1))


def test_cma_es_uses_its_budget_though_nothing_is_to_be_gained():
    assert len(search("cma-es", 300, lambda casts: np.zeros(len(casts)))[1].casts) == 300


def test_bayesian_optimisation_goes_on_where_it_is_sure_of_the_best_cast():
    # In a corner, which it hits exactly, again and again.
    _, asked = search("bayesian", 12, lambda casts: casts @ [1.0, 1.0, 1.0])
    assert len(np.unique(asked.casts, axis=0)) == 12


# --- seeds


@ALL
def test_a_seed_repeats_to_the_last_digit(method):
    (first, _), (second, _) = (search(method, 10, distance_from(LOWER), seed=3) for _ in range(2))
    np.testing.assert_array_equal(first.parameters, second.parameters)
    np.testing.assert_array_equal(first.trace, second.trace)


@RANDOM
def test_seeds_differ(method):
    (_, first), (_, second) = (search(method, 8, distance_from(LOWER), seed=seed) for seed in (3, 2**40))
    assert not np.any(first.casts == second.casts)


def test_a_grid_needs_no_seed():
    (_, first), (_, second) = (search("grid", 12, distance_from(LOWER), seed=seed) for seed in (3, 4))
    np.testing.assert_array_equal(first.casts, second.casts)


@ALL
def test_nothing_global_is_drawn_from_or_printed(method, capsys):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        before = np.random.get_state()[1].copy()  # noqa: NPY002 - the one that must stay as it is
        search(method, 10, distance_from(LOWER))
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002 - the same
    assert capsys.readouterr() == ("", "")


# --- what goes wrong


@ALL
def test_failed_casts_count_as_far_off(method):
    def miss(casts):
        bad = np.where(casts[:, 1] < 0.4, np.nan, np.inf)
        return np.where(casts[:, 0] < 0.2, bad, 0.1 * distance_from(UPPER)(casts))

    found, asked = search(method, 10, miss)
    failed = ~np.isfinite(miss(asked.casts))
    assert failed.any()
    assert found.miss < FAILED
    assert found.parameters[0] >= 0.2
    assert np.all(np.isfinite(found.trace))


@ALL
def test_if_every_cast_fails_the_first_one_is_returned(method):
    found, asked = search(method, 10, lambda casts: np.full(len(casts), np.nan))
    assert found.miss == FAILED
    np.testing.assert_array_equal(found.parameters, asked.casts[0])
    assert found.n_evaluations == len(asked.casts)


@pytest.mark.parametrize(
    ("method", "module", "package"), [("cma-es", "cmaes", "cmaes"), ("bayesian", "bayes_opt", "bayesian-optimization")]
)
def test_a_missing_package_is_named(monkeypatch, method, module, package):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError) as error:
        search(method, 3, distance_from(LOWER))
    assert str(error.value) == f"the search '{method}' needs the package {package}: pip install 'wam-cast[comparison]'"


def test_the_grid_needs_no_package(monkeypatch):
    for module in ("cmaes", "bayes_opt"):
        monkeypatch.setitem(sys.modules, module, None)
    assert search("grid", 8, distance_from(LOWER))[0].n_evaluations == 8


def test_bad_input_is_refused():
    with pytest.raises(InputError, match="search 'random' is not known: choose grid, cma-es, bayesian"):
        search("random", 3, distance_from(LOWER))
    with pytest.raises(InputError, match="budget = 0 must be an integer, 1 or more"):
        search("grid", 0, distance_from(LOWER))
    with pytest.raises(InputError, match="seed = -1 must be an integer, 0 or more"):
        search("grid", 3, distance_from(LOWER), seed=-1)
