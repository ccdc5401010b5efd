"""A Dask cluster simulates the same dataset as one process."""

import importlib.util
import subprocess
import sys

import pytest

# In a process of its own: threads of Dask may collect what other tests left behind, and renderers do not survive that.
# Its workers have several threads, which take turns in one simulator.
SCRIPT = """
import distributed
from wam_cast import Scenario, generate_dataset

with distributed.LocalCluster(n_workers=1, threads_per_worker=3, processes=False, dashboard_address=None) as cluster:
    with distributed.Client(cluster) as client:
        by_cluster = generate_dataset(Scenario(), 6, seed=3, executor=client.get_executor()).frame
alone = generate_dataset(Scenario(), 6, seed=3, n_workers=1).frame
print("equal" if by_cluster.equals(alone) else by_cluster.compare(alone))
"""


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="the extra `distributed` is not installed")
def test_cluster_gives_the_same_rows_as_one_process(tmp_path):
    script = tmp_path / "compare.py"
    script.write_text(f"if __name__ == '__main__':\n{''.join('    ' + line for line in SCRIPT.splitlines(True))}")
    found = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False)
    assert found.stdout.splitlines()[-1:] == ["equal"], found.stderr[-2000:]
