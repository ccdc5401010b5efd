"""Random streams of the experiment: each of its own, and always the same."""

from itertools import product

import numpy as np

from wam_cast.generation.sampling import row_noise_seed
from wam_cast.parallel.seeds import Purpose, derived_seed


def test_purposes_indices_and_seeds_have_seeds_of_their_own():
    keys = list(product((0, 1, 2, 2**40), Purpose, range(50)))
    seeds = [derived_seed(*key) for key in keys]
    assert len(set(seeds)) == len(keys)
    assert all(type(seed) is int and 0 <= seed < 2**32 for seed in seeds)
    assert seeds == [derived_seed(*key) for key in keys]
    assert derived_seed(5, Purpose.NOISE) == derived_seed(5, Purpose.NOISE, 0)


def test_seeds_are_always_the_same():
    assert [purpose.value for purpose in Purpose] == [0, 1, 2, 3, 4, 5, 6, 7]
    assert [derived_seed(0, purpose) for purpose in Purpose] == [
        3678467582,
        1246905493,
        1583241576,
        1075056327,
        1652893257,
        2103482543,
        302225387,
        3003216582,
    ]
    assert derived_seed(7, Purpose.NOISE, 3) == 1313116903


def test_no_stream_is_that_of_a_row():
    for seed in (0, 7):
        rows = {
            int(np.random.SeedSequence(seed, spawn_key=key).generate_state(1)[0])
            for row in range(300)
            for key in ((row,), (row, 0))
        }
        rows |= {row_noise_seed(seed, row) for row in range(300)}
        derived = {derived_seed(seed, *key) for key in product(Purpose, range(20))}
        assert not rows & derived
        draws = {tuple(np.random.default_rng(one).uniform(size=3)) for one in derived}
        row_draws = {
            tuple(np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(row,))).uniform(size=3))
            for row in range(300)
        }
        assert not draws & row_draws
