"""What is quoted in an error is bounded, whatever it is and wherever it is quoted."""

import pickle

import pytest

from wam_cast.errors import LONGEST_LINE, InputError, MachineError, quoted


@pytest.mark.parametrize("kind", [InputError, MachineError])
def test_a_long_path_is_shortened_to_both_of_its_ends_and_the_rest_is_kept(kind):
    error = kind(f"scenario /{'x' * 4000}/end.yaml: is no file; name another")
    assert str(error).startswith("scenario /xxx")
    assert str(error).endswith("xxx/end.yaml: is no file; name another")
    assert len(str(error)) < 300
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_what_has_spaces_is_bounded_too():
    assert len(str(InputError(f"values {'1.5, ' * 10_000}; choose others"))) == LONGEST_LINE - 1


def test_a_command_to_paste_stays_whole():
    command = f"wam-cast fit {'x' * 3000}"
    assert f"`{command}`" in str(InputError(f"no model yet; make one with `{command}`"))


def test_ordinary_lines_stay_as_they_are():
    line = "string.length = 2 m is too long  for a hand `so` high"
    assert str(InputError(line)) == line


def nested():
    values = ["a"]
    for _ in range(40):
        values = [values, values]  # 2 ** 40 letters when it is spelled out
    return values


@pytest.mark.parametrize(
    "value",
    [nested(), "x" * 10**6, list(range(10**5)), {"key": {"x" * 5000: 1}}, 10**5000, b"\0" * 10**5],
    ids=range(6),
)
def test_any_value_is_quoted_in_few_letters(value):
    assert 0 < len(quoted(value)) <= 200


def test_short_values_are_quoted_as_python_writes_them():
    for value in (0.3, "a b", None, (1, 2), {"a": [1]}):
        assert quoted(value) == repr(value)


@pytest.mark.parametrize("kind", [InputError, MachineError])
def test_what_is_quoted_breaks_no_line_and_commands_no_terminal(kind):
    error = kind("scenario a\r\nb.yaml: \x1b[31mball\x00: unknown key; Länge 3")
    assert str(error) == r"scenario a b.yaml: \x1b[31mball\x00: unknown key; Länge 3"
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_python_knows_them_by_its_own_names():
    assert issubclass(InputError, ValueError)
    assert issubclass(MachineError, RuntimeError)
