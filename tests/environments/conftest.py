import pytest

pytest.importorskip("gymnasium", reason="the extra `gymnasium` is not installed")
