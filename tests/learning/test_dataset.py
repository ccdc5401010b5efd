import contextlib
import json
import math
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import kstest

from wam_cast.cast import PARAMETERS, Cast, is_allowed
from wam_cast.errors import InputError, MachineError
from wam_cast.generation.sampling import row_noise_seed, sample_cast, sample_casts
from wam_cast.learning import dataset
from wam_cast.learning.dataset import CastDataset, generate_dataset
from wam_cast.scenario import Noise, Scenario
from wam_cast.storage import cast_values, casts_part
from wam_cast.storage import dataset_directory as storage

SCENARIO = Scenario()
ROOT = Path(__file__).parents[2]
FAULTS = Path(__file__).parents[1] / "faults"


class InlineExecutor(Executor):
    """Runs each call when it is submitted, and keeps what it was asked for."""

    def __init__(self):
        self.rows = []

    def submit(self, fn, /, *args):
        self.rows.extend(args)
        future = Future()
        try:
            future.set_result(fn(*args))
        except Exception as error:
            future.set_exception(error)
        return future


def fake_row(scenario, seed, row):
    """A row without physics; each seventh cast fails, and each eleventh never comes down."""
    cast = sample_cast(scenario, seed, row)
    status = "diverged" if row % 7 == 3 else "never_crossed" if row % 11 == 5 else "landed"
    values = dict.fromkeys(casts_part.SCHEMA.names, math.nan)
    if status == "landed":
        values |= dict.fromkeys((*cast_values.LANDED, *cast_values.LEARNED_PEAKS), 0.25)
        values |= {"landing_along": cast.distance * cast.speed, "landing_across": -cast.wait}
    parameters = dict(zip(PARAMETERS, cast.to_array().tolist(), strict=True))
    return values | parameters | {"cast": row, "status": status, "is_slack": row % 2 == 0}


@pytest.fixture
def no_physics(monkeypatch):
    monkeypatch.setattr(dataset, "simulate_row", fake_row)


def contents(directory):
    files = (path for path in directory.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(directory)): path.read_bytes() for path in files}


def generate(n_casts, directory=None, seed=0, scenario=SCENARIO, **options):
    options = {"executor": InlineExecutor()} | options
    return generate_dataset(scenario, n_casts, seed, directory=directory, **options)


def one_line(error):
    return "\n" not in str(error.value)


# --- sampling


def test_a_row_of_a_seed_is_the_same_cast_whatever_else_is_drawn():
    casts = sample_casts(SCENARIO, 20, seed=5)
    np.testing.assert_array_equal(casts[:7], sample_casts(SCENARIO, 7, seed=5))
    assert sample_cast(SCENARIO, 5, 13) == Cast.from_array(casts[13])
    assert not np.any(casts == sample_casts(SCENARIO, 20, seed=6))
    assert len(np.unique(casts)) == casts.size


def test_the_first_cast_of_seed_zero_stays_what_it_is():
    expected = [0.3800281435090078, 0.4124557775267188, 0.3611712943249127]
    np.testing.assert_allclose(sample_casts(SCENARIO, 1, seed=0)[0], expected, rtol=1e-15)


def test_casts_keep_bounds_and_the_shortest_duration_which_rejects_some():
    scenario = Scenario.from_dict({"motion": {"min_move_duration": 0.5}})
    casts = sample_casts(scenario, 1000, seed=0)
    assert np.all(is_allowed(scenario, casts))
    assert np.min(casts[:, 0] / casts[:, 1]) == pytest.approx(0.5, rel=0.01)


def test_casts_are_uniform():
    scenario = Scenario.from_dict({"motion": {"min_move_duration": 0.5}})
    distance, speed, wait = sample_casts(scenario, 1700, seed=0).T
    low, high = scenario.bounds.wait
    assert kstest(wait, "uniform", args=(low, high - low)).pvalue > 0.01
    # At a given distance, the speed is uniform up to the fastest one that the shortest duration allows.
    slowest, fastest = scenario.bounds.speed[0], np.minimum(scenario.bounds.speed[1], distance / 0.5)
    assert kstest((speed - slowest) / (fastest - slowest), "uniform").pvalue > 0.01
    # The number of casts at a distance is in proportion to that range of speeds.
    grid = np.linspace(slowest * 0.5, scenario.bounds.distance[1], 2001)
    density = np.minimum(scenario.bounds.speed[1], grid / 0.5) - slowest
    cumulative = np.cumsum(density) / np.sum(density)
    assert kstest(np.interp(distance, grid, cumulative), "uniform").pvalue > 0.01


