"""Kernel ridge regression with the kernel at a few of the training inputs, the landmarks, in the place of all.

Time grows with the number of training inputs and memory hardly does, where the exact solution takes the cube and the square. The
features are Nyström's (Williams and Seeger, Using the Nyström Method to Speed Up Kernel Machines, 2001), as of scikit-learn's
`Nystroem`, but computed in blocks and from a kernel that keeps small distances. A ridge in their space is the subset of
regressors, and its standard deviation that of the projected process (Rasmussen and Williams, Gaussian Processes for Machine
Learning, sections 8.3.1 and 8.3.3). With all training inputs as landmarks both are the exact ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from wam_cast.learning.kernel.kernel_matrix import gaussian_kernel
from wam_cast.types import Array

BLOCK = 1000
"""Training inputs whose kernel is in memory at a time."""


def landmark_rows(n_samples: int, n_landmarks: int) -> NDArray[np.intp]:
    """Return which training rows are landmarks: `n_landmarks` of them, or all, evenly spaced in their order."""
    return np.linspace(0, n_samples - 1, min(n_landmarks, n_samples)).round().astype(np.intp)


@dataclass(frozen=True)
class LandmarkFit:
    """What a fit by landmarks found.

    With the kernel `k(x)` of an input and the landmarks, the features are `f(x) = basis^T k(x)`. Over the training inputs, with
    their weights, they are orthogonal: `sum_i w_i f(x_i) f(x_i)^T` is diagonal.

    Attributes
    ----------
    Z_landmarks
        The landmarks, in units of the kernel's width, shape (n_landmarks, n_features).
    basis
        Shape (n_landmarks, rank).
    eigenvalues
        Of the approximated kernel matrix: that diagonal, shape (rank,).
    dual_coef
        Coefficients of the kernel, shape (n_landmarks, n_outputs + 1): of the predictions, and last of the prediction of ones.
    regularization
        λ > 0.
    """

    Z_landmarks: Array
    basis: Array
    eigenvalues: Array
    dual_coef: Array
    regularization: float

    @classmethod
    def of(cls, Z_landmarks: Array, Z: Array, y: Array, regularization: float, weights: Array) -> Self:
        """Fit to training inputs Z, shape (n_samples, n_features), in units of the width, with `weights`, shape (n_samples,).

        y are their targets, without the mean, shape (n_samples, n_outputs); λ is `regularization`, > 0.
        """
        values, vectors = eigh(gaussian_kernel(Z_landmarks, Z_landmarks))
        # Below, eigenvalues are rounding, and their features would be.
        kept = values > len(values) * np.finfo(np.float64).eps * values[-1]
        whitening = vectors[:, kept] / np.sqrt(values[kept])
        targets = np.column_stack([y, np.ones(len(Z))])
        rank = int(np.sum(kept))
        gram, moments = np.zeros((rank, rank)), np.zeros((rank, targets.shape[1]))
        for rows in _blocks(len(Z)):
            root = np.sqrt(weights[rows, np.newaxis])
            features = gaussian_kernel(Z[rows], Z_landmarks) @ whitening * root
            gram += features.T @ features
            moments += features.T @ (targets[rows] * root)
        eigenvalues, rotation = eigh(gram)
        eigenvalues = np.maximum(eigenvalues, 0.0)
        basis = whitening @ rotation
        coef = rotation.T @ moments / (eigenvalues + regularization)[:, np.newaxis]
        return cls(Z_landmarks, basis, eigenvalues, basis @ coef, regularization)

    def whitening(self) -> Array:
        """Return W, shape (rank, n_landmarks): of the prior variance 1 at x, `|W k(x)|^2` is explained by the training inputs.

        What is left is `1 - |f|^2 + λ f^T (D + λ I)^-1 f` with the eigenvalues D (Rasmussen and Williams, Eq. 8.27).
        """
        shrinkage = self.eigenvalues / (self.eigenvalues + self.regularization)
        return np.ascontiguousarray((self.basis * np.sqrt(shrinkage)).T)

    def leave_one_out(
        self, Z: Array, y: Array, dual_coef: Array, weights: Array, is_centered: bool
    ) -> tuple[Array, Array]:
        """Compute `KernelRidge.leave_one_out` without refits, the landmarks staying what they are.

        Z, y and the weights are those of the fit; y may be some of the outputs, with their `dual_coef`. The residual without a row
        is that with it, divided by 1 minus the row's leverage.
        """
        # By how much the mean of the other rows' targets, which are centred, is below that of all.
        shift = y * (weights / _sums_of_others(weights))[:, np.newaxis] if is_centered else np.zeros_like(y)
        residuals, inverse_variance = np.empty_like(y), np.empty(len(Z))
        for rows in _blocks(len(Z)):
            K, w = gaussian_kernel(Z[rows], self.Z_landmarks), weights[rows]
            squares = (K @ self.basis) ** 2
            leverage = w * (squares @ (1.0 / (self.eigenvalues + self.regularization)))
            rest = np.maximum(1.0 - leverage, np.finfo(np.float64).eps)[:, np.newaxis]
            unshifted = y[rows] - K @ dual_coef
            residuals[rows] = (unshifted + shift[rows] * (1.0 - K @ self.dual_coef[:, -1:])) / rest
            unexplained = np.maximum(1.0 - squares.sum(axis=1), 0.0)
            inverse_variance[rows] = 1.0 / (unexplained + self.regularization / w / rest[:, 0])
        return residuals, inverse_variance


def _sums_of_others(weights: Array) -> Array:
    """Return for each row the sum of all the others, shape (n,), without a difference, which would lose a small one."""
    sums: Array = np.zeros_like(weights)
    sums[1:] += np.cumsum(weights[:-1])
    sums[:-1] += np.cumsum(weights[:0:-1])[::-1]
    return sums


def _blocks(n_rows: int) -> Iterator[slice]:
    """Return slices of at most `BLOCK` rows each, together all."""
    return (slice(start, start + BLOCK) for start in range(0, n_rows, BLOCK))
