"""Scenarios whose strings are short for their cups, each with a model of its own: cups are caught, or refused with the reason."""

import pytest

from wam_cast.casting_plane import from_polar
from wam_cast.errors import InputError
from wam_cast.experiments.trials import draw_cups
from wam_cast.learning.dataset import generate_dataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.planning.plan import plan_cast
from wam_cast.planning.reach import Reach
from wam_cast.scenario import Scenario
from wam_cast.simulation.simulator import simulate_cast

N_CASTS, N_CUPS = 120, 6


@pytest.mark.slow
@pytest.mark.parametrize(
    "values",
    [{"string": {"length": 0.40}}, {"string": {"length": 0.40}, "cup": {"rim_height": 0.30}}],
    ids=["a string of 0.40 m", "a rim at 0.30 m"],
)
def test_each_cup_is_caught_or_refused_beforehand(values, inline_executor):
    pytest.importorskip("jax")  # Drake would take two minutes for the casts
    scenario = Scenario.from_dict(values)
    try:
        # In this process, which compiles the engine once for both.
        model = ForwardModel.fit(generate_dataset(scenario, N_CASTS, seed=0, engine="batch", executor=inline_executor))
    except InputError as error:
        assert "mends it" in str(error)
        return
    reach = Reach.of(model)
    for cup in draw_cups(reach, N_CUPS, seed=1):
        plan = plan_cast(model, from_polar(*cup))
        assert plan.is_feasible or "hang" in plan.reason
        if plan.is_feasible:
            assert simulate_cast(scenario, plan.cast, plan.cup).is_caught, cup
    with pytest.raises(InputError, match="out of reach"):
        plan_cast(model, (reach.farthest + 0.02, 0.0))