def test_a_scenario_that_allows_almost_nothing_is_sampled_all_the_same():
    scenario = Scenario.from_dict({"motion": {"min_move_duration": 0.4 / 0.21 - 1e-6}})
    start = time.perf_counter()
    casts = sample_casts(scenario, 20, seed=0)
    assert time.perf_counter() - start < 1
    assert np.all(is_allowed(scenario, casts))


# --- the dataset


def test_a_dataset_has_a_row_a_cast_in_order_with_failures_kept(no_physics):
    data = generate(120, seed=2)
    assert list(data.frame.columns) == casts_part.SCHEMA.names
    assert list(data.frame["cast"]) == list(data.frame.index) == list(range(120))
    np.testing.assert_array_equal(data.frame[list(PARAMETERS)], sample_casts(SCENARIO, 120, seed=2))
    failed = data.frame["status"] != "landed"
    assert failed.sum() == 26
    assert data.frame.loc[failed, "landing_along"].isna().all()
    assert data.frame.loc[~failed, "landing_along"].notna().all()
    assert data.scenario is SCENARIO
    assert (data.seed, len(data)) == (2, 120)


def test_every_column_is_typed_even_if_no_cast_landed(no_physics, tmp_path):
    data = generate(4, tmp_path)
    assert data.frame.loc[3, "status"] == "diverged"
    types = data.frame.dtypes.drop("status")
    assert types.pop("cast") == np.int64
    assert types.pop("is_slack") == np.bool_
    assert set(types) == {np.dtype(np.float64)}


@pytest.mark.parametrize("n", [34, 51, 100, 1700, 2345])
def test_split_is_by_index_in_the_proportions_of_the_paper(n):
    parts = CastDataset(SCENARIO, 0, pd.DataFrame({"cast": np.arange(n)})).split()
    np.testing.assert_array_equal(np.concatenate(parts), np.arange(n))
    assert np.abs(np.array([len(part) for part in parts]) - n * np.array([1300, 300, 100]) / 1700).max() <= 1
    if n == 1700:
        assert [len(part) for part in parts] == [1300, 300, 100]


def test_split_refuses_too_few_rows():
    with pytest.raises(InputError, match=r"33 casts: too few .* at least 34") as error:
        CastDataset(SCENARIO, 0, pd.DataFrame({"cast": np.arange(33)})).split()
    assert one_line(error)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n_casts": 0}, "n_casts = 0 must be an integer, 1 or more"),
        ({"n_casts": 12.5}, "n_casts = 12.5 must be an integer, 1 or more"),
        ({"seed": -1}, "seed = -1 must be an integer, 0 or more"),
        ({"executor": None, "n_workers": 0}, "n_workers = 0 must be an integer, 1 or more"),
        ({"n_workers": 2}, "n_workers = 2: an executor brings its own workers; leave one of the two out"),
    ],
)
def test_numbers_out_of_range_are_refused(no_physics, tmp_path, options, message):
    with pytest.raises(InputError) as error:
        generate(**{"n_casts": 3, "directory": tmp_path / "data"} | options)
    assert str(error.value) == message
    assert not (tmp_path / "data").exists()


def test_progress_counts_every_cast_and_starts_with_what_is_there(no_physics, tmp_path):
    calls = []
    generate(50, tmp_path)
    generate(53, tmp_path, on_progress=lambda *call: calls.append(call))
    assert calls == [(50, 53), (51, 53), (52, 53), (53, 53)]


# --- storage


def test_a_stored_dataset_loads_as_it_was_generated(no_physics, tmp_path):
    data = generate(120, tmp_path / "new" / "data", seed=4)
    loaded = CastDataset.load(tmp_path / "new" / "data")
    pd.testing.assert_frame_equal(loaded.frame, data.frame, check_exact=True)
    pd.testing.assert_frame_equal(generate(120, seed=4).frame, data.frame, check_exact=True)
    assert (loaded.scenario, loaded.seed) == (SCENARIO, 4)


