"""Files that a stranger may send: each is made from a good one, and its hashes are right again."""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import MISSING, fields, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from snooker_cli import store
from snooker_cli.store import file_format as layout
from snooker_cli.store import writer
from snooker_cli.store.hdf5 import ROWS
from snooker_cli.store.value_ranges import GROWING, EventCheck
from snooker_cli.trace import Events, Series, Stop, Trace

Damage = Callable[[Path], object]
"""Changes the good file at a path, or replaces it."""

Make = Callable[[h5py.File, str, int], object]
"""Makes a dataset of this name, which had this many rows."""

ESCAPES = "a\x1b[2J\x1b]0;b\x07\x9b1m\u202egpj.exe\u2066\r\n\u200b$\\frac<script>"
"""Clears a terminal, names its window, and turns text round."""

ALL = slice(None)
DEEP = "[" * 200_000
LARGE = 2**31 - 1
TIME = f"{layout.TIME}/value"
SPIN = f"{layout.BALLS}/angular_velocity"


class NoCheck(EventCheck):
    """Takes all events."""

    def take(self, _events: Events) -> None:
        pass

    def end(self, _trace: Trace) -> None:
        pass


@contextmanager
def unchecked() -> Iterator[None]:
    """Inside, the writer writes values that the reader refuses, as another program could."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(writer, "EventCheck", NoCheck)
        for name in ("check_repeats", "check_snapshot", "check_snapshot_times"):
            patched.setattr(writer, name, lambda *_: None)
        yield


def with_traces(change: Callable[[Trace], Trace]) -> Damage:
    """Writes changed traces as snooker does, with right hashes."""

    def damage(path: Path) -> None:
        found = store.read(path)
        changed = [(header.repeat, change(trace)) for trace, header in found]
        with unchecked():
            store.write(path, changed, found[0][1].provenance)

    return damage


def trace(places: str, value: Any, row: int | None = None) -> Damage:
    """Changes fields of each trace, such as ``finish.positions``; with a row one number of them."""

    def changed(part: Any, names: list[str]) -> Any:
        if names:
            name, *inner = names
            new = {name: changed(getattr(part, name), inner)}
            return part._replace(**new) if isinstance(part, Stop) else replace(part, **new)
        if row is None:
            return value
        values = part.copy()
        values.flat[row] = value
        return values

    def change(before: Trace) -> Trace:
        for place in places.split():
            before = changed(before, place.split("."))
        return before

    return with_traces(change)


def event(name: str, value: float) -> Damage:
    return trace(f"events.{name}", value, 5)


def scene(name: str, value: Any, row: int | None = None) -> Damage:
    """Changes a value of the start and of the finish."""
    return trace(f"start.{name} finish.{name}", value, row)


def times(factor: float) -> Damage:
    """Multiplies all times."""

    def change(before: Trace) -> Trace:
        assert before.events is not None
        events = replace(before.events, time=factor * before.events.time)
        stop = before.stop._replace(time=factor * before.stop.time)
        return replace(before, events=events, stop=stop)

    return with_traces(change)


def residual(value: float) -> Damage:
    """Gives each event this residual of its time, s."""

    def change(before: Trace) -> Trace:
        assert before.events is not None
        column = np.full(len(before.events), value)
        return replace(before, events=replace(before.events, residual=column))

    return with_traces(change)


def edited(change: Callable[[h5py.File], object]) -> Damage:
    """Changes the open file."""

    def damage(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            change(file)

    return damage


def parameter(name: str, values: Any) -> Damage:
    """Replaces a dataset of the parameters by values, or by a function of the old values.

    The hash over the parameters is then right again.
    """

    def change(file: h5py.File) -> None:
        held = file[layout.PARAMETERS]
        old = held.pop(name)[()] if name in held else None
        held[name] = values(old) if callable(values) else values
        contents = [text.decode() for text in held["content"][()]]
        source = held["provenance"][()].decode()
        seal = layout.seal(source, held["repeat"][()].tolist(), contents)
        held.attrs["content"] = np.bytes_(seal, "ascii")

    return edited(change)


def provenance(**values: Any) -> Damage:
    return parameter("provenance", lambda old: np.bytes_(json.dumps(json.loads(old) | values)))


def ending(**values: Any) -> Damage:
    """Changes the JSON about each end."""

    def change(old: Any) -> Any:
        return np.array([json.dumps(json.loads(text) | values) for text in old], np.bytes_)

    return parameter("ending", change)


def attribute(name: str, value: Any, place: str = layout.PARAMETERS) -> Damage:
    """Gives an object an attribute; a text as bytes."""
    value = np.bytes_(value.encode()) if isinstance(value, str) else value
    return edited(lambda file: file.require_group(place).attrs.__setitem__(name, value))


def rules(**values: Any) -> Damage:
    """Changes the JSON of the scene."""

    def change(file: h5py.File) -> None:
        held = file[layout.PARAMETERS].attrs
        held["scene"] = np.bytes_(json.dumps(json.loads(held["scene"]) | values))

    return edited(change)


def dataset(name: str, make: Make) -> Damage:
    """Makes a dataset anew, by a function that also gets the number of its rows."""

    def change(file: h5py.File) -> None:
        unit, rows = {}, 450
        if name in file:
            unit, rows = dict(file[name].attrs), file[name].size
            del file[name]
        make(file, name, rows)
        file[name].attrs.update(unit)

    return edited(change)


def declared(number: int | None, chunk: int | None) -> Make:
    """A dataset of this many rows, or as many as before, of which none is stored."""
    options: dict[str, Any] = {}
    if chunk:
        options = {"chunks": (chunk,), "maxshape": (None,), "shuffle": True, "compression": 1}
    return lambda file, name, rows: file.create_dataset(name, (number or rows,), "f8", **options)


def zeros(number: int) -> Make:
    """A dataset of this many zeros, of which 500 take a byte."""

    def make(file: h5py.File, name: str, _rows: int) -> None:
        declared(number, ROWS)(file, name, number)
        for start in range(0, number, ROWS):
            file[name].id.write_direct_chunk((start,), zlib.compress(bytes(8 * ROWS)))

    return make


def chunk(content: bytes, number: int | None = None) -> Make:
    """A dataset in one chunk with this content."""

    def make(file: h5py.File, name: str, rows: int) -> None:
        declared(number or rows, number or rows)(file, name, rows)
        file[name].id.write_direct_chunk((0,), content)

    return make


def bomb() -> bytes:
    """1.6 MB that unpack to 1.6 GB."""
    deflate = zlib.compressobj(9, wbits=-zlib.MAX_WBITS)
    piece = deflate.compress(bytes(1 << 24)) + deflate.flush(zlib.Z_FULL_FLUSH)
    return b"\x78\x01" + 100 * piece


BOMB, SHORT = bomb(), zlib.compress(bytes(8))


def filled(values: Callable[[int], Any]) -> Make:
    """A dataset with values that a function of the number of rows gives."""
    return lambda file, name, rows: file.create_dataset(name, data=values(rows))


one_less = filled(lambda rows: np.arange(rows - 1.0))


def external(file: h5py.File, name: str, rows: int) -> None:
    file.create_dataset(name, (rows,), "f8", external=[("/etc/passwd", 0, 8 * rows)])


def linked(link: Any) -> Damage:
    """Replaces the times by a link."""

    def change(file: h5py.File) -> None:
        del file[TIME]
        file[TIME] = link

    return edited(change)


def fifo(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def loop(path: Path) -> None:
    path.unlink()
    path.symlink_to(path)


def endless(path: Path) -> None:
    path.unlink()
    path.symlink_to("/dev/zero")


def holes(path: Path) -> None:
    """200 GB that take no space."""
    os.truncate(path, 200 * 10**9)


def text(content: str | bytes) -> Damage:
    data = content if isinstance(content, bytes) else content.encode()
    return lambda path: path.write_bytes(data)


AMOUNTS = (0.0, np.nan, 5e-324, 1e300)
WRONG = (np.nan, -1.0, 1e300)
TYPES = {
    "text": h5py.string_dtype(),
    "sequence": h5py.vlen_dtype("i1"),
    "compound": np.dtype("f8, S9"),
}

SURFACE: dict[str, Any] = {
    "inertia": 0.5,
    "tangential_cor": 0.5,
    "friction": None,
    "wall_tangential_cor": 0.5,
    "wall_friction": 0.1,
}
"""A surface, as files have it."""

REFUSED: dict[str, dict[str, Damage]] = {
    "wrong ball in an event": {
        **{f"i = {value}": event("i", value) for value in (LARGE, 7, -1)},
        **{f"j = {value}": event("j", value) for value in (LARGE, 7, -2, -3)},
    },
    "wrong order of the times": {f"{value}": event("time", value) for value in WRONG},
    "wrong impulse": {
        **{f"{value}": event("impulse", value) for value in WRONG},
        "all at rest": trace("start.velocities finish.velocities", np.zeros((7, 2))),
    },
    "wrong residual": {f"{value}": residual(value) for value in (np.nan, 1e149)},
    "squares of speed times distance": {"fast": scene("velocities", 1e200, 0)},
    "wrong place of a ball": {
        **{f"at {value}": scene("positions", value, 0) for value in (np.nan, 1e3, 1e300)},
        "at the finish": trace("finish.positions", 1e20, 0),
        **{f"container {x}": trace("finish.container_position", x, 0) for x in (np.nan, 1e20)},
    },
    "wrong speed of a ball": {"at the finish": trace("finish.velocities", np.nan, 0)},
    "wrong speed of the container": {
        "at the finish": trace("finish.container_velocity", np.nan, 0)
    },
    "wrong radius, mass or length": {
        f"{name} {value}": scene(name, value, 0)
        for name in ("radii", "masses")
        for value in AMOUNTS
    },
    "wrong mass of the container": {"zero": scene("container_mass", 0.0)},
    "wrong restitution": {
        f"{value!r}": rules(restitution=value) for value in (2.0, -1.0, "a", None, True)
    },
    "wrong contact_duration": {"above 1": rules(contact_duration=1.5)},
    "wrong surface": {
        **{f"{value!r}": rules(surface=value) for value in ("a", 1, [], {}, SURFACE | {"x": 1})},
        **{
            f"{key} {value!r}": rules(surface=SURFACE | {key: value})
            for key in ("inertia", "tangential_cor", "wall_friction")
            for value in (-2, True, "a", np.nan)
        },
        "inertia none": rules(surface=SURFACE | {"inertia": None}),
    },
    "wrong rules": {"slides": rules(slides=True), "all slide": scene("slides", True)},
    "wrong number of events": {
        "too few": trace("wall_events", 0),
        "too many": trace("wall_events", 10**9),
        "none at the wall": ending(wall_events=0, pair_events=150),
    },
    "wrong ending": {
        "tiny times": times(5e-324),
        **{f"time {value}": trace("stop.time", value) for value in (np.nan, np.inf, -1.0)},
        "time as text": ending(time=ESCAPES),
        "no time": ending(reason="time", time=0.0),
        "impulse": ending(reason="wall_trap", accumulation_time=1e9, impulse_to_come=-1.0),
        "counts below zero": ending(wall_events=-1),
    },
    "wrong balls in an ending": {"99": trace("stop.balls", (99,))},
    "wrong end, which is before an event": {"early": trace("stop.time", 0.1)},
    "wrong rows of its repeats": {
        "back": parameter("rows", lambda ends: ends[[0, 2, 1, 3]]),
        "beyond": parameter("rows", lambda ends: np.append(ends[:-1], 10**15)),
        "one time less": dataset(TIME, one_less),
    },
    "wrong lengths of the columns": {
        "one less": dataset(f"{layout.EVENTS['impulse']}/value", one_less)
    },
    "has neither numbers nor text of fixed length": {
        **{
            f"{name} of {place}": attribute("scene", h5py.Empty(kind), place)
            for place in (layout.PARAMETERS, "unread")
            for name, kind in TYPES.items()
        },
        "dataset of compounds": dataset(TIME, filled(lambda rows: np.zeros(rows, "f8, S9"))),
        "dataset of texts": dataset(TIME, filled(lambda rows: ["a"] * rows)),
    },
    "neither a group nor a dataset": {"type by name": parameter("named", np.dtype("f8"))},
    "is stored in a way that snooker does not use": {
        "external": dataset(TIME, external),
        "another filter": dataset(
            TIME, lambda file, name, rows: file.create_dataset(name, (rows,), "f8", scaleoffset=3)
        ),
        "many chunks of one row": dataset(TIME, declared(3 * 10**7, 1)),
        "large chunk": dataset(TIME, declared(None, 5 * 10**8)),
    },
    "it has a link to another place": {
        "soft": linked(h5py.SoftLink("/observables/impulse/value")),
        "external": linked(h5py.ExternalLink("/etc/passwd", "/data")),
    },
    "too many links": {
        "groups": edited(lambda file: [file.create_group(f"g{number}") for number in range(1100)])
    },
    "has a chunk that is missing": {
        "one": dataset(TIME, declared(None, ROWS)),
        "each": dataset(TIME, declared(5 * 10**8, ROWS)),
    },
    "it unpacks to more than": {"zeros": dataset(TIME, zeros(8 * 10**7))},
    "a chunk has another size than it declares": {
        "a bomb": dataset(TIME, chunk(BOMB)),
        "too short": dataset(TIME, chunk(SHORT)),
    },
    " bytes, and ": {
        "wide text": dataset(
            layout.ENDINGS, lambda file, name, _: file.create_dataset(name, (3,), "S1000000000")
        ),
    },
}
"""Damages by a part of the reason why the file is refused."""

OTHERS: dict[str, Damage] = {
    "far: all times × 1e20": times(1e20),
    "fast: 1e150 m/s": scene("velocities", 1e150, 0),
    "rule: a box": rules(shape="box"),
    "stop: balls": trace("stop.balls", (10**30,)),
    "stop: reason": ending(reason=ESCAPES),
    "stop: message": trace("stop.message", ESCAPES),
    "ending: null": parameter("ending", np.array([b"null"] * 3)),
    "rows: none": parameter("rows", np.zeros(0, np.int64)),
    "repeats: twice": parameter("repeat", np.array([0, 0, 2])),
    "repeats: large": parameter("repeat", np.array([-1, 1, 2**62])),
    "provenance: command": provenance(command=ESCAPES),
    "provenance: config of another": provenance(config='{"collisions": 149}'),
    "provenance: config of nothing": provenance(config=ESCAPES),
    "provenance: point": provenance(point="0"),
    "provenance: deep": parameter("provenance", np.bytes_(DEEP.encode())),
    "version: text": attribute("schema_version", ESCAPES),
    "scene: bytes": attribute("scene", np.bytes_(b"\xff\x1b")),
    "storage: no deflate stream": dataset(TIME, chunk(b"\x78\x01" + bytes(range(255, 0, -1)))),
    "storage: lost link": linked(h5py.SoftLink("/nowhere")),
    "storage: 4e8 repeats": dataset(layout.REPEATS, declared(4 * 10**8, 1000)),
    "storage: no array": dataset(TIME, filled(lambda _: 1.0)),
    "unread: a circle of groups": edited(
        lambda file: file.__setitem__("particles/again", file["particles"])
    ),
    "file: noise": text(bytes(range(256)) * 40),
    "file: a folder": folder,
    "file: a pipe": fifo,
    "file: a loop": loop,
    "file: endless": endless,
    "file: 200 GB": holes,
}
"""Damages with other reasons, or of parts that not all commands read."""

REPEATS = {f"{reason}: {name}": d for reason, group in REFUSED.items() for name, d in group.items()}
REPEATS |= OTHERS
"""By name; the file has three repeats of seven balls and up to 150 events each."""


def surface(**numbers: Any) -> Damage:
    """Changes numbers of the surface of rough balls."""
    return rules(surface=SURFACE | numbers)


def gone(name: str) -> Damage:
    return edited(lambda file: file.__delitem__(name))


ROUGH: dict[str, dict[str, Damage]] = {
    "wrong columns of events": {
        "none along the tangent": gone(layout.EVENTS["tangential"]),
        "no surface": rules(surface=None),
    },
    "wrong tangential impulse of an event": {
        f"{value}": event("tangential", value) for value in (np.nan, np.inf)
    },
    "wrong lengths of the columns": {
        "one less": dataset(f"{layout.EVENTS['tangential']}/value", one_less)
    },
    "wrong surface": {
        **{f"{value}": rules(surface=value) for value in (1.0, [])},
        "too few numbers": rules(surface={"inertia": 0.5}),
        "inertia 0": surface(inertia=0.0),
        "tangential_cor 2": surface(tangential_cor=2.0),
        "friction -1": surface(friction=-1.0),
        "friction true": surface(friction=True),
    },
    "wrong number of spins": {
        "none": gone(SPIN),
        "too few": dataset(f"{SPIN}/value", filled(lambda _: np.zeros((6, 6)))),
    },
    "wrong spin of a ball": {
        f"{end} {value}": trace(f"{end}.spins", value, 3)
        for end in ("start", "finish")
        for value in (np.nan, 1e300)
    },
    "wrong speed of a ball": {"fast spin at the finish": trace("finish.spins", 1e100, 3)},
}
"""Damages of a file with rough balls by a part of the reason why it is refused."""


def edges(*values: float) -> Damage:
    """Changes the lengths of the container of a box."""
    return dataset(f"{layout.BALLS}/box/edges", filled(lambda _: values))


def summary(name: str, make: Make) -> Damage:
    """Makes a column of the summary anew."""
    return dataset(f"{layout.SUMMARY}/{name}/value", make)


COLUMNS = [field.name for field in fields(Series) if field.default is MISSING]
"""The columns of a summary that all scenes have."""

KINDS: dict[str, dict[str, Damage]] = {
    "events": REPEATS,
    "summary": {
        **{
            f"{name}: {value}": trace(f"summary.series.{name}", value, 1)
            for name in COLUMNS
            for value in WRONG
        },
        **{f"last {name}: 0": trace(f"summary.series.{name}", 0.0, -1) for name in GROWING},
        "kinetic_energy: none at first": trace("summary.series.kinetic_energy", 0.0, 0),
        "speed_histogram: negative": trace("summary.speed_histogram", -1, -1),
        "one time": summary("time", filled(lambda _: [0.0])),
        "1e15 times": summary("time", declared(10**15, 65536)),
        "a bomb": summary("time", chunk(BOMB)),
        "counts in one column": summary("speed_histogram", declared(450, None)),
        "a box": rules(shape="box"),
    },
    "rough": {
        **{f"{reason}: {name}": d for reason, some in ROUGH.items() for name, d in some.items()},
        "rougher": rules(surface=SURFACE | {"tangential_cor": 1.0}),
        "slides": rules(slides=True),
    },
    "box": {
        **{f"edges {sides}": edges(*sides) for sides in ((), (20.0,), (0.0, 14.0))},
        **{f"edge {side}": edges(side, side) for side in (*WRONG, 1e-300)},
        "a periodic box": rules(shape="periodic"),
        "a circle": rules(shape="circle"),
        "slides": rules(slides=True),
        "partner": event("j", -2),
        "far": scene("positions", 1e300, 0),
    },
}
"""Damages of a file with events, of one with a summary, of rough balls, and of one in a box."""


def with_large_indices(file: h5py.File) -> None:
    """Kernels would write outside of their arrays."""
    for values in file[layout.CHECKPOINT].values():
        if values.dtype.kind == "i":
            values[...] = LARGE


CHECKPOINTS: dict[str, Damage] = {
    "indices": edited(with_large_indices),
    "a number as hash": attribute("content", 1, layout.CHECKPOINT),
    "nothing": edited(lambda file: file[layout.CHECKPOINT].clear()),
    "a bomb": dataset(f"{layout.CHECKPOINT}/bomb", chunk(BOMB)),
    "too short": dataset(f"{layout.CHECKPOINT}/short", chunk(SHORT, 4_000_000)),
}
"""Damages of a file with a checkpoint; its hash, which needs the user's key, stays."""


