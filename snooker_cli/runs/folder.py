"""A run's folder: create it, lock it, extend it, and find it again."""

import difflib
import json
import os
import sys
import time
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import TypeVar

from snooker_cli import store
from snooker_cli.config import LIMITS, Config, ConfigError, Point, digest, extends, with_values
from snooker_cli.config.points import same_physics
from snooker_cli.config.problems import key_path, value_at
from snooker_cli.errors import DeniedError, RunError, SnookerError, StoreError
from snooker_cli.files import (
    append_text,
    discard,
    new_folder,
    own_folder,
    read_text,
    unfinished,
    write_json,
)
from snooker_cli.formatting import counted, listed
from snooker_cli.laws import PackageLaw
from snooker_cli.options import FRESH, OUT, RUN_CONFIG, RUNS_LISTED
from snooker_cli.runs import manifest
from snooker_cli.runs.run import FIGURES, MANIFEST, RepeatState, RunFolder, point_and_repeats

if sys.platform != "win32":
    import fcntl

SomeRun = TypeVar("SomeRun", bound=RunFolder)

RUNS = Path("runs")

LOST = f"its {MANIFEST} is lost"

FAILURES = "failures.jsonl"  # the repeats that failed in the last attempt, a line of JSON each
FORMER_KEPT = ("analysis.json", "point-*/exact-*.json")
"""Files of older versions that follow from the results; nothing reads them."""

MOST_LISTED = 30  # values of a key in a message
NO_VALUE = (AttributeError, IndexError, TypeError)  # of a key that an experiment does not have
MOST_NAMED = 5  # runs that a message about their parent folder names
LOCK_WAITS = (0.0, 0.02, 0.05, 0.1)  # s, because ``is_locked`` holds the lock for a moment


def create(run: RunFolder, *, fresh: bool = False) -> str:
    """Make a run's folder and manifest; results of the same experiment in it are kept.

    fresh : delete what the folder holds

    Returns and raises what ``planned_change`` does. Raises ``RunError`` also if the folder cannot
    be written.
    """
    change = planned_change(run, fresh=fresh)
    with writing(run.directory):
        if fresh:
            folders = _own_folders(run.directory)
            results = (folder.glob("repeats-*.h5") for folder in folders)
            for old in (*chain.from_iterable(results), *run.figures()):
                old.unlink()
            for old in (run.directory / FAILURES, *former_kept(run.directory)):
                discard(old)
            for folder in folders:
                with suppress(OSError):  # it is not empty
                    folder.rmdir()
        if fresh or not holds_manifest(run):
            write_json(run.directory / MANIFEST, manifest.content(run))
    return change


def _own_folders(directory: Path) -> list[Path]:
    """The folders of a run's points and figures. Raises ``OSError`` if one of them is a link."""
    paths = chain(directory.glob("point-*"), directory.glob(FIGURES))
    return [own_folder(path) for path in paths if path.is_dir()]


