"""A file for other programs: whole or not at all, and a sentence if it cannot be."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from snooker_cli.store import whole


class ExportError(Exception):
    """A file that cannot be made; one sentence."""


@contextmanager
def written(path: Path) -> Iterator[Path]:
    """A name for what becomes the file at the end; its folder is made.

    Raises ``ExportError`` if the system refuses.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with whole(path) as part:
            yield part
    except OSError as error:
        raise ExportError(
            f"{path}: cannot be written ({error.strerror or error}); make room or choose another "
            "file"
        ) from None
