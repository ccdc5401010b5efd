"""Every code block of the README and of the site is executed, or declared in the tables below.

Python runs as it stands, the blocks of a page in order and in one namespace. YAML is loaded as a scenario. A shell's lines of
`wam-cast` run in this process, in a folder for the page; what would take long is in `CHEAPER`, with what runs instead, and what is
no business of this test is in `ELSEWHERE`, with who does run it. A line in neither, or a block of another language, fails.
"""

import json
import re
import shlex
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest
import typer
from markdown_it import MarkdownIt

import wam_cast as wc
from wam_cast.cli import main, model_choice
from wam_cast.cli.commands import app
from wam_cast.experiments import preview, trials
from wam_cast.generation.engines import cast_columns, simulate_row
from wam_cast.generation.sampling import sample_cast
from wam_cast.learning import dataset
from wam_cast.parallel.workers import run_rows
from wam_cast.planning.prediction import OUTPUTS

ROOT = Path(__file__).parents[2]
SITE = sorted((ROOT / "docs").glob("*.md")) + sorted((ROOT / "docs" / "howto").glob("*.md"))
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *SITE]
FENCES = {
    page: [token for token in MarkdownIt().parse(page.read_text(encoding="utf-8")) if token.type == "fence"]
    for page in PAGES
}

CHEAPER = {
    "wam-cast generate --casts 1700 --seed 0 --out casts": "wam-cast generate --casts 34 --seed 0 --out casts",
    "wam-cast generate --casts 1700 --seed 0 --out casts --workers 2": (
        "wam-cast generate --casts 2 --seed 0 --out casts --workers 2"
    ),
    "wam-cast generate --scenario longer.yaml --casts 1700 --out longer.casts": (
        "wam-cast generate --scenario longer.yaml --casts 34 --out longer.casts"
    ),
    "wam-cast generate --engine batch --casts 100000 --out many": "wam-cast generate --engine batch --casts 8 --out many",
    # A tenth of the frames; CONTRIBUTING has the picture made.
    "wam-cast throw --cup 0.75 --picture cast.png --animation cast.gif": (
        "wam-cast throw --cup 0.75 --animation cast.gif --speed 10"
    ),
    # README has a film of its own made.
    "wam-cast throw --cup 0.60,-0.25 --replay cast.html --picture cast.png --animation cast.gif": (
        "wam-cast throw --cup 0.60,-0.25 --replay cast.html --picture cast.png"
    ),
    # One way home, and a short turn; the tutorial turns to a cup, and farther.
    "wam-cast throw --cup 0.7 --cup 0.3,0.3 --cup -0.5,-0.6": "wam-cast throw --cup 0.7 --cup 0.42,0.001",
    "wam-cast generate --engine batch --casts 20000 --out many": "wam-cast generate --engine batch --casts 8 --out many",
    "wam-cast throw --cup 0.75 --replay slow.html --animation slow.gif --speed 0.25": (
        "wam-cast throw --cup 0.75 --replay slow.html --speed 0.25"
    ),
    # Cup after cup is README's.
    "wam-cast throw --model longer.model --cup 0.7 --cup 0.45,0.3": "wam-cast throw --model longer.model --cup 0.7",
    "wam-cast crosscheck": "wam-cast crosscheck --casts 1",
    "wam-cast learn --robot robot.yaml --cup 0.75 --casts 5 --out campaign": (
        "wam-cast learn --robot robot.yaml --cup 0.75 --casts 2 --out campaign"
    ),
    "wam-cast learn --robot robot.yaml --cup 0.75 --casts 8 --out campaign": (
        "wam-cast learn --robot robot.yaml --cup 0.75 --casts 3 --out campaign"
    ),
    # Learning from what cameras have seen is `tests/cli/test_learn.py`'s.
    "wam-cast learn --robot robot.yaml --cup 0.75 --casts 2 --out seen --observe camera": (
        "wam-cast learn --robot robot.yaml --cup 0.75 --casts 1 --out seen --observe camera"
    ),
    "wam-cast map --out floor.png": "wam-cast map --out floor.png --radii 2 --bearings 2 --workers 1",
}
"""Lines that take long or never end, and what runs instead."""

TRAINING_CASTS = 34
"""What `--train` simulates here, in place of 1,700: as few as can be split."""

SIMULATED_CASTS = 2
"""How many of a dataset's are simulated here; the others are as the shipped model predicts them: what is learned from them is not
judged here, only that it can be learned."""

