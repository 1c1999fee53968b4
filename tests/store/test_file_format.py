"""docs/file-format.md names all that is in the files, and the files have all that it names."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pyh5md
import pytest
from pyh5md import element
from scenes import gas, lone_bouncer, rough

from snooker_cli import export, runs, store
from snooker_cli.containers import Circle
from snooker_cli.engine import replayed, simulate
from snooker_cli.engine.clock import LEAST_EVENTS
from snooker_cli.laws import Thermal, Viscoelastic
from snooker_cli.runs.folder import FAILURES, record_failure
from snooker_cli.scene import Scene
from snooker_cli.store import SCHEMA_VERSION, Provenance, RepeatHeader
from snooker_cli.trace import StopReason, Trace

PAGE = (Path(__file__).parents[2] / "docs" / "file-format.md").read_text(encoding="utf-8")

Row = dict[str, str]
Snooker = Callable[..., Any]

SCENES: dict[str, Callable[[], Scene]] = {
    "free": lambda: gas("circle", 20, 0.3, mixed=True, container_mass=20.0),
    "box": lambda: gas("box", 60, 0.3, aspect=1.5),
    "periodic": lambda: gas("periodic", 60, 0.3),
    "rough": lambda: rough(gas("circle", 20, 0.3)),
    "thermal": lambda: replace(
        gas("circle", 20, 0.3),
        pair_law=Viscoelastic(0.9, 5.0),
        wall_law=Thermal(20.0),
        wall_key=2**62,
    ),
}


def tables(heading: str) -> list[list[Row]]:
    """The tables under a heading, up to the next one of its level; without its backticks."""
    level = heading.partition(" ")[0]
    body = PAGE.split(f"\n{heading}\n")[1]
    body = re.split(rf"\n#{{1,{len(level)}}} ", body)[0]
    found = []
    for block in re.findall(r"(?:^\|.*\n)+", body, flags=re.MULTILINE):
        head, _, *rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines(block)]
        found.append([dict(zip(head, row, strict=True)) for row in rows])
    return found


def lines(block: str) -> list[str]:
    return block.replace("`", "").splitlines()


def datasets(
    rows: list[Row], kinds: set[str], frames: bool = False
) -> dict[str, tuple[str, str, str]]:
    """Name -> type, shape and unit of what the rows promise to files of some kinds.

    frames : whether elements have a step and a time for each row
    """
    found = {}
    for row in rows:
        if row["in"] not in kinds:
            continue
        name, first = row["name"], re.split(r"[\[,\]]", row["shape"])[1]
        if row["kind"] == "element":
            found[f"{name}/value"] = row["type"], row["shape"], row["unit"]
            found[f"{name}/step"] = "int64", f"[{first}]" if frames else "[]", ""
            if frames:
                found[f"{name}/time"] = "float64", f"[{first}]", "s"
        elif row["kind"] == "frames":
            found[f"{name}/value"] = row["type"], row["shape"], row["unit"]
            found[f"{name}/step"] = "int64", f"[{first}]", ""
            found[f"{name}/time"] = "float64", f"[{first}]", "s"
        else:
            found[name] = row["type"], row["shape"], row["unit"]
    return found


def attributes(rows: list[Row], kinds: set[str]) -> dict[tuple[str, str], tuple[str, str]]:
    return {
        (row["object"], row["attribute"]): (row["type"], row["shape"])
        for row in rows
        if row["in"] in kinds
    }


def objects(group: h5py.Group) -> Iterator[tuple[str, Any]]:
    """Everything below a group by every name that it has, hard links too."""
    for name in group:
        yield name, group[name]
        if isinstance(group[name], h5py.Group):
            yield from ((f"{name}/{below}", item) for below, item in objects(group[name]))


def kind_of(holder: h5py.AttributeManager, name: str) -> tuple[str, tuple[int, ...]]:
    """Type, as the page has it, and shape of an attribute."""
    attribute = holder.get_id(name)
    text = h5py.check_string_dtype(attribute.dtype)
    if text is not None:
        return ("string" if text.length is None else "fixed string"), attribute.shape
    if h5py.check_ref_dtype(attribute.dtype):
        return "reference", attribute.shape
    return str(attribute.dtype), attribute.shape


def shape_of(text: str, letters: dict[str, int]) -> tuple[int, ...]:
    """``[2, N, 2]`` with the numbers that a file has for its letters."""
    sizes = [size.strip() for size in text.strip("[]").split(",")]
    return tuple(letters[size] if size in letters else int(size) for size in sizes if size)


def compare(
    file: h5py.File,
    data: list[Row],
    attrs: list[Row],
    kinds: set[str],
    letters: dict[str, int],
    text: str = "fixed string",
) -> None:
    """Assert that a file has what the page's rows say, and nothing else."""
    there = dict(objects(file))
    promised = datasets(data, kinds, frames=text == "string")
    found = {name for name, item in there.items() if isinstance(item, h5py.Dataset)}
    assert found == set(promised)
    units = {}
    for name, (kind, shape, unit) in promised.items():
        found_kind = "text" if there[name].dtype.kind == "S" else str(there[name].dtype)
        assert found_kind == kind, name
        assert there[name].shape == shape_of(shape, letters), name
        if unit:
            bracketed = re.fullmatch(r"\((.*)\)", unit)
            holder = name.removesuffix("/value") if bracketed else name
            units[holder, "unit"] = bracketed[1] if bracketed else unit
    expected = attributes(attrs, kinds)
    for name, item in [("", file), *there.items()]:
        for attribute in item.attrs:
            kind, shape = kind_of(item.attrs, attribute)
            if attribute == "unit":
                assert (kind, shape) == (text, ())
                unit = item.attrs["unit"]
                found_unit = unit if isinstance(unit, str) else unit.decode()
                assert found_unit == units.pop((name, "unit")), name
                continue
            described, size = expected.pop((name, attribute))
            assert (kind, shape) == (described, shape_of(size, letters)), (name, attribute)
    assert (units, expected) == ({}, {})
    named = {*promised, *(f"{holder}/" for holder, _ in attributes(attrs, kinds))}
    for name in there:
        assert any(f"{full_name}/".startswith(f"{name}/") for full_name in named), name


