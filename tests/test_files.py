"""Files that appear whole or not at all."""

from __future__ import annotations

import errno
import json
import os
import sys
from pathlib import Path

import pytest
from hostile import endless, fifo, folder

from snooker_cli import files
from snooker_cli.files import (
    append_text,
    atomic_write,
    read_text,
    user_key,
    write_json,
    write_text,
)


def test_what_goes_wrong_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "in" / "numbers.json"
    write_json(path, {"k": 0.1 + 0.2})
    with pytest.raises(ValueError, match="nan"):
        write_json(path, {"k": float("nan")})
    with pytest.raises(ZeroDivisionError), atomic_write(path) as part:
        part.write_text(str(1 / len(part.name[:0])))
    assert json.loads(path.read_text()) == {"k": 0.1 + 0.2}
    assert list(path.parent.iterdir()) == [path]


def test_a_failed_write_names_the_file_and_follows_a_given_link(tmp_path: Path) -> None:
    """The temporary name means nothing to a reader."""
    path, link = tmp_path / "film.gif", tmp_path / "link.gif"
    path.write_text("old")
    link.symlink_to(path)
    for error in (OSError(errno.ENOSPC, "full"), OSError(errno.EIO, "broken", "other")):
        with pytest.raises(OSError, match=error.strerror) as failed, atomic_write(link, given=True):
            raise error
        assert failed.value.filename == ("other" if error.errno == errno.EIO else str(link))
    with pytest.raises(FileNotFoundError) as absent, atomic_write(link, given=True):
        pass
    assert absent.value.filename == str(link)
    assert path.read_text() == "old"
    with atomic_write(link, given=True) as part:
        part.write_text("new")
    assert (path.read_text(), link.is_symlink()) == ("new", True)
    assert set(tmp_path.iterdir()) == {path, link}


def test_under_an_own_name_a_link_is_replaced(tmp_path: Path) -> None:
    path, link = tmp_path / "precious", tmp_path / "own"
    path.write_text("old")
    for write in (write_text, append_text):
        link.unlink(missing_ok=True)
        link.symlink_to(path)
        write(link, "new")
        assert (path.read_text(), link.read_text(), link.is_symlink()) == ("old", "new", False)
    append_text(link, "er")
    assert link.read_text() == "newer"


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such files")
def test_only_a_file_of_bounded_size_is_read(tmp_path: Path) -> None:
    path = tmp_path / "read"
    path.write_bytes(b"a\xff")
    assert read_text(path, 2) == "a\ufffd"
    for most, damage in ((1, None), (99, fifo), (99, endless), (99, folder)):
        if damage:
            path.write_text("")
            damage(path)
        with pytest.raises(OSError):  # noqa: PT011
            read_text(path, most)
        if damage is folder:
            path.rmdir()
        path.unlink(missing_ok=True)


def test_a_key_is_whole_and_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two processes that make it at the same time have the same one."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    user_key.cache_clear()
    path, link = tmp_path / "snooker" / "key", os.link

    def after_another(part: Path, key: Path) -> None:
        assert not path.exists()
        path.write_bytes(b"a" * files.KEY_BYTES)
        link(part, key)

    monkeypatch.setattr(files.os, "link", after_another)
    assert user_key() == path.read_bytes() == b"a" * files.KEY_BYTES
    path.unlink()
    monkeypatch.undo()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    user_key.cache_clear()
    mine = user_key()
    user_key.cache_clear()
    assert user_key() == mine == path.read_bytes()
    assert path.stat().st_mode & 0o777 == 0o600
    assert list(path.parent.iterdir()) == [path]
    user_key.cache_clear()


def test_a_failed_write_leaves_no_new_folder_without_files(tmp_path: Path) -> None:
    """An older folder stays, and one that has other files."""
    (tmp_path / "old").mkdir()
    for name in ("old/file", "new/in/new/file"):
        with pytest.raises(ZeroDivisionError), atomic_write(tmp_path / name):
            raise ZeroDivisionError
    assert [path.name for path in tmp_path.rglob("*")] == ["old"]
    new = tmp_path / "new"
    with pytest.raises(ZeroDivisionError), files.new_folder(new), (new / "kept").open("w"):
        raise ZeroDivisionError
    assert (new / "kept").exists()
