"""The closed loop's stability: against closed forms, and against what simulated casts do."""

import math
import re

import numpy as np
import pytest

from wam_cast.cast import Cast
from wam_cast.errors import InputError
from wam_cast.robot.controller import CastController, MeasuredArm
from wam_cast.robot.plant import N_ARM, make_arm_plant
from wam_cast.scenario import Scenario
from wam_cast.simulation.loop_stability import (
    MAX_GROWTH,
    _arm_dynamics,
    _corner_postures,
    _feedback,
    check_loop,
    loop_growth,
)
from wam_cast.simulation.outcome import Status
from wam_cast.simulation.simulator import CastSimulator


def scenario(**controller):
    return Scenario.from_dict({"controller": controller})


def growth(**controller):
    return loop_growth(scenario(**controller), scenario(**controller))


def scaled(factor, **controller):
    gains = Scenario().controller
    values = {name: factor * getattr(gains, name) for name in ("kp", "kd")}
    for name in ("posture_stiffness", "posture_damping"):
        values[name] = [factor * one for one in getattr(gains, name)]
    return scenario(**values, **controller)


def refusal_of(one):
    with pytest.raises(InputError, match="unstable") as caught:
        check_loop(one, one)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def number_after(words, line):
    return float(line.split(words)[1].split()[0])


def test_a_long_delay_turns_a_stable_loop_unstable_and_the_line_says_what_helps():
    check_loop(Scenario(), Scenario())
    line = refusal_of(scenario(delay=2))
    assert re.search(r"kp = 6000, kd = 250.*unstable.*delay = 2: errors double", line)
    for one in (
        scaled(number_after("multiply all gains by ", line), delay=2),
        scenario(delay=2, period=number_after("choose controller.period = ", line)),
        scenario(delay=int(number_after("choose controller.delay = ", line))),
    ):
        check_loop(one, one)


def test_only_what_helps_is_proposed():
    # An arm on the floor whose motors give twice what they are told: it is carried up, unless something holds it.
    arm = {"mount": "floor", "mount_height": 0.45, "wrist_pitch": 0.6}
    motion, bounds = {"start_radius": 0.45, "drop_duration": 0.5}, {"distance": [0.05, 0.25]}

    def station(factor, **arm_change):
        gains = scaled(factor).controller.model_copy(update={"posture_stiffness": N_ARM * (0.0,)})
        one = Scenario.from_dict({"arm": {**arm, **arm_change}, "motion": motion, "bounds": bounds})
        return one.model_copy(update={"controller": gains})

    def refusal(factor):
        with pytest.raises(InputError) as caught:
            check_loop(station(factor, torque_scale=N_ARM * [2.0]), station(factor))
        return str(caught.value)

    assert "neither other gains nor a shorter period or delay helps: look at `arm`" in refusal(0.0)
    weak = next(factor for factor in (1e-4, 3e-4, 1e-3, 3e-3) if "neither" not in refusal(factor))
    line = refusal(weak)
    assert "or less" not in line
    more = weak * number_after("multiply all gains by ", line)
    check_loop(station(more, torque_scale=N_ARM * [2.0]), station(more))


def test_more_delay_and_longer_periods_are_never_better():
    by_delay = [growth(delay=delay) for delay in (1, 2, 3, 5)]
    assert by_delay == sorted(by_delay)
    by_period = [growth(period=period) for period in (0.004, 0.006, 0.008, 0.01)]
    assert by_period == sorted(by_period)


def test_without_gains_nothing_grows_or_dies_out():
    # The controller carries the arm's weight, so that it stays where it is put.
    zero = [0.0] * N_ARM
    assert growth(kp=0, kd=0, posture_stiffness=zero, posture_damping=zero) == pytest.approx(0, abs=1e-3)


def test_a_short_period_approaches_the_continuous_loop():
    one = Scenario()
    plant, believed = make_arm_plant(one), MeasuredArm(make_arm_plant(one))
    rates = []
    for q in _corner_postures(one, believed):
        A, B = _arm_dynamics(plant, q)
        rates.append(np.linalg.eigvals(A + B @ _feedback(one, believed, q)).real.max())
    assert growth(period=1e-5) == pytest.approx(max(rates), rel=1e-2)


def test_postures_put_the_hand_where_casts_take_it():
    one = Scenario()
    believed = MeasuredArm(make_arm_plant(one))
    places = []
    for q in _corner_postures(one, believed):
        believed.measure(np.concatenate([q, np.zeros(N_ARM)]))
        places.append(believed.p_WE)
    expected = [(0.2, 0, 0.8), (0.2, 0, 0.35), (0.6, 0, 0.8), (0.6, 0, 0.35)]
    np.testing.assert_allclose(places, expected, atol=1e-6)


def test_feedback_is_the_derivative_of_the_law():
    from wam_cast.motion.stages import CastMotion
    from wam_cast.robot.controller import Desired

    one = Scenario()
    controller = CastController(one)
    q = controller._rest_state[:N_ARM]
    believed = MeasuredArm(make_arm_plant(one))
    believed.measure(np.concatenate([q, np.zeros(N_ARM)]))
    desired = Desired(believed.p_WE, np.zeros(3), 0.0, CastMotion(one, Cast(0.3, 0.6, 0.1)))

    def torque(state):
        believed.measure(state)
        return controller.torque(believed, desired)

    start, steps = np.concatenate([q, np.zeros(N_ARM)]), 1e-6 * np.eye(2 * N_ARM)
    found = np.column_stack([(torque(start + step) - torque(start - step)) / 2e-6 for step in steps])
    np.testing.assert_allclose(_feedback(one, believed, q), found, atol=1e-3 * np.abs(found).max())


@pytest.mark.slow
def test_random_loops_are_unstable_where_casts_fail():
    rng, longest, reference = np.random.default_rng(0), Cast(0.4, 0.6, 0.1), Scenario().controller

    def factor():
        return float(np.exp(rng.uniform(-math.log(8), math.log(8))))

    n_unstable = 0
    for _ in range(16):
        stiff, damped = factor(), factor()
        one = scenario(
            kp=reference.kp * factor(),
            kd=reference.kd * factor(),
            posture_stiffness=[stiff * value for value in reference.posture_stiffness],
            posture_damping=[damped * value for value in reference.posture_damping],
            period=float(rng.choice([0.001, 0.002, 0.004, 0.008])),
            delay=int(rng.choice([0, 0, 1, 2, 3])),
        )
        rate = loop_growth(one, one)
        if 0 < rate < 25:  # too slow to be told from a single cast
            continue
        simulator = CastSimulator(one, make_controller=lambda belief: CastController(belief))  # which nothing refuses
        outcome = simulator.simulate(longest)
        # An unstable loop saturates the motors; soft gains alone may exceed a velocity limit at the end of the drop.
        fails = outcome.status is Status.DIVERGED or any("torque" in limit for limit in outcome.limits_hit)
        assert fails == (rate > MAX_GROWTH), f"{one.controller}: {rate:.3g} 1/s"
        n_unstable += fails
    assert 3 < n_unstable < 15


def test_a_simulator_refuses_an_unstable_loop_but_not_a_controller_of_ones_own():

    unstable = scenario(delay=2)
    with pytest.raises(InputError, match="unstable"):
        CastSimulator(unstable)
    assert CastSimulator(unstable, make_controller=lambda one: CastController(one)).integration.expected_step > 0
