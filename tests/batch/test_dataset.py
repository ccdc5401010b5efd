"""Datasets by the batched engine: the rows of Drake's, to the word about which engine made them."""

import numpy as np
import pytest

from wam_cast.batch import engine
from wam_cast.errors import InputError
from wam_cast.generation import engines
from wam_cast.generation.engines import checked_engine, rows_in_blocks
from wam_cast.learning.dataset import CastDataset, generate_dataset
from wam_cast.scenario import Scenario

SCENARIO = Scenario()


def own_controller(scenario):
    raise NotImplementedError  # it is refused before it is called


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"engine": "warp"}, "engine = 'warp' must be drake or batch"),
        ({"engine": "batch", "make_controller": own_controller}, "leave make_controller out"),
    ],
)
def test_an_engine_that_cannot_is_refused(options, words):
    with pytest.raises(InputError, match=words):
        generate_dataset(SCENARIO, 4, **options)


def test_an_unstable_loop_is_refused_by_both():
    unstable = Scenario.from_dict({"controller": {"delay": 3}})
    with pytest.raises(InputError, match="unstable"):
        checked_engine("batch", unstable, has_own_controller=False)


@pytest.mark.parametrize("backend", ["cpu", "gpu"])
def test_blocks_hold_the_wanted_rows_in_order(monkeypatch, backend):
    sizes, in_processes = set(), []

    def simulate_block(_scenario, _seed, n_casts, size, block):
        sizes.add(size)
        return [{"cast": row} for row in range(size * block, min(size * block + size, n_casts))]

    def run_rows(function, blocks, *_):
        in_processes.extend(blocks)
        return (function(block) for block in blocks)

    monkeypatch.setattr("jax.default_backend", lambda: backend)
    monkeypatch.setattr(engine, "GPU_CHUNK", 16)
    monkeypatch.setattr(engines, "BLOCK", 10)
    monkeypatch.setattr(engines, "simulate_block", simulate_block)
    monkeypatch.setattr(engines, "run_rows", run_rows)
    todo = [3, 5, 17, 38]
    assert [row["cast"] for row in rows_in_blocks(SCENARIO, 0, todo)] == todo
    # Processes would fight for the device.
    assert (sizes, in_processes) == (({10}, [0, 1, 3]) if backend == "cpu" else ({16}, []))
    assert list(rows_in_blocks(SCENARIO, 0, [])) == []


@pytest.mark.slow
def test_rows_are_drakes_and_a_directory_takes_one_engine_alone(tmp_path):
    data = generate_dataset(SCENARIO, 60, seed=4, engine="batch", directory=tmp_path / "casts", n_workers=1)
    drake = generate_dataset(SCENARIO, 8, seed=4, n_workers=1)
    assert (data.engine, drake.engine) == ("batch", "drake")
    assert list(data.frame) == list(drake.frame)
    assert list(data.frame.dtypes) == list(drake.frame.dtypes)
    landing = ["landing_along", "landing_across"]
    np.testing.assert_allclose(data.frame[landing][:8], drake.frame[landing], rtol=0, atol=1e-6)
    assert CastDataset.load(tmp_path / "casts").engine == "batch"
    with pytest.raises(InputError, match="another engine"):
        generate_dataset(SCENARIO, 60, seed=4, directory=tmp_path / "casts")
    grown = generate_dataset(SCENARIO, 70, seed=4, engine="batch", directory=tmp_path / "casts", n_workers=1)
    assert grown.frame[:60].equals(data.frame)
