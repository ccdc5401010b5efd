"""Text that is no scenario: each is one typed line, whatever YAML's reader makes of it."""

import pytest

from wam_cast.errors import InputError
from wam_cast.scenario import Scenario


@pytest.mark.parametrize(
    "text",
    [
        "ball: {mass: 2026-13-01}",
        "ball: {mass: 0x_}",
        "ball: {mass: !!timestamp }",
        "ball: {mass: !!float ''}",
        "ball: {mass: !!bool maybe}",
        f"ball: {{mass: {'9' * 5000}}}",
        "[" * 5000,
        "ball: {mass: 1\u0000}",
        "ball: &a {mass: 1}\nstring: *b",
        f"ball: {{mass: {':'.join(['1'] * 210)}.5}}",
        f"ball: {{mass: {'1:' * 49_000}1}}",
        f"ball: {{mass: !!int {'1:' * 49_000}1}}",
        f"{{{', '.join(f'k{i}: 1' for i in range(8000))}}}",
    ],
    ids=[
        "a day of month 13",
        "no digits",
        "no time",
        "no number",
        "no truth value",
        "5,000 digits",
        "nested",
        "a null character",
        "no such alias",
        "digits to the base of 60",
        "thousands of digits to the base of 60",
        "digits that a tag says are to the base of 60",
        "thousands of keys",
    ],
)
def test_what_is_no_scenario_is_one_short_line(tmp_path, text):
    path = tmp_path / "my.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        Scenario.from_yaml(path)
    line = str(error.value)
    assert line.startswith(f"scenario {path}: ")
    assert "\n" not in line
    assert len(line) < 600


@pytest.mark.parametrize("path", ["/dev/zero", "/dev/null"])
def test_a_device_is_no_file(path):
    with pytest.raises(InputError, match="not a regular file; name a readable YAML file"):
        Scenario.from_yaml(path)


def test_a_file_larger_than_any_scenario_is_not_read(tmp_path):
    path = tmp_path / "my.yaml"
    path.write_text("# " + "x" * 2_000_000)
    with pytest.raises(InputError, match="larger than 100000 bytes"):
        Scenario.from_yaml(path)


def test_digits_between_colons_are_text_as_in_yaml_1_2(tmp_path):
    path = tmp_path / "my.yaml"
    path.write_text("arm: {base_frame: 1:30, mount_height: 0x2}")
    with pytest.raises(InputError, match="no link '1:30'"):
        Scenario.from_yaml(path)
