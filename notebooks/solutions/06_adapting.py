"""The answers to `exercises/06_adapting.ipynb`."""

import numpy as np


def posterior(mean, covariance, features, offset, noise_std):
    shared = covariance @ features
    gain = shared / (features @ shared + noise_std**2)
    return mean + gain * (offset - features @ mean), covariance - np.outer(gain, shared)


def believed(features, mean, covariance):
    return features @ mean, np.sqrt(features @ covariance @ features)


def most_telling(candidates, targets, covariance, noise_std):
    nothing = np.zeros(len(covariance))
    after = [posterior(nothing, covariance, one, 0.0, noise_std)[1] for one in candidates]  # whatever is seen
    return np.argmin([np.trace(targets @ one @ targets.T) for one in after])


def aim(cup, features_of, mean):
    distance = cup
    for _ in range(50):
        distance = cup - features_of(distance) @ mean
    return distance
