"""A run's folder <-> one file, for archives and for disks on which many small files are slow."""

from __future__ import annotations

import shutil
from pathlib import Path

from snooker_cli import store
from snooker_cli.results import files
from snooker_cli.results.folder import is_held
from snooker_cli.results.run import MANIFEST, Run, RunError, State


def pack(run: Run, out: Path) -> int:
    """Write a run's folder as one file; how many repeats it has.

    Each repeat is checked before and after. Raises ``RunError`` if the run is packed already or
    under way, or if the file is there, and ``StoreError`` for a bad repeat or a full disk.
    """
    if run.packed:
        raise RunError(f"{run.directory}: is packed already")
    if is_held(run.directory):
        raise RunError(f"{run.directory}: a `snooker run` is writing here; let it end, then pack")
    _refuse_run(out.parent)
    if out.exists():
        raise RunError(f"{out}: is there already; remove it, or give --out for another file")
    repeats = files.repeats(run.directory)
    for path in repeats:
        _check(run, path)
    others = {name: run.directory / name for name in files.names(run.directory)}
    store.pack(out, repeats, others)
    return len(repeats)


def unpack(run: Run, directory: Path) -> int:
    """Write a packed run's folder anew; how many repeats it has.

    Raises ``RunError`` if the run is not packed or the folder is there, and ``StoreError`` for a
    bad repeat or a full disk.
    """
    if not run.packed:
        raise RunError(f"{run.directory}: is a folder, not a packed run")
    if directory.exists():
        raise RunError(f"{directory}: is there already; remove it, or give --out for another one")
    _refuse_run(directory.parent)
    part = store.part_beside(directory, store.PACKING)
    try:
        directory.parent.mkdir(parents=True, exist_ok=True)
        with store.packing_beside(directory):
            part.mkdir()
            store.unpack(run.directory, part)
            part.rename(directory)
    except OSError as error:
        raise RunError(
            f"{directory}: cannot be written ({error.strerror}); give --out for another folder"
        ) from None
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return len(files.repeats(directory))


def _check(run: Run, path: Path) -> None:
    """Raise ``StoreError`` for a repeat that is damaged or not of this run."""
    told = store.check(path)
    source = told.provenance
    if source.point >= len(run.points) or path != run.path(source.point, source.repeat):
        raise store.StoreError(f"{path}: is not where it belongs; delete it")
    state, sentence = run.state(run.points[source.point], source.repeat, told)
    if state is State.UNUSABLE:
        raise store.StoreError(sentence)


def _refuse_run(folder: Path) -> None:
    """Raise ``RunError`` for a folder with a run under way: the next run would clear it."""
    if (folder / MANIFEST).is_file() and is_held(folder):
        raise RunError(f"{folder}: a `snooker run` is writing here; give --out for another place")
