"""Files that appear whole or not at all, whenever the process or the machine stops."""

import errno
import hashlib
import hmac
import json
import os
import platform
import re
import secrets
import stat
import sys
from collections.abc import Iterator
from contextlib import AbstractContextManager, chdir, contextmanager, nullcontext, suppress
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, BinaryIO

KEY_BYTES = 32
WRITABLE_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH
MOST_BYTES = 1 << 26  # of a file beside results; a manifest of 100,000 points has 20 to 50 million


@contextmanager
def atomic_write(path: Path, given: bool = False) -> Iterator[Path]:
    """Yield a temporary path; what is written there replaces ``path`` when the block ends.

    Makes the folder. After an exception the older file is as it was. Raises ``OSError``, which
    names ``path``.

    given : whether a user gave this name; a link there is then followed, and else replaced,
        because a stranger's folder may have links to files of the user
    """
    target = path.resolve() if given else path
    part = temporary_path(target)
    try:
        with new_folder(path.parent):
            try:
                yield part
                move_into_place(part, target)
            finally:
                discard(part)
    except OSError as error:
        if error.errno and error.filename in (None, str(part)):
            error.filename, error.filename2 = str(path), None
        raise


def write_text(path: Path, text: str, given: bool = False) -> None:
    """Write a text file as `atomic_write` does. Raises ``OSError``."""
    with atomic_write(path, given) as part:
        part.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Any) -> None:
    """Write an indented JSON file. Raises ``OSError``, and ``ValueError`` for inf and nan."""
    write_text(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def append_text(path: Path, text: str) -> None:
    """Add text to a file; what is there but is no file is replaced. Raises ``OSError``."""
    if path.is_symlink() or not path.is_file():
        path.unlink(missing_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(text)


@contextmanager
def new_folder(path: Path) -> Iterator[None]:
    """Make a folder and those above it. Raises ``OSError``.

    After an exception, the folders that were made are deleted, unless something is in them.
    """
    made = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for folder in made:
            with suppress(OSError):
                folder.rmdir()
        raise


def unlinked(path: Path) -> Path:
    """A folder whose name this program chose. Raises ``OSError`` if it is a link."""
    if path.is_symlink():
        problem = f"there is a link instead of the folder {path.name}"
        raise OSError(errno.ELOOP, problem, str(path))
    return path


def own_folder(path: Path) -> Path:
    """Make a folder whose name this program chose. Raises ``OSError``, also if it is a link."""
    unlinked(path).mkdir(exist_ok=True)
    return path


def cache_within(chosen: str | None, name: str) -> Path:
    """The `private_folder` of a name for what can be made again.

    chosen : the folder that the user has set for it [that of the user's caches]

    Raises ``OSError``, also if the user has no home folder.
    """
    if chosen:
        return private_folder(Path(chosen), name, shared=True)
    try:
        user = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser()
    except RuntimeError as error:
        raise OSError(str(error).rstrip(".")) from None
    return private_folder(user / "snooker", name, shared=False)


def private_folder(parent: Path, name: str, *, shared: bool) -> Path:
    """Make a folder that no other user can change; Windows has no such check.

    shared : whether ``parent`` has other uses, so that its permissions stay as they are

    Raises ``OSError`` if it cannot be written, or if another user can change or replace it.
    """
    parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    folder = parent.resolve() / name
    if sys.platform != "win32":
        user, above = os.geteuid(), folder.parent.stat()
        if above.st_uid == user and not shared:
            folder.parent.chmod(above.st_mode & ~WRITABLE_BY_OTHERS)
            above = folder.parent.stat()
        # In a sticky folder, such as /tmp, others cannot replace what they do not own.
        loose = above.st_mode & WRITABLE_BY_OTHERS and not above.st_mode & stat.S_ISVTX
        if loose or above.st_uid not in (user, 0):
            raise PermissionError(f"other users can change {folder.parent}")
        folder.mkdir(mode=0o700, exist_ok=True)
        mine = folder.lstat()
        if mine.st_uid != user or mine.st_mode & WRITABLE_BY_OTHERS:
            raise PermissionError(f"other users can change {folder}")
    folder.mkdir(mode=0o700, exist_ok=True)
    with TemporaryFile(dir=folder):
        return folder


def open_file(path: Path) -> BinaryIO:
    """Open a file for reading. Raises ``OSError``, at once also for a pipe or a device."""
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    file = os.fdopen(os.open(path, flags), "rb")
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise OSError("it is not a file")
    return file


def read_text(path: Path, most: int = MOST_BYTES) -> str:
    """The text of a file in a run's folder, where a stranger may have put anything.

    What is not UTF-8 is replaced. Raises ``OSError``, also for a file of more than ``most`` bytes.
    """
    with open_file(path) as file:
        if os.fstat(file.fileno()).st_size > most:
            raise OSError(f"it has more than {most:,} bytes")
        content = file.read(most)
    return content.decode("utf-8", "replace")


def temporary_path(path: Path) -> Path:
    """A new name beside ``path`` that no other process uses, with the name of this machine."""
    return path.with_name(f"{path.name}.{_machine()}-{secrets.token_hex(8)}.part")


def unfinished(directory: Path) -> Iterator[Path]:
    """The temporary files of this machine in a folder."""
    return directory.glob(f"*.{_machine()}-*.part")


def move_into_place(part: Path, path: Path) -> None:
    """Flush a temporary file to the disk and give it its final name. Raises ``OSError``."""
    with part.open("rb+") as file:
        os.fsync(file.fileno())
    part.replace(path)


def discard(part: Path) -> None:
    """Delete a temporary file if it is still there."""
    with suppress(OSError):
        part.unlink(missing_ok=True)


@cache
def _machine() -> str:
    """The machine's name in letters and digits, at most 40."""
    return re.sub(r"[^A-Za-z0-9]", "_", platform.node())[:40]


@cache
def sources_hash(*patterns: str) -> str:
    """SHA-256 over the package's sources that match patterns such as ``engine/*.py``."""
    package, total = Path(__file__).parent, hashlib.sha256()
    for pattern in patterns:
        for source in sorted(package.glob(pattern)):
            total.update(source.read_bytes())
    return total.hexdigest()


def out_of_sight(name: str) -> AbstractContextManager[None]:
    """Inside, the current folder has no file of this name, which a library would read there.

    Anyone may have made it. The current folder changes only if there is such a file.
    """
    return chdir(Path(__file__).parent) if os.path.lexists(name) else nullcontext()


def user_hash(content: str) -> hmac.HMAC:
    """A SHA-256 of a text, and of what is added to it, that only this user can make (RFC 2104).

    Raises ``OSError`` if no key can be kept.
    """
    return hmac.new(user_key(), content.encode(), "sha256")


@cache
def user_key() -> bytes:
    """Random bytes that no other user can read; they are made at their first use.

    Raises ``OSError``, whose text names the file, if they cannot be kept or read.
    """
    try:
        folder = Path(os.environ.get("XDG_STATE_HOME") or "~/.local/state").expanduser()
    except RuntimeError as error:
        raise OSError(str(error)) from None
    path = folder / "snooker" / "key"
    try:
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not path.exists():
            _make_key(path)
        key = path.read_bytes()
    except OSError as error:
        raise OSError(f"{path}: {error.strerror}") from None
    if len(key) != KEY_BYTES:
        raise OSError(f"{path} has {len(key)} bytes, but a key has {KEY_BYTES}; delete it")
    return key


def _make_key(path: Path) -> None:
    """Make a key, whole or not at all, unless another process has just made one."""
    part = temporary_path(path)
    try:
        with open(part, "xb", opener=partial(os.open, mode=0o600)) as file:
            file.write(secrets.token_bytes(KEY_BYTES))
        with suppress(FileExistsError):
            os.link(part, path)
    finally:
        discard(part)
