"""A run's folder: its manifest, and the files of its repeats."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from snooker_cli import store
from snooker_cli.config import ConfigError, Experiment, Point, digest, parse, points, to_json
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.trace import Trace

if sys.platform != "win32":
    import fcntl

MANIFEST = "run.json"
RUNS = Path("runs")
ANALYSES = ("fit.json", "compare.json")
FIGURE_KEYS = {"kind", "title", "caption", "numbers", "layers"}
"""In the JSON that ``plot`` writes beside each figure."""


class RunError(Exception):
    """A run's folder that cannot be used; one sentence."""


@dataclass(frozen=True)
class Run:
    """A run's folder and the experiment whose repeats it holds.

    engine : "allpairs" or "cells" for all points, or ``None`` for what suits each
    """

    directory: Path
    experiment: Experiment
    points: tuple[Point, ...]
    engine: str | None = None

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.directory.name

    def path(self, point: int, repeat: int) -> Path:
        """Where a repeat's file is, or will be."""
        return self.directory / f"point-{point:04d}" / f"repeat-{repeat:04d}.h5"

    def present(self, point: Point) -> int:
        """How many repeats of a point have a file; fewer than wanted in an interrupted run."""
        return sum(path.exists() for path in self._paths(point))

    def traces(self, point: Point) -> Iterator[Trace]:
        """The repeats of a point that are there, in order.

        Raises ``RunError`` if there is none and ``StoreError`` for one that cannot be read.
        """
        found = False
        for path in self._paths(point):
            if path.exists():
                found = True
                yield store.read(path).trace
        if not found:
            setting = ", ".join(f"{key}={value}" for key, value in point.parameters)
            which = f"the point {setting}" if setting else "it"
            raise RunError(
                f"{self.directory}: no repeat of {which} is there yet; run the config again, which "
                "goes on where it stopped"
            )

    def _paths(self, point: Point) -> Iterator[Path]:
        """Where a point's repeats are, or will be."""
        return (self.path(point.index, repeat) for repeat in range(self.experiment.repeats))

    def manifest(self) -> dict[str, Any]:
        """What ``run.json`` says: the experiment and what identifies its points."""
        forced = {} if self.engine is None else {"engine": self.engine}
        return {
            "schema_version": store.SCHEMA_VERSION,
            "engine_version": ENGINE_VERSION,
            **forced,
            "experiment": json.loads(to_json(self.experiment)),
            "points": [
                {
                    "index": point.index,
                    "parameters": point.as_json(),
                    "digest": digest(point.experiment),
                }
                for point in self.points
            ],
        }

    def analyses(self) -> list[Path]:
        """What ``fit`` and ``compare`` have saved here."""
        return [path for name in ANALYSES if (path := self.directory / name).is_file()]

    def figures(self) -> list[Path]:
        """What ``plot`` has drawn in the run's folder, known by the numbers beside each figure."""
        found = []
        for data in sorted((self.directory / "figures").glob("*.json")):
            with suppress(OSError, ValueError):
                content = json.loads(data.read_text(encoding="utf-8"))
                if isinstance(content, dict) and content.keys() >= FIGURE_KEYS:
                    found += [data, *(data.with_suffix(ending) for ending in (".svg", ".png"))]
        return [path for path in found if path.is_file()]


@contextmanager
def held(directory: Path) -> Iterator[None]:
    """Keep a folder to one run at a time on this machine, and clear away what a kill has left.

    Raises ``RunError`` if another process has it or it cannot be made. On a disk shared by
    machines two runs may still meet: their files are whole, as each is written under a name of
    its own, and the last one stays.
    """
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
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise RunError(
            f"{directory}: another `snooker run` is writing here; let it end, or give --out for "
            "another folder"
        ) from None
    except OSError:
        return False
    return True


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
    present = _read(manifest)
    with _said(directory):
        if fresh:
            for old in (*directory.glob("point-*/repeat-*.h5"), *run.figures()):
                old.unlink()
        if fresh or (present and present["experiment"].get("repeats", 1) > experiment.repeats):
            for old in run.analyses():
                old.unlink()
        directory.mkdir(parents=True, exist_ok=True)
        write_json(manifest, run.manifest())
    return run


def planned(
    directory: Path, experiment: Experiment, *, fresh: bool = False, engine: str | None = None
) -> Run:
    """The run that ``create`` makes, and its errors, but nothing is written."""
    run = Run(directory, experiment, points(experiment), engine)
    manifest = directory / MANIFEST
    if manifest.exists() and not fresh:
        present = _read(manifest)
        if present is None or _identity(present) != _identity(run.manifest()):
            raise RunError(
                f"{directory}: holds results of another config or engine version, or of another "
                "--engine; give --fresh to replace them or --out for another folder"
            )
    elif not manifest.exists() and _holds_files(directory):
        raise RunError(
            f"{directory}: is not empty and not a run of snooker; give --out for another folder"
        )
    return run


def open_run(name: str | Path) -> Run:
    """A run by its folder, or by its name under ``runs/``. Raises ``RunError``."""
    directory = Path(name)
    if not (directory / MANIFEST).is_file() and (RUNS / name / MANIFEST).is_file():
        directory = RUNS / name
    manifest = directory / MANIFEST
    if not manifest.is_file():
        raise RunError(
            f"{name}: there is no run here (no {MANIFEST}); make one with `snooker run CONFIG`"
        )
    try:
        content = json.loads(manifest.read_text(encoding="utf-8"))
        experiment = parse(json.dumps(content["experiment"]), str(manifest)).experiment
    except (OSError, ValueError, KeyError, TypeError, ConfigError) as error:
        said = str(error).splitlines()[0]
        raise RunError(f"{manifest}: cannot be read ({said}); run the config again") from None
    return Run(directory, experiment, points(experiment), content.get("engine"))


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file, whole or not at all."""
    part = store.part_beside(path)
    try:
        with part.open("x", encoding="utf-8") as file:
            file.write(json.dumps(content, indent=2, allow_nan=False) + "\n")
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def _said(directory: Path) -> Iterator[None]:
    """Turn what the system refuses into a ``RunError``."""
    try:
        yield
    except OSError as error:
        raise RunError(
            f"{directory}: cannot be written ({error.strerror}); give --out for another folder"
        ) from None


def _holds_files(directory: Path) -> bool:
    """Whether a folder has anything in it but what an interrupted write leaves."""
    return directory.is_dir() and any(path.suffix != ".part" for path in directory.iterdir())


def _read(manifest: Path) -> dict[str, Any] | None:
    """What a manifest says; None if it cannot be read."""
    try:
        content: dict[str, Any] = json.loads(manifest.read_text(encoding="utf-8"))
        _identity(content)
        content["experiment"].keys()
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return content


def _identity(manifest: dict[str, Any]) -> str:
    """What must be the same for results to be shared: points and engine, not repeats."""
    engine = manifest["engine_version"], manifest.get("engine")
    return json.dumps([*engine, manifest["points"]], sort_keys=True)
