"""Scenarios, casts and cups of generated values, and YAML of generated text: each works or is refused in one line."""

import math
import types
import typing
from typing import Annotated, Literal, get_args, get_origin

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

from wam_cast.cast import Cast, cast_bounds, checked_cup, default_cast, is_allowed
from wam_cast.generation.sampling import sample_cast
from wam_cast.scenario import Scenario

pytestmark = pytest.mark.usefixtures("little_memory")

ANY_NUMBER = st.floats() | st.integers() | st.sampled_from([0.0, -0.0, 1e308, -1e308, 5e-324, 10**400, -(2**63)])
ANYTHING = st.recursive(
    st.none() | st.booleans() | ANY_NUMBER | st.text(max_size=20) | st.dates() | st.binary(max_size=5),
    lambda inner: st.lists(inner, max_size=8) | st.dictionaries(st.text(max_size=9) | st.integers(), inner, max_size=4),
    max_leaves=12,
)


def allowed(kind, limits=()):
    """Return what may be drawn for a value of some type, within the limits of its annotation."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return allowed(inner[0], [limit for field in inner[1:] for limit in getattr(field, "metadata", ())])
    if origin is tuple:
        return st.tuples(*map(allowed, inner)).map(list)
    if origin is Literal:
        return st.sampled_from(inner)
    if origin in (typing.Union, types.UnionType):
        return st.one_of(map(allowed, inner))
    if kind in (float, int):
        ends = {name: getattr(limit, name) for limit in limits for name in ("ge", "gt", "le") if hasattr(limit, name)}
        low, high = ends.get("ge", ends.get("gt")), ends["le"]
        return st.integers(low, high) if kind is int else st.floats(low, high)
    return {str: st.text(max_size=20), type(None): st.none()}[kind]


def fields(model, path=()):
    """Yield the path of each value of a scenario, and what may be drawn for it."""
    for name, field in model.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield from fields(field.annotation, (*path, name))
        else:
            yield (*path, name), allowed(field.annotation, field.metadata)


def nested(pairs):
    values = {}
    for path, value in pairs:
        owner = values
        for name in path[:-1]:
            owner = owner.setdefault(name, {})
        owner[path[-1]] = value
    return values


SETTINGS = st.one_of([st.tuples(st.just(path), values) for path, values in fields(Scenario)])
ODD_SETTINGS = st.tuples(st.sampled_from([path for path, _ in fields(Scenario)]), ANY_NUMBER | ANYTHING)
SOME_SETTINGS = st.lists(
    st.one_of(SETTINGS, SETTINGS, SETTINGS, ODD_SETTINGS), max_size=5, unique_by=lambda pair: pair[0]
)
VALUES = SOME_SETTINGS.map(nested) | ANYTHING


@given(VALUES)
def test_values_are_a_scenario_that_can_be_cast_in_or_refused(answered, values):
    with answered():
        scenario = Scenario.from_dict(values)
        assert Scenario.from_dict(yaml.safe_load(scenario.to_yaml())) == scenario
        assert is_allowed(scenario, sample_cast(scenario, 0, 0).to_array())
        assert is_allowed(scenario, default_cast(scenario).to_array())
        assert (cast_bounds(scenario)[0] < cast_bounds(scenario)[1]).all()
        assert len(scenario.fingerprint) == 16


WORDS = [
    "string",
    "length",
    "n_links",
    "arm",
    "urdf",
    "noise",
    "cup",
    ": ",
    "{",
    "}",
    "[",
    "]",
    ", ",
    "\n",
    "\n  ",
    "- ",
]
WORDS += [
    "&a ",
    "*a",
    "<<: *a",
    "!!float ",
    "!!python/object:os.system ",
    "!!timestamp ",
    "!!binary ",
    "? ",
    "| ",
    "> ",
]
WORDS += [
    "2026-13-01",
    "0x_",
    "1e400",
    ".nan",
    ".inf",
    "yes",
    "~",
    "0o9",
    "1:60:60",
    '"',
    "'",
    "\x1b[31m",
    "%YAML 9",
    "---\n",
]
WHOLE = Scenario().to_yaml()


@st.composite
def changed_text(draw):
    """Return a scenario file in which something was written over something else."""
    text = WHOLE
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(text)))
        end = start + draw(st.integers(0, 60))
        text = text[:start] + draw(st.sampled_from(WORDS) | st.text(max_size=8)) + text[end:]
    return text


TEXTS = st.lists(st.sampled_from(WORDS) | st.text(max_size=5), max_size=12).map("".join) | changed_text()
CONTENTS = (
    TEXTS.map(lambda text: text.encode("utf-8", "surrogatepass"))
    | st.binary(max_size=100)
    | VALUES.map(lambda values: yaml.dump(values).encode())
)


@given(CONTENTS)
def test_a_file_is_a_scenario_or_refused_by_its_name(answered, tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.yaml"
    path.write_bytes(content)
    with answered():
        assert Scenario.from_yaml(path).fingerprint


@given(st.tuples(*[ANY_NUMBER] * 4) | st.tuples(*[st.floats(0, 2)] * 4))
def test_numbers_are_a_cast_or_refused(answered, numbers):
    with answered():
        cast = Cast(*numbers)
        assert Cast.from_array(cast.to_array(), cast.bearing) == cast
        assert 0 < cast.move_duration + cast.wait <= 300
        assert str(cast).startswith("distance ")


@given(st.tuples(ANY_NUMBER, ANY_NUMBER) | ANYTHING)
def test_anything_is_a_cup_or_refused(answered, cup):
    with answered():
        assert max(map(abs, checked_cup(cup))) <= 100
        assert all(map(math.isfinite, checked_cup(cup)))
