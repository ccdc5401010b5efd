"""The matrix of the Gaussian kernel, and what it is solved by."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor
from scipy.spatial.distance import cdist

from wam_cast.types import Array


def gaussian_kernel(Z: Array, Z_fit: Array) -> Array:
    """Return the Gaussian kernel of unit width, `exp(-||z - z'||^2)`, shape (n, n_samples) (section 2.4 of the paper).

    `Z`, shape (n, n_features), and `Z_fit`, shape (n_samples, n_features), are inputs divided by the width of the kernel. It is
    computed from differences and not from `z^2 - 2 z z' + z'^2`, which would lose the small distances that a small λ depends on.
    """
    K: Array = cdist(Z, Z_fit, "sqeuclidean")
    np.negative(K, out=K)
    return np.exp(K, out=K)


def factorize(K: Array, regularization: float, weights: float | Array = 1.0) -> tuple[Array, bool]:
    """Factorize `K + λ I` for `scipy.linalg.cho_solve`: the lower Cholesky factor, with anything above its diagonal, and True.

    `K` is the symmetric kernel matrix of the training inputs, shape (n_samples, n_samples), and is left as it is. `weights` of the
    samples, a number or shape (n_samples,), divide λ.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the matrix is singular to working precision; a λ well above 2.2e-16 `n_samples` prevents it.
    """
    # Transposed, which changes nothing of a symmetric matrix, it is in LAPACK's order already.
    A = K.copy().T
    np.fill_diagonal(A, K.diagonal() + regularization / weights)
    advice = (
        f"the kernel matrix of {len(K)} training rows is singular to working precision with "
        f"regularization={regularization:g}: raise regularization (1e-10 is enough), "
        "remove training rows whose inputs are duplicates, or lower sigma"
    )
    try:
        factor, is_lower = cho_factor(A, lower=True, overwrite_a=True)
    except np.linalg.LinAlgError as error:
        raise np.linalg.LinAlgError(advice) from error
    # Rounding lets some singular matrices pass, with a factor that is noise.
    if factor.diagonal().min() ** 2 <= len(K) * np.finfo(np.float64).eps:
        raise np.linalg.LinAlgError(advice)
    return factor, is_lower
