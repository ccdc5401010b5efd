"""The string and the ball as a chain of bodies, by its numbers: what the scenario says of them, without Drake."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wam_cast.scenario import Ball, String
from wam_cast.types import Array

STRING_RADIUS = 0.002
"""[m]"""


class StringChain(NamedTuple):
    """The links from the hand on, and the ball as the last one, each on a universal joint; arrays of shape (n_links + 1,).

    Attributes
    ----------
    length
        From a body's joint to the next one's [m], of the ball to its centre.
    mass, moment
        [kg], and mass times the distance of its centre from its joint [kg m].
    inertia, axial_inertia
        About its joint, across it and along it [kg m^2].
    damping, stiffness
        Of the joint that it hangs on, about either axis: [N m s] and [N m].
    """

    length: Array
    mass: Array
    moment: Array
    inertia: Array
    axial_inertia: Array
    damping: Array
    stiffness: Array


def string_chain(string: String, ball: Ball) -> StringChain:
    """Return the chain of a scenario's string and ball: thin rods with a cord's inertia about their own axes, and a sphere."""
    n, link = string.n_links, string.link_length(ball)
    mass, sphere = string.mass / n, ball.inertia_factor * ball.mass * ball.radius**2
    between = np.full(n - 1, 1 / link)  # joints between links
    return StringChain(
        length=np.r_[np.full(n, link), ball.radius],
        mass=np.r_[np.full(n, mass), ball.mass],
        moment=np.r_[np.full(n, mass * link / 2), ball.mass * ball.radius],
        inertia=np.r_[np.full(n, mass * link**2 / 3), sphere + ball.mass * ball.radius**2],
        # Without inertia about its own axis a link could be turned by nothing where its joint is singular.
        axial_inertia=np.r_[np.full(n, mass * STRING_RADIUS**2 / 2), sphere],
        damping=np.r_[string.hook_damping, string.bending_damping * between, string.knot_damping],
        stiffness=np.r_[0.0, string.bending_stiffness * between, 0.0],
    )


def hook_angles(R_WHook: Array) -> Array:
    """Return the angles [rad], (2,), of the joint at the hook at which the string hangs straight down.

    The joint turns about x of the hook's frame first, then about the string's y: its direction is (sin b, -sin a cos b,
    cos a cos b).
    """
    down = R_WHook.T @ np.array([0.0, 0.0, -1.0])
    return np.array([np.arctan2(-down[1], down[2]), np.arcsin(np.clip(down[0], -1, 1))])
