"""Where pages are served, and in which words they are not."""

import socket

import pytest

from wam_cast.errors import InputError
from wam_cast.visualization.viewer import open_meshcat


@pytest.mark.parametrize(("host", "shown"), [("*", "localhost"), ("0.0.0.0", "localhost"), ("127.0.0.1", "127.0.0.1")])
def test_a_page_says_where_a_browser_on_this_machine_finds_it(host, shown):
    meshcat = open_meshcat(host)
    address, _, port = meshcat.web_url().rpartition(":")
    assert address == f"http://{shown}"
    with socket.create_connection(("127.0.0.1", int(port))):
        pass


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"host": "no.such.invalid"}, "host = 'no.such.invalid' is a name that this machine knows no address of"),
        ({"host": "x" * 70}, "is a name that this machine knows no address of"),
        (
            {"host": "192.0.2.1"},
            "host = '192.0.2.1' is no address of this machine",
        ),  # kept for documentation by RFC 5737
        ({"host": ""}, "host = '' is empty"),
        ({"port": 80}, "port = 80 must be from 1024 to 65535, or 0 for a free one"),
        ({"port": 65536}, "port = 65536 must be from 1024 to 65535, or 0 for a free one"),
    ],
)
def test_where_no_page_can_be_the_reason_is_told(options, words):
    with pytest.raises(InputError, match=words):
        open_meshcat(**options)


def test_a_port_that_is_taken_is_told():
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=f"at 127.0.0.1, port {port}: another program has the port"):
            open_meshcat("127.0.0.1", port)
