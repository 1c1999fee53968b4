"""What lies in a run besides repeats, by name: the same in a folder and in a packed run."""

from __future__ import annotations

import fnmatch
from pathlib import Path

from snooker_cli import store

REPEATS = "point-*/repeat-*.h5"
SUFFIX = ".h5"
"""Of a packed run."""


def names(directory: Path, pattern: str = "**/*") -> list[str]:
    """What is there but repeats and what is being written; names have a slash in folders."""
    if directory.is_file():
        there = store.packed_files(directory)
        return sorted(there if pattern == "**/*" else fnmatch.filter(there, pattern))
    return sorted(
        path.relative_to(directory).as_posix()
        for path in directory.glob(pattern)
        if path.is_file() and path.suffix != ".part" and not path.match(REPEATS)
    )


def text(directory: Path, name: str) -> str:
    """What is in one of them; raises ``OSError`` if it is not there."""
    if directory.is_file():
        return store.packed_file(directory, name).decode("utf-8", "replace")
    return (directory / name).read_text("utf-8", "replace")


def repeats(directory: Path) -> list[Path]:
    """The files of all repeats that are there, of the config or not."""
    if directory.is_file():
        return [directory / path for path in store.packed_repeats(directory)]
    return sorted(directory.glob(REPEATS))
