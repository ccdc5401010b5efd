"""What the batched engine refuses, before anything is compiled."""

import numpy as np
import pytest

from wam_cast.batch import engine
from wam_cast.batch.arguments import checked_casts
from wam_cast.batch.derivatives import batch_derivatives
from wam_cast.batch.engine import simulate_batch
from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.scenario import Scenario, Simulation
from wam_cast.storage.casts_part import SCHEMA

CAST = [0.3, 0.6, 0.1]
STIFF = Scenario.from_dict({"string": {"length": 0.35, "n_links": 40, "bending_damping": 1e-4, "mass": 5e-4}})


@pytest.mark.parametrize(
    ("arguments", "options", "words"),
    [
        ((Scenario(), [[0.3, 0.6]]), {}, "shape (1, 2)"),
        ((Scenario(), CAST), {}, "shape (3,)"),
        ((Scenario(), "casts"), {}, "must be Casts, or an array"),
        ((Scenario(), [[0.3, 0.6, 0.1], [0.3, 0.6, 0.1, 0.2]]), {}, "with a bearing for each"),
        ((Scenario(simulation=Simulation(max_step=1e-6)), [CAST]), {}, "simulation.max_step = 1e-06 s"),
        ((Scenario(), [[0.3, np.nan, 0.1]]), {}, "speed = nan is not a finite number"),
        ((Scenario(), [[-0.3, 0.6, 0.1]]), {}, "must be positive"),
        (([Scenario()], [CAST, CAST]), {}, "1 scenarios for 2 casts"),
        ((["scenario"], [CAST]), {}, "must be a Scenario"),
        (([Scenario(), STIFF], [CAST, CAST]), {}, "strings of 10, 40 links"),
        ((STIFF, [CAST]), {}, "integration steps"),
        ((Scenario(), [CAST]), {"noise_seeds": [1, 2]}, "2 seeds for 1 casts"),
        ((Scenario(), [CAST]), {"noise_seeds": [-1]}, "noise_seed = -1"),
        ((Scenario(), [CAST]), {"precision": "float16"}, "float64 or float32"),
        ((Scenario(), [[0.3, 0.6, 0.1, 3.1]]), {}, "joint 1"),
    ],
)
def test_what_cannot_be_simulated_is_refused_in_one_line(arguments, options, words):
    with pytest.raises(InputError) as refused:
        simulate_batch(*arguments, **options)
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "name",
    [
        *(
            "nothing",
            "string",
            "string.nothing",
            "string.length[1]",
            "arm.mass_scale[8]",
            "arm.mount",
            "string.n_links",
            "",
        ),
        *(
            "arm.mass_scale[4",
            "arm.mass_scale]",
            "arm.mass_scale[0]",
            "simulation.max_step",
            "bounds.distance",
            "noise.torque",
        ),
    ],
)
def test_what_has_no_derivative_is_refused(name):
    with pytest.raises(InputError, match="name distance, speed"):
        batch_derivatives(Scenario(), [CAST], [name])


def test_casts_are_taken_as_they_are_too():
    casts = [Cast(0.3, 0.6, 0.1, bearing=0.2), Cast(0.2, 0.5, 0.0)]
    rows = np.array([[*cast.to_array(), cast.bearing] for cast in casts])
    assert checked_casts(casts) == checked_casts(rows) == casts


def test_a_device_that_is_no_processor_takes_what_there_is_at_once(monkeypatch):
    assert [engine.chunk_size(n) for n in (1, 16, 17, 500)] == [16] * 4
    monkeypatch.setattr("jax.default_backend", lambda: "gpu")
    assert [engine.chunk_size(n) for n in (8, 500, 8192, 100_000)] == [16, 512, 8192, 8192]


def test_no_casts_have_no_rows_but_all_columns():
    frame = simulate_batch(Scenario(), np.zeros((0, 3)))
    assert len(frame) == 0
    assert list(frame) == SCHEMA.names
