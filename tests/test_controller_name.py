"""The name by which a controller is known, and what is refused in its name."""

import sys
from copy import copy
from functools import partial

import pytest

from wam_cast.cli import model_choice
from wam_cast.controller_names import DEFAULT_CONTROLLER, controller_name
from wam_cast.errors import InputError
from wam_cast.learning import dataset
from wam_cast.learning.dataset import CastDataset, generate_dataset
from wam_cast.learning.forward_model import ForwardModel
from wam_cast.learning.reference import reference_model
from wam_cast.robot.controller import CastController
from wam_cast.scenario import Scenario

OWN = """
from wam_cast.robot.controller import CastController

class Own(CastController):
    pass

def soft(scenario):
    weak = scenario.controller.model_copy(update={"kp": 1500.0})
    return CastController(scenario.model_copy(update={"controller": weak}))
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A module with controllers that worker processes can import."""
    (tmp_path / "own_controllers.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    import own_controllers

    yield own_controllers
    del sys.modules["own_controllers"]


@pytest.fixture
def model(tmp_path):
    """The reference model, as if it had learned from the casts of another controller, in a file."""
    one = copy(reference_model())
    one.controller = "own_controllers.Own"
    one.save(tmp_path / "own.model")
    return tmp_path / "own.model"


def test_the_default_is_the_packages_own(own):
    assert controller_name() == controller_name(CastController) == DEFAULT_CONTROLLER
    assert controller_name(own.Own) == "own_controllers.Own"
    assert controller_name(own.soft) == "own_controllers.soft"
    assert reference_model().controller == DEFAULT_CONTROLLER


@pytest.mark.parametrize("nameless", [lambda scenario: CastController(scenario), partial(CastController)])
def test_what_workers_could_not_import_is_refused(nameless):
    with pytest.raises(InputError, match="has no name by which worker processes could import it"):
        generate_dataset(Scenario(), 1, make_controller=nameless)


@pytest.mark.slow
def test_casts_are_those_of_the_controller(own):
    soft = generate_dataset(Scenario(), 2, make_controller=own.soft, n_workers=1)
    usual, again = (
        [dataset.simulate_row(Scenario(), 0, row, **options) for row in range(2)]
        for options in ({}, {"make_controller": own.soft})
    )
    assert soft.controller == "own_controllers.soft"
    assert list(soft.frame["landing_along"]) == [row["landing_along"] for row in again]
    assert all(abs(soft.frame["peak_tracking_error"] - [row["peak_tracking_error"] for row in usual]) > 1e-3)


def test_a_directory_takes_one_controllers_casts(own, tmp_path, monkeypatch, inline_executor):
    simulate = dataset.simulate_row
    monkeypatch.setattr(dataset, "simulate_row", lambda *given, **_: simulate(*given))
    options = {"directory": tmp_path / "casts", "executor": inline_executor}
    generate_dataset(Scenario(), 1, make_controller=own.Own, **options)
    assert CastDataset.load(tmp_path / "casts").controller == "own_controllers.Own"
    with pytest.raises(InputError, match=r"another controller \('own_controllers\.Own', not 'wam_cast"):
        generate_dataset(Scenario(), 1, **options)
    generate_dataset(Scenario(), 1, make_controller=own.Own, **options)


@pytest.mark.slow
def test_a_model_refuses_another_controller(model):
    one = ForwardModel.load(model)
    assert one.controller == "own_controllers.Own"
    assert ForwardModel.load(model, Scenario(), "own_controllers.Own").controller == one.controller
    assert one.bound_to(Scenario()).controller == one.controller
    with pytest.raises(InputError, match=r"casts of another controller \(own_controllers\.Own, not wam_cast"):
        one.bound_to(Scenario(), DEFAULT_CONTROLLER)
    with pytest.raises(InputError, match=r"own\.model: made from casts of another controller"):
        ForwardModel.load(model, controller=DEFAULT_CONTROLLER)


def test_the_command_line_refuses_a_model_of_another_controller(model):
    with pytest.raises(InputError, match=r"own\.model: made from casts of another controller"):
        model_choice.find(None, model)
