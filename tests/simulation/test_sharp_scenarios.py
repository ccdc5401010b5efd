"""Scenarios near an edge of what works: a cast that a cup can catch is caught where it lands, or one line says why none can be."""

import pytest
from laboratory_scenarios import (
    GOLF,
    HAND,
    LONG_FOREARM,
    SMALL_STEEL,
    TABLE_TENNIS,
    TENNIS,
    WIDE_CUP,
    arranged,
    on_stand,
)

from wam_cast.errors import InputError
from wam_cast.experiments.preview_verdict import Fate, fate_of
from wam_cast.generation.sampling import sample_cast
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import CastSimulator

WORK = {
    "string of 0.25 m": arranged({"string": {"length": 0.25}}),
    "string of 1.2 m": arranged({"string": {"length": 1.2}}),
    "string of 2 links": {"string": {"n_links": 2}},
    "string of 20 links": {"string": {"n_links": 20}},
    "heavy cord": {"string": {"mass": 0.020}, "ball": {"mass": 0.004}},
    "light line, heavy ball": {"string": {"mass": 0.0005}, "ball": {"mass": 0.2}},
    "undamped string": {"string": {"bending_damping": 0.0, "hook_damping": 0.0, "knot_damping": 0.0}},
    "stiff cord": {"string": {"bending_stiffness": 1e-4}},
    "table tennis ball": arranged({"ball": TABLE_TENNIS, "string": {"mass": 0.001}}),
    "steel ball on 0.3 m": arranged({"ball": SMALL_STEEL, "string": {"length": 0.3}}),
    "golf ball, narrow cup": arranged({"ball": GOLF, "cup": {"inner_radius": 0.028}}),
    "tennis ball": arranged({"ball": TENNIS, "cup": WIDE_CUP}),
    "short string over a pedestal": arranged({"string": {"length": 0.3}, "cup": on_stand(0.3)}),
    "hand of 1.2 kg": {"arm": HAND},
    "long forearm, lively cup": {"arm": LONG_FOREARM, "cup": {"restitution": 0.6}},
    "100 Hz": {"controller": {"period": 0.01, "kp": 800.0, "kd": 50.0}},
    "4 ms late": {"controller": {"delay": 2, "kp": 1500.0, "kd": 100.0}},
}

CANNOT = {
    "a string too short for the drop": ({"string": {"length": 0.3}}, "choose a string.length of at least 0.328"),
    "gains too high for the delay": ({"controller": {"delay": 2}}, "multiply all gains by 0.6 or less"),
    "jolts on 38 links": (
        {"string": {"n_links": 38}, "noise": {"torque": 0.02}},
        "a cast would take about .* fewer links",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", WORK)
def test_a_ball_is_caught_where_it_lands(name):
    scenario = Scenario.from_dict(WORK[name])
    simulator, n_tried = CastSimulator(scenario), 0
    for row in range(12):
        cast = sample_cast(scenario, 0, row)
        free = simulator.simulate(cast)
        assert free.status is not Status.DIVERGED
        if fate_of(scenario, cast.distance, free) is Fate.GOOD:
            n_tried += 1
            assert simulator.simulate(cast, tuple(free.landing)).status is Status.CAUGHT, cast
        if n_tried == 2:
            return
    raise AssertionError(f"only {n_tried} of 12 casts could be caught")


@pytest.mark.parametrize("name", CANNOT)
def test_what_cannot_work_is_one_line(name):
    values, words = CANNOT[name]
    with pytest.raises(InputError, match=words) as error:
        CastSimulator(Scenario.from_dict(values))
    assert "\n" not in str(error.value)
