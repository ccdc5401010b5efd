"""String and ball against closed forms: pendulums, hanging chain, the ball about its knot, free fall, dissipation."""

from itertools import pairwise

import numpy as np
import pytest
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import FixedOffsetFrame, MultibodyForces
from pydrake.systems.analysis import Simulator
from scipy.integrate import quad
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import ellipk, j0, y0

from wam_cast.arm.posture import starting_posture
from wam_cast.robot.plant import N_ARM, STRING_RADIUS, add_ball, add_string, fill_plant, hanging_positions
from wam_cast.scenario import Ball, Scenario, String
from wam_cast.simulation.contact_free import ACCURACY
from wam_cast.simulation.integration import EXPLICIT, begin_integration

G = 9.81
BALL = Ball()
SHELL = Ball(inertia_factor=2 / 3)
SMALL = Ball(radius=0.005)
POINT = Ball(radius=1e-4)
UNDAMPED = {"bending_damping": 0.0, "hook_damping": 0.0, "knot_damping": 0.0}
DOWN = RotationMatrix(np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]))  # hook in the world: x along y, z down


class Pendulum:
    """String and ball below a hook that is fixed to the world at the origin."""

    def __init__(self, string, ball=BALL):
        self.string = string
        self.plant = MultibodyPlant(0.0)
        world = self.plant.world_frame()
        hook = self.plant.AddFrame(FixedOffsetFrame("hook", world, RigidTransform(DOWN, [0, 0, 0])))
        string_end = add_string(self.plant, string, ball, hook)
        self.ball = add_ball(self.plant, ball, string_end, string.knot_damping)
        self.plant.Finalize()
        self.n = self.plant.num_positions()
        self.context = self.plant.CreateDefaultContext()

    def in_plane(self, angles):
        """Return positions in which only the joints' first angles are turned, those at the top if not all are given."""
        q = np.zeros(self.n)
        angles = np.atleast_1d(angles)
        q[0 : 2 * len(angles) : 2] = angles
        return q

    def set(self, q, v=None):
        self.plant.SetPositionsAndVelocities(self.context, np.r_[q, np.zeros(self.n) if v is None else v])

    def ball_position(self, q):
        self.set(q)
        return self.ball.EvalPoseInWorld(self.context).translation()

    def acceleration(self, q, v=None):
        self.set(q, v)
        return self.plant.EvalTimeDerivatives(self.context).CopyToVector()[self.n :]

    def energy(self):
        return self.plant.EvalPotentialEnergy(self.context) + self.plant.EvalKineticEnergy(self.context)

    def states(self, q, duration, step):
        """Return times and states (n, 2 n_q) of a fall from rest under the integrator of a cast's contact-free phase."""
        simulator = Simulator(self.plant)
        begin_integration(simulator, EXPLICIT, step, ACCURACY)
        context = simulator.get_mutable_context()
        self.plant.SetPositions(context, q)
        simulator.Initialize()
        times, states = [0.0], [self.plant.GetPositionsAndVelocities(context)]
        for k in range(1, round(duration / step) + 1):
            simulator.AdvanceTo(k * step)
            times.append(k * step)
            states.append(self.plant.GetPositionsAndVelocities(context))
        return np.array(times), np.array(states)

    def in_plane_modes(self):
        """Return the eigenvalues of small motions in the plane about hanging, slowest first, one of each pair."""
        first = np.arange(0, self.n, 2)
        zero, h, w = np.zeros(self.n), 1e-4, 1e-2
        directions = np.eye(self.n)[first]
        columns = [(self.acceleration(h * e) - self.acceleration(-h * e))[first] / (2 * h) for e in directions]
        columns += [
            (self.acceleration(zero, w * e) - self.acceleration(zero, -w * e))[first] / (2 * w) for e in directions
        ]
        n = len(first)
        A = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), np.array(columns).T])
        eigenvalues = np.linalg.eigvals(A)
        eigenvalues = eigenvalues[eigenvalues.imag > 1e-6]
        return eigenvalues[np.argsort(eigenvalues.imag)]


