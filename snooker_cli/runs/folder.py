"""A run's folder: made, held by one run at a time, and found again."""

from __future__ import annotations

import difflib
import json
import os
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from snooker_cli import errors, files, store
from snooker_cli.config import (
    LIMITS,
    ConfigError,
    Experiment,
    Point,
    digest,
    extends,
    parse,
    points,
    to_json,
)
from snooker_cli.errors import DamagedError, RunError
from snooker_cli.files import write_json
from snooker_cli.runs.run import ANALYSES, MANIFEST, Run, State

# The record of repeats that failed: a line of JSON each, of a run's last attempt alone.

FAILURES = "failures.jsonl"


def note_failure(run: Run, point: int, repeat: int, error: str) -> bool:
    """Add a failure; false if it cannot be, as on a full disk, which may be why."""
    line = json.dumps({"point": point, "repeat": repeat, "error": error})
    try:
        with (run.directory / FAILURES).open("a", encoding="utf-8") as file:
            file.write(line + "\n")
    except OSError:
        return False
    return True


def failures(run: Run) -> dict[tuple[int, int], str]:
    """The error of each point and repeat that failed; a line that a kill has cut is left out."""
    found: dict[tuple[int, int], str] = {}
    with suppress(OSError):
        for line in (run.directory / FAILURES).read_text("utf-8", "replace").splitlines():
            with suppress(ValueError, KeyError, TypeError):
                one = json.loads(line)
                found[int(one["point"]), int(one["repeat"])] = str(one["error"])
    return found


def forget_failures(run: Run) -> None:
    """Remove the record, as another attempt begins."""
    with suppress(OSError):
        (run.directory / FAILURES).unlink(missing_ok=True)


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
                for part in files.unfinished(folder):
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
    with suppress(errors.StoreError):
        store.read_header(path)
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


# What a new run is to the results in its folder: the same, an extension, or another.


def read_manifest(manifest: Path) -> dict[str, Any] | None:
    """What a manifest says; None if it cannot be read."""
    try:
        content: dict[str, Any] = json.loads(manifest.read_text(encoding="utf-8"))
        content["engine_version"], content["experiment"].keys()
        [(one["parameters"].keys(), one["digest"]) for one in content["points"]]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
    return content


def refusal(run: Run, present: dict[str, Any] | None) -> str:
    """Why results are not of this run; nothing if they are, or if it extends them.

    A run may end earlier than its folder's manifest says if no repeat that is there goes on longer:
    so an extension that was interrupted before any repeat was extended can be taken back.
    """
    if present is None:
        return f"holds results, but its {MANIFEST} cannot be read"
    if present["engine_version"] != run.engine_version:
        return (
            f"holds results of engine version {present['engine_version']}, where this snooker has "
            f"version {run.engine_version}, which may give other bits"
        )
    if present.get("engine") != run.engine:
        return "holds results of another --engine, whose bits differ"
    if present["points"] == as_json(run.manifest())["points"]:
        return ""
    before = _points(present)
    if not _same_physics(run.points, before):
        return f"holds results of another config{_differences(run, present)}"
    if _goes_on(run.points, before) or not _cuts(run):
        return ""
    cut = [
        name for name in LIMITS if any(_is_cut(name, *pair) for pair in _pairs(run.points, before))
    ]
    return (
        f"holds repeats that may go on longer than with this config ({_changes(run, present, cut)})"
        ", and nothing is cut off: the former values keep them"
    )


def extension(run: Run) -> str:
    """How a run extends what its folder's manifest says, or takes less of it, in a sentence.

    Nothing if it is the same run.
    """
    present = read_manifest(run.directory / MANIFEST)
    if present is None or refusal(run, present):
        return ""
    longer = _changes(run, present, LIMITS)
    repeats = present["experiment"].get("repeats", 1)
    more = (
        f"repeats from {repeats} to {run.experiment.repeats}"
        if repeats < run.experiment.repeats
        else ""
    )
    if repeats > run.experiment.repeats and not longer:
        return (
            f"{run.directory} has {repeats} repeats, of which this config takes "
            f"{run.experiment.repeats}; the others' files stay, for a run with more"
        )
    if not longer and not more:
        return ""
    if not _goes_on(run.points, _points(present)):
        return f"{run.directory} ends earlier than was meant: {longer}; no repeat there is longer"
    how = (
        "; repeats that are shorter are simulated anew, to the same collisions as far as they went"
    )
    return (
        f"this extends {run.directory}: {', '.join(each for each in (longer, more) if each)}"
        f"{how if longer else ''}"
    )


