"""Files and folders that a user names: whether they can be written, or may be replaced."""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryFile

from snooker_cli import options
from snooker_cli.errors import UserError
from snooker_cli.files import new_folder, unlinked
from snooker_cli.runs.folder import holds_results, writing


def check_free(out: Path, replace: bool) -> None:
    """Raise ``UserError`` if writing a file would replace one that is not a page of snooker."""
    if replace or not os.path.lexists(out):
        return
    from snooker_cli.pages.html_page import is_page

    if not is_page(out):
        raise UserError(
            f"{out}: exists already", f"give {options.REPLACE}, or {options.OUT} for another name"
        )


def check_no_results(out: Path) -> None:
    """Raise ``UserError`` if a file holds results of a run, which nothing else may replace."""
    if holds_results(out):
        raise UserError(
            f"{options.OUT.of(out)}: this file holds results of a run", "give another name"
        )


@contextmanager
def made_folder(folder: Path) -> Iterator[None]:
    """Make a folder before long work, which is done inside; without files it does not stay.

    Raises ``RunError`` if no file can be written there.
    """
    with ExitStack() as made:
        with writing(folder):
            made.enter_context(new_folder(folder))
            TemporaryFile(dir=folder).close()
        yield


def own_output(folder: Path) -> Path:
    """A folder in that of a run, made with its first file. Raises ``RunError`` if it is a link."""
    with writing(folder.parent):
        return unlinked(folder)
