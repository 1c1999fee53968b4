"""A run: its points, the files of its repeats, and whether each repeat is valid and complete."""

import hashlib
import json
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cached_property, partial
from itertools import chain, groupby
from pathlib import Path
from typing import NamedTuple

from snooker_cli import store
from snooker_cli.config import Config, Point, digest, extends, validated
from snooker_cli.engine import ENGINE_VERSION, stands_still
from snooker_cli.errors import AbsentError, PlaceError, RunError, StoreError
from snooker_cli.files import discard, read_text
from snooker_cli.formatting import point_label, printable, spans
from snooker_cli.results_cache import MEMORY
from snooker_cli.store import RepeatHeader
from snooker_cli.trace import StopReason, Trace

MANIFEST = "run.json"
RUN = "run"  # of runs side by side, the parameter that names the run of a point
FIGURES = "figures"  # the folder where ``plot`` saves them
REMEMBERED_SIZE = 32_000_000  # bytes of a file up to which its repeats stay in memory
REPLACES = "run the config again, which replaces it"

Check = Callable[[Path], list[RepeatHeader]]  # ``store.check``, or the same with a limit of memory

FIGURE_KEYS = {"kind", "title", "caption", "numbers", "layers"}  # in the JSON beside a figure


class RepeatState(StrEnum):
    """Whether a repeat's file belongs to a run and is complete."""

    DONE = "done"  # complete, and of this run
    INTERRUPTED = "interrupted"  # its beginning, because the user asked to stop
    SHORTER = "shorter"  # complete, but older than an extension of the run
    UNUSABLE = "unusable"  # damaged, or of another run
    MISSING = "missing"


class RepeatStatus(NamedTuple):
    """Whether a repeat belongs to a run and is complete.

    path : of the batch's file
    header : None without a readable file
    error : why the repeat is not done, if there is a file, and what to do
    """

    point: int
    repeat: int
    path: Path
    state: RepeatState
    header: RepeatHeader | None = None
    error: StoreError | None = None

    def raise_if_unusable(self) -> None:
        """Raise ``StoreError`` for a file that cannot be used; reading reports a missing one."""
        if self.error and self.state is RepeatState.UNUSABLE:
            raise self.error

    @property
    def collisions(self) -> int:
        """The collisions in a file that can be used; -1 without one."""
        if self.header is None or self.state is RepeatState.UNUSABLE:
            return -1
        return self.header.collisions

    def worth(self) -> tuple[bool, int]:
        """Of several files of a repeat the best is done, or has the most collisions."""
        return self.state is RepeatState.DONE, self.collisions