def takes_back(run: Run, present: dict[str, Any]) -> bool:
    """Whether a run has fewer repeats, or ends earlier, than its folder's manifest says."""
    if run.experiment.repeats < present["experiment"].get("repeats", 1):
        return True
    if present["points"] == as_json(run.manifest())["points"]:
        return False
    return not _goes_on(run.points, _points(present))


def as_json(content: dict[str, Any]) -> Any:
    """A manifest as it is read back."""
    return json.loads(json.dumps(content))


def _points(present: dict[str, Any]) -> tuple[Point, ...]:
    """The points of a manifest; none if this snooker takes its config for another."""
    try:
        found = points(parse(json.dumps(present["experiment"])).experiment)
    except ConfigError:
        return ()
    said = [one["digest"] for one in present["points"]]
    return found if said == [digest(point.experiment) for point in found] else ()


def _pairs(new: tuple[Point, ...], old: tuple[Point, ...]) -> list[tuple[Experiment, Experiment]]:
    """The experiments of each point, now and before."""
    return [(a.experiment, b.experiment) for a, b in zip(new, old, strict=True)]


def _same_physics(new: tuple[Point, ...], old: tuple[Point, ...]) -> bool:
    """Whether two runs have the same points, but for where they end."""
    return [_physics(point) for point in new] == [_physics(point) for point in old]


def _physics(point: Point) -> tuple[dict[str, Any], str]:
    """What two points must have in common for one to go on where the other ends."""
    parameters = {key: value for key, value in point.as_json().items() if key not in LIMITS}
    return parameters, digest(point.experiment, limits=False)


def _goes_on(new: tuple[Point, ...], old: tuple[Point, ...]) -> bool:
    """Whether no point ends earlier than it did before."""
    return all(extends(*pair) for pair in _pairs(new, old))


def _cuts(run: Run) -> bool:
    """Whether a repeat that is there, and can be read, goes on longer than a run's config."""
    for path in run.repeats_there():
        try:
            told = store.read_header(path)
        except errors.StoreError:
            continue
        source = told.provenance
        if run.state(run.points[source.point], source.repeat, told)[0] is State.UNUSABLE:
            return True
    return False


def _is_cut(name: str, new: Experiment, old: Experiment) -> bool:
    """Whether a limit is lower than it was."""
    end = {other: None for other in LIMITS if other != name}
    return not extends(new.model_copy(update=end), old.model_copy(update=end))


def _changes(run: Run, present: dict[str, Any], names: Sequence[str]) -> str:
    """The keys of these names whose values are others now: ``collisions from 150 to 300``."""
    old, new = present["experiment"], json.loads(to_json(run.experiment))
    found = []
    for name in names:
        was, is_now = (_given(each, name) for each in (old, new))
        if was != is_now:
            found.append(f"{name} from {json.dumps(was)} to {json.dumps(is_now)}")
    return ", ".join(found)


def _given(experiment: dict[str, Any], name: str) -> Any:
    """The values of a key in its sweep, by itself or in a zip, or the one it has."""
    sweep = experiment.get("sweep") or {}
    zipped = sweep.get("zip") or ()
    for group in (sweep, *([zipped] if isinstance(zipped, dict) else zipped)):
        if name in group:
            return group[name]
    return experiment.get(name)


def _differences(run: Run, present: dict[str, Any]) -> str:
    """The top-level keys that make another config."""
    old, new = present["experiment"], json.loads(to_json(run.experiment))
    keys = [key for key in new if key not in ("title", "repeats") and old.get(key) != new[key]]
    return f" ({', '.join(keys)} changed)" if keys else ""