def manifest(name: str, value: Any) -> Damage:
    """Changes a value of the manifest; those of ``experiment`` one by one."""

    def damage(path: Path) -> None:
        content = json.loads(path.read_text())
        both = isinstance(value, dict) and isinstance(content.get(name), dict)
        content[name] = content[name] | value if both else value
        path.write_text(json.dumps(content))

    return damage


MANIFESTS: dict[str, Damage] = {
    "deep": text(DEEP),
    "deep inside": text('{"experiment": ' + "[" * 900 + "]" * 900 + "}"),
    "many digits": text('{"engine_version": ' + "9" * 5000 + "}"),
    "escapes": text(json.dumps({ESCAPES: 1})),
    **{f"a {json.dumps(value)}": text(json.dumps(value)) for value in (None, "a", {}, [[]])},
    **{
        f"{name} {json.dumps(value)[:20]}": manifest(name, value)
        for name, values in (
            ("experiment", (None, [], {"cor": 5}, {"repeats": 10**9}, {"title": ESCAPES})),
            ("experiment", ({"sweep": {ESCAPES: [1]}}, {f"key{n}": n for n in range(999)})),
            ("points", (None, [1], {}, [{"digest": ESCAPES}] * 2)),
            ("engine_version", (None, "a", 10**30, 1e300)),
            ("engine", ("none", ESCAPES, {})),
            ("schema_version", (None, 99, 1e999, [], ESCAPES)),
        )
        for value in values
    },
    "a pipe": fifo,
    "a folder": folder,
    "a loop": loop,
    "endless": endless,
    "200 GB": holes,
}