def trace_of(scene: str, record: str) -> Trace:
    number = LEAST_EVENTS + 1 if record == "long" else 40
    times = [0.1, 0.5, 0.9] if record == "snapshots" else []
    summary = record in ("summary", "snapshots")
    return simulate(SCENES[scene](), collisions=number, summary=summary, snapshots=times)


@pytest.mark.parametrize(
    ("scene", "record"),
    [*itertools.product(SCENES, ["events", "summary", "snapshots"]), ("free", "long")],
)
def test_a_batchs_file_has_what_the_page_says(
    scene: str, record: str, tmp_path: Path, provenance: Provenance
) -> None:
    trace = trace_of(scene, record)
    repeats = 1 if trace.snapshots else 2
    store.write(tmp_path / "batch.h5", [(k, trace) for k in range(repeats)], provenance)
    kinds = {"all", record} | ({"events"} if record == "long" else set())
    kinds |= {"box"} if not isinstance(trace.start.container, Circle) else set()
    kinds |= {"thermal wall"} if trace.start.wall_key is not None else set()
    kinds |= {"warm"} if trace.summary is not None and trace.start.wall_law.adds_energy else set()
    kinds |= {"summary"} if record == "snapshots" else set()
    if trace.start.surface is not None:
        kinds |= {"rough", *(f"rough {kind}" for kind in kinds)}
    kinds |= {"box snapshots"} if kinds >= {"box", "snapshots"} else set()
    letters = {"N": trace.start.number, "n": repeats * trace.collisions, "B": repeats}
    letters |= {"2B": 2 * repeats, "B + 1": repeats + 1}
    if trace.summary is not None:
        letters["g"] = repeats * len(trace.summary.series.time)
    if trace.snapshots is not None:
        letters["s"] = len(trace.snapshots)
    (data,), (attrs,) = tables("### Datasets"), tables("### Attributes")
    container = trace.start.container
    with h5py.File(tmp_path / "batch.h5") as file:
        compare(file, data, attrs, kinds, letters)
        for group in file["particles"].values():
            boundary = b"periodic" if container.period else b"none"
            assert group["box"].attrs["boundary"].tolist() == [boundary] * 2
            if "box" in kinds:  # H5MD wants edges wherever a boundary is periodic
                assert group["box/edges"][:].tolist() == list(container.size)


