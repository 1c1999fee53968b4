"""A run: its points, the files of its repeats, and whether each file is valid and complete."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from snooker_cli import store
from snooker_cli.config import ConfigError, Experiment, Point, digest, extends, parse, to_json
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import RunError, StoreError
from snooker_cli.store import RepeatHeader
from snooker_cli.trace import StopReason, Trace

MANIFEST = "run.json"
ANALYSES = ("fit.json", "compare.json")
FIGURE_KEYS = {"kind", "title", "caption", "numbers", "layers"}
"""In the JSON that ``plot`` writes beside each figure."""


class State(StrEnum):
    """Whether a repeat's file belongs to a run and is complete."""

    DONE = "done"  # complete, and of this run
    INTERRUPTED = "interrupted"  # its beginning, because the user asked to stop
    SHORTER = "shorter"  # complete, but older than an extension of the run
    UNUSABLE = "unusable"  # damaged, or of another run
    MISSING = "missing"


@dataclass(frozen=True)
class RepeatStatus:
    """Whether a repeat's file belongs to a run and is complete.

    point, repeat : their numbers
    header : None without a readable file
    reason, advice : why the repeat is not done, if there is a file, and what to do
    """

    point: int
    repeat: int
    path: Path
    state: State
    header: RepeatHeader | None = None
    reason: str = ""
    advice: str = ""

    @property
    def error(self) -> StoreError:
        """The error of a file that is not usable."""
        return StoreError(self.path, self.reason, self.advice)