def planned_change(run: RunFolder, *, fresh: bool = False) -> str:
    """How ``create`` will extend or reduce the results in the folder; empty if it does not.

    Writes nothing. Raises ``RunError`` if the folder is not a run's, or holds results that this
    run cannot use and not ``fresh``, and ``StoreError`` if its manifest cannot be read. A run may
    end earlier than before if no repeat in the folder is longer. So a user can undo an extension
    until its first repeat is done.
    """
    directory = run.directory
    # A run has its manifest before its repeats.
    if _repeat_files(directory) and not _is_run(directory):
        return "" if fresh else _restored(run)
    if not _is_run(directory):
        other = directory.is_dir() and any(path.suffix != ".part" for path in directory.iterdir())
        if other and not _is_run(directory):  # another process may just have made the run
            raise RunError(
                f"{directory}: is not empty and not a run of snooker",
                f"give {OUT} for another folder",
                code="not_a_run",
            )
        return ""
    if fresh:
        return ""
    stored = open_run(directory)
    before = {point.index: point for point in (*stored.points, *stored.former)}
    pairs = [(point, before[point.index]) for point in run.points if point.index in before]
    added = [point for point in run.points if point.index not in before]
    former = {point.index for point in stored.former}
    left_out = [point for point in run.former if point.index not in former]
    limits = _changed_limits(pairs)
    # Whether some point would end earlier than the stored run.
    earlier = not all(extends(new.config, old.config) for new, old in pairs)
    refusal, code = "", ""
    if stored.engine_version != run.engine_version:
        code = "other_engine_version"
        refusal = (
            f"results of engine version {stored.engine_version}, where this snooker has version "
            f"{run.engine_version}, which may give other bits"
        )
    elif not (
        all(same_physics(new.config, old.config) for new, old in pairs)
        and all(_is_of_sweep(stored, point) for point in added)
    ):
        keys = [key for key in Config.model_fields if key not in ("title", "repeats")]
        new, old = run.config, stored.config
        changed = ", ".join(key for key in keys if getattr(new, key) != getattr(old, key))
        problems = [law.problem for law in old.collision_rules.laws if isinstance(law, PackageLaw)]
        why = f": {problems[0]}" if any(problems) else ""
        code, refusal = "other_config", f"results of another config ({changed} changed{why})"
    elif earlier and _has_longer_repeat(run):
        code, refusal = "shorter_limits", f"repeats longer than this config asks for ({limits})"
    if refusal:
        advice = f"give {OUT} for another folder, or {FRESH}, which deletes them"
        raise RunError(f"{directory}: holds {refusal}", advice, code=code)
    if earlier:
        return f"{directory} ends earlier than before: {limits}; no repeat is longer yet"
    wanted, present = run.config.repeats, stored.config.repeats
    more = f"repeats from {present} to {wanted}" if wanted > present else ""
    new_points = counted(len(added), "new point") if added else ""
    gone = f"{counted(len(left_out), 'point')} no longer listed, stored as before"
    if override := _override_for_all(run):
        gone = f"{gone} ({override} lists all points)"
    changes = [text for text in (limits, more, new_points, gone if left_out else "") if text]
    verb = "extends" if limits or more or added else "changes"
    change = f"this {verb} {directory}: {', '.join(changes)}"
    if limits:
        again = "shorter repeats are simulated again, with the same collisions up to their end"
        return f"{change}; {again}"
    if wanted < present:
        used = f"this config uses {wanted} of them; the other files stay"
        return f"{directory} has {present} repeats, and {used}"
    return change if changes else ""


def continued(run: SomeRun) -> SomeRun:
    """The run, with the numbers that its points have in its folder.

    A point keeps its number while the sweep changes around it; new ones have unused numbers. So
    repeats stay where they are. Those that the sweep no longer lists are ``former``. A folder
    without a run, or with one that cannot be read, changes nothing: `planned_change` says why.
    """
    try:
        stored = open_run(run.directory) if _is_run(run.directory) else None
    except SnookerError:
        stored = None
    if stored is None:
        return run
    before = [*stored.points, *stored.former]
    numbers: dict[int, int] = {}  # by the place among the new points
    # First those that are the same with their limits, because limits may be swept too.
    for without in ((), LIMITS):
        taken, same = set(numbers.values()), dict[str, deque[int]]()
        for point in before:
            if point.index not in taken:
                identity = digest(point.config, without=without)
                same.setdefault(identity, deque()).append(point.index)
        for place, point in enumerate(run.points):
            if place not in numbers:
                alike = same.get(digest(point.config, without=without))
                numbers |= {place: alike.popleft()} if alike else {}
    used = {point.index for point in before}
    unused = (number for number in count() if number not in used)
    for place in range(len(run.points)):
        if place not in numbers:
            numbers[place] = next(unused)
    numbered = tuple(replace(point, index=numbers[k]) for k, point in enumerate(run.points))
    kept = set(numbers.values())
    former = tuple(point for point in before if point.index not in kept)
    return replace(run, points=numbered, former=former)


def _is_of_sweep(stored: RunFolder, point: Point) -> bool:
    """Whether a point has the physics of a stored config, but for the values of swept keys.

    The keys that the stored run sweeps may have one value now.
    """
    try:
        here = with_values(
            stored.config,
            {
                key: value_at(point.config, key_path(key))
                for key in _swept((*stored.points, *stored.former, point))
            },
        )
    except (ConfigError, *NO_VALUE):
        return False
    return same_physics(here, point.config)


def _swept(points: Iterable[Point]) -> list[str]:
    """The keys that are swept in one of these points."""
    return list(dict.fromkeys(key for point in points for key, _ in point.parameters))


def _override_for_all(run: RunFolder) -> str:
    """``cor=0.8,0.9``, which lists all points of a run's folder; empty if one key is not enough."""
    points = (*run.points, *run.former)
    keys = _swept(points)
    if len(keys) != 1 or len(points) > MOST_LISTED:
        return ""
    values = [value_at(point.config, key_path(keys[0])) for point in points]
    if len(set(values)) < len(values) or not {*map(type, values)} <= {int, float}:
        return ""
    return f"{keys[0]}={','.join(map(repr, sorted(values)))}"