def test_the_directory_reads_as_it_stands_and_says_what_it_is(no_physics, tmp_path):
    data = generate(120, tmp_path)
    (tmp_path / "casts" / ".part-00003.parquet.tmp").write_bytes(b"half a part")
    assert sorted(contents(tmp_path)) == [
        "casts/.part-00003.parquet.tmp",
        "casts/part-00000.parquet",
        "casts/part-00001.parquet",
        "casts/part-00002.parquet",
        "manifest.json",
        "scenario.yaml",
    ]
    pd.testing.assert_frame_equal(pd.read_parquet(tmp_path / "casts"), data.frame)
    assert Scenario.from_yaml(tmp_path / "scenario.yaml") == SCENARIO
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    (versions,) = manifest.pop("versions")
    assert set(versions) == {"wam_cast", "python", "drake", "numpy"}
    assert set(manifest.pop("checksums")) == {*manifest, "versions"}
    assert manifest == {
        "format": 3,
        "controller": "wam_cast.robot.controller.CastController",
        "engine": "drake",
        "fingerprint": SCENARIO.fingerprint,
        "seed": 0,
        "n_casts": 120,
        "rows_per_part": 50,
        "scenario": SCENARIO.model_dump(mode="json"),
    }


def test_a_dataset_of_another_format_is_refused_with_the_command_that_makes_it_anew(no_physics, tmp_path):
    generate(60, tmp_path)
    path = tmp_path / "manifest.json"
    path.write_text(path.read_text().replace('"format": 3', '"format": 2'))
    command = "wam-cast generate --casts 60 --seed 0 --out DIR"
    for use in (lambda: CastDataset.load(tmp_path), lambda: generate(60, tmp_path)):
        with pytest.raises(InputError, match=f"of format 2, this version reads 3.*{command}"):
            use()


def test_an_interrupted_run_resumes_to_identical_bytes(no_physics, tmp_path):
    generate(170, tmp_path / "whole")

    def interrupt(done, n_casts):
        if done == 130:
            raise KeyboardInterrupt

    executor = ThreadPoolExecutor(2)
    with executor, pytest.raises(KeyboardInterrupt):
        generate(170, tmp_path / "resumed", executor=executor, on_progress=interrupt)
    assert sorted(p.name for p in (tmp_path / "resumed" / "casts").iterdir()) == [
        "part-00000.parquet",
        "part-00001.parquet",
    ]
    executor = InlineExecutor()
    generate(170, tmp_path / "resumed", executor=executor)
    assert executor.rows == list(range(100, 170))
    assert contents(tmp_path / "resumed") == contents(tmp_path / "whole")


def test_an_interrupt_amid_the_writing_of_a_part_spoils_nothing(no_physics, tmp_path, monkeypatch):
    def write_half(table, file, **_):
        file.write(b"half a part")
        raise KeyboardInterrupt

    generate(100, tmp_path)
    expected = contents(tmp_path)
    (tmp_path / "casts" / "part-00001.parquet").unlink()
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(casts_part.pq, "write_table", write_half)
        generate(100, tmp_path)
    assert len(contents(tmp_path)) == 3  # and no half a part
    assert len(pd.read_parquet(tmp_path / "casts")) == 50
    (tmp_path / ".manifest.json.tmp").write_bytes(b"half a manifest")
    (tmp_path / "casts" / ".part-00000.parquet.tmp").write_bytes(b"half a part")
    generate(100, tmp_path)
    assert contents(tmp_path) == expected


def test_a_spoilt_or_missing_part_is_made_again(no_physics, tmp_path, caplog):
    generate(170, tmp_path)
    expected = contents(tmp_path) | {"set_aside/part-00000.parquet": b""}
    (tmp_path / "casts" / "part-00000.parquet").write_bytes(b"")
    (tmp_path / "casts" / "part-00002.parquet").unlink()
    executor = InlineExecutor()
    generate(170, tmp_path, executor=executor)
    assert executor.rows == [*range(50), *range(100, 150)]
    assert contents(tmp_path) == expected
    assert f"it is now {tmp_path}/set_aside/part-00000.parquet" in caplog.text


