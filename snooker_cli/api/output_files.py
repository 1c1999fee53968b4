"""Files and folders that a user names: whether they can be written, or may be replaced."""

import os
from pathlib import Path
from tempfile import TemporaryFile

from snooker_cli.errors import UserError
from snooker_cli.files import own_folder
from snooker_cli.pages.html_page import is_page
from snooker_cli.runs.folder import holds_results, writing


def check_free(out: Path, replace: bool) -> None:
    """Raise ``UserError`` if writing a file would replace one that is not a page of snooker."""
    if os.path.lexists(out) and not replace and not is_page(out):
        raise UserError(f"{out}: exists already", "give --replace, or --out for another name")


def check_no_results(out: Path) -> None:
    """Raise ``UserError`` if a file holds results of a run, which nothing else may replace."""
    if holds_results(out):
        raise UserError(f"--out {out}: this file holds results of a run", "give another name")


def make_folder(folder: Path) -> None:
    """Make a folder before long work. Raises ``RunError`` if no file can be written there."""
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=folder).close()


def make_own_folder(folder: Path) -> Path:
    """Make a folder in that of a run. Raises ``RunError`` if it cannot be made, or is a link."""
    with writing(folder.parent):
        return own_folder(folder)
