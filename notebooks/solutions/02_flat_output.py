"""The answers to `exercises/02_flat_output.ipynb`."""

import numpy as np
from numpy.polynomial import Polynomial


def ball_acceleration(hand, ball, length, gravity):
    return gravity / length * (hand - ball)


def hand_for_ball(ball, acceleration, length, gravity):
    return ball + length / gravity * acceleration


def step_coefficients():
    # The first derivative is s^4 (1 - s)^4 with a factor, so that four derivatives are zero at both ends.
    rate = Polynomial([0, 1]) ** 4 * Polynomial([1, -1]) ** 4
    step = rate.integ()
    return (step / step(1)).coef


def arc_motion(angle, rate, acceleration, radius):
    outward = np.array([np.cos(angle), np.sin(angle)])
    onward = np.array([-outward[1], outward[0]])
    return radius * outward, radius * (acceleration * onward - rate**2 * outward)


def turning_hand(t, angle, duration, radius, length, gravity):
    step, s = Polynomial(step_coefficients()), t / duration
    turned, rate, change = (angle * step.deriv(k)(s) / duration**k for k in range(3))
    ball, acceleration = arc_motion(turned, rate, change, radius)
    return hand_for_ball(ball, acceleration, length, gravity)
