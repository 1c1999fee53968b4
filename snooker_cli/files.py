"""Files that appear whole or not at all, whenever the process or the machine stops."""

import hashlib
import hmac
import json
import os
import platform
import re
import secrets
from collections.abc import Iterator
from contextlib import AbstractContextManager, chdir, contextmanager, nullcontext, suppress
from functools import cache, partial
from pathlib import Path
from typing import Any

KEY_BYTES = 32


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a temporary path; what is written there replaces ``path`` when the block ends.

    Makes the folder, and follows a link. After an exception the older file is as it was. Raises
    ``OSError``, which names ``path``.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    target = path.resolve()
    part = temporary_path(target)
    try:
        yield part
        move_into_place(part, target)
    except OSError as error:
        if error.errno and error.filename in (None, str(part)):
            error.filename, error.filename2 = str(path), None
        raise
    finally:
        discard(part)


def write_text(path: Path, text: str) -> None:
    """Write a text file. Raises ``OSError``."""
    with atomic_write(path) as part:
        part.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Any) -> None:
    """Write an indented JSON file. Raises ``OSError``, and ``ValueError`` for inf and nan."""
    write_text(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


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


def signature(*content: Any) -> str:
    """The `user_hash` of values that JSON can have. Raises ``OSError`` if no key can be kept."""
    return user_hash(json.dumps(content)).hexdigest()


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
