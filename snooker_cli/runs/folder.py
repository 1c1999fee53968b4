"""A run's folder: create it, lock it, extend it, and find it again."""

from __future__ import annotations

import difflib
import json
import os
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from snooker_cli import store
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
from snooker_cli.errors import DamagedError, RunError, StoreError
from snooker_cli.files import unfinished, write_json
from snooker_cli.runs.run import ANALYSES, MANIFEST, Run

if sys.platform != "win32":
    import fcntl

RUNS = Path("runs")

FAILURES = "failures.jsonl"
"""The repeats that failed in the last attempt, a line of JSON each."""

LOCK_WAITS = (0.0, 0.02, 0.05, 0.1)
"""Seconds before each try to lock a folder: ``is_locked`` holds the lock for a moment."""


# Create, open and find.


def create(run: Run, *, fresh: bool = False) -> Change:
    """Make a run's folder and manifest; results of the same experiment in it are kept.

    fresh : delete what the folder holds

    Raises ``RunError`` as ``planned_change`` does, or if the folder cannot be written.
    """
    change = planned_change(run, fresh=fresh)
    with _writing(run.directory):
        if fresh:
            for old in (*run.files(), *run.figures()):
                old.unlink()
            for folder in run.directory.glob("point-*"):
                with suppress(OSError):  # it is not empty
                    folder.rmdir()
            forget_failures(run)
        if fresh or change.reduces:
            for old in run.analyses():
                old.unlink()
        run.directory.mkdir(parents=True, exist_ok=True)
        if _read_manifest(run) != _manifest(run):
            write_json(run.directory / MANIFEST, run.manifest())
    return change


def planned_change(run: Run, *, fresh: bool = False) -> Change:
    """What ``create`` will change in the folder. Writes nothing.

    Raises ``RunError`` if the folder is not a run's, or holds other results and not ``fresh``.
    """
    directory = run.directory
    if directory.is_file():
        raise RunError(
            f"{directory}: cannot be written (is a file)", "give --out for another folder"
        )
    if not (directory / MANIFEST).exists():
        if directory.is_dir() and any(path.suffix != ".part" for path in directory.iterdir()):
            raise RunError(
                f"{directory}: is not empty and not a run of snooker",
                "give --out for another folder",
                code="not_a_run",
            )
        return Change()
    if fresh:
        return Change()
    change = _change(run, _read_manifest(run))
    if change.refusal:
        raise RunError(
            f"{directory}: {change.refusal}",
            "give --fresh to replace them or --out for another folder",
            code=change.code,
        )
    return change


