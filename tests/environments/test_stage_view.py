"""The page of an environment that is watched: closed, it serves the next one."""

import psutil
import pytest

from wam_cast.environments.stage_view import StageView
from wam_cast.scenario import Scenario


def n_listening():
    connections = psutil.Process().net_connections("tcp")
    return sum(connection.status == psutil.CONN_LISTEN for connection in connections)


@pytest.fixture
def watched(caplog):
    """Return a function that begins to show a scenario, and returns the view and the address of its page."""

    def begin():
        view = StageView(Scenario(), "human")
        view.begin((0.6, 0.1))
        return view, caplog.messages[-1].split()[-1]

    return begin


def test_one_page_after_the_other_is_the_same_and_two_at_a_time_are_two(watched):
    first, address = watched()
    n_pages = n_listening()
    first.close()
    first.close()
    second, next_address = watched()
    assert (next_address, n_listening()) == (address, n_pages)
    other, other_address = watched()
    assert other_address != address
    assert n_listening() > n_pages
    n_pages = n_listening()
    second.close()
    other.close()
    assert {watched()[1], watched()[1]} == {address, other_address}
    assert n_listening() == n_pages