@dataclass(frozen=True)
class RunFolder:
    """A run's folder and the experiment whose repeats it holds.

    engine_version : of the engine that makes its repeats
    former : points that the sweep no longer lists; their repeats stay in the folder
    """

    directory: Path
    config: Config
    points: tuple[Point, ...]
    engine_version: int = ENGINE_VERSION
    former: tuple[Point, ...] = ()

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.directory.name

    @property
    def unlisted(self) -> int:
        """How many points are stored that the sweep no longer lists."""
        return len(self.former)

    @cached_property
    def by_number(self) -> dict[int, Point]:
        """The points by their numbers, which also name their folders."""
        return {point.index: point for point in self.points}

    @cached_property
    def digests(self) -> dict[int, str]:
        """What identifies each point, by its number."""
        return {point.index: digest(point.config) for point in self.points}

    @property
    def identity(self) -> str:
        """Eight hexadecimal digits for all that determines the physics of the run's points."""
        return hashlib.sha256("".join(self.digests.values()).encode()).hexdigest()[:8]

    @property
    def can_be_replayed(self) -> bool:
        """Whether its repeats are those of this engine, which simulates them again."""
        return self.engine_version == ENGINE_VERSION

    @property
    def common_random_notes(self) -> list[str]:
        """A sentence if several points have the same random numbers; else none."""
        note = "all points have the same random starts (common_random); compare repeat by repeat"
        return [note] if self.config.common_random and len(self.points) > 1 else []

    # The files of batches.

    def path(self, point: int, repeats: Sequence[int]) -> Path:
        """The file of a batch: of repeats in order, from the first to the last of them."""
        name = f"repeats-{repeats[0]:04d}-{repeats[-1]:04d}.h5"
        return self.directory / f"point-{point:04d}" / name

    def batches(self, point: int) -> list[Path]:
        """The files of a point's batches."""
        files = (self.directory / f"point-{point:04d}").glob("repeats-*-*.h5")
        return sorted(path for path in files if point_and_repeats(path)[1])

    def origin(self, point: Point) -> "tuple[RunFolder, Point]":
        """The run that has a point, and the point as it has it; see ``RunsSideBySide``."""
        return self, point

    def requested(self, point: Point) -> int:
        """The number of repeats that the run should have of a point."""
        return self.origin(point)[0].config.repeats

    def place(self, point: Point) -> str:
        """Where a point is in the sweep: ``point 2 of 5``."""
        place = [*self.by_number].index(point.index) + 1
        return f"point {place:,} of {len(self.points):,}"

    def chosen(self, point: int | None, repeat: int) -> Point:
        """The point with a number, or the first. Raises ``PlaceError`` if one does not exist."""
        point = self.points[0].index if point is None else point
        chosen = self.by_number.get(point, self.points[0])
        given = ("point", point, self.by_number), ("repeat", repeat, range(self.requested(chosen)))
        for noun, number, numbers in given:
            if number not in numbers:
                existing = f"{self.name} has {noun}s {spans(numbers)}"
                raise PlaceError(f"there is no {noun} {number}: {existing}")
        return chosen

    def present(self, point: Point) -> list[int]:
        """The repeats of a point that have a file, with any content."""
        statuses = self.statuses(point.index)
        return [status.repeat for status in statuses if status.state is not RepeatState.MISSING]

    def shorter(self, point: Point) -> int:
        """The number of a point's repeats that are older than an extension of the run."""
        statuses = self.statuses(point.index)
        return sum(status.state is RepeatState.SHORTER for status in statuses)

    def traces(self, point: Point, present: Sequence[int] | None = None) -> Iterator[Trace]:
        """The repeats of a point that have a file, or these repeats, in order.

        They include interrupted ones, and during an extension those that it has not reached.

        Raises ``RunError`` if there is none, and ``StoreError`` for one that cannot be read or is
        not of this run.
        """
        statuses = [
            status
            for status in self.statuses(point.index)
            if status.state is not RepeatState.MISSING
            and (present is None or status.repeat in present)
        ]
        # Repeats of one file follow each other, so each file is read once.
        for path, of_file in groupby(statuses, key=lambda status: status.path):
            yield from self._read(path, list(of_file))
        if not statuses:
            which = f"the point {point_label(point.as_json())}" if point.parameters else "it"
            raise RunError(
                f"{self.directory}: no repeat of {which} is there yet",
                "wait for a run that is under way, or run the config again to continue",
            )

    def read(self, point: Point, repeat: int) -> Trace:
        """A repeat. Raises ``StoreError`` if it cannot be read or is not of this run."""
        status = self.status_of(point.index, repeat)
        return self._read(status.path, [status])[0]

    def _read(self, path: Path, statuses: Sequence[RepeatStatus]) -> list[Trace]:
        for status in statuses:
            status.raise_if_unusable()
        numbers = tuple(status.repeat for status in statuses)
        info = store.file_info(path)

        def read() -> list[Trace]:
            return [_ended(trace, header) for trace, header in store.read(path, numbers)]

        if info is None or info[0] > REMEMBERED_SIZE:
            return read()
        return MEMORY.get(("traces", path, numbers, info), read)

    def status_of(self, point: int, repeat: int) -> RepeatStatus:
        """Whether a repeat is done, by the header of its file."""
        return self.statuses(point)[repeat]

    def statuses(self, point: int, *, check: Check | None = None) -> list[RepeatStatus]:
        """Whether each repeat of a point is done, as ``file_statuses``."""
        of_files = (self.file_statuses(path, check=check) for path in self.batches(point))
        return self.best(point, chain.from_iterable(of_files))

    def best(self, point: int, statuses: Iterable[RepeatStatus]) -> list[RepeatStatus]:
        """The best status of each repeat of a point, of all files that may hold it."""
        best: dict[int, RepeatStatus] = {}
        for status in statuses:
            other = best.get(status.repeat)
            if other is None or status.worth() > other.worth():
                best[status.repeat] = status
        return [
            best.get(repeat)
            or RepeatStatus(point, repeat, self.path(point, [repeat]), RepeatState.MISSING)
            for repeat in range(self.config.repeats)
        ]

    def delete_all_but(self, kept: Collection[Path]) -> None:
        """Delete the files of repeats that are all in these, unless another run deletes them."""
        if not all(path.exists() for path in kept):
            return
        for path in chain.from_iterable(self.batches(point.index) for point in self.points):
            # A file with later repeats than this run has belongs to a longer run: it stays.
            if path not in kept and point_and_repeats(path)[1].stop <= self.config.repeats:
                discard(path)

    def file_statuses(self, path: Path, *, check: Check | None = None) -> list[RepeatStatus]:
        """Whether the repeats of a file belong to this run and are complete.

        check : checks the content too; without it, headers are read once, as long as the file's
            size and age stay
        """
        point, repeats = point_and_repeats(path)
        try:
            info = store.file_info(path)
            if info is None:  # another process has just deleted it
                return []
            if check:
                headers = check(path)
            else:
                headers = MEMORY.get(("headers", path, info), partial(store.read_headers, path))
            for header in headers:
                if header.provenance.point != point or header.repeat not in repeats:
                    reason = f"is repeat {header.repeat} of point {header.provenance.point}"
                    raise StoreError(path, reason, REPLACES)
        except AbsentError:
            return []
        except StoreError as error:
            return [
                RepeatStatus(point, repeat, path, RepeatState.UNUSABLE, error=error)
                for repeat in repeats[: self.config.repeats]
            ]
        return [self._classified(path, point, header) for header in headers]

    def _classified(self, path: Path, point: int, header: RepeatHeader) -> RepeatStatus:
        """Whether a repeat with this header belongs to this run and is complete."""
        source, own = header.provenance, self.by_number[point]
        state, reason, advice = RepeatState.UNUSABLE, "", REPLACES
        most = own.config.collisions or math.inf
        if source.engine_version != self.engine_version:
            reason = f"is of engine version {source.engine_version}, not {self.engine_version}"
        elif source.digest != self.digests[point]:
            key = "extended", source.config, source.digest, own.config
            order = MEMORY.get(key, partial(_extension, source, own.config))
            reason = "is of another config"
            if order < 0:
                state, reason, advice = RepeatState.SHORTER, "is shorter than the extended run", ""
            elif order > 0:  # a run may extend it while other commands read
                reason, advice = "is longer than the run was", "give the command again"
        elif header.collisions > most:
            reason = f"has {header.collisions:,} collisions, where its config allows {most:,}"
        elif header.stop.reason is StopReason.INTERRUPTED:
            state, reason, advice = RepeatState.INTERRUPTED, printable(header.stop.message), ""
        else:
            return RepeatStatus(point, header.repeat, path, RepeatState.DONE, header)
        error = StoreError(path, reason, advice)
        return RepeatStatus(point, header.repeat, path, state, header, error)

    # Files that are made from the repeats.

    @property
    def figures_folder(self) -> Path:
        """Where ``plot`` saves figures."""
        return self.directory / FIGURES

    def figures(self) -> list[Path]:
        """The figure files that ``plot`` saved, known by the JSON beside each figure."""
        paths = []
        for path in sorted(self.figures_folder.glob("*.json")):
            with suppress(Exception):
                content = json.loads(read_text(path))
                if isinstance(content, dict) and content.keys() >= FIGURE_KEYS:
                    paths += [path, *map(path.with_suffix, (".svg", ".png", ".pdf"))]
        return [path for path in paths if path.is_file()]


