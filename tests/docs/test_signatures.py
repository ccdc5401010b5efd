"""Signatures in the reference are as short as in the source."""

import pytest

from wam_cast.learning.model_file import Fit
from wam_cast.learning.uncertainty import ErrorFit

inspect = pytest.importorskip("sphinx.util.inspect")


@pytest.fixture
def shorten(extension):
    return extension("signatures").shorten


@pytest.mark.parametrize("mode", ["smart", "fully-qualified"])
@pytest.mark.parametrize(
    ("thing", "expected"),
    [
        (Fit, "(seed: int, n_train: int, n_validation: int, n_test: int, sigma: tuple[float, float, float], "),
        (ErrorFit, "(sigma: tuple[float, float, float], regularization: float, scale: float)"),
    ],
)
def test_checked_numbers_are_numbers(shorten, thing, expected, mode):
    signature = inspect.stringify_signature(inspect.signature(thing), unqualified_typehints=mode == "smart")
    assert "FieldInfo" in signature
    short, _ = shorten(None, "class", thing.__name__, thing, None, signature, None)
    assert short.startswith(expected)
    assert "Annotated" not in short