CHECKED_CASTS = 8
"""What `check` simulates here, in place of 30: as few as it does for scenarios that take long."""

CHEAPER_PYTHON = {
    "CANDIDATES, CUPS = 16, 8\n": "CANDIDATES, CUPS = 8, 8\n",
    # Smaller pictures, each one in place of the mean of several, and fewer of them.
    '{"cameras": {"number": 2}}': '{"cameras": {"number": 2, "width": 320, "height": 240, "exposure": 0.0}}',
    "    start=0.5,\n": "    start=0.7,\n",
    'write_animation(recording, "cast.gif", speed=2.0)': 'write_animation(recording, "cast.gif", speed=8.0)',
    # Replays of the way home too are README's.
    ".record(plan.cast, plan.cup)\n": ".record(plan.cast, plan.cup, returns=False)\n",
    "n_casts=4, seed=0, n_workers=1": "n_casts=2, seed=0, n_workers=1",
    "n_casts=4, seed=0, executor=executor": "n_casts=2, seed=0, executor=executor",
}
"""The same for what stands in Python."""

IN_CI, IN_DASK, IN_REPRODUCE = ".ci/run", "tests/learning/test_dask.py", "tests/cli/test_reproduce.py"

ELSEWHERE = {
    r"python3 -m venv \.venv && \.venv/bin/pip install -q -e \. && .*": (IN_CI, 'bash -c "$first_command"'),
    r"python3 -m venv \.venv && \.venv/bin/pip install -q -e '\.\[test.*": (IN_CI, "test_command"),
    r"source \.venv/bin/activate": (IN_CI, ".venv/bin/"),
    r"pip install -e '\.\[notebooks\]'": ("pyproject.toml", "notebooks = ["),
    r"pip install -e '\.\[batch\]'": ("pyproject.toml", "batch = ["),
    r"pip install -e '\.\[gymnasium,batch\]'": ("pyproject.toml", "gymnasium = ["),
    r"pip install -e '\.\[mcap\]'": ("pyproject.toml", "mcap = ["),
    r"pip install -e '\.\[distributed\]'": ("pyproject.toml", "distributed = ["),
    r"wam-cast robot .*": ("tests/wire/test_processes.py", 'start("robot"'),
    r"wam-cast throw .*--robot \S+": ("tests/wire/test_processes.py", '"--robot", url'),
    r"wam-cast show( --port 7000)?": ("tests/cli/test_explorer.py", 'start("show"'),
    r"jupyter lab notebooks(/exercises)?": ("pyproject.toml", "jupyterlab"),
    r"wam-cast grade submissions --out marks\.csv": ("tests/teaching/test_grading.py", '"grade", str(folder), "--out"'),
    r"dask (scheduler|worker \S+)": (IN_DASK, "LocalCluster"),
    r"wam-cast generate .*--scheduler \S+": (IN_DASK, "get_executor"),
    r"wam-cast reproduce .*": (IN_REPRODUCE, '"reproduce", "--quick", "--out"'),
    r"wam-cast transfer .*": ("tests/experiments/transfer/test_transfer.py", "experiment.transfer(Scenario()"),
    r"python3 -m venv \.venv && \.venv/bin/pip install -q -e '\.\[dev\]' && .*": ("pyproject.toml", "dev = ["),
    r"python -m pytest tests/\S+\.py": (IN_CI, "$test_command"),
    r"poe \w+": ("tests/docs/test_tasks.py", "test_every_task_that_is_called_exists"),
    r"\.ci/run": (".github/workflows/ci.yml", "run: .ci/run"),
}
"""Lines that are run by something else: which file of the project does it, and a word of it that shows."""

LANGUAGES = {"python", "bash", "yaml", "bibtex", "text"}

pytestmark = pytest.mark.slow


def blocks(page, language):
    """Return the code blocks of a page in a language."""
    return [token.content for token in FENCES[page] if token.info == language]


def name(page):
    return page.relative_to(ROOT).as_posix()


def pages_with(language):
    return pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, language)], ids=name)


def shell_lines(page):
    """Return the commands of a page's shell blocks, and the comment behind each."""
    lines = [line for block in blocks(page, "bash") for line in block.splitlines() if line.strip()]
    return [tuple(part.strip() for part in re.split(r"\s+#|$", line, maxsplit=1)) for line in lines]


def elsewhere(line):
    """Return who runs a line, if it is declared."""
    return next((who for pattern, who in ELSEWHERE.items() if re.fullmatch(pattern, line)), None)


