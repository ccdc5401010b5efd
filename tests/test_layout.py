"""The package's layers: which folder may import which, that no imports go in circles, and what `import wam_cast` leaves alone."""

import ast
import subprocess
import sys
from collections import Counter
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import wam_cast

PACKAGE = Path(wam_cast.__file__).parent
MODULES = {
    ".".join(["wam_cast", *path.relative_to(PACKAGE).with_suffix("").parts]).removesuffix(".__init__"): path
    for path in PACKAGE.rglob("*.py")
}

FRONT_DOORS = ("wam_cast", "wam_cast.__main__")
"""These name everything, and load it when it is first used."""

BELOW = {
    "base": (),
    "parallel": ("base",),
    "storage": ("base",),
    "motion": ("base",),
    "robot": ("base", "motion"),
    "simulation": ("base", "motion", "robot"),
    "wire": ("base", "motion", "robot", "simulation"),
    "perception": ("base", "motion", "robot", "simulation"),
    "batch": ("base", "motion", "storage"),
    "generation": ("base", "parallel", "storage", "motion", "simulation", "batch"),
    "planning": ("base", "parallel"),
    "learning": ("base", "parallel", "storage", "generation", "planning"),
    "crosscheck": ("base", "motion", "robot", "simulation", "generation", "batch"),
    "adaptation": (
        "base",
        "parallel",
        "storage",
        "motion",
        "simulation",
        "perception",
        "generation",
        "batch",
        "planning",
        "learning",
    ),
    "visualization": ("base", "storage", "motion", "robot", "simulation", "perception", "planning", "learning"),
    "exchange": ("base", "storage", "motion", "robot", "simulation", "visualization"),
    "environments": ("base", "motion", "robot", "simulation", "batch", "visualization"),
    "experiments": (
        *("base", "parallel", "storage", "motion", "robot", "simulation", "generation"),
        *("batch", "planning", "learning", "adaptation", "visualization"),
    ),
    "teaching": ("base", "parallel"),
    "cli": (
        *("base", "parallel", "storage", "motion", "robot", "simulation", "generation"),
        *(
            "wire",
            "planning",
            "learning",
            "adaptation",
            "crosscheck",
            "visualization",
            "exchange",
            "experiments",
            "teaching",
        ),
    ),
}
"""What each folder may import besides itself; the modules that lie in none are the base."""

NO_DRAKE = ("base", "parallel", "storage", "motion", "batch", "learning", "teaching")
"""Folders that do without Drake at all."""

NO_SIMULATION = ("planning",)
SIMULATION = ("pydrake.multibody", "pydrake.systems", "pydrake.geometry", "pydrake.visualization")
"""Planning takes Drake's solvers, and nothing that could simulate."""

MOST_MODULES = 12
"""Of a folder."""


def is_within(name, prefix):
    return name == prefix or name.startswith(f"{prefix}.")


def folder_of(name):
    parts = name.split(".")
    return parts[1] if len(parts) > 1 and parts[1] in BELOW else "base"


@cache
def imports_of(name, *, typing_too=False):
    """Return all that a module imports, in functions too, as dotted names; without what only a type checker reads."""
    tree = ast.parse(MODULES[name].read_text(encoding="utf-8"))
    unread = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING" and not typing_too
        for inner in ast.walk(node)
    }
    found = set()
    for node in ast.walk(tree):
        if id(node) in unread:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name} imports relatively; the package's imports are absolute"
            targets = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {target if target in MODULES else node.module for target in targets}
    return frozenset(found)


def own_imports_of(name, **options):
    return {target for target in imports_of(name, **options) if target in MODULES}


INSIDE = sorted(set(MODULES) - set(FRONT_DOORS))


def test_imports_run_one_way():
    for name in INSIDE:
        allowed = {folder_of(name), *BELOW[folder_of(name)]}
        refused = {target for target in own_imports_of(name) - {"wam_cast"} if folder_of(target) not in allowed}
        assert not refused, f"{name} may not import {sorted(refused)}"


def test_only_the_command_line_uses_the_front_door():
    assert not [name for name in INSIDE if folder_of(name) != "cli" and "wam_cast" in own_imports_of(name)]


def test_no_imports_go_in_circles():
    # Not even those that stand in functions or serve types alone: a circle is a wrong layout, however it is hidden.
    graph = {name: own_imports_of(name, typing_too=True) - set(FRONT_DOORS) for name in INSIDE}
    TopologicalSorter(graph).prepare()  # raises CycleError, which names the circle
    TopologicalSorter(BELOW).prepare()


def test_folders_without_drake_import_none():
    without = [name for name in INSIDE if folder_of(name) in NO_DRAKE]
    assert not [name for name in without if any(is_within(target, "pydrake") for target in imports_of(name))]


def test_folders_that_never_simulate_import_no_simulation():
    for name in INSIDE:
        if folder_of(name) in NO_SIMULATION:
            assert not [t for t in imports_of(name) if any(is_within(t, prefix) for prefix in SIMULATION)], name


def test_library_imports_no_pydrake_all():
    assert not [name for name in MODULES if "pydrake.all" in imports_of(name)]


def test_every_module_has_a_name_of_its_own():
    names = Counter(name.rpartition(".")[2] for name, path in MODULES.items() if path.stem[0] != "_")
    assert not {name for name, n in names.items() if n > 1}


def test_no_folder_has_more_modules_than_one_looks_through():
    sizes = Counter(path.parent for path in MODULES.values() if path.stem[0] != "_")
    assert not {folder.name: n for folder, n in sizes.items() if n > MOST_MODULES}


def loaded_by(statement):
    """Return the names of the modules that are loaded after `statement` in a new process."""
    code = f"{statement}\nimport sys\nprint(*sys.modules)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(result.stdout.split())


def test_importing_the_package_loads_nothing_heavy():
    heavy = {"pydrake", "sklearn", "pandas", "scipy", "matplotlib", "numpy", "pydantic", "mujoco", "gymnasium", "mcap"}
    assert not heavy & loaded_by("import wam_cast")


def test_help_loads_nothing_heavy():
    heavy = {
        "pydrake",
        "sklearn",
        "pandas",
        "pyarrow",
        "scipy",
        "matplotlib",
        "numpy",
        "pydantic",
        "yaml",
        "mujoco",
        "mcap",
    }
    assert not heavy & loaded_by("import wam_cast.cli.running")


def test_scenario_and_cast_load_neither_drake_nor_learning():
    loaded = loaded_by("import wam_cast; wam_cast.Scenario(); wam_cast.Cast(0.3, 0.6, 0.1)")
    assert not {"pydrake", "sklearn", "pandas", "scipy"} & loaded
    assert "wam_cast.scenario" in loaded


@pytest.mark.slow
def test_estimator_loads_no_drake():
    loaded = loaded_by("import wam_cast.learning.kernel_ridge")
    assert "sklearn" in loaded
    assert not {name for name in loaded if name.startswith("pydrake")}


def test_public_names_resolve():
    for name, home in wam_cast._HOME.items():
        assert f"wam_cast.{home}" in MODULES
        assert getattr(wam_cast, name).__name__ == name
    assert set(dir(wam_cast)) == {*wam_cast._HOME, "__version__"}
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = wam_cast.no_such_name
