"""A Dask cluster simulates the same dataset as this machine's processes."""

import pandas as pd
import pytest

from wam_cast.learning.dataset import generate_dataset
from wam_cast.scenario import Scenario

distributed = pytest.importorskip("distributed", reason="the extra `distributed` is not installed")


@pytest.fixture(scope="module")
def client():
    # Workers in this process, with several threads: each thread must have a simulator of its own.
    with (
        distributed.LocalCluster(
            n_workers=1, threads_per_worker=3, processes=False, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def test_cluster_gives_the_same_rows_as_one_process(client):
    scenario = Scenario()
    by_cluster = generate_dataset(scenario, 6, seed=3, executor=client.get_executor())
    alone = generate_dataset(scenario, 6, seed=3, n_workers=1)
    pd.testing.assert_frame_equal(by_cluster.frame, alone.frame, check_exact=True)