def open_run(name: str | Path) -> Run:
    """A run by its folder, or by its name under ``runs/``.

    Raises ``RunError`` if there is none, and its subclass ``DamagedError`` if its manifest cannot
    be read.
    """
    directory = next(filter(_is_run, (Path(name), RUNS / name)), None)
    if directory is None and Path(name).is_file():
        raise RunError(f"{name}: is a file, not a run's folder")
    if directory is None:
        near = _nearest(Path(name))
        advice = f"the nearest is {near}, and `snooker ls` lists all"
        raise RunError(
            f"{name}: there is no run here (no {MANIFEST})",
            advice if near else "make one with `snooker run CONFIG`",
        )
    manifest = directory / MANIFEST
    try:
        content = json.loads(manifest.read_text("utf-8", "replace"))
        experiment = parse(json.dumps(content["experiment"]), str(manifest)).experiment
        version = int(content["engine_version"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError, ConfigError) as error:
        why = f"no {error}" if isinstance(error, KeyError) else str(error).splitlines()[0]
        raise DamagedError(
            f"{manifest}: cannot be read ({why})",
            "put a copy of it back, or run the config with --fresh, which replaces the results",
        ) from None
    return Run(directory, experiment, points(experiment), content.get("engine"), version)


def runs_in(directory: Path) -> list[Path]:
    """The folders of runs in a folder, or itself if it is a run. Raises ``RunError``."""
    if _is_run(directory):
        return [directory]
    if not directory.is_dir():
        raise RunError(
            f"{directory}: there is no such folder",
            f"`snooker run CONFIG` makes {RUNS}, or name a folder that has runs in it",
        )
    return sorted(path.parent for path in directory.glob(f"*/{MANIFEST}"))


def holds_results(path: Path) -> bool:
    """Whether a file is a repeat, or another of a run's own, which no command may replace."""
    if not path.is_file():
        return False
    if path.name in (MANIFEST, FAILURES, *ANALYSES):
        return _is_run(path.parent)
    with suppress(StoreError):
        store.read_header(path)
        return True
    return False


def _is_run(path: Path) -> bool:
    return (path / MANIFEST).is_file()


def _nearest(name: Path) -> str:
    """The run with the most similar name in the folder that is named, or in ``runs/`` and here."""
    folders = [name.parent] if len(name.parts) > 1 else [RUNS, Path()]
    found = [path.parent.name for folder in folders for path in folder.glob(f"*/{MANIFEST}")]
    near = difflib.get_close_matches(name.name, found, n=1)
    return str(name.with_name(near[0])) if near else ""


@contextmanager
def _writing(directory: Path) -> Iterator[None]:
    """Turn what the system refuses into a ``RunError``."""
    try:
        yield
    except OSError as error:
        raise RunError(
            f"{directory}: cannot be written ({error.strerror})", "give --out for another folder"
        ) from None


# Lock.


@contextmanager
def locked(directory: Path) -> Iterator[None]:
    """Lock a folder for one run at a time on this machine, and delete what a kill has left.

    Raises ``RunError`` if another process has the lock or the folder cannot be made. Runs on two
    machines may share a folder: each writes its own temporary files, and the last one stays.
    """
    with _writing(directory):
        directory.mkdir(parents=True, exist_ok=True)
    if sys.platform == "win32":  # which cannot lock folders
        yield
        return
    with _writing(directory):
        descriptor = os.open(directory, os.O_RDONLY)
    try:
        if _lock(descriptor, directory):
            for folder in (directory, *directory.glob("point-*")):
                for part in unfinished(folder):
                    part.unlink(missing_ok=True)
        yield
    finally:
        os.close(descriptor)


def _lock(descriptor: int, directory: Path) -> bool:
    """Lock a folder until it is closed; False on a disk without locks. Raises ``RunError``."""
    for wait in LOCK_WAITS:
        time.sleep(wait)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            continue
        except OSError:
            return False
        return True
    raise RunError(
        f"{directory}: another `snooker run` is writing here",
        "let it end, or give --out for another folder",
        code="locked",
    )


def is_locked(directory: Path) -> bool:
    """Whether a `snooker run` of this machine is writing in a folder; never on Windows."""
    if sys.platform == "win32":
        return False
    with suppress(OSError):
        descriptor = os.open(directory, os.O_RDONLY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
        finally:
            os.close(descriptor)
    return False


# Failures.


def note_failure(run: Run, point: int, repeat: int, error: str) -> bool:
    """Add a line to the record of failures; False if the disk does not take it."""
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
    """Delete the record of failures."""
    with suppress(OSError):
        (run.directory / FAILURES).unlink(missing_ok=True)


# A run and the manifest in its folder: the same, an extension, or another experiment.


@dataclass(frozen=True)
class Change:
    """What a run changes in a folder that has results.

    description : a sentence on how it extends or reduces them; empty if they are of the same run
    reduces : whether it has fewer repeats or ends earlier
    refusal, code : why the results cannot be kept; empty if they can
    """

    description: str = ""
    reduces: bool = False
    refusal: str = ""
    code: str = ""


def _change(run: Run, manifest: dict[str, Any] | None) -> Change:
    """What a run changes in a folder with this manifest.

    A run may end earlier than the manifest says if no repeat in the folder is longer. So a user
    can undo an extension until its first repeat is done.
    """
    if manifest is None:
        return Change(refusal=f"holds results, but its {MANIFEST} cannot be read", code="damaged")
    if manifest["engine_version"] != run.engine_version:
        refusal = (
            f"holds results of engine version {manifest['engine_version']}, where this snooker has "
            f"version {run.engine_version}, which may give other bits"
        )
        return Change(refusal=refusal, code="other_engine_version")
    if manifest.get("engine") != run.engine:
        refusal = "holds results of another --engine, whose bits differ"
        return Change(refusal=refusal, code="other_engine")
    new, old = json.loads(to_json(run.experiment)), manifest["experiment"]
    limits, earlier = "", False
    if manifest["points"] != _manifest(run)["points"]:
        before = _points(manifest)
        if list(map(_physics, run.points)) != list(map(_physics, before)):
            keys = [key for key in new if key not in ("title", "repeats")]
            changed = ", ".join(key for key in keys if old.get(key) != new[key])
            refusal = f"holds results of another config{f' ({changed} changed)' if changed else ''}"
            return Change(refusal=refusal, code="other_config")
        pairs = [(a.experiment, b.experiment) for a, b in zip(run.points, before, strict=True)]
        earlier = not all(extends(*pair) for pair in pairs)
        if earlier and _has_longer_repeat(run):
            cut = [name for name in LIMITS if any(_is_lower(name, *pair) for pair in pairs)]
            refusal = (
                f"holds repeats longer than this config asks for ({_difference(new, old, cut)})"
            )
            return Change(refusal=refusal, code="shorter_limits")
        limits = _difference(new, old, LIMITS)
    wanted, present = run.experiment.repeats, old.get("repeats", 1)
    fewer, description = wanted < present, ""
    more = f"repeats from {present} to {wanted}" if wanted > present else ""
    if fewer and not limits:
        description = (
            f"{run.directory} has {present} repeats, and this config uses {wanted} of them; the "
            "other files stay"
        )
    elif earlier:
        description = f"{run.directory} ends earlier than before: {limits}; no repeat is longer yet"
    elif limits or more:
        description = f"this extends {run.directory}: {', '.join(filter(None, (limits, more)))}"
        if limits:
            description += (
                "; shorter repeats are simulated again, with the same collisions up to their end"
            )
    return Change(description, reduces=fewer or earlier)


def _manifest(run: Run) -> Any:
    """A run's manifest as it is read back."""
    return json.loads(json.dumps(run.manifest()))


def _read_manifest(run: Run) -> dict[str, Any] | None:
    """The manifest in a run's folder; None if it cannot be read."""
    try:
        content: dict[str, Any] = json.loads((run.directory / MANIFEST).read_text("utf-8"))
        content["engine_version"], content["experiment"].keys()
        [(one["parameters"].keys(), one["digest"]) for one in content["points"]]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
    return content


def _points(manifest: dict[str, Any]) -> tuple[Point, ...]:
    """The points of a manifest; none if this snooker reads its config in another way."""
    try:
        found = points(parse(json.dumps(manifest["experiment"])).experiment)
    except ConfigError:
        return ()
    digests = [one["digest"] for one in manifest["points"]]
    return found if digests == [digest(point.experiment) for point in found] else ()


def _physics(point: Point) -> tuple[dict[str, Any], str]:
    """What two points have in common if one continues the other."""
    parameters = {key: value for key, value in point.as_json().items() if key not in LIMITS}
    return parameters, digest(point.experiment, limits=False)


def _has_longer_repeat(run: Run) -> bool:
    """Whether a readable repeat in the folder is longer than a run's config asks for."""
    for path in run.files():
        try:
            header = store.read_header(path)
        except StoreError:
            continue
        try:
            source = header.provenance
            run.accept(run.points[source.point], source.repeat, header)
        except StoreError:
            return True
    return False


def _is_lower(name: str, new: Experiment, old: Experiment) -> bool:
    """Whether a limit is lower than before."""
    end = {other: None for other in LIMITS if other != name}
    return not extends(new.model_copy(update=end), old.model_copy(update=end))


def _difference(new: dict[str, Any], old: dict[str, Any], names: Iterable[str]) -> str:
    """The keys of two experiments with other values: ``collisions from 150 to 300``."""
    found = []
    for name in names:
        before, now = _values(old, name), _values(new, name)
        if before != now:
            found.append(f"{name} from {json.dumps(before)} to {json.dumps(now)}")
    return ", ".join(found)


def _values(experiment: dict[str, Any], name: str) -> Any:
    """The value of a key, or its values in the sweep, by itself or in a zip."""
    sweep = experiment.get("sweep") or {}
    zipped = sweep.get("zip") or ()
    for group in (sweep, *([zipped] if isinstance(zipped, dict) else zipped)):
        if name in group:
            return group[name]
    return experiment.get(name)
