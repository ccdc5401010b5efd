"""Errors that users meet are one line each, whatever they quote."""

import pickle

import pytest

from wam_cast.errors import InputError, MachineError


@pytest.mark.parametrize("kind", [InputError, MachineError])
def test_what_is_quoted_breaks_no_line_and_commands_no_terminal(kind):
    error = kind("scenario a\r\nb.yaml: \x1b[31mball\x00: unknown key; Länge 3")
    assert str(error) == r"scenario a b.yaml: \x1b[31mball\x00: unknown key; Länge 3"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_python_knows_them_by_its_own_names():
    assert issubclass(InputError, ValueError)
    assert issubclass(MachineError, RuntimeError)