# Collapses of few balls, which older engines did not recognise.

RECOGNISED_SINCE = 9  # engine version
MOST_STILL = 4096  # last events in which they are looked for: those of up to some 30 balls


def _may_hide_collapse(header: RepeatHeader) -> bool:
    """Whether a repeat that counts as complete may have collapsed before."""
    old = header.provenance.engine_version < RECOGNISED_SINCE
    return old and header.stop.reason is StopReason.COLLISIONS and not header.summary


def _ended(trace: Trace, header: RepeatHeader) -> Trace:
    """A repeat with the ending that this version gives it: a collapse, if its clock stood still."""
    if trace.events is None or not _may_hide_collapse(header):
        return trace
    if not stands_still(trace.start, trace.events[-MOST_STILL:]):
        return trace
    last = trace.events[-1:]
    balls = tuple(ball for ball in (int(last.i[0]), int(last.j[0])) if ball >= 0)
    message = f"inelastic collapse, not recognised by the older engine; {trace.stop.message}"
    stop = trace.stop._replace(reason=StopReason.COLLAPSE, balls=balls, message=message)
    return replace(trace, stop=stop)


def hidden_collapses(run: RunFolder) -> list[tuple[int, int]]:
    """Point and number of each repeat that counts as complete, but whose clock stands still.

    Reads only the last events, and those only of an older engine.
    """
    found: list[tuple[int, int]] = []
    for point in run.points:
        done = [
            status
            for status in run.statuses(point.index)
            if status.header and status.state is RepeatState.DONE
            if _may_hide_collapse(status.header)
        ]
        for path, of_file in groupby(done, key=lambda status: status.path):
            numbers = [status.repeat for status in of_file]
            with suppress(StoreError):  # `verify` reports a damaged file
                for repeat, scene, last in store.read_last_events(path, numbers, MOST_STILL):
                    if stands_still(scene, last):
                        found.append((point.index, repeat))
    return found


_FILE = re.compile(r"point-(\d+)/repeats-(\d+)-(\d+)\.h5")


def point_and_repeats(path: Path) -> tuple[int, range]:
    """The point and the repeats in the name of a batch's file; no repeats for another file."""
    match = _FILE.fullmatch(f"{path.parent.name}/{path.name}")
    point, first, last = map(int, match.groups()) if match else (-1, 0, -1)
    return point, range(first, last + 1)


def _extension(source: store.Provenance, config: Config) -> int:
    """-1 if an experiment continues the one of a file's provenance, 1 for the opposite, else 0."""
    try:
        stored = validated(json.loads(source.config))
    except Exception:
        return 0
    if digest(stored) != source.digest:
        return 0
    return extends(stored, config) - extends(config, stored)