def rigid_pendulum(string, ball=BALL):
    """Return inertia about the hook and restoring moment per angle of a straight string with its ball."""
    links = string.length - ball.radius
    inertia = string.mass * links**2 / 3 + ball.mass * (string.length**2 + ball.inertia_factor * ball.radius**2)
    return inertia, G * (string.mass * links / 2 + ball.mass * string.length)


def double_pendulum(string, ball=BALL):
    """Return mass and stiffness matrix of small angles from the vertical: of one link, and of the ball about its knot."""
    links, m, M, r = string.length - ball.radius, string.mass, ball.mass, ball.radius
    coupling = M * links * r
    mass = [[(m / 3 + M) * links**2, coupling], [coupling, M * (1 + ball.inertia_factor) * r**2]]
    return np.array(mass), np.diag([G * (m / 2 + M) * links, G * M * r])


def period(times, angles):
    """Return the mean time between downward zero crossings of `angles`, each found by a cubic through four samples."""
    crossings = []
    for k in np.flatnonzero((angles[:-1] > 0) & (angles[1:] <= 0)):
        cubic = np.polynomial.Polynomial.fit(times[k - 1 : k + 3], angles[k - 1 : k + 3], 3)
        crossings.append(brentq(cubic, times[k], times[k + 1]))
    return np.diff(crossings).mean()


def chain_frequency(string, ball, mode):
    """Return a mode's frequency and shape of a hanging flexible string with a ball hung at its surface, in Bessel functions.

    With z up from the knot and zeta = z + M / mu, g (zeta y')' + omega^2 y = 0 has J0 and Y0 of 2 omega sqrt(zeta / g); the
    hook keeps y = 0. The ball, tilted by s, has its centre at y - r s. The string pulls at the knot along y', so that
    g y' = -omega^2 (y - r s), and turns the ball: g (y' - s) = -omega^2 k r s, with k its inertia factor.
    """
    links = string.length - ball.radius
    mu = string.mass / links
    bottom = ball.mass / mu

    def shape(omega, zeta):
        top = 2 * omega * np.sqrt((links + bottom) / G)
        x = 2 * omega * np.sqrt(zeta / G)
        return j0(x) * y0(top) - y0(x) * j0(top)

    def end_condition(omega):
        h = 1e-6
        slope = (shape(omega, bottom + h) - shape(omega, bottom - h)) / (2 * h)
        stiffness = G - omega**2 * ball.inertia_factor * ball.radius  # of the ball's tilt: s = g y' / stiffness
        return stiffness * (G * slope + omega**2 * shape(omega, bottom)) - omega**2 * ball.radius * G * slope

    grid = np.linspace(0.5, 200, 8000)
    values = np.array([end_condition(omega) for omega in grid])
    brackets = np.flatnonzero(values[:-1] * values[1:] < 0)
    k = brackets[mode]
    omega = brentq(end_condition, grid[k], grid[k + 1])
    return omega, lambda z: shape(omega, z + bottom)


def modal_mass(string, phi):
    """Return the modal mass of a string with a `POINT` ball."""
    return string.mass / string.length * quad(lambda z: phi(z) ** 2, 0, string.length)[0] + POINT.mass * phi(0) ** 2


# ---------------------------------------------------------------- geometry and mass


@pytest.mark.parametrize("n_links", [1, 2, 10, 37])
def test_mass_and_length_do_not_depend_on_the_number_of_links(n_links):
    pendulum = Pendulum(String(n_links=n_links))
    assert pendulum.plant.CalcTotalMass(pendulum.context) == pytest.approx(0.003 + 0.030, rel=1e-12)
    for angle in (0.0, 0.7, -2.0):
        # The hook's x axis is the world's y, so the first angle swings in the world's x-z plane.
        expected = 0.6 * np.array([-np.sin(angle), 0, -np.cos(angle)])
        np.testing.assert_allclose(pendulum.ball_position(pendulum.in_plane(angle)), expected, atol=1e-14)


def test_balls_distance_from_the_hook_is_at_most_the_strings_length():
    pendulum = Pendulum(String())
    rng = np.random.default_rng(0)
    distances = [np.linalg.norm(pendulum.ball_position(rng.uniform(-1, 1, pendulum.n))) for _ in range(50)]
    assert max(distances) < 0.6
    assert np.linalg.norm(pendulum.ball_position(np.zeros(pendulum.n))) == pytest.approx(0.6, abs=1e-14)