def _restored(run: RunFolder) -> str:
    """What ``planned_change`` returns where the manifest is lost. Raises ``RunError``."""
    for path in _repeat_files(run.directory):
        reason = "belongs to a longer sweep"
        if point_and_repeats(path)[0] in run.by_number:
            others = (s for s in run.file_statuses(path) if s.state is RepeatState.UNUSABLE)
            reason = next((s.error.reason for s in others if s.header and s.error), "")
        if reason:
            raise RunError(
                f"{run.directory}: {LOST}, and {path.relative_to(run.directory)} {reason}",
                f"give {FRESH} to replace the repeats or {OUT} for another folder",
                code="other_config",
            )
    return f"{run.directory}: {LOST}; it is made again, and the repeats are kept"


def _repeat_files(directory: Path) -> list[Path]:
    """The files of repeats in a folder."""
    return [path for path in directory.glob("point-*/repeats-*-*.h5") if point_and_repeats(path)[1]]


def _changed_limits(pairs: Sequence[tuple[Point, Point]]) -> str:
    """The limits that differ between points now and before: ``collisions from 150 to 300``."""
    changes = []
    for name in LIMITS:
        values = [
            list(dict.fromkeys(getattr(point.config, name) for point in points))
            for points in ([old for _, old in pairs], [new for new, _ in pairs])
        ]
        if values[0] != values[1]:
            old, new = (json.dumps(limits if limits[1:] else limits[0]) for limits in values)
            changes.append(f"{name} from {old} to {new}")
    return ", ".join(changes)


def _has_longer_repeat(run: RunFolder) -> bool:
    """Whether a readable repeat in the folder is longer than a run's config asks for."""
    files = chain.from_iterable(run.batches(point.index) for point in run.points)
    return any(
        status.state is RepeatState.UNUSABLE
        and status.header
        and status.repeat < run.config.repeats
        for status in chain.from_iterable(map(run.file_statuses, files))
    )


def open_run(name: str | Path) -> RunFolder:
    """A run by its folder, or by its name under ``runs/``.

    Raises ``RunError`` if there is none, and ``StoreError`` if its manifest cannot be read.
    """
    try:
        directory = next(filter(_is_run, (Path(name), RUNS / name)), None)
    except OSError as error:  # such as for a name of more than 255 bytes
        raise RunError(f"{name}: {error.strerror}", "check the name and its permissions") from None
    if directory is None and Path(name).is_file():
        raise RunError(f"{name}: is a file, not a run's folder", "give a folder of `snooker run`")
    if directory is None:
        folder = RUNS if len(Path(name).parts) == 1 else Path(name).parent
        others = [path.parent.name for path in folder.glob(f"*/{MANIFEST}")]
        near = difflib.get_close_matches(Path(name).name, others, n=1)
        advice = f"make one with {RUN_CONFIG}"
        if inside := [str(path.parent) for path in sorted(Path(name).glob(f"*/{MANIFEST}"))]:
            more = [f"{len(inside) - MOST_NAMED:,} more"] if len(inside) > MOST_NAMED else []
            advice = f"give one of the runs in it: {listed(inside[:MOST_NAMED] + more)}"
        elif near:
            advice = f"the nearest is {Path(name).with_name(near[0])}, and {RUNS_LISTED} lists all"
        if _repeat_files(lost := Path(name)) or _repeat_files(lost := RUNS / name):
            advice = f"run its config again with {OUT.of(lost)}, which keeps the repeats"
            raise RunError(f"{lost}: {LOST}", advice)
        raise RunError(f"{name}: there is no run here (no {MANIFEST})", advice)
    return manifest.read(directory)


def runs_in(directory: Path) -> list[Path]:
    """The folders of runs in a folder, or itself if it is a run. Raises ``RunError``.

    With those that have lost their manifest, so that no repeat is hidden.
    """
    if _is_run(directory) or _repeat_files(directory):
        return [directory]
    if not directory.is_dir():
        raise RunError(
            f"{directory}: there is no such folder",
            f"{RUN_CONFIG} makes {RUNS}, or name a folder that has runs in it",
        )
    lost = {path.parents[1] for path in directory.glob("*/point-*/repeats-*-*.h5")}
    return sorted(lost | {path.parent for path in directory.glob(f"*/{MANIFEST}")})


def former_kept(directory: Path) -> list[Path]:
    """The files of a run's folder that older versions kept beside the results."""
    return sorted(chain.from_iterable(map(directory.glob, FORMER_KEPT)))


