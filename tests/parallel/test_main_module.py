"""Where worker processes start: from a script, a module, standard input or a prompt, guarded or not; and where they cannot."""

import os
import subprocess
import sys
import warnings
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context, spawn
from pathlib import Path

import pytest

import wam_cast
from wam_cast.parallel.main_module import can_be_imported, without_main
from wam_cast.parallel.workers import Workers, run_rows

UNGUARDED = """
import os
from worker_test_helper import process
from wam_cast.parallel.workers import run_rows

print("work is done", os.getpid() not in set(run_rows(process, range(4), n_workers=2)))
"""

OWN = """
import os
import warnings
from wam_cast.parallel.workers import run_rows

warnings.simplefilter("always")

def own(row):
    return row * row, os.getpid()
{guard}
    results, processes = zip(*run_rows(own, range(4), n_workers=2))
    assert results == (0, 1, 4, 9)
    print("work is done", os.getpid() not in processes)
"""

GUARDED = OWN.format(guard='if __name__ == "__main__":')
NOT_GUARDED = OWN.format(guard="if True:")


@pytest.fixture
def run(helper, tmp_path):
    """Return a function that runs a script in some way, and returns what it prints and what it says."""
    (tmp_path / "package").mkdir()
    (tmp_path / "package" / "__init__.py").touch()
    path = os.pathsep.join([str(tmp_path), str(Path(wam_cast.__file__).parents[1])])

    def run(how, script):
        if how == "prompt":
            pytest.importorskip("IPython")
        (tmp_path / "package" / "script.py").write_text(script)
        words = {
            "script": ["package/script.py"],
            "module": ["-m", "package.script"],
            "input": ["-"],
            "-c": ["-c", script],
        }
        words["prompt"] = ["-m", "IPython", "--quick", "--no-banner", "--colors=NoColor", "-c", script]
        done = subprocess.run(
            [sys.executable, *words[how]],
            input=script,
            cwd=tmp_path,
            env=os.environ | {"PYTHONPATH": path, "IPYTHONDIR": str(tmp_path)},
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
        return done.stdout, done.stderr

    return run


@pytest.mark.parametrize(
    "how", ["script", *(pytest.param(how, marks=pytest.mark.slow) for how in ("module", "input", "-c", "prompt"))]
)
def test_processes_start_from_anywhere_without_a_guard(run, how):
    assert run(how, UNGUARDED) == ("work is done True\n", "")


@pytest.mark.parametrize("how", ["script", "module"])
def test_a_script_under_a_guard_has_its_own_functions_run_by_processes(run, how):
    assert run(how, GUARDED) == ("work is done True\n", "")


@pytest.mark.parametrize(
    ("how", "reason"),
    [
        ("script", "must stand under `if __name__"),
        ("input", "Can't get attribute 'own'"),
        ("prompt", "attribute 'own'"),
    ],
)
def test_functions_that_processes_cannot_import_run_in_this_one_which_says_so(run, how, reason):
    out, err = run(how, NOT_GUARDED)
    assert out == "work is done False\n"
    (line,) = [line for line in err.splitlines() if "RuntimeWarning" in line]
    assert "worker processes cannot start here (" in line
    assert reason in line
    assert line.endswith("this process does their work, one row after the other")


def all_in_one(_):
    with warnings.catch_warnings(record=True) as told:
        results = list(run_rows(str, range(3), n_workers=2))
    return results, [str(one.message) for one in told]


def test_a_daemonic_process_does_the_work_itself():
    with get_context("spawn").Pool(1) as pool:
        (results, told) = pool.apply(all_in_one, (0,))
    assert results == ["0", "1", "2"]
    assert len(told) == 1
    assert "daemonic processes are not allowed to have children" in told[0]


def test_a_process_of_a_pool_starts_its_own():
    with ProcessPoolExecutor(1, get_context("spawn")) as executor:
        assert executor.submit(all_in_one, 0).result() == (["0", "1", "2"], [])


@pytest.mark.parametrize(
    "wanted", ["popen_spawn_posix.Popen._launch", "synchronize.SemLock.__init__", "context.BaseContext.Pipe"]
)
def test_where_the_system_has_no_more_for_processes_this_one_goes_on(helper, monkeypatch, wanted):
    def refuse(*_, **__):
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(f"multiprocessing.{wanted}", refuse)
    with Workers(2) as workers, pytest.warns(RuntimeWarning, match="Resource temporarily unavailable"):
        assert set(workers.run(helper.process, range(3))) == {os.getpid()}


def test_workers_without_the_main_module_make_way_for_some_with_it(helper, monkeypatch):
    with Workers(1) as workers:
        (first,) = set(workers.run(helper.process, range(2)))
        with monkeypatch.context() as patch:
            patch.setattr("wam_cast.parallel.workers._needs_main", lambda data: True)
            (second,) = set(workers.run(helper.process, range(2)))
        assert second != first
        assert set(workers.run(helper.process, range(2))) == {second}


def test_a_prompt_whose_names_were_reset_starts_processes_too(monkeypatch):
    monkeypatch.delattr(sys.modules["__main__"], "__spec__")
    with without_main():
        assert not [name for name in spawn.get_preparation_data("worker") if "main" in name]
    monkeypatch.delattr(sys.modules["__main__"], "__spec__")
    monkeypatch.setattr(sys.modules["__main__"], "__file__", None, raising=False)
    assert not can_be_imported()