def test_a_dataset_grows_into_the_one_that_would_have_been_made_at_once(no_physics, tmp_path):
    generate(70, tmp_path / "grown")
    executor = InlineExecutor()
    data = generate(160, tmp_path / "grown", executor=executor)
    assert executor.rows == list(range(70, 160))
    assert len(data) == 160
    generate(160, tmp_path / "whole")
    assert contents(tmp_path / "grown") == contents(tmp_path / "whole")


def test_other_versions_are_recorded_and_no_reason_to_refuse(no_physics, tmp_path, monkeypatch):
    monkeypatch.setattr(storage, "current_versions", lambda: {"drake": "0.1"})
    generate(40, tmp_path)
    monkeypatch.setattr(storage, "current_versions", lambda: {"drake": "0.2"})
    for _ in range(2):
        generate(60, tmp_path)
    assert json.loads((tmp_path / "manifest.json").read_text())["versions"] == [{"drake": "0.1"}, {"drake": "0.2"}]
    assert len(CastDataset.load(tmp_path)) == 60


LONGER = Scenario.from_dict({"string": {"length": 0.58}})
WIDER_CUP = Scenario.from_dict({"cup": {"inner_radius": 0.04}})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scenario": LONGER}, f"another scenario \\('{SCENARIO.fingerprint}', not '{LONGER.fingerprint}'\\)"),
        ({"seed": 1}, r"another seed \(0, not 1\)"),
        ({"n_casts": 39}, "a dataset of 40 casts, more than the 39 asked for"),
    ],
)
def test_a_directory_of_another_dataset_is_refused_and_left_alone(no_physics, tmp_path, options, message):
    generate(40, tmp_path)
    before = contents(tmp_path)
    with pytest.raises(InputError, match=message) as error:
        generate(**{"n_casts": 40, "directory": tmp_path} | options)
    assert one_line(error)
    assert "choose another directory (--out)" in str(error.value)
    assert contents(tmp_path) == before


