"""What a new run is to the results in its folder: the same, an extension, or another."""

from __future__ import annotations

import json
from collections.abc import Sequence
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
from snooker_cli.results.run import MANIFEST, Run, State


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
            told = store.glance(path)
        except store.StoreError:
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
