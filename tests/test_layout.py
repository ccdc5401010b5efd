"""The package's layers: which module may import which, and what `import wam_cast` leaves alone."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import wam_cast

PACKAGE = Path(wam_cast.__file__).parent
MODULES = {
    ".".join(["wam_cast", *path.relative_to(PACKAGE).with_suffix("").parts]).removesuffix(".__init__"): path
    for path in PACKAGE.rglob("*.py")
}

# What each layer may import besides itself, by prefix; the longest prefix of a module's name decides.
BASE = [
    f"wam_cast.{name}" for name in ("version", "errors", "files", "threads", "arm_model", "scenario", "cast")
]
ALLOWED = {
    "wam_cast": ["wam_cast"],  # the lazy front door names everything
    "wam_cast.__main__": ["wam_cast"],
    "wam_cast.version": [],
    "wam_cast.errors": [],
    "wam_cast.files": ["wam_cast.errors"],
    "wam_cast.threads": [],
    "wam_cast.arm_model": [],
    "wam_cast.scenario": ["wam_cast.errors", "wam_cast.arm_model"],
    "wam_cast.cast": ["wam_cast.errors", "wam_cast.scenario"],
    "wam_cast.system": BASE,
    "wam_cast.learning": BASE,
    "wam_cast.learning.dataset": [*BASE, "wam_cast.system"],
    "wam_cast.planning": BASE,
    "wam_cast.evaluation": ["wam_cast"],
    "wam_cast.cli": ["wam_cast"],
}

# Parts of Drake that a layer may not use at all.
LEARNING = [
    f"wam_cast.learning.{name}"
    for name in ("kernel_ridge", "tuning", "leave_one_out", "parts", "baselines", "forward_model")
]
NO_DRAKE = (*BASE, *LEARNING)
NO_SIMULATION = ("wam_cast.planning", "wam_cast.system.outcome")
SIMULATION = (
    "pydrake.multibody",
    "pydrake.systems",
    "pydrake.geometry",
    "pydrake.all",
    "pydrake.visualization",
)


def is_within(name, prefix):
    return name == prefix or name.startswith(f"{prefix}.")


def imports_of(name):
    """Return all that a module imports, as dotted names, without what only a type checker reads."""
    tree = ast.parse(MODULES[name].read_text(encoding="utf-8"))
    found = set()
    unread = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if id(node) in unread:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name} imports relatively; the package's imports are absolute"
            targets = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {target if target in MODULES else node.module for target in targets}
    return found


def rules_of(name):
    return ALLOWED[max((prefix for prefix in ALLOWED if is_within(name, prefix)), key=len)]


@pytest.mark.parametrize("name", sorted(MODULES))
def test_imports_run_one_way(name):
    own_layer = ".".join(name.split(".")[:2])
    allowed = [*rules_of(name), own_layer] if own_layer != "wam_cast" else rules_of(name)
    ours = [target for target in imports_of(name) if is_within(target, "wam_cast")]
    refused = [target for target in ours if not any(is_within(target, prefix) for prefix in allowed)]
    assert not refused, f"{name} may not import {refused}"


@pytest.mark.parametrize(
    "name", sorted(n for n in MODULES if n != "wam_cast.__main__" and not is_within(n, "wam_cast.cli"))
)
def test_nothing_but_the_command_line_imports_the_command_line(name):
    assert not [target for target in imports_of(name) if is_within(target, "wam_cast.cli")]


@pytest.mark.parametrize(
    "name",
    sorted(n for n in MODULES if not any(is_within(n, p) for p in ("wam_cast.cli", "wam_cast.evaluation"))),
)
def test_nothing_below_the_evaluation_imports_it(name):
    if name not in ("wam_cast", "wam_cast.__main__"):
        assert not [target for target in imports_of(name) if is_within(target, "wam_cast.evaluation")]


@pytest.mark.parametrize("name", sorted(n for n in MODULES if any(is_within(n, p) for p in NO_DRAKE)))
def test_layers_without_drake_import_none(name):
    assert not [target for target in imports_of(name) if is_within(target, "pydrake")]


@pytest.mark.parametrize("name", sorted(n for n in MODULES if any(is_within(n, p) for p in NO_SIMULATION)))
def test_layers_that_never_simulate_import_no_simulation(name):
    refused = [t for t in imports_of(name) if any(is_within(t, prefix) for prefix in SIMULATION)]
    assert not refused


def test_library_imports_no_pydrake_all():
    assert not [name for name in MODULES if "pydrake.all" in imports_of(name)]


def loaded_by(statement):
    """Return the names of the modules that are loaded after `statement` in a new process."""
    code = f"{statement}\nimport sys\nprint(*sys.modules)"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(result.stdout.split())


def test_importing_the_package_loads_nothing_heavy():
    heavy = {"pydrake", "sklearn", "pandas", "scipy", "matplotlib", "numpy", "pydantic"}
    assert not heavy & loaded_by("import wam_cast")


def test_scenario_and_cast_load_neither_drake_nor_learning():
    loaded = loaded_by("import wam_cast; wam_cast.Scenario(); wam_cast.Cast(0.3, 0.6, 0.1)")
    assert not {"pydrake", "sklearn", "pandas", "scipy"} & loaded
    assert "wam_cast.scenario" in loaded


def test_estimator_loads_no_drake():
    loaded = loaded_by("import wam_cast.learning.kernel_ridge")
    assert "sklearn" in loaded
    assert not {name for name in loaded if name.startswith("pydrake")}


def test_public_names_resolve():
    # Names whose module does not exist yet are skipped, so that a misspelt one in a module that does cannot hide.
    for name, home in wam_cast._HOME.items():
        if f"wam_cast.{home}" in MODULES:
            assert getattr(wam_cast, name).__name__ == name
    assert set(dir(wam_cast)) == {*wam_cast._HOME, "__version__"}
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = wam_cast.no_such_name