@pytest.mark.parametrize("n_links", [1, 10])
def test_centre_of_mass_hangs_where_the_parts_put_it(n_links):
    pendulum = Pendulum(String(n_links=n_links))
    centre = pendulum.plant.CalcCenterOfMassPositionInWorld(pendulum.context)
    np.testing.assert_allclose(centre, [0, 0, -(0.003 * 0.29 + 0.030 * 0.6) / 0.033], atol=1e-14)


@pytest.mark.parametrize("ball", [BALL, SHELL])
@pytest.mark.parametrize("n_links", [1, 4, 10])
def test_straight_string_has_the_inertia_of_a_rod_whatever_its_links(n_links, ball):
    pendulum = Pendulum(String(n_links=n_links), ball)
    pendulum.set(np.zeros(pendulum.n))
    M = pendulum.plant.CalcMassMatrix(pendulum.context)
    expected = rigid_pendulum(pendulum.string, ball)[0]
    assert M[0, 0] == pytest.approx(expected, rel=1e-12)  # in the casting plane
    assert M[1, 1] == pytest.approx(expected, rel=1e-12)  # across it


def test_ball_hangs_at_its_surface_and_turns_about_that_point():
    pendulum = Pendulum(String())
    for angle in (0.3, -2.0):
        q = np.zeros(pendulum.n)
        q[-2] = angle
        expected = [-0.02 * np.sin(angle), 0, -0.58 - 0.02 * np.cos(angle)]
        np.testing.assert_allclose(pendulum.ball_position(q), expected, atol=1e-14)


@pytest.mark.parametrize("n_links", [1, 10, 40])
def test_last_link_turns_without_turning_the_ball(n_links):
    # Then the ball's inertia is none of the link's, and what a landing owes to it does not depend on the link's length.
    pendulum = Pendulum(String(n_links=n_links))
    v = np.zeros(pendulum.n)
    v[-4], v[-2] = 1.0, -1.0
    pendulum.set(np.zeros(pendulum.n), v)
    link = 0.58 / n_links
    expected = (0.003 / n_links / 3 + 0.030) * link**2 / 2
    assert pendulum.plant.CalcKineticEnergy(pendulum.context) == pytest.approx(expected, rel=1e-12)


# ---------------------------------------------------------------- periods


def test_small_swing_of_one_link_has_the_double_pendulums_period():
    string = String(n_links=1, **UNDAMPED)
    squares, shapes = eigh(*double_pendulum(string)[::-1])
    pendulum = Pendulum(string)
    link, ball = 0.005 * shapes[:, 0] / shapes[0, 0]
    times, states = pendulum.states(pendulum.in_plane([link, ball - link]), 4.0, 0.001)
    # The amplitude adds theta^2 / 16 = 1.6e-6, the step next to nothing.
    assert period(times, states[:, 0]) == pytest.approx(2 * np.pi / np.sqrt(squares[0]), rel=1e-5)


def test_large_swing_of_one_link_has_the_elliptic_integrals_period():
    # As long as the link is taut the ball stays in line with it but for k r / L = 0.3 %, and so the square of that of its energy.
    string = String(n_links=1, **UNDAMPED)
    inertia, moment = rigid_pendulum(string, SMALL)
    pendulum = Pendulum(string, SMALL)
    times, states = pendulum.states(pendulum.in_plane(1.4), 6.0, 0.001)
    expected = 4 * np.sqrt(inertia / moment) * ellipk(np.sin(0.7) ** 2)
    assert expected > 1.13 * 2 * np.pi * np.sqrt(inertia / moment)
    assert period(times, states[:, 0]) == pytest.approx(expected, rel=2e-5)


@pytest.mark.parametrize("ball", [BALL, SHELL])
def test_modes_of_one_link_are_the_double_pendulums(ball):
    string = String(n_links=1, **UNDAMPED)
    modes = Pendulum(string, ball).in_plane_modes()
    expected = np.sqrt(eigh(*double_pendulum(string, ball)[::-1], eigvals_only=True))
    np.testing.assert_allclose(modes.imag, expected, rtol=1e-7)


