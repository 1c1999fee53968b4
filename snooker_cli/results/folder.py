"""A run's folder: made, held by one run at a time, and found again."""

from __future__ import annotations

import difflib
import json
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from snooker_cli import store
from snooker_cli.config import ConfigError, Experiment, parse, points
from snooker_cli.results.extension import as_json, read_manifest, refusal, takes_back
from snooker_cli.results.failures import FAILURES, forget_failures
from snooker_cli.results.run import ANALYSES, MANIFEST, DamagedError, Run, RunError, write_json

if sys.platform != "win32":
    import fcntl

RUNS = Path("runs")

_MAKE = "make one with `snooker run CONFIG`"

WAITS = (0.0, 0.02, 0.05, 0.1)
"""Seconds before each try to lock a folder: whoever asks whether it is held holds it a moment."""


@contextmanager
def held(directory: Path) -> Iterator[None]:
    """Keep a folder to one run at a time on this machine, and clear away what a kill has left.

    Raises ``RunError`` if another process has it or it cannot be made. On a disk shared by
    machines two runs may still meet: their files are whole, as each is written under a name of
    its own, and the last one stays.
    """
    _refuse_file(directory)
    with _said(directory):
        directory.mkdir(parents=True, exist_ok=True)
    if sys.platform == "win32":  # where a folder cannot be locked
        yield
        return
    with _said(directory):
        descriptor = os.open(directory, os.O_RDONLY)
    try:
        if _locked(descriptor, directory):
            for folder in (directory, *directory.glob("point-*")):
                for part in store.parts_of_this_machine(folder):
                    part.unlink(missing_ok=True)
        yield
    finally:
        os.close(descriptor)


def _locked(descriptor: int, directory: Path) -> bool:
    """Lock a folder until it is closed; false on a disk without locks. Raises ``RunError``."""
    for wait in WAITS:
        time.sleep(wait)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            continue
        except OSError:
            return False
        return True
    raise RunError(
        f"{directory}: another `snooker run` is writing here; let it end, or give --out for "
        "another folder"
    )


def is_held(directory: Path) -> bool:
    """Whether a `snooker run` of this machine is writing in a folder; never on Windows."""
    if sys.platform == "win32":
        return False
    try:
        descriptor = os.open(directory, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(descriptor)
    return False


def create(
    directory: Path, experiment: Experiment, *, fresh: bool = False, engine: str | None = None
) -> Run:
    """A folder for a run, with its manifest; results of the same experiment in it are kept.

    engine : "allpairs" or "cells" for all points, or ``None`` for what suits each

    Raises ``RunError`` if the folder holds another experiment's results (unless ``fresh``) or
    cannot be written.
    """
    run = planned(directory, experiment, fresh=fresh, engine=engine)
    manifest = directory / MANIFEST
    present = read_manifest(manifest)
    with _said(directory):
        if fresh:
            for old in (*run.repeats_there(), *run.figures()):
                old.unlink()
            for empty in directory.glob("point-*"):
                with suppress(OSError):  # it is not
                    empty.rmdir()
            forget_failures(run)
        if fresh or (present and takes_back(run, present)):
            for old in run.analyses():
                old.unlink()
        directory.mkdir(parents=True, exist_ok=True)
        if present != as_json(run.manifest()):
            write_json(manifest, run.manifest())
    return run


def planned(
    directory: Path, experiment: Experiment, *, fresh: bool = False, engine: str | None = None
) -> Run:
    """The run that ``create`` makes, and its errors, but nothing is written."""
    _refuse_file(directory)
    run = Run(directory, experiment, points(experiment), engine)
    manifest = directory / MANIFEST
    if manifest.exists() and not fresh:
        if reason := refusal(run, read_manifest(manifest)):
            raise RunError(
                f"{directory}: {reason}; give --fresh to replace them or --out for another folder"
            )
    elif not manifest.exists() and _holds_files(directory):
        raise RunError(
            f"{directory}: is not empty and not a run of snooker; give --out for another folder"
        )
    return run


def open_run(name: str | Path) -> Run:
    """A run by its folder, or by its name under ``runs/``.

    Raises ``RunError`` if there is none, and of its kinds ``DamagedError`` if it cannot be read.
    """
    directory = next(filter(_is_run, (Path(name), RUNS / name)), None)
    if directory is None:
        if Path(name).is_file():
            raise RunError(f"{name}: is a file, not a run's folder (packed runs cannot be read)")
        near = _nearest(Path(name))
        meant = f"the nearest is {near}, and `snooker ls` lists all" if near else _MAKE
        raise RunError(f"{name}: there is no run here (no {MANIFEST}); {meant}")
    manifest = directory / MANIFEST
    try:
        content = json.loads(manifest.read_text("utf-8", "replace"))
        experiment = parse(json.dumps(content["experiment"]), str(manifest)).experiment
        version = int(content["engine_version"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError, ConfigError) as error:
        said = f"no {error}" if isinstance(error, KeyError) else str(error).splitlines()[0]
        raise DamagedError(
            f"{manifest}: cannot be read ({said}); put a copy of it back, or run the config with "
            "--fresh, which replaces the results"
        ) from None
    return Run(directory, experiment, points(experiment), content.get("engine"), version)


def _nearest(name: Path) -> str:
    """The run whose name is most like one that is not there; none if it is like none.

    Among those in the folder that is named or, without one, in ``runs/`` and here.
    """
    folders = [name.parent] if len(name.parts) > 1 else [RUNS, Path()]
    found = [path.parent.name for folder in folders for path in folder.glob(f"*/{MANIFEST}")]
    near = difflib.get_close_matches(name.name, found, n=1)
    return str(name.with_name(near[0])) if near else ""


def runs_in(directory: Path) -> list[Path]:
    """The folders of runs in a folder, or itself if it is a run. Raises ``RunError``."""
    if _is_run(directory):
        return [directory]
    if not directory.is_dir():
        raise RunError(
            f"{directory}: there is no such folder; `snooker run CONFIG` makes {RUNS}, or name a "
            "folder that has runs in it"
        )
    return sorted(path.parent for path in directory.glob(f"*/{MANIFEST}"))


def _is_run(path: Path) -> bool:
    """Whether a path is a run's folder."""
    return (path / MANIFEST).is_file()


def holds_results(path: Path) -> bool:
    """Whether a file is a repeat or another of a run's own, which no command may replace."""
    if not path.is_file():
        return False
    if path.name in (MANIFEST, FAILURES, *ANALYSES):
        return _is_run(path.parent)
    with suppress(store.StoreError):
        store.glance(path)
        return True
    return False


@contextmanager
def _said(directory: Path) -> Iterator[None]:
    """Turn what the system refuses into a ``RunError``."""
    try:
        yield
    except OSError as error:
        raise RunError(
            f"{directory}: cannot be written ({error.strerror}); give --out for another folder"
        ) from None


def _refuse_file(directory: Path) -> None:
    """Raise ``RunError`` for a file where a run's folder should be."""
    if directory.is_file():
        raise RunError(f"{directory}: cannot be written (is a file); give --out for another folder")


def _holds_files(directory: Path) -> bool:
    """Whether a folder has anything in it but what an interrupted write leaves."""
    return directory.is_dir() and any(path.suffix != ".part" for path in directory.iterdir())
