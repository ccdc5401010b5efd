"""Noise: drawn as it says, a pure function of its seed, and physically what it is meant to be."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import kstest

from wam_cast.arm.arm_chain import arm_chain, encoder_resolution
from wam_cast.cast import PARAMETERS, Cast
from wam_cast.casting_plane import to_casting_plane
from wam_cast.errors import InputError
from wam_cast.motion.noise_draws import CHUNK, Source, executed_cast, random_stream, swing_at_start, torque_deviates
from wam_cast.motion.stages import CastMotion
from wam_cast.robot.controller import CastController
from wam_cast.robot.motors import saturate
from wam_cast.robot.noise import TorqueNoise
from wam_cast.robot.station import CastStation
from wam_cast.scenario import Noise, Scenario
from wam_cast.simulation.outcome import Outcome
from wam_cast.simulation.simulator import CastSimulator, simulate_cast

CAST = Cast(0.30, 0.60, 0.10, bearing=1e-3)  # its turn is short
TYPICAL = Noise.typical()
NAMES = tuple(Noise.model_fields)
PERIOD = 0.002
LIMITS = np.array([75.6, 101.7, 60.5, 28.8, 11.4, 11.4, 2.6])
BIG_SEED = 2**64 - 1


def only(*names):
    """Return typical noise of these sources alone."""
    return Noise(**{name: getattr(TYPICAL, name) for name in names})


def simulator_of(noise, **changes):
    return CastSimulator(Scenario(noise=noise, **changes))


def assert_identical(found, expected):
    for field in dataclasses.fields(Outcome):
        np.testing.assert_array_equal(getattr(found, field.name), getattr(expected, field.name), err_msg=field.name)


@pytest.fixture(scope="module")
def noisy():
    return simulator_of(TYPICAL)


@pytest.fixture(scope="module")
def quiet(simulator):
    """Return the outcome without noise."""
    return simulator.simulate(CAST)


@pytest.fixture(scope="module")
def outcomes(noisy):
    """Return the outcomes of some seeds, simulated after each other."""
    return {seed: noisy.simulate(CAST, noise_seed=seed) for seed in (0, 7, 2**32, BIG_SEED)}


# ---------------------------------------------------------------- a pure function of the seed


@pytest.mark.parametrize("seed", [1, BIG_SEED])
def test_without_noise_the_seed_is_of_no_consequence(simulator, quiet, seed):
    assert_identical(simulator.simulate(CAST, noise_seed=seed), quiet)


def test_without_noise_the_diagram_is_what_it_was(simulator):
    names = {system.get_name() for system in CastStation(Scenario()).diagram.GetSystems()}
    assert names == {"plant", "scene_graph", "controller", "motors", "hold", "ball_tracker", "state_log", "torque_log"}


def test_same_seed_gives_the_same_cast_whoever_ran_before(outcomes):
    fresh = simulator_of(TYPICAL)
    for seed in (BIG_SEED, 7):
        assert_identical(fresh.simulate(CAST, noise_seed=seed), outcomes[seed])
    assert_identical(simulate_cast(Scenario(noise=TYPICAL), CAST, noise_seed=0), outcomes[0])


@pytest.mark.slow
def test_same_seed_gives_the_same_cast_into_a_cup(noisy):
    cup = tuple(noisy.simulate(CAST, noise_seed=5).landing)
    first = noisy.simulate(CAST, cup, noise_seed=5)
    assert first.is_caught
    noisy.simulate(CAST, cup, noise_seed=6)
    assert_identical(noisy.record(CAST, cup, noise_seed=5).outcome, first)


def test_other_seeds_give_other_landings(outcomes):
    assert len({tuple(outcome.landing) for outcome in outcomes.values()}) == len(outcomes)


@pytest.mark.parametrize("name", NAMES)
def test_each_source_alone_moves_the_landing(quiet, name):
    moved = simulator_of(only(name)).simulate(CAST, noise_seed=1).landing - quiet.landing
    assert 1e-6 < np.linalg.norm(moved) < 0.05


def test_sources_do_not_disturb_each_others_draw():
    together, alone = Scenario(noise=TYPICAL), Scenario(noise=only("swing"))
    np.testing.assert_array_equal(swing_at_start(together, 4), swing_at_start(alone, 4))
    executed = executed_cast(TYPICAL, CAST, 4)
    for name in PARAMETERS:
        assert getattr(executed_cast(only(name), CAST, 4), name) == getattr(executed, name)


def test_streams_share_no_numbers():
    streams = [(seed, source, chunk) for seed in (0, 1, BIG_SEED) for source in Source for chunk in (0, 1)]
    numbers = np.concatenate([random_stream(*stream).standard_normal(50) for stream in streams])
    assert len(np.unique(numbers)) == numbers.size


@pytest.mark.parametrize("seed", [-1, 0.5, "one", None])
def test_seed_that_is_no_integer_is_refused(simulator, seed):
    for run in (simulator.simulate, simulator.record, lambda *a, **k: simulate_cast(Scenario(), *a, **k)):
        with pytest.raises(InputError, match=r"^noise_seed = .* must be an integer, 0 or more$"):
            run(CAST, noise_seed=seed)


# ---------------------------------------------------------------- repeatability of the move


def test_moves_have_the_deviations_that_the_scenario_states():
    casts = np.array([executed_cast(TYPICAL, CAST, seed).to_array() for seed in range(2000)])
    deviates = (casts - CAST.to_array()) / [TYPICAL.distance, TYPICAL.speed, TYPICAL.wait]
    for column in deviates.T:
        assert kstest(column, "norm").pvalue > 0.01
    correlation = np.corrcoef(deviates.T)[np.triu_indices(3, 1)]
    assert np.abs(correlation).max() < 4 / np.sqrt(len(casts))


def test_moves_stay_physical():
    wild = Noise(distance=1.0, speed=1.0, wait=1.0)
    casts = np.array([executed_cast(wild, CAST, seed).to_array() for seed in range(200)])
    np.testing.assert_allclose(casts.min(axis=0), [0.03, 0.06, 0.0], rtol=1e-12)
    assert executed_cast(wild, CAST, 0).bearing == CAST.bearing


def test_noise_of_the_move_is_a_cast_without_noise_of_the_executed_parameters(simulator):
    noisy = simulator_of(only("distance", "speed", "wait"))
    executed = executed_cast(noisy.scenario.noise, CAST, 2)
    assert executed != CAST
    assert_identical(noisy.simulate(CAST, noise_seed=2), simulator.simulate(executed))


def test_recording_judges_by_the_executed_motion_and_keeps_the_command(noisy):
    recording = noisy.record(CAST, noise_seed=2)
    motion = CastMotion(noisy.scenario, executed_cast(TYPICAL, CAST, 2))
    assert recording.cast == CAST
    np.testing.assert_array_equal(recording.p_WE_desired, [motion.evaluate(t)[0] for t in recording.times])
    assert list(recording.stages) == [motion.stage(t) for t in recording.times]
    assert recording.outcome.peak_tracking_error < 0.02


@pytest.mark.slow
def test_landings_scatter_as_their_sensitivity_to_the_distance_says(simulator):
    noise = only("distance")
    noisy, seeds = simulator_of(noise), range(12)
    step = 0.002
    ends = [
        simulator.simulate(dataclasses.replace(CAST, distance=CAST.distance + h)).landing_along for h in (step, -step)
    ]
    sensitivity = (ends[0] - ends[1]) / (2 * step)
    landings = [noisy.simulate(CAST, noise_seed=seed).landing_along for seed in seeds]
    drawn = [executed_cast(noise, CAST, seed).distance for seed in seeds]
    assert np.std(landings) == pytest.approx(abs(sensitivity) * np.std(drawn), rel=0.03)
    assert abs(sensitivity) > 1


# ---------------------------------------------------------------- swing


def test_swing_has_the_deviations_that_the_scenario_states():
    scenario = Scenario(noise=only("swing"))
    drawn = np.array([np.ravel(swing_at_start(scenario, seed)) for seed in range(2000)])
    frequency = np.sqrt(9.81 / scenario.string.length)
    for column in (drawn / TYPICAL.swing / [1, 1, frequency, frequency]).T:
        assert kstest(column, "norm").pvalue > 0.01
    assert np.abs(np.corrcoef(drawn.T)[np.triu_indices(4, 1)]).max() < 4 / np.sqrt(len(drawn))


@pytest.mark.parametrize("seed", [0, 1])
def test_ball_hangs_off_and_moves_as_drawn(seed):
    station = CastStation(Scenario(noise=only("swing")), has_scene=False)
    context = station.diagram.CreateDefaultContext()
    station.set_start(context, dataclasses.replace(CAST, bearing=0.0), noise_seed=seed)
    p_WE = station.plant.GetBodyByName("tool_plate").EvalPoseInWorld(station.plant.GetMyContextFromRoot(context))
    p_EL_W = station.diagram.GetOutputPort("ball_position").Eval(context) - p_WE.translation()
    v_WL = station.diagram.GetOutputPort("ball_velocity").Eval(context)
    length = station.scenario.string.length
    angles, rates = swing_at_start(station.scenario, seed)
    assert np.linalg.norm(p_EL_W) == pytest.approx(length, rel=1e-12)
    # In the casting plane, x, and across it, y, up to the sense in which each angle counts.
    np.testing.assert_allclose(np.abs(p_EL_W[:2]), length * np.abs(np.sin(angles)), rtol=1e-4)
    np.testing.assert_allclose(np.abs(v_WL[:2]), length * np.abs(rates), rtol=1e-3)
    assert np.all(np.sign(p_EL_W[:2] * v_WL[:2]) == np.sign(angles * rates))


def test_hanging_ball_swings_with_the_drawn_amplitude():
    # A move so short that the string does not feel it, over one and a half periods of the pendulum.
    scenario = Scenario(noise=only("swing"))
    recording = CastSimulator(scenario).record(Cast(1e-4, 4e-5, 0.0), noise_seed=1)
    swung = (recording.p_WL - recording.p_WE)[: round(2.4 / PERIOD), :2]
    angles, rates = swing_at_start(scenario, 1)
    amplitude = np.hypot(angles, rates / np.sqrt(9.81 / scenario.string.length))
    np.testing.assert_allclose(np.abs(swung).max(axis=0), scenario.string.length * amplitude, rtol=0.06)


# ---------------------------------------------------------------- torque


def torque_noise(share, commanded, sample, seed=0, within=0.0):
    """Return the output of the block, `within` a share of a period after a sample."""
    block = TorqueNoise(share, LIMITS, PERIOD)
    context = block.CreateDefaultContext()
    block.set_seed(context, seed)
    block.get_input_port().FixValue(context, commanded)
    context.SetTime((sample + within) * PERIOD)
    return block.get_output_port().Eval(context)


def test_torque_noise_is_that_of_its_sample_and_seed_for_a_period():
    zero = np.zeros(7)
    # 2001 periods of 2 ms are less than 2001 of them in floating point.
    for sample in (0, 1, 3, 29, CHUNK - 1, CHUNK, 2001, 2999):
        expected = 0.01 * LIMITS * torque_deviates(9, sample)
        for within in (0.0, 0.3, 0.999):
            np.testing.assert_array_equal(torque_noise(0.01, zero, sample, 9, within), expected)
    deviates = [torque_deviates(seed, sample) for seed in (8, 9) for sample in (0, 1, CHUNK)]
    assert len(np.unique(deviates)) == 6 * 7


def test_torque_deviates_are_standard_normal_and_independent():
    deviates = np.array([torque_deviates(1, sample) for sample in range(3000)])
    for column in deviates.T:
        assert kstest(column, "norm").pvalue > 0.01
    assert np.abs(np.corrcoef(deviates.T)[np.triu_indices(7, 1)]).max() < 4 / np.sqrt(3000)
    following = [np.corrcoef(column[1:], column[:-1])[0, 1] for column in deviates.T]
    assert np.abs(following).max() < 4 / np.sqrt(3000)


def test_torque_noise_is_added():
    command = np.array([70.0, -50.0, 25.0, 28.0, 5.0, -6.0, 2.5])
    for share in (1e-3, 0.5):
        found = torque_noise(share, command, 4)
        np.testing.assert_allclose(found, command + share * LIMITS * torque_deviates(0, 4), rtol=1e-12)


def test_torque_noise_keeps_its_seed_in_the_context():
    block = TorqueNoise(0.01, LIMITS, PERIOD)
    one, other = block.CreateDefaultContext(), block.CreateDefaultContext()
    for context, seed in ((one, 3), (other, BIG_SEED)):
        block.get_input_port().FixValue(context, np.zeros(7))
        block.set_seed(context, seed)
    clone = one.Clone()
    for context, seed in ((one, 3), (other, BIG_SEED), (clone, 3)):
        expected = 0.01 * LIMITS * torque_deviates(seed, 0)
        np.testing.assert_array_equal(block.get_output_port().Eval(context), expected)
    block.set_seed(clone, 5)
    np.testing.assert_array_equal(block.get_output_port().Eval(clone), 0.01 * LIMITS * torque_deviates(5, 0))
    np.testing.assert_array_equal(block.get_output_port().Eval(one), 0.01 * LIMITS * torque_deviates(3, 0))
    with pytest.raises(ValueError, match="read-only"):
        torque_deviates(3, 0)[0] = 1.0


@pytest.mark.slow
def test_every_torque_of_a_recording_is_the_law_of_what_the_encoders_saw_and_the_noise():
    """In the contact-free phase as in that with contact: nothing is drawn anew at the hand-over, nor shifted by a sample."""
    quick = dict.fromkeys(("hold", "fetch", "pull", "slide", "lift", "retreat"), 0.3)
    motion = {f"{stage}_duration": duration for stage, duration in quick.items()}
    scenario = Scenario.from_dict({"noise": TYPICAL.model_dump(), "motion": motion})
    noisy, seed = CastSimulator(scenario), 11
    recording = noisy.record(CAST, tuple(noisy.simulate(CAST, noise_seed=seed).landing), noise_seed=seed)
    assert recording.outcome.is_caught
    controller = CastController(scenario)
    context = controller.CreateDefaultContext()
    along, _ = to_casting_plane(np.array(recording.cup), CAST.bearing)
    controller.set_cast(context, executed_cast(scenario.noise, CAST, seed), cup_radius=along)
    resolution = encoder_resolution(arm_chain(scenario.arm), TYPICAL.encoder_counts)
    unit = np.concatenate([resolution, resolution / PERIOD])
    n_q = recording.states.shape[1] // 2
    arm_states = recording.states[:, np.r_[0:7, n_q : n_q + 7]]
    expected = []
    for k, arm_state in enumerate(arm_states[:-1]):
        context.SetTime(recording.times[k])
        controller.get_input_port().FixValue(context, np.rint(arm_state / unit) * unit)
        commanded = controller.GetOutputPort("actuation").Eval(context)
        expected.append(saturate(commanded + 0.005 * LIMITS * torque_deviates(seed, k), LIMITS))
    # Each log entry is the torque that was held up to then.
    np.testing.assert_allclose(recording.torques[1:], expected, atol=1e-9)


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_torque_noise_is_a_share_of_what_the_motors_give(scale):
    scenario = Scenario.from_dict({"noise": {"torque": 0.01}, "arm": {"torque_scale": scale}})
    quiet = scenario.without_noise
    given = []
    for setting, n_seeds in ((scenario, 200), (quiet, 1)):
        station = CastStation(setting, has_scene=False)
        context = station.diagram.CreateDefaultContext()
        samples = []
        for seed in range(n_seeds):
            station.set_start(context, Cast(0.3, 0.6, 0.1), noise_seed=seed)
            samples.append(station.motors.get_output_port().Eval(station.motors.GetMyContextFromRoot(context)))
        given.append(np.array(samples))
    limits = station.plant.GetEffortUpperLimits()
    deviation = (given[0] - given[1])[:, [0, 3, 6]].std(axis=0)
    np.testing.assert_allclose(deviation, 0.01 * limits[[0, 3, 6]], rtol=0.15)
