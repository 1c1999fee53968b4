"""``snooker pack`` and ``unpack``: a run's folder as one file, and back."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from snooker_cli.cli.analysing import RunName


def pack(
    run: RunName,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="The packed run [RUN.h5].")
    ] = None,
) -> None:
    """Write RUN as one HDF5 file, for archives and disks on which many small files are slow.

    Every command that takes a RUN reads it like the folder, which is left as it is. Each repeat is
    checked, and so is its copy. The written file is printed.
    """
    from snooker_cli import results
    from snooker_cli.cli.progress import say
    from snooker_cli.words import counted, size

    opened = results.open_run(run)
    folder = opened.directory.resolve() if not opened.directory.name else opened.directory
    file = out or folder.with_name(f"{folder.name}.h5")
    number = results.pack(opened, file)
    say(f"{counted(number, 'repeat')}, {size(file.stat().st_size)}")
    typer.echo(file)


def unpack(
    run: RunName,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="The run's folder [RUN without .h5]."),
    ] = None,
) -> None:
    """Write the folder of a packed RUN anew, to the same collisions, bit by bit.

    Each repeat is checked. The folder is printed; the packed file is left as it is.
    """
    from snooker_cli import results
    from snooker_cli.cli.endings import UserError

    opened = results.open_run(run)
    folder = out or opened.directory.with_suffix("")
    if opened.packed and folder == opened.directory:
        raise UserError(f"{folder}: its name has no ending to leave out; give --out for a folder")
    results.unpack(opened, folder)
    typer.echo(folder)
