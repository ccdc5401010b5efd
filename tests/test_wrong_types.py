"""Values of the wrong Python type, in the place of every argument of the public names: one line names the argument."""

import inspect
import pickle

import numpy as np
import pandas as pd
import pytest

import wam_cast as wc
from wam_cast.cast import PARAMETERS
from wam_cast.errors import InputError
from wam_cast.planning.prediction import OUTPUTS

SCENARIO, CAST, CUP = wc.Scenario(), wc.Cast(0.3, 0.6, 0.1), (0.75, 0.0)


class Wrong:
    """What no argument can be."""

    def __repr__(self):
        return "<wrong\nthing>"


def dataset():
    frame = pd.DataFrame(np.random.default_rng(0).random((60, 10)), columns=[*PARAMETERS, *OUTPUTS])
    return wc.CastDataset(SCENARIO, 0, frame.assign(status="landed", is_slack=True))


CALLS = {
    "Cast": (lambda: wc.Cast, {"distance": 0.3, "speed": 0.6, "wait": 0.1, "bearing": 0.0}),
    "Cast.from_array": (lambda: wc.Cast.from_array, {"parameters": np.array([0.3, 0.6, 0.1]), "bearing": 0.0}),
    "Scenario": (lambda: wc.Scenario, dict.fromkeys(wc.Scenario.model_fields)),
    "Noise": (lambda: wc.Noise, dict.fromkeys(wc.Noise.model_fields)),
    "Scenario.from_dict": (lambda: wc.Scenario.from_dict, {"values": {}}),
    "Scenario.from_yaml": (lambda: wc.Scenario.from_yaml, {"path": "none.yaml"}),
    "Throw": (lambda: wc.Throw, {"cast": CAST, "cup": CUP}),
    "CastDataset": (
        lambda: wc.CastDataset,
        {"scenario": SCENARIO, "seed": 0, "frame": pd.DataFrame(), "controller": "a", "engine": "drake"},
    ),
    "CastDataset.load": (lambda: wc.CastDataset.load, {"directory": "none", "scenario": SCENARIO}),
    "generate_dataset": (
        lambda: wc.generate_dataset,
        {
            "scenario": SCENARIO,
            "n_casts": 1,
            "seed": 0,
            "make_controller": None,
            "engine": "drake",
            "executor": None,
            "n_workers": None,
            "directory": None,
            "on_progress": None,
        },
    ),
    "ForwardModel.fit": (lambda: wc.ForwardModel.fit, {"data": dataset(), "estimator": None}),
    "ForwardModel.from_hyperparameters": (
        lambda: wc.ForwardModel.from_hyperparameters,
        {"data": dataset(), "sigma": 0.5, "regularization": 1e-4},
    ),
    "ForwardModel.load": (lambda: wc.ForwardModel.load, {"path": "none", "scenario": SCENARIO, "controller": None}),
    "ForwardModel.serves": (lambda: wc.reference_model().serves, {"scenario": SCENARIO}),
    "ForwardModel.bound_to": (lambda: wc.reference_model().bound_to, {"scenario": SCENARIO, "controller": None}),
    "ForwardModel.save": (lambda: wc.reference_model().save, {"path": "none"}),
    "plan_cast": (
        lambda: wc.plan_cast,
        {"model": wc.reference_model(), "cup": CUP, "method": "gradient", "solver": None},
    ),
    "preview_scenario": (lambda: wc.preview_scenario, {"scenario": SCENARIO, "n_casts": 2}),
    "reproduce": (
        lambda: wc.reproduce,
        {
            "scenario": SCENARIO,
            "directory": "none",
            "seed": 0,
            "engine": "drake",
            "executor": None,
            "n_workers": None,
            "on_progress": None,
        },
    ),
    "CastController": (lambda: wc.CastController, {"scenario": SCENARIO}),
    "CastStation": (
        lambda: wc.CastStation,
        {"scenario": SCENARIO, "belief": SCENARIO, "controller": None, "meshcat": None},
    ),
    "CastSimulator": (
        lambda: wc.CastSimulator,
        {"scenario": SCENARIO, "belief": SCENARIO, "make_controller": wc.CastController},
    ),
    "CastSimulator.simulate": (lambda: simulator().simulate, {"cast": CAST, "cup": CUP, "noise_seed": 0}),
    "CastSimulator.record": (lambda: simulator().record, {"cast": CAST, "cup": CUP, "noise_seed": 0}),
    "CastSimulator.simulate_sequence": (
        lambda: simulator().simulate_sequence,
        {"throws": [wc.Throw(CAST, CUP)], "noise_seed": 0, "on_outcome": None},
    ),
    "CastSimulator.record_sequence": (
        lambda: simulator().record_sequence,
        {"throws": [wc.Throw(CAST, CUP)], "noise_seed": 0, "on_outcome": None, "on_recording": None},
    ),
    "RobotDistribution": (
        lambda: wc.RobotDistribution,
        {"believed": SCENARIO, "ranges": (), "scale": 1.0, "shifts": {}},
    ),
    "RobotDistribution.scaled": (lambda: wc.RobotDistribution().scaled, {"scale": 2.0}),
    "RobotDistribution.shifted": (lambda: wc.RobotDistribution().shifted, {"shifts": {"ball.mass": 0.5}}),
    "RobotDistribution.draw": (lambda: wc.RobotDistribution().draw, {"seed": 0}),
    "SimulatedRobot": (
        lambda: wc.SimulatedRobot,
        {"truth": SCENARIO, "belief": None, "seed": 0, "landing_std": 0.0, "observe": "direct", "n_before": 0},
    ),
    "SimulatedRobot.draw": (
        lambda: wc.SimulatedRobot.draw,
        {"robots": wc.RobotDistribution(), "seed": 0, "landing_std": 0.0, "observe": "direct"},
    ),
    "SimulatedRobot.cast": (lambda: wc.SimulatedRobot(SCENARIO).cast, {"cast": CAST, "cup": CUP}),
    "AdaptiveModel.from_prior": (
        lambda: wc.AdaptiveModel.from_prior,
        {"robots": wc.RobotDistribution(), "believed": None},
    ),
    "AdaptiveModel.observe": (
        lambda: adaptive_model().observe,
        {"casts": [CAST], "landings": [[0.5, 0.0]], "std": 0.002},
    ),
    "AdaptiveModel.learn": (lambda: adaptive_model().learn, {"observations": []}),
    "AdaptiveModel.toward": (lambda: adaptive_model().toward, {"bearing": 0.1}),
    "read_recording": (lambda: wc.read_recording, {"path": "cast.csv"}),
    "write_recording": (
        lambda: wc.write_recording,
        {"recording": wc.CastRecording.__new__(wc.CastRecording), "path": "cast.csv"},
    ),
    "simulate_batch": (
        lambda: wc.simulate_batch,
        {"scenario": SCENARIO, "casts": [], "noise_seeds": None, "precision": "float64", "belief": None},
    ),
    "batch_derivatives": (
        lambda: wc.batch_derivatives,
        {"scenario": SCENARIO, "casts": [], "parameters": ["speed"], "noise_seeds": None, "belief": None},
    ),
    "simulate_cast": (
        lambda: wc.simulate_cast,
        {"scenario": SCENARIO, "cast": CAST, "cup": CUP, "belief": None, "noise_seed": 0, "make_controller": None},
    ),
    "simulate_casts": (
        lambda: wc.simulate_casts,
        {"scenario": SCENARIO, "casts": [CAST], "cups": [CUP], "belief": None, "noise_seed": 0, "on_outcome": None},
    ),
}
"""Public functions, each with arguments that it takes, or that it refuses later than the ones that are wrong."""