def first_pages():
    """Return the first page of every command that needs none of its page's files: there it runs, elsewhere it is the same."""
    found = {}
    for page in PAGES:
        for line, _ in shell_lines(page):
            if ".yaml" not in line:
                found.setdefault(line, page)
    return found


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Work in a new folder, whatever the terminal's width."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


@cache
def simulated_row(scenario, seed, row):
    return simulate_row(scenario, seed, row)


def simulate_first_rows(scenario, seed, row, *, make_controller=None):
    """Simulate a row as `simulate_row` does, or remember it, if it is among the first; predict it if it is not."""
    assert make_controller is None
    first = simulated_row(scenario, seed, row % SIMULATED_CASTS)
    if row < SIMULATED_CASTS:
        return dict(first)
    cast = sample_cast(scenario, seed, row)
    (predicted,) = wc.reference_model().predict(cast.to_array()[None])
    return first | cast_columns(row, cast) | dict(zip(OUTPUTS, map(float, predicted), strict=True))


@cache
def previewed(scenario):
    return preview.preview_scenario(scenario)


def preview_once(scenario, *, ends_early=False):
    """Preview a scenario as `preview_scenario` does, or remember it; so few casts end no earlier."""
    assert CHECKED_CASTS == preview.FEWEST_CASTS
    return previewed(scenario)


record_sequence = wc.CastSimulator.record_sequence


@cache
def recorded(scenario, belief, throws):
    return record_sequence(wc.CastSimulator(scenario, belief), throws)


def record_once(simulator, throws, *, noise_seed, on_outcome, on_recording):
    """Record casts as `record_sequence` does, or remember them: many lines show the same cast, each in its way."""
    assert noise_seed == 0
    for recording in recorded(simulator.scenario, simulator._belief, tuple(throws)):
        on_recording(recording)
        on_outcome(recording.outcome)


@pytest.fixture
def run(monkeypatch, capsys, inline_executor):
    """Return a function that runs a line of `wam-cast` in this process and returns its exit code and what it printed."""
    generate = wc.generate_dataset

    def generate_here(*args, executor=None, n_workers=None, **options):
        return generate(*args, executor=inline_executor, **options)

    def run_rows_here(function, rows, *_):
        return run_rows(function, rows, inline_executor)

    monkeypatch.setattr(wc, "generate_dataset", generate_here)
    monkeypatch.setattr(dataset, "simulate_row", simulate_first_rows)
    monkeypatch.setattr(wc.CastSimulator, "record_sequence", record_once)
    monkeypatch.setattr(trials, "run_rows", run_rows_here)
    monkeypatch.setattr(model_choice, "TRAINING_CASTS", TRAINING_CASTS)
    monkeypatch.setattr(preview, "N_CASTS", CHECKED_CASTS)
    monkeypatch.setattr(wc, "preview_scenario", preview_once)

    def call(line):
        capsys.readouterr()
        monkeypatch.setattr(sys, "argv", shlex.split(line))
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, "".join(capsys.readouterr())

    return call


def write_scenarios(page, folder):
    """Write the page's scenarios under the names that their first lines give."""
    for text in blocks(page, "yaml"):
        named = re.match(r"# (\S+\.yaml)", text)
        assert named, f"{name(page)}: begin the scenario with a line such as `# mine.yaml`:\n{text}"
        (folder / named[1]).write_text(text, encoding="utf-8")


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_languages_are_known(page):
    tags = {token.info for token in FENCES[page]}
    directives = {tag for tag in tags if re.fullmatch(r"\{(include|toctree)\}.*", tag)}
    assert tags - directives <= LANGUAGES


@pages_with("python")
def test_python_runs(page, folder):
    namespace = {"__name__": "__main__"}
    for number, code in enumerate(blocks(page, "python"), 1):
        for words, cheaper in CHEAPER_PYTHON.items():
            code = code.replace(words, cheaper)
        exec(compile(code, f"{name(page)}, Python block {number}", "exec"), namespace)


@pages_with("yaml")
def test_scenarios_load_and_differ_from_the_reference(page, folder):
    write_scenarios(page, folder)
    files = list(folder.glob("*.yaml"))
    assert len(files) == len(blocks(page, "yaml"))
    for file in files:
        assert wc.Scenario.from_yaml(file) != wc.Scenario()


