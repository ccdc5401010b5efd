"""Casts in MuJoCo against those of Drake, at steps at which both have converged."""

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.crosscheck.flight_numbers import flight_numbers
from wam_cast.crosscheck.mujoco_flight import MujocoSimulator
from wam_cast.errors import InputError
from wam_cast.generation.engines import simulate_row
from wam_cast.generation.sampling import row_noise_seed, sample_cast
from wam_cast.scenario import Controller, Noise, Scenario, Simulation

pytest.importorskip("mujoco")


STEP = 5e-4
COUNTED = ("status", "is_slack")


def columns_of(simulator, cast, noise_seed=0):
    return flight_numbers(simulator.fly(cast, noise_seed), simulator.scenario, simulator.limits)


def both(scenario, seed, rows):
    """Yield the columns of each row in Drake and in MuJoCo."""
    simulator = MujocoSimulator(scenario, STEP)
    fine = scenario.model_copy(update={"simulation": Simulation(max_step=STEP)})
    for row in rows:
        drake = simulate_row(fine, seed, row)
        yield drake, columns_of(simulator, sample_cast(scenario, seed, row), row_noise_seed(seed, row))


@pytest.mark.slow
def test_landings_are_drakes():
    off = []
    for drake, own in both(Scenario(), 2, range(5)):
        assert own["status"] == drake["status"] == "landed"
        off.append(np.hypot(*(own[name] - drake[name] for name in ("landing_along", "landing_across"))))
    assert np.median(off) < 1e-7  # m
    assert max(off) < 1e-5


ROBOTS = {
    "noise": Scenario(noise=Noise.typical().model_copy(update={"encoder_counts": 0})),
    "another robot": Scenario.from_dict(
        {
            "arm": {
                "coulomb_friction": 0.8,
                "mass_scale": 1.3,
                "inertia_scale": 0.8,
                "rotor_inertia_scale": 1.2,
                "torque_scale": 0.9,
                "knee_speed": 0.5,
                "encoder_offset": 0.004,
                "base_tilt": [0.01, -0.02],
            },
            "controller": {"delay": 1},
            "string": {"n_links": 5, "bending_stiffness": 1e-5},
        }
    ),
    "floor": Scenario.from_dict({"arm": {"mount": "floor", "mount_height": 0.2}, "motion": {"start_radius": 0.4}}),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name != "another robot")) for name in ROBOTS]
)
def test_all_that_is_told_of_a_cast_is_drakes(name):
    for drake, own in both(ROBOTS[name], 3, range(1)):
        assert [own[column] for column in COUNTED] == [drake[column] for column in COUNTED]
        for column in own.keys() - COUNTED:
            assert own[column] == pytest.approx(drake[column], abs=2e-6, nan_ok=True), column


@pytest.mark.slow
def test_encoders_count_as_drakes_do():
    # Where a count falls is chance: no more than a few of them are to differ.
    scenario = Scenario(noise=Noise(encoder_counts=4096))
    ((drake, own),) = both(scenario, 2, range(1))
    assert own["landing_along"] == pytest.approx(drake["landing_along"], abs=1e-5)


@pytest.mark.slow
def test_a_turn_goes_before_the_cast():
    scenario = Scenario()
    simulator = MujocoSimulator(scenario)
    ahead, aside = (columns_of(simulator, Cast(0.3, 0.6, 0.1, bearing)) for bearing in (0.0, 0.5))
    assert aside["landing_along"] == pytest.approx(ahead["landing_along"], abs=5e-4)
    assert aside["crossing_time"] == pytest.approx(ahead["crossing_time"], abs=5e-3)


def test_a_seed_draws_the_noise():
    simulator = MujocoSimulator(Scenario(noise=Noise.typical()))
    first, same, other = (columns_of(simulator, Cast(0.3, 0.6, 0.1), seed)["landing_along"] for seed in (1, 1, 2))
    assert first == same
    assert abs(first - other) > 1e-5


def test_numbers_that_run_away_are_seen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    simulator = MujocoSimulator(Scenario(controller=Controller(kp=1e6, kd=1e5, period=0.05)))
    columns = columns_of(simulator, Cast(0.3, 0.6, 0.1))
    assert columns["status"] == "diverged"
    assert np.isnan(columns["landing_along"])
    assert not list(tmp_path.iterdir())


def test_a_string_too_stiff_for_its_steps_is_refused():
    stiff = Scenario.from_dict({"string": {"n_links": 40, "bending_damping": 1e-2}})
    with pytest.raises(InputError, match=r"string\.n_links = 40, string\.bending_damping = 0\.01 .* fewer links"):
        MujocoSimulator(stiff)


def test_steps_fit_the_control_period():
    simulator = MujocoSimulator(Scenario(), 3e-4)
    assert simulator.n_steps == 7
    assert simulator.robot.model.opt.timestep == pytest.approx(0.002 / 7)
