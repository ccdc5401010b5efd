"""Files that a user asked for: written whole, replaced whole, or not touched."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from wam_cast.errors import InputError
from wam_cast.storage.atomic import check_writable, replacing, write_file

UNWRITABLE = ["missing/file", ".", "folder", "old/file", "x" * 300, "a\0b"]
"""Below a folder that holds `old`, a file, and `folder`."""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "old").write_bytes(b"before")
    (tmp_path / "folder").mkdir()
    return tmp_path


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_new_file_is_written(folder):
    write_file(folder / "new", b"\x00content\n")
    assert (folder / "new").read_bytes() == b"\x00content\n"
    assert names(folder) == ["folder", "new", "old"]


def test_a_name_as_text_is_as_good(folder, monkeypatch):
    monkeypatch.chdir(folder)
    write_file("new", b"")
    assert (folder / "new").read_bytes() == b""


def test_what_was_there_is_replaced(folder):
    write_file(folder / "old", b"now")
    assert (folder / "old").read_bytes() == b"now"
    assert names(folder) == ["folder", "old"]


def test_readers_of_the_old_file_keep_it_whole(folder):
    with (folder / "old").open("rb") as reader:
        write_file(folder / "old", b"now")
        assert reader.read() == b"before"


def test_a_link_is_followed(folder):
    (folder / "folder" / "link").symlink_to(folder / "old")
    write_file(folder / "folder" / "link", b"now")
    assert (folder / "folder" / "link").is_symlink()
    assert (folder / "old").read_bytes() == b"now"


def test_a_pipe_is_written_to_and_stays_one(folder):
    pipe = folder / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_file(pipe, b"now")
        assert os.read(reader, 100) == b"now"
    finally:
        os.close(reader)
    assert pipe.is_fifo()
    assert names(folder) == ["folder", "old", "pipe"]


@pytest.mark.parametrize("name", UNWRITABLE)
def test_what_cannot_be_written_is_refused_in_one_line_and_nothing_changes(folder, name):
    with pytest.raises(InputError) as caught:
        write_file(folder / name, b"now")
    line = str(caught.value)
    assert line.startswith(f"cannot write {folder / name}".replace("\0", r"\x00")[:100])
    assert "existing folder" in line
    assert "\n" not in line
    assert names(folder) == ["folder", "old"]
    assert (folder / "old").read_bytes() == b"before"


@pytest.mark.parametrize("name", UNWRITABLE)
def test_that_can_be_asked_before(folder, name):
    with pytest.raises(InputError, match="cannot write"):
        check_writable(folder / name)


def test_asking_writes_nothing(folder):
    check_writable(folder / "new")
    check_writable(folder / "old")
    assert names(folder) == ["folder", "old"]


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing keeps the superuser from writing")
def test_a_folder_that_may_not_be_written_to_is_refused(folder):
    (folder / "folder").chmod(0o500)
    for ask in (check_writable, lambda path: write_file(path, b"")):
        with pytest.raises(InputError, match="permission denied"):
            ask(folder / "folder" / "new")


def test_asking_meets_whatever_writing_would(folder, monkeypatch):
    def refuse(path, *_, **__):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Path, "touch", refuse)
    with pytest.raises(InputError, match="read-only file system"):
        check_writable(folder / "new")


@pytest.mark.parametrize(
    ("raised", "seen"), [(OSError(28, "No space left on device"), InputError), (KeyboardInterrupt(), None)]
)
def test_a_write_that_fails_half_way_leaves_nothing_behind(folder, monkeypatch, raised, seen):
    write_bytes = Path.write_bytes

    def fail(path, content):
        write_bytes(path, content[:2])
        raise raised

    monkeypatch.setattr(Path, "write_bytes", fail)
    with pytest.raises(seen or type(raised)) as caught:
        write_file(folder / "old", b"now")
    if seen:
        assert "no space left" in str(caught.value)
    assert names(folder) == ["folder", "old"]
    assert (folder / "old").read_bytes() == b"before"


WRITE = """
import sys, time
from pathlib import Path
from wam_cast.storage.atomic import replacing

with replacing(Path(sys.argv[1])) as temporary:
    temporary.write_bytes(b"half")
    print("written", flush=True)
    time.sleep(60)
"""


def test_what_a_killed_process_left_goes_with_the_next_write(folder):
    writer = subprocess.Popen([sys.executable, "-c", WRITE, folder / "r.html"], stdout=subprocess.PIPE)
    try:
        writer.stdout.readline()
        assert len(names(folder)) == 3
        write_file(folder / "r.html", b"whole")
        assert len(names(folder)) == 4  # whoever is alive may yet replace it
    finally:
        writer.kill()
        writer.communicate()
    others = [".wam_cast.tmp", f".wam_cast-elsewhere-{writer.pid}-0.tmp"]
    for other in others:
        (folder / other).touch()
    write_file(folder / "s.html", b"whole")
    assert names(folder) == sorted([*others, "folder", "old", "r.html", "s.html"])


def test_two_writers_of_one_file_in_one_process_do_not_meet(folder):
    with replacing(folder / "new") as one:
        one.write_bytes(b"one")
        with replacing(folder / "new") as other:
            other.write_bytes(b"other")
        assert (folder / "new").read_bytes() == b"other"
    assert (folder / "new").read_bytes() == b"one"


def test_the_longest_name_will_do(folder):
    write_file(folder / ("x" * 255), b"now")
    assert (folder / ("x" * 255)).read_bytes() == b"now"
