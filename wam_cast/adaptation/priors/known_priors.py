"""Priors that were learned before: one that the package ships, and those that are kept in the user's cache."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from dataclasses import asdict
from pathlib import Path

import numpy as np
from platformdirs import user_cache_path

from wam_cast.adaptation.priors.interpolated_prior import InterpolatedPrior
from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.errors import InputError
from wam_cast.planning.prediction import OUTPUTS
from wam_cast.storage.array_archive import LARGEST_MEMBER, NOT_AN_ARCHIVE, read_array
from wam_cast.storage.atomic import write_file
from wam_cast.text_file import read_bytes

FORMAT = "wam_cast prior 2"

N_ROBOTS, N_CASTS = 128, 512
"""Of an ensemble that a prior is learned from."""

LEARNED_SCALES = (1.0, 2.0)
"""At which robots are drawn to learn from: at twice the ranges landings are no longer in proportion."""

SHIPPED = tuple(Path(__file__).parents[2] / "reference" / name for name in ("prior.npz", "prior_twice.npz"))
"""Of the default robots, at either scale."""

ARRAYS = ("casts", "values", "left_out")
"""What a file holds: what an `.InterpolatedPrior` is made of, in single precision."""


def prior_of(robots: RobotDistribution) -> InterpolatedPrior:
    """Return what an ensemble of such robots has taught, drawn at that of `LEARNED_SCALES` which is nearer to theirs.

    It is multiplied by what the two scales differ by. It is a shipped one, or read from the user's cache, or learned now by the
    batched engine and kept there: 65,000 casts, some ten minutes on one core.

    Raises
    ------
    InputError
        If it has to be learned and cannot, as the batched engine is missing or robots like these cannot cast.
    """
    learned = min(LEARNED_SCALES, key=lambda scale: abs(scale - robots.scale))
    ours = RobotDistribution(robots.believed, robots.ranges, learned, robots.shifts)
    key = _key(ours)
    for path in (*SHIPPED, _cache(key)):
        known = _read(path, ours, key)
        if known is not None:
            return known.scaled(robots.scale / learned)
    from wam_cast.adaptation.priors.robot_ensemble import simulate_ensemble

    prior = InterpolatedPrior.of_ensemble(ours.believed, simulate_ensemble(ours, N_ROBOTS, N_CASTS))
    write_prior(_cache(key), prior, ours)
    return prior.scaled(robots.scale / learned)


def write_prior(path: Path, prior: InterpolatedPrior, robots: RobotDistribution) -> None:
    """Write a prior of robots to a file. Raises `.InputError` if that cannot be done."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"cache {path.parent}: {reason}; make room for it, or set XDG_CACHE_HOME") from None
    content = io.BytesIO()
    arrays = {name: getattr(prior, name).astype(np.float32) for name in ARRAYS}
    np.savez_compressed(content, key=np.array(_key(robots)), **arrays)
    write_file(path, content.getvalue())


def _read(path: Path, robots: RobotDistribution, key: str) -> InterpolatedPrior | None:
    """Return the prior that a file holds of these robots; None if there is no file, or one of others or a damaged one."""
    try:
        content = read_bytes(path, LARGEST_MEMBER)
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            is_ours = str(read_array(archive, "key")) == key
            arrays = [read_array(archive, name).astype(float) for name in ARRAYS] if is_ours else []
    except (InputError, *NOT_AN_ARCHIVE):
        return None
    return InterpolatedPrior(robots.believed, *arrays) if is_ours and _are_whole(*arrays) else None


def _are_whole(casts: np.ndarray, values: np.ndarray, left_out: np.ndarray) -> bool:
    """Return whether arrays are those of a prior."""
    n, n_outputs = len(casts), len(OUTPUTS)
    fits = casts.shape == (n, 3) and values.ndim == 3 and values.shape[::2] == (n, n_outputs)
    is_finite = all(np.isfinite(array).all() for array in (casts, values, left_out))
    return fits and left_out.shape == (n, n_outputs) and is_finite and bool((left_out >= 0).all())


def _cache(key: str) -> Path:
    return user_cache_path("wam_cast", appauthor=False) / "priors" / f"{key}.npz"


def _key(robots: RobotDistribution) -> str:
    """Return what tells priors apart: all that an ensemble's casts depend on, noise aside."""
    of_robots = {
        "format": FORMAT,
        "believed": robots.believed.without_noise.fingerprint,
        "ranges": [asdict(one) | {"source": ""} for one in robots.ranges],
        "scale": robots.scale,
        "shifts": robots.shifts,
        "ensemble": [N_ROBOTS, N_CASTS],
    }
    return hashlib.sha256(json.dumps(of_robots, sort_keys=True).encode()).hexdigest()[:16]
