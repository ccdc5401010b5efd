"""The answers to `exercises/04_planning_under_uncertainty.ipynb`."""

import numpy as np
from scipy.stats import norm


def landing_std(slopes, cast_std, model_std):
    return np.sqrt(np.sum((slopes * cast_std) ** 2) + model_std**2)


def hit_probability(offset, std, radius):
    return norm.cdf(radius, offset, std) - norm.cdf(-radius, offset, std)


def disc_probability(offset, std, radius):
    # In strips across the casting plane: the middle of each, its width, and its half length within the circle.
    edges = radius * np.linspace(-1, 1, 401)
    along, half = (edges[1:] + edges[:-1]) / 2, np.sqrt(radius**2 - ((edges[1:] + edges[:-1]) / 2) ** 2)
    return np.sum(norm.pdf(along, offset[0], std[0]) * hit_probability(offset[1], std[1], half)) * (edges[1] - edges[0])


def best_cast(offsets, stds, radius):
    return np.argmax([disc_probability(offset, std, radius) for offset, std in zip(offsets, stds, strict=True)])