@dataclass(frozen=True)
class Run:
    """A run's folder and the experiment whose repeats it holds.

    engine : "allpairs" or "cells" for all points; None lets snooker choose
    engine_version : of the engine that makes its repeats
    """

    directory: Path
    experiment: Experiment
    points: tuple[Point, ...]
    engine: str | None = None
    engine_version: int = ENGINE_VERSION

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.directory.name

    @cached_property
    def digests(self) -> tuple[str, ...]:
        """What identifies each point."""
        return tuple(digest(point.experiment) for point in self.points)

    @property
    def identity(self) -> str:
        """Eight hexadecimal digits for all that determines the physics of the run's points."""
        return hashlib.sha256("".join(self.digests).encode()).hexdigest()[:8]

    def manifest(self) -> dict[str, Any]:
        """The content of ``run.json``: the experiment and what identifies its points."""
        forced = {} if self.engine is None else {"engine": self.engine}
        return {
            "schema_version": store.SCHEMA_VERSION,
            "engine_version": self.engine_version,
            **forced,
            "experiment": json.loads(to_json(self.experiment)),
            "points": [
                {"index": point.index, "parameters": point.as_json(), "digest": identity}
                for point, identity in zip(self.points, self.digests, strict=True)
            ],
        }

    # The files of repeats.

    def repeats(self) -> Iterator[tuple[int, int]]:
        """The numbers of every point and repeat."""
        for point in self.points:
            for repeat in range(self.experiment.repeats):
                yield point.index, repeat

    def path(self, point: int, repeat: int) -> Path:
        """A repeat's file."""
        return self.directory / f"point-{point:04d}" / f"repeat-{repeat:04d}.h5"

    def files(self) -> list[Path]:
        """All repeats' files in the folder, also those that are not of the config."""
        return sorted(self.directory.glob("point-*/repeat-*.h5"))

    def holds(self, point: Point, repeat: int) -> bool:
        """Whether a repeat has a file, with any content."""
        return store.file_info(self.path(point.index, repeat)) is not None

    def present(self, point: Point) -> list[int]:
        """The repeats of a point that have a file."""
        return [number for number in range(self.experiment.repeats) if self.holds(point, number)]

    def shorter(self, point: Point) -> int:
        """The number of a point's repeats that are older than an extension of the run."""
        return sum(
            self.repeat_status(point.index, repeat, store.read_header).state is State.SHORTER
            for repeat in range(self.experiment.repeats)
        )

    def traces(self, point: Point, present: Sequence[int] | None = None) -> Iterator[Trace]:
        """The repeats of a point that have a file, or these repeats, in order.

        They include interrupted ones, and during an extension those that it has not reached.

        Raises ``RunError`` if there is none, and ``StoreError`` for one that cannot be read or is
        not of this run.
        """
        present = self.present(point) if present is None else present
        for repeat in present:
            yield self.read(point, repeat)
        if not present:
            setting = ", ".join(f"{key}={value}" for key, value in point.parameters)
            which = f"the point {setting}" if setting else "it"
            raise RunError(
                f"{self.directory}: no repeat of {which} is there yet",
                "wait for a run that is under way, or run the config again to continue",
            )

    def read(self, point: Point, repeat: int) -> Trace:
        """A repeat. Raises ``StoreError`` if it cannot be read or is not of this run."""
        trace, header = store.read(self.path(point.index, repeat))
        self.accept(point, repeat, header)
        return trace

    def accept(self, point: Point, repeat: int, header: RepeatHeader) -> None:
        """Raise ``StoreError`` if a file with this header is not of this run."""
        status = self._classified(point.index, repeat, header)
        if status.state is State.UNUSABLE:
            raise status.error

    def repeat_status(
        self, point: int, repeat: int, read: Callable[[Path], RepeatHeader] = store.check
    ) -> RepeatStatus:
        """Whether a repeat's file belongs to this run and is complete.

        read : ``store.check``, or ``store.read_header`` to trust the content
        """
        path = self.path(point, repeat)
        if store.file_info(path) is None:
            return RepeatStatus(point, repeat, path, State.MISSING)
        try:
            header = read(path)
        except StoreError as error:
            return RepeatStatus(
                point, repeat, path, State.UNUSABLE, None, error.reason, error.advice
            )
        return self._classified(point, repeat, header)

    def _classified(self, point: int, repeat: int, header: RepeatHeader) -> RepeatStatus:
        """Whether a file with this header belongs to this run and is complete."""
        source, own = header.provenance, self.points[point]
        state, reason, advice = State.UNUSABLE, "", "run the config again, which replaces it"
        if (source.point, source.repeat) != (point, repeat):
            reason = f"is repeat {source.repeat} of point {source.point}"
        elif source.engine_version != self.engine_version:
            reason = f"is of engine version {source.engine_version}, not {self.engine_version}"
        elif source.engine != self.engine:
            reason = "was simulated without --engine"
            if source.engine:
                reason = f"was simulated with --engine {source.engine}"
        elif source.digest != self.digests[point]:
            reason = "is of another config"
            if _is_extended(source.config, source.digest, own.experiment):
                state, reason, advice = State.SHORTER, "is shorter than the extended run", ""
        elif header.stop.reason is StopReason.INTERRUPTED:
            state, reason, advice = State.INTERRUPTED, header.stop.message, ""
        else:
            state, advice = State.DONE, ""
        return RepeatStatus(point, repeat, self.path(point, repeat), state, header, reason, advice)

    # Files that are made from the repeats.

    def analyses(self) -> list[Path]:
        """What ``fit`` and ``compare`` saved."""
        return [path for name in ANALYSES if (path := self.directory / name).is_file()]

    @property
    def figures_folder(self) -> Path:
        """Where ``plot`` saves figures."""
        return self.directory / "figures"

    def figures(self) -> list[Path]:
        """The figure files that ``plot`` saved, known by the JSON beside each figure."""
        found = []
        for path in sorted(self.figures_folder.glob("*.json")):
            with suppress(OSError, ValueError):
                content = json.loads(path.read_text("utf-8", "replace"))
                if isinstance(content, dict) and content.keys() >= FIGURE_KEYS:
                    found += [path, path.with_suffix(".svg"), path.with_suffix(".png")]
        return [path for path in found if path.is_file()]


@lru_cache(maxsize=1024)
def _is_extended(config: str, identity: str, experiment: Experiment) -> bool:
    """Whether an experiment continues the one of a file's provenance."""
    try:
        before = parse(config).experiment
    except ConfigError:
        return False
    return digest(before) == identity and extends(experiment, before)