BESIDE: dict[str, tuple[str, Damage]] = {
    f"{name} {title}": (name, damage)
    for name in ("failures.jsonl", "figures/energy.json")
    for title, damage in {
        **{
            f"{content[:24]!r}": text(content)
            for content in (
                DEEP,
                "[1, 2]",
                '{"point": 1e999, "repeat": 0, "error": "a"}',
                '{"point": 0, "repeat": null, "error": []}',
            )
        },
        **{kind.__name__: kind for kind in (fifo, folder, endless, holes)},
    }.items()
}
"""Other files of a run, by name."""


def plant_modules(folder: Path) -> None:
    """Modules that raise an error if Python takes them instead of its own, or of a library's."""
    names = "multiprocessing numba numpy h5py pydantic rich typer yaml json signal tempfile socket"
    for name in (*names.split(), "distributed", "matplotlib", "concurrent", "logging"):
        (folder / f"{name}.py").write_text(f"raise SystemExit('{name} of the current folder')")


def damaged(path: Path, damages: dict[str, Damage], chosen: slice = ALL) -> Iterator[str]:
    """The name of each of some damages, while the file at a path has it."""
    good = path.read_bytes()
    for name, damage in [*damages.items()][chosen]:
        damage(path)
        yield name
        if path.is_dir():
            path.rmdir()
        path.unlink(missing_ok=True)
        path.write_bytes(good)
