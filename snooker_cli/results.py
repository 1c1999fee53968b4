"""A run's folder: its manifest, and the files of its repeats."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from snooker_cli import store
from snooker_cli.config import ConfigError, Experiment, Point, digest, parse, points, to_json
from snooker_cli.engine import ENGINE_VERSION
from snooker_cli.trace import Trace

MANIFEST = "run.json"
RUNS = Path("runs")


class RunError(Exception):
    """A run's folder that cannot be used; one sentence."""


@dataclass(frozen=True)
class Run:
    """A run's folder and the experiment whose repeats it holds."""

    directory: Path
    experiment: Experiment
    points: tuple[Point, ...]

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.directory.name

    def path(self, point: int, repeat: int) -> Path:
        """Where a repeat's file is, or will be."""
        return self.directory / f"point-{point:04d}" / f"repeat-{repeat:04d}.h5"

    def traces(self, point: Point) -> Iterator[Trace]:
        """The repeats of a point, in order. Raises ``StoreError`` for one that cannot be read."""
        for repeat in range(self.experiment.repeats):
            yield store.read(self.path(point.index, repeat)).trace

    def manifest(self) -> dict[str, Any]:
        """What ``run.json`` says: the experiment and what identifies its points."""
        return {
            "schema_version": store.SCHEMA_VERSION,
            "engine_version": ENGINE_VERSION,
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

    def identity(self) -> str:
        """What must be the same for results to be shared: points and engine, not repeats."""
        manifest = self.manifest()
        return json.dumps([manifest["engine_version"], manifest["points"]], sort_keys=True)


def create(directory: Path, experiment: Experiment, *, fresh: bool = False) -> Run:
    """A folder for a run, with its manifest; results of the same experiment in it are kept.

    Raises ``RunError`` if the folder holds another experiment's results (unless ``fresh``) or
    cannot be written.
    """
    run = Run(directory, experiment, points(experiment))
    manifest = directory / MANIFEST
    if manifest.exists() and not fresh:
        present = _identity(manifest)
        if present != run.identity():
            raise RunError(
                f"{directory}: holds results of another config or engine version; give --fresh to "
                "replace them or --out for another folder"
            )
    elif not manifest.exists() and _holds_files(directory):
        raise RunError(
            f"{directory}: is not empty and not a run of snooker; give --out for another folder"
        )
    try:
        if fresh:
            for old in directory.glob("point-*/repeat-*.h5*"):
                old.unlink()
        directory.mkdir(parents=True, exist_ok=True)
        write_json(manifest, run.manifest())
    except OSError as error:
        raise RunError(
            f"{directory}: cannot be written ({error.strerror}); give --out for another folder"
        ) from None
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
    return Run(directory, experiment, points(experiment))


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file, whole or not at all."""
    part = path.with_name(path.name + ".part")
    with part.open("w", encoding="utf-8") as file:
        file.write(json.dumps(content, indent=2, allow_nan=False) + "\n")
        file.flush()
        os.fsync(file.fileno())
    part.replace(path)


def _holds_files(directory: Path) -> bool:
    """Whether a folder has anything in it but what an interrupted write leaves."""
    return directory.is_dir() and any(path.suffix != ".part" for path in directory.iterdir())


def _identity(manifest: Path) -> str | None:
    """The identity of the results a manifest speaks of; None if it cannot be read."""
    try:
        content = json.loads(manifest.read_text(encoding="utf-8"))
        return json.dumps([content["engine_version"], content["points"]], sort_keys=True)
    except (OSError, ValueError, KeyError, TypeError):
        return None
