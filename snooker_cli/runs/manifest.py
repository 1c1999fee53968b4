"""The manifest of a run, ``run.json``: what it has, and a run that is read from it.

A manifest may come from another program or another user. So each value has a type and a range, and
what follows from the experiment is compared with it.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from snooker_cli import store
from snooker_cli.config import Point, PointConfig, points, to_json, validated, with_values
from snooker_cli.config.problems import in_words, key_path, rendered, value_at
from snooker_cli.errors import DeniedError, RunError, StoreError, error_text
from snooker_cli.files import read_text
from snooker_cli.formatting import listed, plain, printable
from snooker_cli.options import FRESH, OUT
from snooker_cli.ranges import Index
from snooker_cli.runs.run import MANIFEST, RunFolder


class _Row(BaseModel):
    """A point: its number, and its swept keys and their values."""

    index: Index
    parameters: dict[str, Any]


class _Listed(_Row):
    """A point of the experiment, and the hash of its physics."""

    digest: str


class _Former(_Row):
    """A point that the sweep no longer lists, and its experiment."""

    experiment: dict[str, Any]


class _Manifest(BaseModel):
    """The content of ``run.json``; docs/file-format.md describes it."""

    schema_version: Index
    engine_version: Index
    experiment: dict[str, Any]
    points: list[_Listed]
    former: list[_Former] = []


_NEEDS = {
    "dict_type": "a mapping of keys to values",
    "model_type": "a mapping of keys to values",
    "list_type": "a list",
    "string_type": "a text",
}
"""What is needed, by the type of pydantic's error."""


def content(run: RunFolder) -> dict[str, Any]:
    """The content of a run's manifest, as JSON has it."""
    rows = [_row(point, digest=run.digests[point.index]) for point in run.points]
    former = [_row(point, experiment=_data(point.config)) for point in run.former]
    manifest: dict[str, Any] = plain(
        {
            "schema_version": store.SCHEMA_VERSION,
            "engine_version": run.engine_version,
            "experiment": _data(run.config),
            "points": rows,
        }
        | ({"former": former} if former else {})
    )
    return manifest


def _row(point: Point, **more: Any) -> dict[str, Any]:
    return {"index": point.index, "parameters": point.as_json(), **more}


def _data(experiment: Any) -> Any:
    return json.loads(to_json(experiment))


def read(directory: Path) -> RunFolder:
    """The run of a folder that has a manifest.

    Raises ``StoreError`` if the manifest cannot be read, and ``RunError`` if it is of another
    schema.
    """
    path = directory / MANIFEST
    try:
        manifest = _Manifest.model_validate(json.loads(read_text(path)), strict=True)
        run = _run(directory, manifest)
    except PermissionError:
        raise DeniedError(path) from None
    except Exception as error:
        reason = _sentence(error) if isinstance(error, ValidationError) else error_text(error)
        raise StoreError(
            path,
            f"cannot be read ({printable(reason)})",
            f"put a copy of it back, or run the config with {FRESH}, which replaces the results",
        ) from None
    if manifest.schema_version not in store.READABLE:
        raise RunError(
            f"{directory}: its files have version {manifest.schema_version} of the schema, and "
            f"this snooker reads versions {listed([*map(str, store.READABLE)])}",
            f"run its config with {FRESH}, which replaces the results, or with {OUT}",
            code="other_schema",
        )
    return run


def _sentence(error: ValidationError) -> str:
    """What is wrong first."""
    fault = error.errors(include_url=False)[0]
    *outer, last = fault["loc"] or ("",)
    if fault["type"] == "missing":
        return f"{rendered((*outer, last))}: the key is missing"
    needs = _NEEDS.get(fault["type"]) or fault.get("ctx", {}).get("needs", fault["msg"])
    where = f"{rendered(fault['loc'])}: " if fault["loc"] else ""
    return f"{where}{in_words(fault['input'])} is given where {needs} is needed"


def _run(directory: Path, manifest: _Manifest) -> RunFolder:
    """The run of a manifest. Raises ``ValueError`` if its parts contradict each other."""
    experiment = validated(manifest.experiment)
    grid = points(experiment)
    if len(manifest.points) != len(grid):
        raise ValueError("its points are not those of its experiment")
    numbers = [row.index for row in (*manifest.points, *manifest.former)]
    if len(set(numbers)) < len(numbers):
        raise ValueError("two of its points have one number")
    pairs = zip(grid, manifest.points, strict=True)
    numbered = tuple(replace(point, index=row.index) for point, row in pairs)
    former = tuple(_former_points(manifest.former))
    run = RunFolder(directory, experiment, numbered, manifest.engine_version, former)
    if [row.digest for row in manifest.points] != list(run.digests.values()):
        raise ValueError("its points are not those of its experiment")
    return run


def _former_points(rows: list[_Former]) -> Iterator[Point]:
    for place, row in enumerate(rows):
        experiment, given = validated(row.experiment), row.parameters
        is_nested = any(isinstance(value, dict) for value in given.values())
        if is_nested or with_values(experiment, given) != experiment:
            raise ValueError(f"former[{place}]: its parameters are not those of its experiment")
        parameters = tuple((key, value_at(experiment, key_path(key))) for key in given)
        yield Point(row.index, parameters, PointConfig(experiment))