@pytest.mark.parametrize(("ball", "frequency"), [(BALL, 35.0), (SHELL, 27.1)])
def test_ball_spins_about_its_knot_under_the_strings_tension(ball, frequency):
    # A light string that pulls straight up at the surface of a ball whose centre stays: omega^2 = M g r / (k M r^2).
    assert np.sqrt(G / (ball.inertia_factor * ball.radius)) == pytest.approx(frequency, rel=2e-3)
    string = String.model_construct(length=20.0, mass=1e-6, n_links=1, **UNDAMPED)  # as no laboratory has
    assert Pendulum(string, ball).in_plane_modes()[1].imag == pytest.approx(frequency, rel=5e-3)


@pytest.mark.parametrize(("mode", "at_10_links"), [(0, 1e-5), (1, 5e-3), (2, 2e-2)])
@pytest.mark.parametrize("ball", [POINT, BALL, SHELL])
def test_modes_of_many_links_converge_to_the_flexible_strings(ball, mode, at_10_links):
    errors = []
    for n_links in (10, 20, 40):
        string = String(n_links=n_links, **UNDAMPED)
        expected, _ = chain_frequency(string, ball, mode)
        errors.append(abs(Pendulum(string, ball).in_plane_modes()[mode].imag / expected - 1))
    assert errors[0] < at_10_links
    if mode > 0:  # the first mode's error is that of the differences that linearize
        assert errors[0] / errors[1] == pytest.approx(4, rel=0.2)
        assert errors[1] / errors[2] == pytest.approx(4, rel=0.2)


# ---------------------------------------------------------------- integration


def test_energy_drift_without_damping_falls_with_the_cube_of_the_step():
    # A step h multiplies the amplitude of an oscillation by 1 - (omega h)^4 / 24.
    pendulum = Pendulum(String(n_links=1, **UNDAMPED))
    drifts = []
    for step in (0.002, 0.001):
        _, states = pendulum.states(pendulum.in_plane(1.2), 5.0, step)
        energies = []
        for state in states[[0, -1]]:
            pendulum.plant.SetPositionsAndVelocities(pendulum.context, state)
            energies.append(pendulum.energy())
        drifts.append(abs(energies[1] - energies[0]) / rigid_pendulum(pendulum.string)[1])
    assert drifts[0] < 1e-5
    assert np.log2(drifts[0] / drifts[1]) == pytest.approx(3, abs=0.3)


@pytest.mark.slow
def test_contact_free_integrator_converges_at_third_order():
    pendulum = Pendulum(String(n_links=2, **UNDAMPED))
    q = pendulum.in_plane([1.0, 0.5])
    steps = (5e-4, 2.5e-4, 1.25e-4, 3.125e-5)
    *ends, exact = [pendulum.ball_position(pendulum.states(q, 0.6, h)[1][-1, : pendulum.n]) for h in steps]
    errors = [np.linalg.norm(end - exact) for end in ends]
    assert errors[0] < 1e-6
    for coarse, fine in pairwise(errors):
        assert np.log2(coarse / fine) == pytest.approx(3, abs=0.25)


def test_damped_string_only_loses_energy():
    pendulum = Pendulum(String())
    _, states = pendulum.states(pendulum.in_plane(np.full(10, 0.15)), 1.0, 0.002)
    energies = []
    for state in states[::10]:
        pendulum.plant.SetPositionsAndVelocities(pendulum.context, state)
        energies.append(pendulum.energy())
    assert np.all(np.diff(energies) < 1e-7)
    assert energies[0] - energies[-1] > 1e-4


# ---------------------------------------------------------------- slack


