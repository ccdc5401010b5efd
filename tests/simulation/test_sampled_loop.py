"""The loop without a diagram gives what the station's diagram gives, bit for bit, whatever lies between law and plant."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wam_cast.cast import Cast
from wam_cast.robot.controller import ArmController, CastController
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Scenario
from wam_cast.simulation.outcome import Outcome, Status
from wam_cast.simulation.recording import CastRecording, Throw
from wam_cast.simulation.sampled_loop import SampledLoop, make_loop
from wam_cast.simulation.simulator import CastSimulator
from wam_cast.simulation.station_loop import StationLoop

TYPICAL = Cast(0.30, 0.60, 0.10)

GROUPS = {
    "arm": {
        "coulomb_friction": (0.5,) * 7,
        "torque_scale": (1.0, 0.9, 1.0, 1.1, 1.0, 1.0, 1.0),
        "encoder_offset": (0.0, 0.004, 0.0, -0.003, 0.0, 0.002, 0.0),
        "base_tilt": (0.01, -0.02),
        "knee_speed": 0.2,
    },
    "string": {"bending_stiffness": 1e-7},
    "controller": {"delay": 2, "kp": 3000.0, "kd": 120.0},
    "noise": {"torque": 0.01, "encoder_counts": 4096, "swing": 0.02, "distance": 0.003, "wait": 0.01},
}
"""Values that are not the default ones, each of which takes part in the loop."""

EVERYTHING = {group: dict(values) for group, values in GROUPS.items()}

SHORT_TURN = {"turn_duration": 1.0}
"""Of a turn every period is the same to the loop."""

QUICK = SHORT_TURN | {"hold_duration": 0.4, "pull_duration": 0.4, "slide_duration": 0.4, "retreat_duration": 1.0}
"""And of a way home."""


def some_of(values):
    return st.fixed_dictionaries({}, optional={name: st.just(value) for name, value in values.items()})


SETTINGS = st.fixed_dictionaries({group: some_of(values) for group, values in GROUPS.items()})


def in_diagram(law):
    """Return a controller of the same law that keeps the diagram, since it computes its port itself."""

    class InDiagram(law):
        def _calc_actuation(self, context, output):
            super()._calc_actuation(context, output)

    return InDiagram


class Law(CastController):
    """The package's controller, whose loop need not be stable."""


def both(scenario, belief=None, law=Law):
    """Return a simulator with the loop of samples, and one with the diagram."""
    sampled, diagram = (CastSimulator(scenario, belief, make_controller=make) for make in (law, in_diagram(law)))
    assert isinstance(sampled._contact_free._loop, SampledLoop)
    assert not isinstance(diagram._contact_free._loop, SampledLoop)
    return sampled, diagram


def assert_identical(found, expected):
    for field in dataclasses.fields(Outcome):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(expected, field.name), err_msg=field.name)


def assert_same_recordings(found, expected):
    for field in dataclasses.fields(CastRecording):
        if field.name not in ("scenario", "cast", "cup", "outcome"):
            np.testing.assert_array_equal(getattr(found, field.name), getattr(expected, field.name), err_msg=field.name)
    assert_identical(found.outcome, expected.outcome)


def assert_equal(scenario, cast, belief=None):
    """Compare a cast into a cup where its ball lands, so that it goes through all phases."""
    sampled, diagram = both(scenario, belief)
    cup = tuple(sampled.simulate(cast, noise_seed=5).landing)
    assert np.isfinite(cup).all()
    found = sampled.record(cast, cup, noise_seed=5, returns=False)
    assert_same_recordings(found, diagram.record(cast, cup, noise_seed=5, returns=False))


@pytest.mark.parametrize(
    ("values", "bearing"), [(EVERYTHING, 0.0), ({"controller": {"delay": 1}}, -0.1)], ids=["everything", "turn"]
)
def test_it_equals_the_diagram(values, bearing):
    assert_equal(Scenario.from_dict(values | {"motion": SHORT_TURN}), Cast(0.30, 0.60, 0.10, bearing=bearing))


@pytest.mark.slow
@settings(max_examples=4)
@given(SETTINGS, st.sampled_from([0.0, 0.4]))
def test_it_equals_the_diagram_whatever_lies_between(values, bearing):
    assert_equal(Scenario.from_dict(values | {"motion": SHORT_TURN}), Cast(0.30, 0.60, 0.10, bearing=bearing))


@pytest.mark.parametrize(
    "values",
    [
        {"arm": {"mount": "floor", "mount_height": 0.2}, "motion": {"start_height": 0.9}},
        {"arm": {"mount": "wall", "mount_height": 1.0}, "motion": {"start_radius": 0.5}},
        pytest.param({"string": {"hook_damping": 0.01, "bending_stiffness": 1e-5}}, marks=pytest.mark.slow),
        pytest.param({"controller": {"period": 0.005}, "simulation": {"max_step": 0.001}}, marks=pytest.mark.slow),
    ],
    ids=["floor", "wall", "implicit method", "steps within a period"],
)
def test_it_equals_the_diagram_for_other_robots(values):
    assert_equal(Scenario.from_dict(values), TYPICAL)


