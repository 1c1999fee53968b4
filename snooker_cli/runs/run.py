"""A run: its points, where their repeats are, and what each file there is to it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from snooker_cli import errors, store
from snooker_cli.config import ConfigError, Experiment, Point, digest, extends, parse, to_json
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.errors import RunError
from snooker_cli.store import RepeatHeader
from snooker_cli.trace import StopReason, Trace

MANIFEST = "run.json"
ANALYSES = ("fit.json", "compare.json")
FIGURE_KEYS = {"kind", "title", "caption", "numbers", "layers"}
"""In the JSON that ``plot`` writes beside each figure."""


class State(StrEnum):
    """What is there of a repeat."""

    DONE = "done"  # whole, and of this run
    INTERRUPTED = "interrupted"  # its beginning, as the user asked to stop
    SHORTER = "shorter"  # whole, but of before the run was extended
    UNUSABLE = "unusable"  # damaged, or of another run
    MISSING = "missing"


@dataclass(frozen=True)
class Run:
    """A run's folder and the experiment whose repeats it holds.

    engine : "allpairs" or "cells" for all points, or ``None`` for what suits each
    engine_version : what its repeats are made with
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

    def path(self, point: int, repeat: int) -> Path:
        """Where a repeat's file is, or will be."""
        return self.directory / f"point-{point:04d}" / f"repeat-{repeat:04d}.h5"

    def present(self, point: Point) -> list[int]:
        """Which repeats of a point have a file; not all that are wanted in an interrupted run."""
        return [number for number in range(self.experiment.repeats) if self.holds(point, number)]

    def shorter(self, point: Point) -> int:
        """How many of these end where they did before the run was extended."""
        return sum(self._shorter(point, repeat) for repeat in range(self.experiment.repeats))

    def holds(self, point: Point, repeat: int) -> bool:
        """Whether a repeat has a file, whatever is in it."""
        return store.file_info(self.path(point.index, repeat)) is not None

    def repeats_there(self) -> list[Path]:
        """The files of all repeats that are there, of the config or not."""
        return sorted(self.directory.glob("point-*/repeat-*.h5"))

    def traces(self, point: Point, present: Sequence[int] | None = None) -> Iterator[Trace]:
        """The repeats of a point that are there, or were when ``present`` was asked, in order.

        Interrupted ones are among them, and in an extension that is not finished those of before
        it: what is simulated can be read, and ``shorter`` tells how many do not go as far.

        Raises ``RunError`` if there is none and ``StoreError`` for one that cannot be read or is
        not of this run.
        """
        present = self.present(point) if present is None else present
        for repeat in present:
            yield self.read(point, repeat)
        if not present:
            setting = ", ".join(f"{key}={value}" for key, value in point.parameters)
            which = f"the point {setting}" if setting else "it"
            raise RunError(
                f"{self.directory}: no repeat of {which} is there yet; a run that is under way "
                "brings it, or run the config again, which goes on where it stopped"
            )

    def read(self, point: Point, repeat: int) -> Trace:
        """A repeat. Raises ``StoreError`` if it cannot be read or is not of this run."""
        trace, header = store.read(self.path(point.index, repeat))
        self.accept(point, repeat, header)
        return trace

    def accept(self, point: Point, repeat: int, told: RepeatHeader) -> None:
        """Raise ``StoreError`` if what a repeat's file says of itself is not of this run."""
        state, said = self.state(point, repeat, told)
        if state is State.UNUSABLE:
            raise errors.StoreError(said)

    def state(self, point: Point, repeat: int, told: RepeatHeader) -> tuple[State, str]:
        """What a repeat's file is to this run by what it says of itself, and why in a sentence."""
        source = told.provenance
        reason = ""
        if (source.point, source.repeat) != (point.index, repeat):
            reason = f"is repeat {source.repeat} of point {source.point}"
        elif source.engine_version != self.engine_version:
            reason = f"is of engine version {source.engine_version}, not {self.engine_version}"
        elif source.engine != self.engine:
            reason = f"is of --engine {source.engine}" if source.engine else "is of no --engine"
        elif source.digest != self.digests[point.index]:
            if _continues(point.experiment, source.config, source.digest):
                return State.SHORTER, "it is shorter, of before the run was extended"
            reason = "is of another config"
        elif json.loads(source.parameters) != json.loads(json.dumps(point.as_json())):
            reason = "is of another point"
        if reason:
            path = self.path(point.index, repeat)
            return State.UNUSABLE, f"{path}: {reason}; run the config again, which replaces it"
        if told.stop.reason is StopReason.INTERRUPTED:
            return State.INTERRUPTED, told.stop.message
        return State.DONE, ""

    @cached_property
    def digests(self) -> tuple[str, ...]:
        """What identifies each point."""
        return tuple(digest(point.experiment) for point in self.points)

    @property
    def identity(self) -> str:
        """Eight hexadecimal digits for all that determines the physics of the run's points."""
        return hashlib.sha256("".join(self.digests).encode()).hexdigest()[:8]

    def _shorter(self, point: Point, repeat: int) -> bool:
        """Whether a repeat's file is of before the run was extended."""
        try:
            told = store.read_header(self.path(point.index, repeat))
        except errors.StoreError:
            return False
        return self.state(point, repeat, told)[0] is State.SHORTER

    def manifest(self) -> dict[str, Any]:
        """What ``run.json`` says: the experiment and what identifies its points."""
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

    def analyses(self) -> list[Path]:
        """What ``fit`` and ``compare`` have saved here."""
        return [path for name in ANALYSES if (path := self.directory / name).is_file()]

    @property
    def figures_folder(self) -> Path:
        """Where ``plot`` draws."""
        return self.directory / "figures"

    def figures(self) -> list[Path]:
        """What ``plot`` has drawn in the run's folder, known by the numbers beside each figure."""
        found = []
        for path in sorted(self.figures_folder.glob("*.json")):
            with suppress(OSError, ValueError):
                content = json.loads(path.read_text("utf-8", "replace"))
                if isinstance(content, dict) and content.keys() >= FIGURE_KEYS:
                    found += [path, path.with_suffix(".svg"), path.with_suffix(".png")]
        return [path for path in found if path.is_file()]


@lru_cache(maxsize=1024)
def _continues(experiment: Experiment, config: str, identity: str) -> bool:
    """Whether an experiment goes on where the one in a file's provenance ends."""
    try:
        before = parse(config).experiment
    except ConfigError:
        return False
    return digest(before) == identity and extends(experiment, before)
