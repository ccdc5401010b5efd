"""Priors that are kept: what is shipped serves the default robots, what is damaged or of others is learned anew."""

import numpy as np
import pytest

from wam_cast.adaptation.priors import known_priors
from wam_cast.adaptation.priors.interpolated_prior import InterpolatedPrior
from wam_cast.adaptation.priors.known_priors import SHIPPED, prior_of, write_prior
from wam_cast.adaptation.priors.robot_ensemble import RobotEnsemble
from wam_cast.adaptation.robot_distribution import RobotDistribution
from wam_cast.cast import cast_bounds
from wam_cast.planning.prediction import ALONG
from wam_cast.scenario import Noise, Scenario

ROBOTS = RobotDistribution(Scenario(noise=Noise.typical()))


def few(seed=0):
    """Return an ensemble of nobody's robots."""
    rng = np.random.default_rng(seed)
    casts = rng.uniform(*cast_bounds(Scenario()), size=(20, 3))
    return RobotEnsemble(casts, 0.01 * rng.standard_normal((6, 20, 7)), np.zeros((2, 20, 7)), 0.003)


@pytest.fixture
def learned(monkeypatch, tmp_path):
    """Keep priors in a folder of their own, and count how often one is learned."""
    calls = []
    monkeypatch.setattr(known_priors, "user_cache_path", lambda *_, **__: tmp_path / "cache")
    monkeypatch.setattr(
        "wam_cast.adaptation.priors.robot_ensemble.simulate_ensemble", lambda *given: calls.append(given) or few()
    )
    return calls


def values(prior):
    return prior.predict(few(1).casts, 0.4)


@pytest.mark.parametrize(("scale", "learned_at"), [(0.5, 1.0), (1.4, 1.0), (1.6, 2.0), (3.0, 2.0)])
def test_the_default_robots_have_a_shipped_one_that_was_learned_about_as_far_off(learned, scale, learned_at):
    ours, nearest = values(prior_of(ROBOTS.scaled(scale))), values(prior_of(ROBOTS.scaled(learned_at)))
    times = scale / learned_at
    np.testing.assert_allclose(ours.values, times * nearest.values, atol=1e-9)
    np.testing.assert_allclose(ours.variance, times**2 * nearest.variance, rtol=1e-3, atol=1e-11)  # (3 um)^2
    assert not learned
    assert all(path.stat().st_size < 500_000 for path in SHIPPED)


def test_robots_that_are_as_believed_have_no_offset(learned):
    assert np.abs(values(prior_of(ROBOTS.scaled(0.0))).values).max() == 0


def test_the_shipped_one_is_of_robots_whose_string_counts_most():
    # The string's 3 % to either side move landings by some 8.5 mm (rms) of about 10 in all.
    prior = prior_of(ROBOTS)
    components = prior.predict(prior.casts, 0.0).values[:, 1:, ALONG]
    strengths = np.sqrt((components**2).mean(axis=0))
    assert 0.008 < np.sqrt((components**2).sum(axis=1).mean()) < 0.013
    assert strengths[0] > 3 * strengths[1]


@pytest.mark.parametrize(
    "other",
    [
        RobotDistribution(Scenario.from_dict({"ball": {"mass": 0.05}})),
        ROBOTS.without("string.length"),
        ROBOTS.shifted({"ball.mass": 0.5}),
    ],
    ids=["believed", "ranges", "shifts"],
)
def test_other_robots_have_one_of_their_own_which_is_kept(learned, other):
    first, second = prior_of(other), prior_of(other)
    assert len(learned) == 1
    for one, again in zip(values(first), values(second), strict=True):
        np.testing.assert_allclose(one, again, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("damage", [b"", b"PK no archive", None])
def test_a_damaged_one_is_learned_again(learned, tmp_path, damage):
    other = ROBOTS.shifted({"ball.mass": 0.5})
    prior_of(other)
    (path,) = (tmp_path / "cache" / "priors").iterdir()
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2] if damage is None else damage)
    prior_of(other)
    assert len(learned) == 2
    assert path.read_bytes() == content


def test_numbers_that_are_none_are_no_prior(learned, tmp_path):
    other = ROBOTS.shifted({"ball.mass": 0.5})
    prior_of(other)
    (path,) = (tmp_path / "cache" / "priors").iterdir()
    bad = InterpolatedPrior.of_ensemble(Scenario(), few())
    bad.values = np.full_like(bad.values, np.nan)
    write_prior(path, bad, other)
    prior_of(other)
    assert len(learned) == 2
