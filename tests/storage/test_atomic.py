"""Files that a user asked for: written whole, replaced whole, or not touched."""

import os
from pathlib import Path

import pytest

from wam_cast.errors import InputError
from wam_cast.storage.atomic import check_writable, write_file

UNWRITABLE = ["missing/file", ".", "folder", "old/file", "x" * 300]
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
    assert line.startswith(f"cannot write {folder / name}: ")
    assert "existing folder" in line
    assert "\n" not in line
    assert names(folder) == ["folder", "old"]
    assert (folder / "old").read_bytes() == b"before"


@pytest.mark.parametrize("name", [name for name in UNWRITABLE if len(name) < 256])
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


def test_a_folder_that_may_not_be_written_to_is_asked_about(folder, monkeypatch):
    monkeypatch.setattr(os, "access", lambda path, mode: path != folder)
    with pytest.raises(InputError, match="permission denied"):
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