def test_a_directory_of_something_else_is_refused_and_left_alone(no_physics, tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(InputError, match=r"holds thesis\.tex and no dataset; choose an empty"):
        generate(3, tmp_path)
    assert contents(tmp_path) == {"thesis.tex": b"precious"}


@pytest.mark.parametrize("name", ["file", "file/below"])
def test_a_path_that_cannot_be_a_directory_is_refused(no_physics, tmp_path, name):
    (tmp_path / "file").write_text("precious")
    with pytest.raises(InputError, match="cannot be written") as error:
        generate(3, tmp_path / name)
    assert one_line(error)
    assert contents(tmp_path) == {"file": b"precious"}


def test_a_full_disk_ends_the_run_with_finished_parts_kept(no_physics, tmp_path, monkeypatch):
    write_table = casts_part.pq.write_table

    def write_or_fail(table, path, **options):
        write_table(table, path, **options)
        if table["cast"][0].as_py() == 50:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(casts_part.pq, "write_table", write_or_fail)
    with pytest.raises(InputError, match="No space left on device"):
        generate(100, tmp_path)
    assert [p.name for p in (tmp_path / "casts").iterdir()] == ["part-00000.parquet"]


def test_loading_under_another_scenario_is_refused(no_physics, tmp_path):
    generate(3, tmp_path)
    with pytest.raises(InputError, match=f"{SCENARIO.fingerprint}, not of {LONGER.fingerprint}; generate") as error:
        CastDataset.load(tmp_path, LONGER)
    assert one_line(error)


def test_the_shape_of_the_cup_makes_no_other_dataset(no_physics, tmp_path):
    generate(60, tmp_path)
    assert CastDataset.load(tmp_path, WIDER_CUP).scenario == WIDER_CUP
    executor = InlineExecutor()
    assert generate(60, tmp_path, scenario=WIDER_CUP, executor=executor).scenario == WIDER_CUP
    assert executor.rows == []


def test_a_changed_model_of_the_arm_is_noticed(no_physics, tmp_path, monkeypatch):
    generate(3, tmp_path / "data")
    urdf = (ROOT / "models" / "wam7.urdf").read_text()
    assert "<mass value=" in urdf
    changed = urdf.replace('<mass value="', '<mass value="1', 1).replace("meshes/", f"{ROOT}/models/meshes/")
    (tmp_path / "wam7.urdf").write_text(changed)
    monkeypatch.setattr("wam_cast.arm.arm_model.models_directory", lambda: tmp_path)
    with pytest.raises(InputError, match="the arm's model changed since"):
        CastDataset.load(tmp_path / "data")


def test_an_unfinished_dataset_says_how_to_finish_it(no_physics, tmp_path):
    generate(120, tmp_path, seed=8)
    (tmp_path / "casts" / "part-00001.parquet").unlink()
    with pytest.raises(InputError, match="only 70 of its 120 casts are there") as error:
        CastDataset.load(tmp_path)
    assert one_line(error)
    assert f"--casts 120 --seed 8 --scenario {tmp_path}/scenario.yaml --out {tmp_path}`" in str(error.value)


@pytest.mark.parametrize("manifest", [None, "", "{}", "[1]", '{"format": 3}', "\0"])
def test_what_is_no_dataset_is_refused(tmp_path, manifest):
    if manifest is not None:
        (tmp_path / "manifest.json").write_text(manifest)
    with pytest.raises(InputError, match=r"manifest\.json") as error:
        CastDataset.load(tmp_path)
    assert one_line(error)
    assert str(tmp_path) in str(error.value)


# --- workers


@pytest.mark.slow
def test_a_cast_whose_process_died_is_simulated_again(helper, monkeypatch):
    monkeypatch.setattr(dataset, "simulate_row", helper.dying_row)
    frame = generate(3, executor=None, n_workers=1).frame
    assert list(frame["status"]) == ["landed"] * 3


@pytest.mark.slow
def test_what_was_finished_before_a_process_died_for_good_is_kept(helper, monkeypatch, tmp_path):
    monkeypatch.setattr(dataset, "simulate_row", helper.dead_row)
    with pytest.raises(MachineError, match="row 60"):
        generate(120, executor=None, n_workers=1, directory=tmp_path / "d")
    assert [path.name for path in (tmp_path / "d" / "casts").iterdir()] == ["part-00000.parquet"]


# --- real casts


def run_script(script, *arguments):
    return subprocess.run(
        [sys.executable, script, *arguments], env=script_environment(), capture_output=True, text=True, timeout=120
    )


def script_environment():
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(FAULTS), *filter(None, sys.path)])}


@pytest.fixture(scope="module")
def real(tmp_path_factory):
    directory = tmp_path_factory.mktemp("real")
    return generate_dataset(SCENARIO, 5, 0, n_workers=1, directory=directory), directory


@pytest.mark.slow
def test_the_number_of_workers_changes_no_bit(real, tmp_path):
    data, directory = real
    assert list(data.frame["status"]) == ["landed"] * 5
    generate_dataset(SCENARIO, 5, 0, n_workers=2, directory=tmp_path)
    assert contents(tmp_path) == contents(directory)


def test_a_row_is_the_outcome_of_its_cast(real):
    from wam_cast.simulation.simulator import simulate_cast

    row = real[0].frame.iloc[4]
    outcome = simulate_cast(SCENARIO, Cast(row["distance"], row["speed"], row["wait"]))
    assert row["landing_along"] == outcome.landing_along == outcome.landing[0]
    assert row["landing_across"] == outcome.landing_across == outcome.landing[1]
    for name in ("crossing_time", "entry_speed", "entry_angle", "is_slack", "peak_tracking_error"):
        assert row[name] == getattr(outcome, name)
    assert row["peak_torque_utilization"] == max(outcome.peak_torque_utilization)
    assert row["peak_velocity_utilization"] == max(outcome.peak_velocity_utilization)


