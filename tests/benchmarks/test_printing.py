"""What benchmarks print loses no digit, however narrow the terminal is."""

import re
from pathlib import Path

import calibration
import numpy as np
import pytest

from wam_cast.cli import terminal


@pytest.mark.parametrize("columns", [40, 10])
def test_no_digit_is_lost_on_a_narrow_terminal(monkeypatch, capsys, columns):
    def numbers(width):
        out = terminal.Terminal(width=width, soft_wrap=True, highlight=False, markup=False, emoji=False)
        monkeypatch.setattr(terminal, "out", out)
        calibration._print_groups(np.linspace(1e-3, 2e-3, 100), np.linspace(0.01, 0.02, 100))
        return re.findall(r"\d+\.\d+", capsys.readouterr().out)

    expected = numbers(200)
    assert len(expected) == 3 * calibration.N_GROUPS
    assert numbers(columns) == expected


def test_every_table_is_printed_by_what_looks_after_that():
    folder = Path(calibration.__file__).parent
    assert not [path.name for path in folder.rglob("*.py") if "rich.table" in path.read_text(encoding="utf-8")]