def holds_results(path: Path) -> bool:
    """Whether a file is a repeat, or another of a run's own, which no command may replace."""
    if not path.is_file():
        return False
    if path.name in (MANIFEST, FAILURES):
        return _is_run(path.parent)
    try:
        store.read_headers(path)
    except StoreError as error:
        return isinstance(error, DeniedError)
    return True


@contextmanager
def locked_for_part(run: RunFolder) -> Iterator[None]:
    """Make a run's folder and lock it together with other parts of the run.

    The first part makes the manifest. Raises ``RunError`` as ``create`` and ``locked`` do, and if
    other parts have another config.
    """
    try:
        with locked(run.directory):
            create(run)
    except RunError as error:
        if error.code != "locked":
            raise
    with locked(run.directory, shared=True):
        if not holds_manifest(run):
            raise RunError(
                f"{run.directory}: parts of another config are running here",
                f"let them end, or give {OUT} for another folder",
                code="locked",
            )
        yield


def holds_manifest(run: RunFolder) -> bool:
    """Whether the folder has this run's manifest, in any file."""
    with suppress(Exception):
        stored = json.loads(read_text(run.directory / MANIFEST))
        return bool(stored == manifest.content(run))
    return False


def manifest_number(directory: Path) -> int | None:
    """The manifest's number on its disk, which another manifest does not have; None without one."""
    with suppress(OSError):
        return (directory / MANIFEST).stat().st_ino
    return None


def _is_run(path: Path) -> bool:
    return (path / MANIFEST).is_file()


@contextmanager
def writing(directory: Path) -> Iterator[None]:
    """Turn what the system refuses into a ``RunError`` about a folder."""
    try:
        yield
    except OSError as error:
        raise RunError(
            f"{directory}: cannot be written ({error.strerror})",
            f"give {OUT} for another folder",
        ) from None


@contextmanager
def locked(directory: Path, shared: bool = False) -> Iterator[None]:
    """Lock a folder for one run at a time on this machine; delete temporary files of a killed one.

    shared : parts of a run may hold the lock together, and delete nothing

    Raises ``RunError`` if another process has the lock or the folder cannot be made. Runs on two
    machines may share a folder: each writes its own temporary files, and the last file is kept.
    """
    with ExitStack() as exits:
        with writing(directory):
            exits.enter_context(new_folder(directory))
        if sys.platform == "win32":  # which cannot lock folders
            yield
            return
        with writing(directory):
            descriptor = os.open(directory, os.O_RDONLY)
        exits.callback(os.close, descriptor)
        for wait in LOCK_WAITS:
            time.sleep(wait)
            taken = _lock(descriptor, fcntl.LOCK_SH if shared else fcntl.LOCK_EX)
            if taken is not False:
                break
        else:
            raise RunError(
                f"{directory}: another `snooker run` is writing here",
                f"let it end, or give {OUT} for another folder",
                code="locked",
            )
        # With the lock, no other run of this machine is here: its temporary files are left-overs.
        if taken and not shared:
            with writing(directory):
                for folder in (directory, *_own_folders(directory)):
                    for part in unfinished(folder):
                        part.unlink(missing_ok=True)
        yield


def is_locked(directory: Path) -> bool:
    """Whether a `snooker run` of this machine is writing in a folder; never on Windows."""
    if sys.platform == "win32":
        return False
    with suppress(OSError):
        descriptor = os.open(directory, os.O_RDONLY)
        try:
            return _lock(descriptor, fcntl.LOCK_SH) is False
        finally:
            os.close(descriptor)
    return False


def _lock(descriptor: int, how: int) -> bool | None:
    """Lock a folder until it is closed. False if another has it; None on a disk without locks."""
    try:
        fcntl.flock(descriptor, how | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def record_failure(run: RunFolder, point: int, repeat: int, error: str) -> None:
    """Add a repeat that has failed to the record, if the disk takes it."""
    line = json.dumps({"point": point, "repeat": repeat, "error": error})
    with suppress(OSError):
        append_text(run.directory / FAILURES, f"{line}\n")


def failures(run: RunFolder) -> dict[tuple[int, int], str]:
    """The error of each point and repeat that failed; a line that is cut is skipped."""
    errors: dict[tuple[int, int], str] = {}
    with suppress(OSError):
        for line in read_text(run.directory / FAILURES).splitlines():
            with suppress(Exception):
                row = json.loads(line)
                errors[int(row["point"]), int(row["repeat"])] = str(row["error"])
    return errors
