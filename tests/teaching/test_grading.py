"""A class's notebooks are run each in a process of its own, and whatever they do, the others are graded."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

import wam_cast
from wam_cast.errors import InputError
from wam_cast.teaching.grading import find_submissions, grade, grading
from wam_cast.teaching.submission import Submission

ROOT = Path(wam_cast.__file__).parents[1]
RIGHT = "import numpy as np\ndef joint_torques(J, force):\n    return J.T @ force"
WRONG = "def joint_torques(J, force):\n    return -(J.T @ force)"


@pytest.fixture
def folder(tmp_path):
    return tmp_path / "class"


def hand_in(path, *cells):
    path.parent.mkdir(parents=True, exist_ok=True)
    content = [{"cell_type": "code", "source": cell.splitlines(keepends=True)} for cell in cells]
    path.write_text(
        json.dumps({"cells": [{"cell_type": "markdown", "source": ["# Mine"]}, *content]}), encoding="utf-8"
    )


def test_notebooks_are_found_in_order_and_copies_of_jupyter_are_not(folder):
    for name in ("ben/hand.ipynb", "anna/hand.ipynb", "anna/.ipynb_checkpoints/hand-checkpoint.ipynb", "carl.ipynb"):
        hand_in(folder / name, RIGHT)
    (folder / "notes.txt").write_text("mine")
    (folder / "folder.ipynb").mkdir()
    found = [path.relative_to(folder).as_posix() for path in find_submissions(folder)]
    assert found == ["anna/hand.ipynb", "ben/hand.ipynb", "carl.ipynb"]


def test_an_exercise_is_known_by_its_functions(folder):
    cells = ("%matplotlib inline\n!ls\nx = 1", WRONG, "def aim(cup):\n  pass", "%%time\nhand_law = lambda: 0")
    hand_in(folder / "a.ipynb", *cells)
    submission = Submission.read(folder / "a.ipynb")
    assert submission == Submission(cells, "01_hand_kinematics")


@pytest.mark.parametrize(
    ("cell", "exercise"),
    [
        ("restitution?\ndef restitution(a, b): ...", "05_contact_and_restitution"),
        ("files = !ls\nrestitution = max", "05_contact_and_restitution"),
        ("async def restitution(a, b)  # and no Python", "05_contact_and_restitution"),
        ("restitution == max\nprint(restitution)\n  # def restitution", None),
    ],
)
def test_a_function_is_found_in_what_is_no_plain_python(folder, cell, exercise):
    hand_in(folder / "a.ipynb", cell)
    assert Submission.read(folder / "a.ipynb").exercise == exercise


def test_without_ipython_nothing_is_graded(folder, monkeypatch):
    hand_in(folder / "a.ipynb", RIGHT)
    monkeypatch.setattr("wam_cast.teaching.grading.find_spec", lambda name: None)
    with pytest.raises(InputError, match="IPython runs the notebooks"):
        grade(folder)


@pytest.mark.parametrize("options", [{"seed": -1}, {"limit": 0}, {"limit": float("nan")}, {"n_workers": 0}])
def test_bad_numbers_and_empty_folders_are_refused(folder, options):
    for place, words in ((folder, "is no folder"), (ROOT / "constraints", "holds no notebook")):
        with pytest.raises(InputError, match=words):
            grade(place)
    hand_in(folder / "a.ipynb", RIGHT)
    with pytest.raises(InputError, match=next(iter(options))):
        grade(folder, **options)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"[" * 200_000, ""),
        (b'{"cells": ' + b'{"a":' * 200_000, ""),
        (b"\xff\xfe", ""),
        (b"5", ""),
        (b'{"cells": [{"cell_type": "code", "source": 5}]}', ""),
        (None, ": larger than 50000000 bytes"),
    ],
    ids=["lists in lists", "objects in objects", "no UTF-8", "a number", "a cell that is a number", "gigabytes"],
)
@pytest.mark.usefixtures("little_memory")
def test_an_unreadable_notebook_is_a_row_and_the_next_one_is_graded(folder, content, reason):
    hand_in(folder / "b.ipynb", "x = 1")
    (folder / "a.ipynb").write_bytes(content or b"")
    if content is None:
        os.truncate(folder / "a.ipynb", 6 * 1024**3)
    table = grade(folder, n_workers=1)
    assert table["submission"].tolist() == ["a", "b"]
    assert table["words"].tolist() == [f"it cannot be read as a notebook{reason}", "it has no function of any exercise"]


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names are Unicode")
def test_any_name_is_a_line_that_a_table_can_hold(folder):
    folder.mkdir()
    names = [b"\xff\xfe.ipynb", b"two\nlines.ipynb", "\u4e00\u00e9.ipynb".encode(), b"red \x1b[31m.ipynb"]
    for name in names:
        Path(os.fsdecode(bytes(folder) + b"/" + name)).write_text("{}")
    found = grade(folder, n_workers=1)["submission"].tolist()
    assert sorted(found) == sorted(["\\udcff\\udcfe", "two\\nlines", "\u4e00\u00e9", "red \\x1b[31m"])


@pytest.mark.parametrize(
    "written", [b"5", b"[5]", b'[["joint_torques", [], ""]]', b"[" * 90_000, b"[" + b" " * 10**7 + b"]"]
)
def test_what_a_notebook_writes_among_the_answers_ends_nothing(folder, monkeypatch, written):
    def process(self, seed, folder, answers):
        answers.write(written)
        return subprocess.Popen([sys.executable, "-S", "-c", ""], start_new_session=True)

    monkeypatch.setattr(Submission, "process", process)
    hand_in(folder / "a.ipynb", RIGHT)
    assert set(grade(folder, n_workers=1)["words"]) == {"the notebook ended Python"}


@pytest.mark.slow
def test_an_error_of_stray_letters_is_written_to_the_table(folder, tmp_path):
    hand_in(folder / "a.ipynb", f"raise ValueError('\\udcff\\x1b[0m')\n{RIGHT}")
    grade(folder).to_csv(tmp_path / "marks.csv", index=False)
    assert "raises ValueError: \\udcff\\x1b[0m" in (tmp_path / "marks.csv").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_class_is_graded_whatever_its_notebooks_do(folder, monkeypatch):
    hand_in(
        folder / "anna.ipynb", "%matplotlib inline\nimport matplotlib.pyplot as plt", RIGHT, "plt.plot([1])\nplt.show()"
    )
    hand_in(folder / "ben.ipynb", "1 / 0", WRONG, "this is no Python", "input()")
    hand_in(folder / "carl.ipynb", RIGHT, "import os\nos._exit(3)")
    hand_in(folder / "emil.ipynb", "x = 1")
    (folder / "fred.ipynb").write_text("{not a notebook")
    hand_in(folder / "gina.ipynb", RIGHT, "open('left.txt', 'w').write('litter')\nraise SystemExit")
    hand_in(
        folder / "hana.ipynb",
        "from asyncio import sleep",
        f"files = !ls\nhere = get_ipython()\njoint_torques?\nn = (7\n     % 4)\n{RIGHT} * (n / 3)\nawait sleep(0)",
        "%%time\nhand_position = lambda q, lengths: 0",
    )
    hand_in(
        folder / "ivan.ipynb", "def joint_torques(J, force):\n    return ...", f"import nothing_of_that_name\n{RIGHT}"
    )
    forged = "import json, os\njson.dump([['joint_torques', 'right', '']], open('answers.json', 'w'))\nos._exit(0)"
    hand_in(folder / "jana.ipynb", f"def joint_torques(): ...\n{forged}")
    before = sorted(path.name for path in folder.iterdir())
    table = grade(folder, n_workers=2).set_index(["submission", "task"])
    assert sorted(path.name for path in folder.iterdir()) == before
    told = table.loc[(slice(None), ["joint_torques", ""]), :].reset_index().set_index("submission")
    expected = {
        "anna": ("right", ""),
        "ben": ("wrong", "the sign is wrong: the motors exert the force, they do not resist it"),
        "carl": ("wrong", "the notebook ended Python"),
        "emil": ("wrong", "it has no function of any exercise"),
        "fred": ("wrong", "it cannot be read as a notebook"),
        "gina": ("right", ""),
        "hana": ("right", ""),
        "ivan": ("wrong", "raises ModuleNotFoundError: No module named 'nothing_of_that_name' (line 1 of its cell)"),
        "jana": ("wrong", "the notebook ended Python"),
    }
    assert {name: (row["standing"], row["words"]) for name, row in told.iterrows()} == expected
    assert table.loc[("anna", "hand_position"), "standing"] == "not yet"
    assert table.loc[("hana", "hand_position"), "words"].startswith("the result must be of shape")
    assert len(table.loc["anna"]) == 5


@pytest.mark.slow
def test_a_notebook_that_does_not_end_is_ended_and_the_next_one_is_graded(folder):
    hand_in(folder / "dora.ipynb", RIGHT, "import time\ntime.sleep(300)")
    hand_in(folder / "emil.ipynb", "x = 1")
    table = grade(folder, limit=2.0, n_workers=1)
    assert table["submission"].tolist() == ["dora"] * 5 + ["emil"]
    assert table["words"].tolist() == ["the notebook ran longer than 2 s"] * 5 + ["it has no function of any exercise"]
    assert set(table["standing"]) == {"wrong"}


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="processes of POSIX")
def test_what_still_runs_ends_with_the_grading(folder):
    sleeper = "import os\nopen({!r}, 'w').write(str(os.getpid()))\nimport time\ntime.sleep(300)"
    hand_in(folder / "a.ipynb", RIGHT)
    hand_in(folder / "b.ipynb", RIGHT, sleeper.format(str(folder / "process")))
    grades = grading(find_submissions(folder), folder, n_workers=2)
    assert next(grades)[2].standing == "right"
    deadline = time.monotonic() + 60
    while not (folder / "process").exists() or not (folder / "process").read_text():
        assert time.monotonic() < deadline
        time.sleep(0.05)
    grades.close()
    process = int((folder / "process").read_text())
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


@pytest.mark.slow
def test_command_grades_and_writes_a_table(folder, tmp_path):
    hand_in(folder / "ben.ipynb", WRONG)
    command = [sys.executable, "-m", "wam_cast", "grade", str(folder), "--out", str(tmp_path / "marks.csv")]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 1
    assert "0 of 5" in done.stdout
    lines = (tmp_path / "marks.csv").read_text(encoding="utf-8").splitlines()
    assert lines[0] == "submission,exercise,task,standing,words"
    assert lines[3].startswith("ben,01_hand_kinematics,joint_torques,wrong,")