@pytest.mark.slow
def test_noise_leaves_the_drawn_casts_alone_and_does_not_depend_on_who_draws_it(real, tmp_path):
    from wam_cast.simulation.simulator import simulate_cast

    noisy = Scenario(noise=Noise.typical())
    frame = generate(5, tmp_path, scenario=noisy).frame
    quiet = real[0].frame
    parameters = ["cast", *PARAMETERS]
    pd.testing.assert_frame_equal(frame[parameters], quiet[parameters], check_exact=True)
    assert not np.any(frame["landing_along"] == quiet["landing_along"])
    backward = pd.DataFrame([dataset.simulate_row(noisy, 0, row) for row in (4, 2, 0)])
    pd.testing.assert_frame_equal(frame.iloc[[4, 2, 0]].reset_index(drop=True), backward, check_exact=True)
    cast = Cast.from_array(frame.loc[3, list(PARAMETERS)].to_numpy(dtype=float))
    outcome = simulate_cast(noisy, cast, noise_seed=row_noise_seed(0, 3))
    assert frame.loc[3, "landing_along"] == outcome.landing_along
    assert CastDataset.load(tmp_path).scenario == noisy


def test_each_row_of_each_seed_always_has_a_noise_seed_of_its_own():
    seeds = [row_noise_seed(seed, row) for seed in (0, 1, 2**32) for row in range(1000)]
    assert len(set(seeds)) == 3000
    assert min(seeds) >= 0
    assert row_noise_seed(0, 0) == 2635072618980576772


@pytest.mark.slow
def test_threads_do_not_disturb_each_other(real):
    with ThreadPoolExecutor(4) as executor:
        data = generate_dataset(SCENARIO, 5, 0, executor=executor)
    pd.testing.assert_frame_equal(data.frame, real[0].frame, check_exact=True)


def test_datasets_load_without_drake(real):
    code = (
        "import sys; from wam_cast.learning.dataset import CastDataset; "
        "assert len(CastDataset.load(sys.argv[1])) == 5; assert 'pydrake' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code, real[1]], env=script_environment(), check=True, timeout=60)


MANY_CASTS = """
import signal, sys
import wam_cast as wc

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if sys.argv[2] == "by closed forms":
        import closed_forms
        from wam_cast.learning import dataset
        dataset.simulate_row = closed_forms.row
    wc.generate_dataset(
        wc.Scenario(), 100_000, n_workers=2, directory=sys.argv[1], on_progress=lambda done, n: print(done, flush=True)
    )
"""


@pytest.fixture
def start_run(tmp_path):
    """Start a long run into `tmp_path / "data"`, in a process group of its own, and return it after so many casts."""
    runs = []

    def start(n_casts, how="by Drake"):
        (tmp_path / "script.py").write_text(MANY_CASTS)
        run = subprocess.Popen(
            [sys.executable, tmp_path / "script.py", tmp_path / "data", how],
            env=script_environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        runs.append(run)
        while int(run.stdout.readline()) < n_casts:
            pass
        return run

    yield start
    for run in runs:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(run.pid, signal.SIGKILL)


def interrupt(run):
    """Press Ctrl-C as a terminal does, which the workers get too; return what the run says on standard error."""
    os.killpg(run.pid, signal.SIGINT)
    start = time.perf_counter()
    _, errors = run.communicate(timeout=30)  # until no process holds the pipes any more
    assert time.perf_counter() - start < 5
    return errors


@pytest.mark.slow
def test_ctrl_c_ends_a_run_soon_and_keeps_finished_parts(start_run, tmp_path):
    errors = interrupt(start_run(55, how="by closed forms"))
    assert errors.splitlines()[-1] == "KeyboardInterrupt"
    assert errors.count("Traceback") == 1
    assert (tmp_path / "data" / "casts" / "part-00000.parquet").exists()
    assert not list((tmp_path / "data").rglob("*.tmp"))


@pytest.mark.slow
def test_ctrl_c_while_the_workers_start_is_left_to_their_parent(start_run):
    run = start_run(0)
    time.sleep(0.7)
    errors = interrupt(run)
    assert errors.splitlines()[-1] == "KeyboardInterrupt"
    assert errors.count("Traceback") == 1


@pytest.mark.slow
def test_workers_end_with_a_parent_that_was_killed(start_run):
    run = start_run(1)
    run.kill()
    run.communicate(timeout=30)  # until no process holds the pipes any more