@pages_with("bash")
def test_shell_runs(page, folder, run):
    write_scenarios(page, folder)
    first = first_pages()
    for line, comment in shell_lines(page):
        if who := elsewhere(line):
            file, word = who
            assert word in (ROOT / file).read_text(encoding="utf-8"), f"{file} does not run: {line}"
            continue
        assert line.startswith("wam-cast "), f"{name(page)}: declare who runs this line: {line}"
        parse(line)
        if first.get(line, page) is not page:
            continue
        runs = CHEAPER.get(line, line)
        code, printed = run(runs)
        declared = re.search(r"exit code (\d+)", comment)
        # A model of a few casts may miss.
        allowed = {int(declared[1])} if declared else {0, 1} if re.search("--scenario|--model", line) else {0}
        assert code in allowed, f"{line}\nended with {code}:\n{printed}"
        for file in re.findall(r"--(?:replay|picture|animation|graph|recording|out) (\S+)", runs):
            assert (folder / file).exists(), f"{runs}\ndid not write {file}"


def parse(line):
    """Check a line of `wam-cast` against the real command line, without running it."""
    _, command, *words = shlex.split(line)
    typer.main.get_command(app).commands[command].make_context(command, words)


def test_declared_lines_stand_somewhere():
    lines = {line for page in PAGES for line, _ in shell_lines(page)}
    assert set(CHEAPER) <= lines
    code = "".join(block for page in PAGES for block in blocks(page, "python"))
    assert all(words in code for words in CHEAPER_PYTHON)
    assert [pattern for pattern in ELSEWHERE if not any(re.fullmatch(pattern, line) for line in lines)] == []


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_commands_within_the_text_have_their_options(page):
    commands = typer.main.get_command(app).commands
    tokens = MarkdownIt().enable("table").parse(page.read_text(encoding="utf-8"))
    codes = [child.content for token in tokens for child in token.children or () if child.type == "code_inline"]
    for code in codes:
        options = set(re.findall(r"(?<!\S)--[a-z-]+", code))
        if ours := re.match(r"wam-cast (\w+)", code):
            known = {option for parameter in commands[ours[1]].params for option in parameter.opts} | {"--help"}
            assert options <= known, code
        elif script := re.match(r"python (benchmarks/\w+\.py)", code):
            text = (ROOT / script[1]).read_text(encoding="utf-8")
            assert [option for option in options - {"--help"} if f'"{option}"' not in text] == [], code


@pytest.mark.parametrize("line", ["wam-cast throw --cup 0.75 --json", "wam-cast check --json"])
def test_keys_of_json_are_all_explained(run, line):
    _, printed = run(line)
    page = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")
    section = page.split(f"`{line.split()[1]} --json` prints one object")[1].split("--json` prints one object")[0]
    cells = re.findall(r"^\| (`.+?) \|", section, re.MULTILINE)
    assert sorted(key for cell in cells for key in re.findall(r"`(\w+)`", cell)) == sorted(json.loads(printed))


def test_statuses_are_all_explained():
    row = re.search(r"^\| `status`.*$", (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8"), re.M)
    assert set(re.findall(r"`(\w+)`", row[0])) == {"status", "is_caught", *wc.Status} - {"landed"}


@pages_with("bibtex")
def test_citation_is_of_this_version(page):
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    for entry in blocks(page, "bibtex"):
        assert f"version = {{{version}}}" in entry


@pytest.mark.parametrize("page", [*PAGES, ROOT / "models" / "README.md", ROOT / "CHANGELOG.md"], ids=name)
def test_relative_links_and_images_lead_somewhere(page):
    tokens = MarkdownIt().enable("table").parse(page.read_text(encoding="utf-8"))
    inline = [child for token in tokens for child in token.children or ()]
    targets = [
        child.attrs.get("href") or child.attrs.get("src") for child in inline if child.type in ("link_open", "image")
    ]
    files = [target.partition("#")[0] for target in targets if not re.match(r"\w+:|#", target)]
    assert [file for file in files if not (page.parent / file).exists()] == []


def test_physics_has_the_joints_of_the_sheet():
    rows = re.findall(r"^\| (\d) \| (.+) \|$", (ROOT / "docs" / "physics.md").read_text(encoding="utf-8"), re.MULTILINE)
    header, *sheet = (line.split(",") for line in (ROOT / "models" / "wam7_parameters.csv").read_text().splitlines())
    joints = [dict(zip(header, cells, strict=True)) for cells in sheet]
    assert len(rows) == 7
    for (_, cells), joint in zip(rows, joints, strict=False):
        span, *values = cells.split(" | ")
        names = ("effort", "velocity", "reflected_inertia", "damping", "coulomb")
        assert span == f"{joint['lower']} to {joint['upper']}"
        assert values == [joint[column] for column in names]
