"""Reading YAML: one line for each thing that can be wrong with a file."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import yaml

from wam_cast.errors import InputError, quoted
from wam_cast.text_file import read_text

LARGEST_YAML = 100_000
"""Bytes: tens of times more than a scenario that spells everything out."""

TEXT = "tag:yaml.org,2002:str"
BASE_60 = ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float")
"""What PyYAML also takes digits between colons for, as YAML 1.1 does: `12:30` is 750. In YAML 1.2 it is text."""


def read_yaml(path: str | Path) -> Any:
    """Return the values in a file, as `yaml.safe_load` does.

    Raises
    ------
    InputError
        If the file cannot be read, is no YAML, or has a key twice, where YAML's readers keep the last. The line does not name
        the file: the caller knows what it is for.
    """
    try:
        return yaml.load(read_text(path, LARGEST_YAML), _UniqueKeyLoader)
    except OSError as error:
        raise InputError(f"{error.strerror}; name a readable YAML file") from None
    except RecursionError:
        raise InputError("not a YAML file of any use (its values are nested too deeply)") from None
    except (yaml.YAMLError, UnicodeError) as error:
        what, *_ = str(error).splitlines() or [type(error).__name__]
        what = what[:200]
        if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
            mark = error.problem_mark
            what = f"line {mark.line + 1}, column {mark.column + 1}: {error.problem}"
        raise InputError(f"not a YAML file ({what})") from None


class _UniqueKeyLoader(yaml.SafeLoader):
    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        if node.tag in BASE_60 and ":" in node.value:
            node.tag = TEXT
        try:
            return super().construct_object(node, deep)
        # Of values that look like dates or numbers, or whose tag says so, from within the library.
        except (ValueError, LookupError, AttributeError, ArithmeticError):
            kind = node.tag.rpartition(":")[2]
            problem = f"{quoted(node.value)} is no {kind}"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark) from None

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        counts = Counter(key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode))
        if counts and (most := counts.most_common(1)[0])[1] > 1:
            raise yaml.YAMLError(
                f"the key {most[0]!r} stands twice, the first time in line {node.start_mark.line + 1} or below"
            )
        return super().construct_mapping(node, deep)
