"""The name of a file while it is being written: nobody else's, and known for this machine's."""

from __future__ import annotations

import platform
import re
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path


def part_beside(path: Path) -> Path:
    """A new name beside ``path``, for writing what then replaces it."""
    return path.with_name(f"{path.name}.{_machine()}-{secrets.token_hex(8)}.part")


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A name beside ``path`` for what replaces it at the end, or is gone if anything goes wrong."""
    part = part_beside(path)
    try:
        yield part
        part.replace(path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def parts_of_this_machine(directory: Path) -> Iterator[Path]:
    """What this machine has begun to write in a folder and not finished."""
    return directory.glob(f"*.{_machine()}-*.part")


@cache
def _machine() -> str:
    """The machine's name, as far as it can be in the name of a file."""
    return re.sub(r"[^A-Za-z0-9]", "_", platform.node())[:40]