@pytest.mark.parametrize(("step", "tolerance"), [(0.002, 6e-4), (0.0005, 4e-5)])
def test_ball_on_a_slack_string_falls_freely(step, tolerance):
    # Folded like a bellows, neighbouring links turned by 2.4 rad, the string is loose: the hook holds a link of 0.3 g, and
    # next to nothing of that reaches the ball. What is left is the step's error.
    pendulum = Pendulum(String(**UNDAMPED))
    q = pendulum.in_plane(2.4 * np.array([0.5, *[(-1) ** i for i in range(1, 10)]]))
    start = pendulum.ball_position(q)
    assert np.linalg.norm(start) < 0.4 * 0.6
    times, states = pendulum.states(q, 0.1, step)
    fall = np.array([pendulum.ball_position(state[: pendulum.n]) - start for state in states])
    error = np.linalg.norm(fall - np.outer(times**2 / 2, [0, 0, -G]), axis=1)
    assert error[-1] < tolerance * G * times[-1] ** 2 / 2


def test_ball_on_a_taut_string_does_not_fall():
    pendulum = Pendulum(String(**UNDAMPED))
    _, states = pendulum.states(np.zeros(pendulum.n), 0.1, 0.002)
    np.testing.assert_allclose(pendulum.ball_position(states[-1, : pendulum.n]), [0, 0, -0.6], atol=1e-12)


# ---------------------------------------------------------------- no gimbal lock in the casting plane


@pytest.mark.parametrize("n_links", [1, 10])
def test_mass_matrix_is_as_well_conditioned_at_every_angle_in_the_plane(n_links):
    pendulum = Pendulum(String(n_links=n_links))

    def mass_matrix(q):
        pendulum.set(q)
        return pendulum.plant.CalcMassMatrix(pendulum.context)

    hanging = mass_matrix(np.zeros(pendulum.n))
    for angle in np.deg2rad([45, 90, 135, 180, -90, 270, 400]):
        condition = np.linalg.cond(mass_matrix(pendulum.in_plane(angle)))
        assert condition == pytest.approx(np.linalg.cond(hanging), rel=1e-6)
    across = np.zeros(pendulum.n)
    across[1] = np.pi / 2 - 1e-3  # where a universal joint is singular: only across the plane
    assert mass_matrix(across)[0, 0] < 1e-3 * hanging[0, 0]


def test_swing_over_the_top_keeps_its_energy_and_its_plane():
    pendulum = Pendulum(String(n_links=1, **UNDAMPED))
    simulator = Simulator(pendulum.plant)
    begin_integration(simulator, EXPLICIT, 0.001, ACCURACY)
    context = simulator.get_mutable_context()
    inertia, moment = rigid_pendulum(pendulum.string)
    speed = 1.1 * np.sqrt(5 * moment / inertia)  # enough to go round with the link taut
    pendulum.set(np.zeros(4), [speed, 0, 0, 0])
    start = pendulum.energy()
    pendulum.plant.SetVelocities(context, [speed, 0, 0, 0])
    simulator.AdvanceTo(1.5)
    q, v = np.split(pendulum.plant.GetPositionsAndVelocities(context), 2)
    assert q[0] > 2 * np.pi
    np.testing.assert_allclose(q[[1, 3]], 0, atol=1e-12)
    pendulum.set(q, v)
    assert pendulum.energy() == pytest.approx(start, abs=1e-5 * moment)


# ---------------------------------------------------------------- damping


def dissipation(pendulum, rates):
    """Return the power [W] that damping takes from a string whose joints turn at `rates` in the plane, hanging straight."""
    q, v = np.zeros(pendulum.n), pendulum.in_plane(rates)
    acceleration = pendulum.acceleration(q, v)
    gravity = MultibodyForces(pendulum.plant)
    gravity.mutable_generalized_forces()[:] = pendulum.plant.CalcGravityGeneralizedForces(pendulum.context)
    damping = pendulum.plant.CalcInverseDynamics(pendulum.context, acceleration, gravity)
    return -v @ damping


@pytest.mark.parametrize("n_links", [2, 5, 10, 40])
def test_bending_takes_the_same_power_whatever_the_number_of_links(n_links):
    B, rate = 8e-7, 3.0  # a uniform rate of curvature [1/(m s)]
    pendulum = Pendulum(String(n_links=n_links, bending_damping=B, hook_damping=0.0))
    rates = np.full(n_links, rate * 0.58 / n_links)
    rates[0] = 0.0
    # B times rate^2 along the string, of which the joints between n links stand for the share (n - 1) / n.
    expected = B * rate**2 * 0.58 * (n_links - 1) / n_links
    assert dissipation(pendulum, rates) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("n_links", [1, 10])
