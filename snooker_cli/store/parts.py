"""The name of a file while it is being written: nobody else's, and known for this machine's."""

from __future__ import annotations

import os
import platform
import re
import secrets
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from glob import escape
from pathlib import Path

if sys.platform != "win32":
    import fcntl

PACKING = ".packing"
"""In the names of what is packed or unpacked, so that no one else's is taken for a leftover."""


def part_beside(path: Path, of: str = "") -> Path:
    """A new name beside ``path``, for writing what then replaces it."""
    return path.with_name(f"{path.name}{of}.{_machine()}-{secrets.token_hex(8)}.part")


@contextmanager
def whole(path: Path, of: str = "") -> Iterator[Path]:
    """A name beside ``path`` for what replaces it at the end, or is gone if anything goes wrong."""
    part = part_beside(path, of)
    try:
        yield part
        part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


@contextmanager
def packing_beside(path: Path) -> Iterator[None]:
    """Clear away what a kill has left of packing or unpacking to ``path``; inside, it can be begun.

    All who pack or unpack in a folder share its lock, and it is cleared only by one who has it
    alone: then nobody is writing there. Where a folder cannot be locked, nothing is cleared.
    """
    if sys.platform == "win32":
        yield
        return
    descriptor = os.open(path.parent, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            for part in path.parent.glob(f"{escape(path.name)}{PACKING}.{_machine()}-*.part"):
                if part.is_dir():
                    shutil.rmtree(part)
                else:
                    part.unlink(missing_ok=True)
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_SH)
        yield
    finally:
        os.close(descriptor)


def parts_of_this_machine(directory: Path) -> Iterator[Path]:
    """What this machine has begun to write in a folder and not finished."""
    return directory.glob(f"*.{_machine()}-*.part")


@cache
def _machine() -> str:
    """The machine's name, as far as it can be in the name of a file."""
    return re.sub(r"[^A-Za-z0-9]", "_", platform.node())[:40]