@pytest.mark.slow
def test_it_equals_the_diagram_where_the_robot_is_not_what_is_believed():
    belief = Scenario.from_dict(
        {"arm": {"mass_scale": (1.0, 1.1, 1.0, 0.9, 1.0, 1.0, 1.0)}, "string": {"length": 0.55}}
    )
    assert_equal(Scenario.from_dict(EVERYTHING), TYPICAL, belief)


@pytest.mark.slow
def test_it_equals_the_diagram_from_cup_to_cup():
    controller = {"delay": 1, "kp": 3000.0, "kd": 120.0}
    sampled, diagram = both(Scenario.from_dict({"controller": controller, "noise": {"torque": 0.002}, "motion": QUICK}))
    casts = [TYPICAL, Cast(0.20, 0.30, 0.45, bearing=0.05)]
    throws = [Throw(cast, tuple(diagram.simulate(cast).landing)) for cast in casts]
    expected = diagram.record_sequence(throws)
    assert expected[0].outcome.is_caught
    for found, recording in zip(sampled.record_sequence(throws), expected, strict=True):
        assert_same_recordings(found, recording)


def test_it_diverges_as_the_diagram_does(monkeypatch):
    sampled, diagram = both(Scenario())
    monkeypatch.setattr("wam_cast.simulation.station_loop.MAX_BALL_SPEED", 1.0)
    expected = diagram.simulate(TYPICAL)
    assert expected.status is Status.DIVERGED
    assert_identical(sampled.simulate(TYPICAL), expected)


def gives_nan():
    return np.full(7, np.nan)


def fails():
    raise RuntimeError("no torque to be had")


@pytest.mark.parametrize(("late", "message"), [(gives_nan, "Detected NaN"), (fails, "no torque to be had")])
def test_an_error_of_the_law_is_told_as_by_the_diagram(late, message):
    class Broken(CastController):
        def torque(self, arm, desired):
            return super().torque(arm, desired) if desired.time < 0.1 else late()

    for simulator in both(Scenario(), law=Broken):
        with pytest.raises(RuntimeError, match=message):
            simulator.simulate(TYPICAL)


def test_an_impact_that_no_step_is_short_enough_for_diverges_as_in_the_diagram(monkeypatch):
    """In the middle of a period: where the log ends is the integrator's choice."""
    sampled, diagram = both(Scenario())
    cup = tuple(sampled.simulate(TYPICAL).landing)
    monkeypatch.setattr("wam_cast.simulation.integration.MIN_STEP", 1e-3)
    expected = diagram.record(TYPICAL, cup)
    assert expected.outcome.status is Status.DIVERGED
    assert_same_recordings(sampled.record(TYPICAL, cup), expected)


@pytest.mark.slow
def test_outcomes_do_not_depend_on_what_was_simulated_before():
    sampled = CastSimulator(Scenario.from_dict(EVERYTHING), make_controller=Law)
    first = sampled.record(TYPICAL, (0.6, 0.0), noise_seed=3, returns=False)
    sampled.record(Cast(0.2, 0.4, 0.3), noise_seed=4)
    assert_same_recordings(sampled.record(TYPICAL, (0.6, 0.0), noise_seed=3, returns=False), first)


class Soft(ArmController):
    def torque(self, arm, desired):
        return 500 * arm.Jv_WE.T @ (desired.p_WE - arm.p_WE) + arm.holding_torque


def test_a_law_of_ones_own_is_sampled_too():
    sampled, diagram = both(Scenario(), law=Soft)
    assert_same_recordings(sampled.record(TYPICAL), diagram.record(TYPICAL))


class WithState(CastController):
    """Remembers something, of which a pure law could know nothing."""

    def __init__(self, scenario):
        super().__init__(scenario)
        self.DeclareDiscreteState(1)


class WithEvent(CastController):
    """Does something ten times a second."""

    def __init__(self, scenario):
        super().__init__(scenario)
        self.n_events = 0
        self.DeclarePeriodicPublishEvent(0.1, 0.0, self._count)

    def _count(self, context):
        self.n_events += 1


class OtherStart(CastController):
    """Is told of no places."""

    def set_cast(self, context, cast):
        super().set_cast(context, cast)


@pytest.mark.parametrize(
    ("make", "loop"),
    [
        (CastController, SampledLoop),
        (OtherStart, SampledLoop),
        (WithState, StationLoop),
        (WithEvent, StationLoop),
        (in_diagram(Law), StationLoop),
    ],
)
def test_the_diagram_is_kept_where_torque_is_not_the_whole(make, loop):
    station = CastStation(Scenario(), has_scene=False, controller=make(Scenario()))
    assert type(make_loop(station, "runge_kutta3", 0.002, 0.01)) is loop


def test_events_of_a_controller_of_ones_own_happen():
    made = []
    simulator = CastSimulator(Scenario(), make_controller=lambda known: made.append(WithEvent(known)) or made[-1])
    end = simulator.simulate(Cast(0.3, 0.6, 0.1)).end_time
    assert max(one.n_events for one in made) >= int(end / 0.1)
