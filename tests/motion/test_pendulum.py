"""String and ball as a pendulum: its frequency against Drake's linearised plant, and the flat output in closed form."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wam_cast.motion.pendulum import Pendulum, hand_above, pendulum_derivatives, swing_frequency
from wam_cast.scenario import Ball, Cup, Scenario, String

G = 9.81


@pytest.mark.parametrize("n_links", [1, 2, 5, 10])
@pytest.mark.parametrize(
    "ball",
    [Ball(), Ball(mass=0.005, radius=0.05), Ball(radius=0.03, inertia_factor=0.66)],
    ids=["ball", "light", "shell"],
)
def test_frequency_is_that_of_the_linearised_plant(n_links, ball):
    from pydrake.multibody.plant import MultibodyPlant

    from wam_cast.robot.plant import add_ball, add_string

    string = String(n_links=n_links, bending_damping=0, hook_damping=0)
    plant = MultibodyPlant(0.0)
    add_ball(plant, ball, add_string(plant, string, ball, plant.world_frame()), 0.0)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, G])  # the string hangs along its own z
    plant.Finalize()
    context, n, h = plant.CreateDefaultContext(), plant.num_positions(), 1e-6
    columns = []
    for e in np.eye(n):
        plant.SetPositions(context, h * e)
        columns.append(plant.CalcGravityGeneralizedForces(context) / h)
    plant.SetPositions(context, np.zeros(n))
    squares = -np.linalg.eigvals(np.linalg.solve(plant.CalcMassMatrix(context), np.array(columns).T)).real
    assert swing_frequency(Scenario(string=string, ball=ball, cup=Cup(inner_radius=0.06))) == pytest.approx(
        np.sqrt(squares.min()), rel=1e-6
    )


def double_pendulum_frequency():
    """Return the lower frequency [rad/s] of a rod of 0.58 m and 3 g with the ball below it, its centre 0.02 m from their joint."""
    L, r, m, M = 0.58, 0.02, 0.003, 0.030
    inertia = np.array([[m * L**2 / 3 + M * L**2, M * L * r], [M * L * r, 1.4 * M * r**2]])
    stiffness = G * np.diag([(m / 2 + M) * L, M * r])
    return np.sqrt(np.linalg.eigvals(np.linalg.solve(inertia, stiffness)).min())


def test_one_link_and_a_ball_are_a_double_pendulum():
    found = swing_frequency(Scenario(string=String(n_links=1)))
    assert found == pytest.approx(double_pendulum_frequency(), rel=1e-12)


def test_frequency_goes_with_the_root_of_gravity():
    assert swing_frequency(Scenario(gravity=4 * G)) == pytest.approx(2 * swing_frequency(Scenario()), rel=1e-12)


def test_stiff_string_swings_as_a_rod():
    # Its links keep in line; only the ball turns on its knot.
    found = swing_frequency(Scenario(string=String(bending_stiffness=10.0)))
    assert found == pytest.approx(double_pendulum_frequency(), rel=1e-6)


def test_hand_above_a_ball_that_rests_hangs_it_straight():
    p_WE, v_WE = hand_above(np.array([0.3, 0.1, 0.2]), np.zeros(3), np.zeros(3), np.zeros(3), Pendulum(G / 16, G))
    np.testing.assert_allclose(p_WE, [0.3, 0.1, 0.2 + G / 16], atol=1e-15)
    np.testing.assert_array_equal(v_WE, 0)


def test_small_motion_is_the_linear_pendulums_flatness():
    # b'' = -omega^2 (b - p) gives p = b + b'' / omega^2, and its derivative.
    omega, small = 4.0, 1e-4
    b, v, a, jerk = small * np.array([[1.0, 2, 0], [3, -1, 0], [-2, 5, 0], [4, 1, 0]])
    p_WE, v_WE = hand_above(b, v, a, jerk, Pendulum(G / omega**2, G))
    np.testing.assert_allclose(p_WE[:2], (b + a / omega**2)[:2], atol=1e-3 * small)
    np.testing.assert_allclose(v_WE[:2], (v + jerk / omega**2)[:2], atol=1e-3 * small)


def test_ball_below_the_hand_moves_as_it_was_asked_to_at_any_angle():
    """A point mass on a massless string whose hook follows `hand_above` follows the path, though that takes it far aslant."""
    omega = 4.0
    length = G / omega**2

    def path(t, order):
        # A circle that grows: nothing about it is small, and no derivative is zero.
        z = (0.2 + 0.1j * t) * np.exp(2j * t)
        dz = 0.1j * np.exp(2j * t) + 2j * z
        ddz = 2j * (0.1j * np.exp(2j * t) + dz)
        dddz = 2j * (2j * 0.1j * np.exp(2j * t) + ddz)
        w = (z, dz, ddz, dddz)[order]
        return np.array([w.real, w.imag, 0.0])

    def hand(t):
        return hand_above(*(path(t, order) for order in range(4)), Pendulum(length, G))

    for t in (0.0, 0.4, 1.3):
        p_WE, v_WE = hand(t)
        line = path(t, 0) - p_WE
        assert np.linalg.norm(line) == pytest.approx(length, rel=1e-12)
        # All that the string can do to the ball is pull it toward the hand.
        pull = path(t, 2) + np.array([0, 0, G])
        np.testing.assert_allclose(np.cross(pull, line), 0, atol=1e-12)
        assert pull @ line < 0
        h = 1e-6
        np.testing.assert_allclose(v_WE, (hand(t + h)[0] - hand(t - h)[0]) / (2 * h), atol=1e-8)


def test_derivatives_of_the_free_pendulum_are_those_of_its_motion():
    omega, slant, rate = 4.0, 0.3, -0.5
    h = 0.01
    times = h * np.arange(-3, 4)

    def law(_, y):
        return [y[1], -(omega**2) * np.sin(y[0])]

    theta = [solve_ivp(law, (0, t), [slant, rate], rtol=1e-12, atol=1e-13).y[0, -1] if t else slant for t in times]
    place = G / omega**2 * np.column_stack([np.sin(theta), -np.cos(theta)])
    # The Taylor polynomial of these derivatives must fit the motion to the fifth order.
    orders = pendulum_derivatives(slant, rate, Pendulum(G / omega**2, G))
    powers = np.array([times**k / np.prod(np.arange(1, k + 1)) for k in range(5)]).T
    np.testing.assert_allclose(powers @ orders, place, atol=2e-7)
    assert np.abs(orders).min() > 1e-3, "none is zero by chance"