NOTHING_TO_GIVE = {"__version__", "reference_model", "reference_dataset"}
RESULTS = {"Plan", "Solution", "Outcome", "Status", "CastRecording", "MeasuredCast", "Observation"}
"""They are made by the package."""
OF_OTHERS = {"InputError", "KernelRidge", "ArmController"}
"""An exception, an estimator that scikit-learn's own checks look at, and a base class."""


def simulator(made=[]):  # noqa: B006 - one for all
    if not made:
        made.append(wc.CastSimulator(SCENARIO))
    return made[0]


def adaptive_model():
    return wc.AdaptiveModel.from_prior(wc.RobotDistribution())


PAIRS = [(name, argument) for name, (_, arguments) in CALLS.items() for argument in arguments]


@pytest.mark.parametrize(("name", "argument"), PAIRS)
@pytest.mark.parametrize("wrong", [Wrong(), [[Wrong()]]], ids=["object", "nested"])
def test_an_argument_of_the_wrong_type_is_one_line_that_names_it(tmp_path, monkeypatch, name, argument, wrong):
    monkeypatch.chdir(tmp_path)
    function, arguments = CALLS[name]
    given = {one: value for one, value in arguments.items() if one == argument or name not in ("Scenario", "Noise")}
    with pytest.raises((InputError, TypeError)) as caught:
        function()(**(given | {argument: wrong}))
    assert argument.removesuffix("s") in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_every_public_name_is_looked_at():
    looked_at = {name.partition(".")[0] for name in CALLS}
    assert looked_at | NOTHING_TO_GIVE | RESULTS | OF_OTHERS == set(wc.__all__)
    flags = {"quick", "force", "returns", "has_scene", "has_ball", "ends_early", "sees_move", "is_measured"}
    for name, (function, arguments) in CALLS.items():
        if name not in ("Scenario", "Noise"):
            assert set(inspect.signature(function()).parameters) - flags == set(arguments), name


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda: wc.simulate_cast(SCENARIO, CAST, belief=3), "belief = 3 must be a Scenario or None"),
        (lambda: wc.simulate_cast(SCENARIO, (0.3, 0.6, 0.1)), "cast = (0.3, 0.6, 0.1) must be a Cast"),
        (lambda: wc.simulate_casts(SCENARIO, [CAST, 3], [CUP, CUP]), "casts = [Cast(distance=0.3, speed=0.6, wait=0.1"),
        (lambda: wc.CastSimulator(SCENARIO, make_controller=5), "make_controller = 5 must be a function"),
        (
            lambda: wc.plan_cast(wc.reference_model(), cup="x"),
            "cup = 'x' must be the pair (x, y) of its axis in metres",
        ),
        (lambda: wc.plan_cast(3, CUP), "model = 3 must be a Predictor"),
        (lambda: wc.ForwardModel.fit(3), "data = 3 must be a CastDataset"),
        (lambda: wc.ForwardModel.load(None), "path = None must be a text or a path"),
        (lambda: wc.generate_dataset(SCENARIO, "10"), "n_casts = '10' must be an integer, 1 or more"),
        (lambda: wc.generate_dataset("scenario.yaml"), "scenario = 'scenario.yaml' must be a Scenario"),
        (lambda: wc.Cast("0.3", 0.6, 0.1), "cast: distance = '0.3' is not a finite number"),
        (lambda: wc.Cast(10**400, 0.6, 0.1), "is not a finite number"),
        (lambda: wc.Cast.from_array([0.3, 0.6]), "parameters = [0.3, 0.6] must be [distance, speed, wait]"),
        (lambda: wc.Scenario(ball=3), "ball: must map some of these keys to values: mass, radius"),
        (lambda: wc.Scenario(ball={"mass": "heavy"}), "ball.mass: input should be a valid number"),
        (lambda: wc.Noise(swing=-1), "swing: input should be greater than or equal to 0, not -1"),
    ],
)
def test_the_line_says_what_is_allowed(call, line):
    with pytest.raises(InputError) as caught:
        call()
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_as_good_is_taken():
    casts = np.array([CAST, CAST], dtype=object)
    assert wc.Throw(CAST, [0.75, 0]).cup == [0.75, 0]
    assert wc.Cast(np.float32(0.3), np.int64(1), 0).speed == 1
    assert wc.Cast.from_array([0.3, 0.6, 0.1]) == CAST
    assert len(wc.simulate_casts(SCENARIO, casts[:1], np.array([[0.75, 0.0]]))) == 1
    with pytest.raises(TypeError, match=r"missing 1 required positional argument: 'cast'"):
        wc.simulate_cast(SCENARIO)
    assert str(inspect.signature(wc.simulate_cast)).startswith("(scenario: 'Scenario', cast: 'Cast'")
    assert pickle.loads(pickle.dumps(wc.Throw(CAST, CUP))) == wc.Throw(CAST, CUP)
