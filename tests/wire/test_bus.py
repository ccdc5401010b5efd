"""Addresses, and a bus within one process that delays, loses and doubles as it is told."""

import numpy as np
import pytest

from wam_cast.errors import InputError
from wam_cast.wire.bus import DEFAULT_URL, LcmBus, check_url
from wam_cast.wire.lossy_link import LossyLink
from wam_cast.wire.memory_network import MemoryNetwork


@pytest.mark.parametrize(
    "url",
    [
        *(
            "",
            "nonsense",
            "memq://",
            "udpm://",
            "tcpq://127.0.0.1:7700",
            "udpm://10.0.0.1:7667?ttl=0",
            "udpm://239.255.76.67",
        ),
        *("udpm://239.255.76.67:0", "udpm://239.255.76.67:99999", "udpm://239.255.76.999:7667", f"{DEFAULT_URL}&x=1"),
        *(
            "udpm://239.255.76.67:7667?ttl=999",
            "udpm://239.255.76.67:7667?ttl=256",
            "udpm://239.255.76.67:\u0667\u0666\u0666\u0667",
        ),
    ],
)
def test_what_is_no_address_is_refused(url):
    # Of these LCM takes nearly all, and nobody ever hears of each other.
    with pytest.raises(InputError, match="must be udpm://GROUP:PORT"):
        LcmBus(url)


def test_addresses():
    assert check_url(DEFAULT_URL) == DEFAULT_URL
    assert check_url("udpm://224.0.0.1:1")
    assert check_url("udpm://224.0.0.1:1?ttl=255")


def delays(link, n=4000):
    times = [link.arrivals(1.0) for _ in range(n)]
    return [len(one) for one in times], np.array([time - 1.0 for one in times for time in one])


def test_a_perfect_link_delivers_at_once_and_once():
    counts, late = delays(LossyLink())
    assert set(counts) == {1}
    assert not late.any()


def test_links_are_as_bad_as_they_are_said_to_be():
    counts, late = delays(LossyLink(delay=0.004, jitter=0.001, loss=0.1, doubling=0.2, seed=1))
    n, sigmas = len(counts), 4
    for count, share in ((0, 0.1), (2, 0.9 * 0.2)):
        assert counts.count(count) / n == pytest.approx(share, abs=sigmas * np.sqrt(share * (1 - share) / n))
    assert late.min() >= 0.002
    assert late.mean() == pytest.approx(0.003, abs=sigmas * 0.001 / np.sqrt(n))
    again = delays(LossyLink(delay=0.004, jitter=0.001, loss=0.1, doubling=0.2, seed=1))[1]
    np.testing.assert_array_equal(late, again)


def test_messages_arrive_in_the_order_of_their_times():
    network, heard = MemoryNetwork(LossyLink(delay=0.2)), []
    sender, receiver = network.join(), network.join()
    receiver.subscribe("A", lambda data: heard.append((data, network.now())))
    sender.subscribe("A", lambda _: pytest.fail("nobody hears himself"))
    sender.publish("A", b"1")
    network.sleep_until(0.05)
    sender.publish("A", b"2")
    sender.publish("B", b"nobody listens")
    assert heard == []
    receiver.handle(1.0)
    assert heard == [(b"1", 0.1)]
    receiver.handle(0.01)
    assert (len(heard), network.now()) == (1, pytest.approx(0.11))
    network.sleep_until(2.0)
    assert heard == [(b"1", 0.1), (b"2", pytest.approx(0.15))]


def test_one_side_works_while_another_waits():
    network, left = MemoryNetwork(), [3]

    def work():
        left[0] -= left[0] > 0
        return left[0] > 0

    network.join(work)
    waiting = network.join()
    waiting.handle(1.0)
    assert left == [2]
    assert network.now() == 0.0
    for _ in range(2):
        waiting.handle(1.0)
    assert (left, network.now()) == ([0], 1.0)
