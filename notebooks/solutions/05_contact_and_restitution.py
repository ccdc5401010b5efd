"""The answers to `exercises/05_contact_and_restitution.ipynb`."""

import numpy as np
from scipy.optimize import brentq


def restitution(drop_height, bounce_height):
    return np.sqrt(bounce_height / drop_height)  # speeds go with the root of heights


def bouncing_time(height, e, gravity):
    fall = np.sqrt(2 * height / gravity)
    return fall * (1 + 2 * e / (1 - e))  # a geometric series: each bounce goes up and comes down


def contact_force(depth, rate, stiffness, dissipation):
    return stiffness * max(depth, 0.0) * max(1 + dissipation * rate, 0.0)


def rebound_speed(speed, mass, stiffness, dissipation):
    h = 0.001 * np.sqrt(mass / stiffness)  # short beside the contact's time
    depth, rate = 0.0, speed
    while depth >= 0.0:
        middle = depth + h / 2 * rate, rate - h / 2 * contact_force(depth, rate, stiffness, dissipation) / mass
        depth, rate = depth + h * middle[1], rate - h * contact_force(*middle, stiffness, dissipation) / mass
    return -rate


def dissipation_for(e, speed):
    def mismatch(dissipation):
        return rebound_speed(speed, 1.0, 1.0, dissipation) / speed - e  # of any mass and stiffness

    return brentq(mismatch, 0.0, 1 / (e * speed), xtol=1e-4)