def test_hook_and_knot_take_their_own_power_and_no_more(n_links):
    pendulum = Pendulum(String(n_links=n_links, hook_damping=2e-4, knot_damping=3e-5))
    assert dissipation(pendulum, [1.5]) == pytest.approx(2e-4 * 1.5**2, rel=1e-7)
    assert dissipation(pendulum, [0.0] * n_links + [4.0]) == pytest.approx(3e-5 * 4.0**2, rel=1e-7)


def damped_double_pendulum(string):
    """Return the eigenvalues of the double pendulum with the damping of hook and knot, slowest first, one of each pair."""
    mass, stiffness = double_pendulum(string)
    hook, knot = string.hook_damping, string.knot_damping
    damping = np.array([[hook + knot, -knot], [-knot, knot]])
    lower = [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)]
    eigenvalues = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], lower]))
    eigenvalues = eigenvalues[eigenvalues.imag > 0]
    return eigenvalues[np.argsort(eigenvalues.imag)]


@pytest.mark.parametrize(("hook", "knot"), [(4e-4, 0.0), (0.0, 1e-6), (0.0, 5e-5)])
def test_damping_of_hook_and_knot_makes_a_double_pendulum_decay_as_it_should(hook, knot):
    string = String(n_links=1, hook_damping=hook, knot_damping=knot, bending_damping=0.0)
    modes, expected = Pendulum(string).in_plane_modes(), damped_double_pendulum(string)
    np.testing.assert_allclose(modes.real, expected.real, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose(modes.imag, expected.imag, rtol=1e-7)


def test_hooks_damping_does_not_depend_on_the_number_of_links():
    # The slowest mode's rate from its shape phi: c phi'(L)^2 / (2 (mu int phi^2 + M phi(0)^2)).
    damped = UNDAMPED | {"hook_damping": 1e-4}
    string = String(**damped)
    _, phi = chain_frequency(string, POINT, mode=0)
    links = string.length - POINT.radius
    slope = (phi(links) - phi(links - 1e-5)) / 1e-5
    expected = -string.hook_damping * slope**2 / (2 * modal_mass(string, phi))
    found = [Pendulum(String(n_links=n, **damped), POINT).in_plane_modes()[0].real for n in (10, 20, 40)]
    np.testing.assert_allclose(found, expected, rtol=0.01)


@pytest.mark.parametrize("mode", [1, 2])  # the first one turns the ball as it turns the string
def test_knots_damping_does_not_depend_on_the_number_of_links(mode):
    # A mode's rate from its shape phi and the ball's tilt s: c (s - phi'(0))^2 over twice the modal mass.
    damped = UNDAMPED | {"knot_damping": 1e-6}
    string, M, k, r = String(**damped), BALL.mass, BALL.inertia_factor, BALL.radius
    omega, phi = chain_frequency(string, BALL, mode)
    slope = (phi(1e-5) - phi(-1e-5)) / 2e-5
    tilt = G * slope / (G - k * r * omega**2)
    links = string.length - r
    ball_mass = M * (phi(0) - r * tilt) ** 2 + k * M * r**2 * tilt**2
    mass = string.mass / links * quad(lambda z: phi(z) ** 2, 0, links)[0] + ball_mass
    expected = -string.knot_damping * (tilt - slope) ** 2 / (2 * mass)
    found = [Pendulum(String(n_links=n, **damped)).in_plane_modes()[mode].real for n in (10, 20, 40)]
    np.testing.assert_allclose(found, expected, rtol=0.05)
    assert abs(found[2] / expected - 1) < 0.01


def test_bending_mode_decays_as_the_flexible_string_does():
    # The second mode's rate from its shape phi: B int phi''^2 / (2 (mu int phi^2 + M phi(0)^2)).
    damped = UNDAMPED | {"bending_damping": 8e-7}
    string = String(**damped)
    _, phi = chain_frequency(string, POINT, mode=1)

    def curvature(z, h=1e-4):
        return (phi(z + h) - 2 * phi(z) + phi(z - h)) / h**2

    bent = quad(lambda z: curvature(z) ** 2, 0, string.length)[0]
    expected = -string.bending_damping * bent / (2 * modal_mass(string, phi))
    found = [Pendulum(String(n_links=n, **damped), POINT).in_plane_modes()[1].real for n in (10, 20, 40)]
    np.testing.assert_allclose(found, expected, rtol=0.05)
    assert abs(found[2] / expected - 1) < 0.01


# ---------------------------------------------------------------- on the arm


@pytest.fixture(scope="module")
def robot():
    plant = MultibodyPlant(0.0)
    fill_plant(plant, Scenario())
    return plant, plant.CreateDefaultContext()


@pytest.mark.parametrize("bearing", [0.0, 0.8, -1.2])
def test_hooks_x_axis_is_normal_to_the_casting_plane(robot, bearing):
    plant, context = robot
    q_arm = starting_posture(Scenario(), bearing)
    for turn in (0.0, 0.5):  # at the start, and with the arm elsewhere in the plane
        plant.SetPositions(context, hanging_positions(plant, q_arm + turn * np.eye(N_ARM)[1]))
        X_WHook = plant.GetFrameByName("hook").CalcPoseInWorld(context)
        normal = np.array([-np.sin(bearing), np.cos(bearing), 0.0])
        assert abs(X_WHook.rotation().col(0) @ normal) == pytest.approx(1, abs=1e-12)
        p_WE = plant.GetFrameByName("tool_plate").CalcPoseInWorld(context).translation()
        np.testing.assert_allclose(X_WHook.translation(), p_WE, atol=1e-15)
        assert normal @ p_WE == pytest.approx(0, abs=1e-12)


def test_swinging_in_the_casting_plane_turns_the_first_angle_alone(robot):
    plant, context = robot
    q = hanging_positions(plant, starting_posture(Scenario(), 0.6))
    normal = np.array([-np.sin(0.6), np.cos(0.6), 0.0])
    for angle in (-1.7, 0.9, 2.5):
        turned = q.copy()
        turned[N_ARM] += angle
        plant.SetPositions(context, turned)
        p_WL = plant.GetBodyByName("ball").EvalPoseInWorld(context).translation()
        assert normal @ p_WL == pytest.approx(0, abs=1e-12)


def test_string_hangs_straight_down_from_any_arm(robot):
    plant, context = robot
    rng = np.random.default_rng(3)
    for _ in range(20):
        q_arm = rng.uniform(-1.0, 1.0, N_ARM)
        q = hanging_positions(plant, q_arm)
        np.testing.assert_array_equal(q[:N_ARM], q_arm)
        plant.SetPositions(context, q)
        p_WE = plant.GetFrameByName("hook").CalcPoseInWorld(context).translation()
        p_WL = plant.GetBodyByName("ball").EvalPoseInWorld(context).translation()
        np.testing.assert_allclose(p_WL - p_WE, [0, 0, -0.6], atol=1e-12)


def test_hanging_string_rests_where_it_hangs(robot):
    plant, context = robot
    q = hanging_positions(plant, starting_posture(Scenario()))
    plant.SetPositions(context, q)
    plant.SetVelocities(context, np.zeros(plant.num_velocities()))
    force = plant.CalcGravityGeneralizedForces(context)[N_ARM:]
    np.testing.assert_allclose(force, 0, atol=1e-12)


def test_a_link_that_joints_on_both_sides_let_turn_about_its_axis_has_inertia():
    # At right angles the axes of a link's two joints are its own, about which a thin rod would turn by nothing.
    scenario = Scenario()
    plant = MultibodyPlant(0.0)
    fill_plant(plant, scenario)
    context = plant.CreateDefaultContext()
    q = np.zeros(plant.num_positions())
    q[-3] = q[-2] = np.pi / 2  # the last link's second angle, and the first one of the knot
    plant.SetPositions(context, q)
    axial = scenario.string.mass / scenario.string.n_links * STRING_RADIUS**2 / 2
    twist = np.linalg.inv(plant.CalcMassMatrix(context))[-4, -4]  # what a torque about the link's axis does
    assert 0.9 / axial < twist < 1.1 / axial