def test_an_independent_reader_reads_it(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    trace, path = traces["events"], tmp_path / "batch.h5"
    back = replace(trace, finish=trace.start)
    store.write(path, [(3, trace), (4, back)], provenance)
    with pyh5md.File(path, "r") as file:
        balls = file.particles_group("balls")
        for name, values in (("position", "positions"), ("velocity", "velocities")):
            found = element(balls, name)
            assert (found.element_type, found.step) == ("LinearElement", 1)
            for k, scene in enumerate((trace.start, trace.finish, trace.start, trace.start)):
                assert np.array_equal(found.value[k], getattr(scene, values))
        assert np.array_equal(element(balls, "mass").value[:], trace.start.masses)
        wall = element(file.particles_group("container"), "position")
        assert np.array_equal(wall.value[1], [trace.finish.container_position])
        own = file["parameters/snooker"]
        assert own["repeat"][:].tolist() == [3, 4]
        second = slice(*own["rows"][1:])
        collisions = element(file["connectivity"], "collisions")
        assert file[file["connectivity/collisions"].attrs["particles_group"]] == balls
        assert np.array_equal(collisions.value[second, 0, 0], trace.events.i)
        assert np.array_equal(collisions.value[second, 0, 1], trace.events.j)
        for name in ("time", "impulse"):
            column = element(file["observables"], name)
            assert np.array_equal(column.value[second], getattr(trace.events, name))


JSON = {
    str: "string",
    bool: "boolean",
    int: "integer",
    float: "number",
    list: "list",
    dict: "object",
}


def compare_keys(content: dict[str, Any], rows: list[Row]) -> None:
    """Assert that JSON has the page's keys, in its order, with its types."""
    assert list(content) == [row["key"] for row in rows]
    for row in rows:
        value = content[row["key"]]
        kind = "null" if value is None else JSON[type(value)]
        assert kind in row["type"].split(" or "), row["key"]


def test_the_jsons_have_the_keys_of_the_page(
    traces: dict[str, Trace], tmp_path: Path, provenance: Provenance
) -> None:
    store.write(tmp_path / "batch.h5", [(0, traces["events"])], provenance)
    with h5py.File(tmp_path / "batch.h5") as file:
        own = dict(file["parameters/snooker"].attrs)
        made = file["parameters/snooker/provenance"][()]
        ending = file["parameters/snooker/ending"][0]
    always, _ = tables("### The ending")
    compare_keys(json.loads(ending), always)
    compare_keys(json.loads(own["scene"]), *tables("### The scene"))
    compare_keys(json.loads(made), *tables("### The provenance"))
    assert re.fullmatch(b"[0-9a-f]{64}", own["content"])


def test_rough_balls_have_a_surface(tmp_path: Path, provenance: Provenance) -> None:
    trace = trace_of("rough", "events")
    store.write(tmp_path / "batch.h5", [(0, trace)], provenance)
    with h5py.File(tmp_path / "batch.h5") as file:
        scene = json.loads(file["parameters/snooker"].attrs["scene"])
    assert trace.start.surface is not None
    numbers = vars(trace.start.surface)
    assert scene["surface"] == numbers | {"wall_friction": None}  # infinite
    body = " ".join(PAGE.split("\n### The scene\n")[1].split("\n### ")[0].split())
    named = re.findall(r"`(\w+)`", body.partition("A surface has")[2])
    assert named[: len(numbers)] == list(numbers)


def test_a_wall_trap_has_more_keys(tmp_path: Path, provenance: Provenance) -> None:
    trace = simulate(lone_bouncer(), collisions=9)
    store.write(tmp_path / "trap.h5", [(0, trace)], provenance)
    with h5py.File(tmp_path / "trap.h5") as file:
        ending = json.loads(file["parameters/snooker/ending"][0])
    more = {row["key"]: ending.pop(row["key"]) for row in tables("### The ending")[1]}
    compare_keys(ending, tables("### The ending")[0])
    compare_keys(more, tables("### The ending")[1])
    stop = trace.stop
    assert list(more.values()) == [stop.accumulation_time, stop.impulse_to_come]


def test_the_page_is_of_this_schema() -> None:
    endings, _ = tables("### The ending")
    named = re.findall(r"[a-z_]+", endings[0]["what"].replace(" or ", " "))
    assert set(named) == set(StopReason)
    assert f"1.1, schema version {SCHEMA_VERSION}." in PAGE


def test_a_runs_folder_has_what_the_page_says(finished: Path, snooker: Snooker) -> None:
    run = runs.open_run(finished)
    for command in (["fit", "small"], ["compare", "small"], ["verify", "small", "--exact"]):
        assert snooker(*command).code == 0
    assert snooker("export", "small", "--table", "--out", "table.csv").code == 0
    record_failure(run, 0, 1, "it failed")
    folder, manifest = tables("## A run's folder")
    names = {name for row in folder for name in row["name"].split(", ")}
    there = {re.sub(r"\d{4}", "0000", str(path.relative_to(finished))) for path in walk(finished)}
    there |= {f"{run.figures_folder.relative_to(finished)}/"}
    assert there == names - {"*.part"}
    (failure,) = (finished / FAILURES).read_text().splitlines()
    assert [f"`{key}`" in PAGE for key in json.loads(failure)] == [True] * 3
    content = json.loads((finished / runs.MANIFEST).read_text())
    compare_keys(content, [row for row in manifest if row["default"] == "–"])
    (points,) = (row["what"] for row in manifest if row["key"] == "points")
    assert all(key in points for key in content["points"][0])


def walk(directory: Path) -> Iterator[Path]:
    return (path for path in directory.rglob("*") if path.is_file())


@pytest.mark.parametrize("scene", SCENES)
def test_exported_states_are_what_the_page_says(
    scene: str, tmp_path: Path, provenance: Provenance
) -> None:
    trace, times = trace_of(scene, "events"), np.array([0.0, 0.1, 0.1])
    out = tmp_path / "states.h5md"
    header = RepeatHeader(7, trace.stop, 30, 10, provenance, "bits", trace.start.rules)
    export.write_states(out, trace.start, header, times, replayed(trace, times))
    data, attrs = tables("### States: `.h5md`")
    with h5py.File(out) as file:
        kinds = {"all"} if trace.start.surface is None else {"all", "rough"}
        compare(file, data, attrs, kinds, {"N": trace.start.number, "t": 3}, "string")
