"""Pages that are written at each build from what they describe: notebooks, the reference, the command line.

They go to folders that git ignores, and are rewritten only where they changed, so that Sphinx reads again only those.
"""

import inspect
from pathlib import Path
from typing import Any

import typer

import wam_cast
from wam_cast.cli.commands import app as command_line

PACKAGE = Path(wam_cast.__file__).parent

LAYERS = {
    "base": ("Base: scenario, cast and what all layers share", [".", "arm", "parts"]),
    "parallel": ("Parallel: processes, threads and seeds", ["parallel"]),
    "storage": ("Storage: files and directories", ["storage"]),
    "motion": ("Motion: how the hand moves", ["motion"]),
    "robot": ("Robot: the arm and its controller as a Drake diagram", ["robot"]),
    "simulation": ("Simulation: from a cast to its outcome", ["simulation"]),
    "wire": ("Wire: the arm and its controller in two processes", ["wire"]),
    "perception": ("Perception: cameras that see the ball", ["perception"]),
    "planning": ("Planning: from a cup to a cast", ["planning"]),
    "learning": ("Learning: datasets and the forward model", ["generation", "learning", "learning/kernel"]),
    "batch": ("Batch: thousands of casts at once", ["batch"]),
    "crosscheck": ("Crosscheck: the same casts in MuJoCo", ["crosscheck"]),
    "adaptation": (
        "Adaptation: robots that nobody told it about",
        ["adaptation", "adaptation/priors", "adaptation/closed_form"],
    ),
    "visualization": ("Visualization: scenes, replays and films", ["visualization", "visualization/interactive"]),
    "figures": ("Visualization: figures", ["visualization/figures"]),
    "exchange": ("Exchange: casts as MCAP, and tables of real ones", ["exchange"]),
    "environments": ("Environments: the cast for learners", ["environments"]),
    "experiments": (
        "Experiments: trials, the paper's experiment, and unknown robots",
        ["experiments", "experiments/paper", "experiments/transfer"],
    ),
    "teaching": ("Teaching: exercises, their checker, and grading", ["teaching", "teaching/tasks"]),
}
"""Pages of the reference, in the order of the imports: title, and the folders whose modules they hold."""


def write_if_changed(path: Path, text: str) -> None:
    """Write a page, unless it says so already."""
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


# ---------------------------------------------------------------- notebooks


def copy_notebooks(source: Path, target: Path) -> None:
    """Copy the notebooks of a folder to where Sphinx finds them, and remove copies of those that are gone.

    Their links to these pages are right where they lie; a folder deeper the way is another.
    """
    wanted = {path.name: path for path in source.glob("*.ipynb")}
    for copy in target.glob("*.ipynb"):
        if copy.name not in wanted:
            copy.unlink()
    for name, path in wanted.items():
        write_if_changed(target / name, path.read_text(encoding="utf-8").replace("](../docs/", "](../"))


# ---------------------------------------------------------------- reference


def modules_in(folder: str) -> list[str]:
    """Return the names of the modules that lie directly in a folder of the package."""
    files = sorted((PACKAGE / folder).glob("[!_]*.py"))
    return [".".join(["wam_cast", *file.relative_to(PACKAGE).with_suffix("").parts]) for file in files]


def first_line(docstring: str | None) -> str:
    """Return the first paragraph of a docstring, in one line."""
    return " ".join((docstring or "").split("\n\n")[0].split())


def reference_page(title: str, folders: list[str]) -> str:
    """Return a page of the reference: a section for each module."""
    sections = [
        f"## {name}\n\n```{{eval-rst}}\n.. automodule:: {name}\n```\n"
        for folder in folders
        for name in modules_in(folder)
    ]
    return "\n".join([f"# {title}\n", *sections])


def public_names() -> str:
    """Return a table of the names that `import wam_cast as wc` has."""
    rows = ["| `wc.` | what |", "|---|---|"]
    for name, home in sorted(wam_cast._HOME.items()):
        thing = getattr(wam_cast, name)
        role = "py:class" if inspect.isclass(thing) else "py:func"
        rows.append(f"| {{{role}}}`~wam_cast.{home}.{name}` | {first_line(inspect.getdoc(thing))} |")
    return "\n".join([*rows, ""])


def write_reference(folder: Path) -> None:
    """Write a page of the reference for each layer."""
    for name, page in LAYERS.items():
        write_if_changed(folder / f"{name}.md", reference_page(*page))


# ---------------------------------------------------------------- command line


def command_section(context: Any, name: str, command: Any) -> str:
    """Return a command's description, usage and options, as its own `--help` has them."""
    own = type(context)(command, info_name=name, parent=context)
    usage = command.get_usage(own).removeprefix("Usage: ")
    rows = ["| option | what |", "|---|---|"]
    for parameter in command.get_params(own):
        record = parameter.get_help_record(own)
        if record is not None and "--help" not in parameter.opts:
            names, text = (part.replace("|", r"\|") for part in record)
            rows.append(f"| `{names}` | {text} |")
    return "\n\n".join([f"## {name}", inspect.cleandoc(command.help), f"```text\n{usage}\n```", "\n".join(rows), ""])


def command_line_page() -> str:
    """Return a section for each command of `wam-cast`."""
    group = typer.main.get_command(command_line)
    context = group.make_context("wam-cast", ["throw"], resilient_parsing=True)
    return "\n".join(command_section(context, name, group.commands[name]) for name in group.commands)


# ---------------------------------------------------------------- Sphinx


def write_pages(app: Any) -> None:
    """Write all of it."""
    docs = Path(app.srcdir)
    for folder in (".", "exercises"):
        copy_notebooks(docs.parent / "notebooks" / folder, docs / "notebooks" / folder)
    write_reference(docs / "reference")
    write_if_changed(docs / "_generated" / "public_names.md", public_names())
    write_if_changed(docs / "_generated" / "commands.md", command_line_page())


def setup(app: Any) -> dict[str, bool]:
    """Write them before Sphinx looks for pages."""
    app.connect("builder-inited", write_pages)
    return {"parallel_read_safe": True}
