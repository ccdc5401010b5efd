import pytest

pytest.importorskip("jax", reason="the extra `batch` is not installed")
