"""Files that a stranger may send: each is made from a good one, and its hashes are right again."""

from __future__ import annotations

import json
import math
import os
import shutil
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from snooker_cli import store
from snooker_cli.store import file_format as layout
from snooker_cli.trace import SERIES_UNITS, Series, Summary, Trace

Damage = Callable[[Path], object]
"""Changes the good file at a path, or replaces it."""

Make = Callable[[h5py.File, str, int], object]
"""Makes a dataset of this name, which had this many rows."""

ESCAPES = "a\x1b[2J\x1b]0;b\x07\x9b1m\u202egpj.exe\u2066\r\n\u200b$\\frac<script>"
"""Clears a terminal, names its window, and turns text round."""

DEEP = "[" * 200_000
LARGE = 2**31 - 1
TIME, PAIRS = f"{layout.TIME}/value", f"{layout.COLLISIONS}/value"


def with_traces(change: Callable[[Trace], Trace]) -> Damage:
    """Writes changed traces as snooker does, with right hashes."""

    def damage(path: Path) -> None:
        found = store.read(path)
        changed = [(header.repeat, change(trace)) for trace, header in found]
        store.write(path, changed, found[0][1].provenance)

    return damage


def trace(places: str, value: Any, row: int | None = None) -> Damage:
    """Changes fields of each trace, such as ``finish.positions``; with a row one number of them."""

    def changed(part: Any, names: list[str]) -> Any:
        if names:
            name, *inner = names
            return replace(part, **{name: changed(getattr(part, name), inner)})
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
        stop = replace(before.stop, time=factor * before.stop.time)
        return replace(before, events=events, stop=stop)

    return with_traces(change)


def tiny_times(trace: Trace) -> Trace:
    assert trace.events is not None
    times = np.full_like(trace.events.time, 5e-324)
    return replace(trace, events=replace(trace.events, time=times))


def no_residual(before: Trace) -> Trace:
    assert before.events is not None
    column = np.full(len(before.events), np.nan)
    return replace(before, events=replace(before.events, residual=column))


def no_rows(before: Trace) -> Trace:
    """A summary without times."""
    assert before.summary is not None
    columns = {name: values[:0] for name, values in vars(before.summary.series).items()}
    counts = before.summary.speed_histogram[:0]
    return replace(before, summary=Summary(Series(**columns), counts))


@contextmanager
def resealed(path: Path) -> Iterator[h5py.File]:
    """A file to change; then the hash over its parameters is right again."""
    with h5py.File(path, "r+") as file:
        yield file
        held = file[layout.PARAMETERS]
        contents = [text.decode() for text in held["content"][()]]
        numbers = held["repeat"][()].tolist()
        source = held["provenance"][()].decode()
        held.attrs["content"] = np.bytes_(layout.seal(source, numbers, contents), "ascii")


def parameter(name: str, values: Any) -> Damage:
    """Replaces a dataset of the parameters."""

    def damage(path: Path) -> None:
        with resealed(path) as file:
            file[layout.PARAMETERS].pop(name, None)
            file[f"{layout.PARAMETERS}/{name}"] = values

    return damage


def rows(change: Callable[[Any], Any]) -> Damage:
    """Changes the rows at which repeats begin and end."""

    def damage(path: Path) -> None:
        with h5py.File(path) as file:
            ends = file[layout.ROWS][()]
        parameter("rows", change(ends))(path)

    return damage


def provenance(**values: Any) -> Damage:
    def damage(path: Path) -> None:
        with h5py.File(path) as file:
            source = json.loads(file[layout.PROVENANCE][()])
        parameter("provenance", np.bytes_(json.dumps(source | values), "ascii"))(path)

    return damage


def ending(**values: Any) -> Damage:
    def damage(path: Path) -> None:
        with h5py.File(path) as file:
            found = file[layout.ENDINGS][()]
        texts = [json.dumps(json.loads(text) | values) for text in found]
        parameter("ending", np.array(texts, np.bytes_))(path)

    return damage


def attribute(name: str, value: Any, place: str = layout.PARAMETERS) -> Damage:
    """Gives an object an attribute; a text as bytes."""

    def damage(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            text = isinstance(value, str)
            file.require_group(place).attrs[name] = np.bytes_(value.encode()) if text else value

    return damage


def rules(**values: Any) -> Damage:
    """Changes the JSON of the scene."""

    def damage(path: Path) -> None:
        with h5py.File(path) as file:
            held = json.loads(file[layout.PARAMETERS].attrs["scene"])
        attribute("scene", json.dumps(held | values))(path)

    return damage


def dataset(name: str, make: Make) -> Damage:
    """Makes a dataset anew, by a function that also gets the number of its rows."""

    def damage(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            unit, rows = dict(file[name].attrs), file[name].size
            del file[name]
            make(file, name, rows)
            file[name].attrs.update(unit)

    return damage


def declared(number: int | None, chunk: int | None) -> Make:
    """A dataset of this many rows, or as many as before, of which none is stored."""
    options: dict[str, Any] = {}
    if chunk:
        options = {"chunks": (chunk,), "maxshape": (None,), "shuffle": True, "compression": 1}
    return lambda file, name, rows: file.create_dataset(name, (number or rows,), "f8", **options)


def all_declared(rows: int) -> Damage:
    """All columns of events agree on their number, which no disk could hold."""

    def damage(path: Path) -> None:
        for name, rest in ((TIME, ()), (f"{layout.IMPULSE}/value", ()), (PAIRS, (1, 2))):
            with h5py.File(path, "r+") as file:
                kind = file[name].dtype
                del file[name]
                chunk = (65536, *rest)
                options = {"chunks": chunk, "shuffle": True, "compression": 1}
                data = file.create_dataset(name, (rows, *rest), kind, **options)
                data[0] = 0
        parameter("rows", np.array([0, 1, 2, rows], np.int64))(path)
        with h5py.File(path) as file:
            found = [json.loads(text) for text in file[layout.ENDINGS][()]]
        counts = ({"pair_events": each, "wall_events": 0} for each in (1, 1, rows - 2))
        texts = [json.dumps(one | each) for one, each in zip(found, counts, strict=True)]
        parameter("ending", np.array(texts, np.bytes_))(path)

    return damage


def bomb(name: str) -> Damage:
    """A dataset in a chunk of 1.6 MB that unpacks to 1.6 GB."""

    def damage(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            rows = file[name].shape[0] if name in file else 450
            if name in file:
                del file[name]
            declared(rows, rows)(file, name, rows)
            deflate = zlib.compressobj(9, wbits=-zlib.MAX_WBITS)
            piece = deflate.compress(bytes(1 << 24)) + deflate.flush(zlib.Z_FULL_FLUSH)
            file[name].id.write_direct_chunk((0,), b"\x78\x01" + 100 * piece)

    return damage


def filled(values: Callable[[int], Any]) -> Make:
    """A dataset with values that a function of the number of rows gives."""
    return lambda file, name, rows: file.create_dataset(name, data=values(rows))


one_less = filled(lambda rows: np.arange(rows - 1.0))


def external(file: h5py.File, name: str, rows: int) -> None:
    file.create_dataset(name, (rows,), "f8", external=[("/etc/passwd", 0, 8 * rows)])


def virtual(file: h5py.File, name: str, rows: int) -> None:
    held = h5py.VirtualLayout((rows,), "f8")
    held[:] = h5py.VirtualSource("other.h5", "data", (rows,))
    file.create_virtual_dataset(name, held)


def linked(link: Any) -> Damage:
    def damage(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            del file[TIME]
            file[TIME] = link

    return damage


def many_groups(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        for number in range(1100):
            file.create_group(f"g{number}")


def circle_of_groups(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file["particles/again"] = file["particles"]


def fifo(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


def loop(path: Path) -> None:
    path.unlink()
    path.symlink_to(path)


def cut(share: float) -> Damage:
    return lambda path: path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])


AMOUNTS = (0.0, -1.0, np.nan, np.inf, 5e-324, 1e300)
WRONG = (np.nan, np.inf, -1.0, 1e300)
TYPES = {
    "text": h5py.string_dtype(),
    "sequence": h5py.vlen_dtype("i1"),
    "compound": np.dtype("f8, S9"),
}

REFUSED: dict[str, dict[str, Damage]] = {
    "wrong ball in an event": {
        **{f"i = {value}": event("i", value) for value in (LARGE, 7, -1, -(2**31))},
        **{f"j = {value}": event("j", value) for value in (LARGE, 7, -2, -3, -(2**31))},
    },
    "wrong order of the times": {f"{value}": event("time", value) for value in WRONG},
    "wrong impulse": {f"{value}": event("impulse", value) for value in WRONG},
    "wrong residual": {"nan": with_traces(no_residual)},
    "squares of speed times distance": {
        f"speed {value}": scene("velocities", value, 0) for value in (1e200, np.inf)
    },
    "wrong place of a ball": {
        **{
            f"at {value}": scene("positions", value, 0)
            for value in (np.nan, np.inf, 1e3, 1e20, 1e300)
        },
        **{
            f"finish at {value}": trace("finish.positions", value, 0)
            for value in (np.nan, 1e20, 1e300)
        },
        "container": trace("finish.container_position", np.nan, 0),
    },
    "wrong speed of a ball": {
        f"finish {value}": trace("finish.velocities", value, 0) for value in (np.nan, 1e20, 1e300)
    },
    "wrong place of the container": {
        f"{value}": trace("finish.container_position", value, 0) for value in (1e20, 1e300)
    },
    "wrong speed of the container": {
        "all at rest": trace("start.velocities finish.velocities", np.zeros((7, 2))),
        "away": scene("container_position", 1.0, 0),
        "moves": scene("container_velocity", 1.0, 0),
        **{
            f"{value}": trace("finish.container_velocity", value, 0)
            for value in (np.nan, 1e20, 1e300)
        },
    },
    "wrong radius, mass or length": {
        **{f"radius {value}": scene("radii", value, 0) for value in AMOUNTS},
        **{f"mass {value}": scene("masses", value, 0) for value in AMOUNTS},
    },
    "wrong mass of the container": {
        f"{value}": scene("container_mass", value) for value in (-1.0, 0.0, np.nan)
    },
    "wrong restitution": {
        f"{value!r}": rules(restitution=value) for value in (2.0, -1.0, "a", None, [], True)
    },
    "wrong contact_duration": {
        f"{value!r}": rules(contact_duration=value) for value in (-1.0, 1.5, math.inf, {})
    },
    "wrong rules": {
        **{f"slides {value}": rules(slides=value) for value in (True, 2)},
        "all slide": scene("slides", True),
    },
    "wrong number of events": {
        "too many": trace("wall_events", 10**9),
        "none at the wall": ending(wall_events=0, pair_events=150),
    },
    "wrong ending": {
        **{f"times {factor} of them": times(factor) for factor in (5e-324, 1e-300)},
        **{f"time {value}": trace("stop.time", value) for value in (np.nan, np.inf, -1.0, 5e-324)},
        "time as text": ending(time=ESCAPES),
        "no time": ending(reason="time", time=0.0),
        "impulse": ending(reason="wall_trap", accumulation_time=1e9, impulse_to_come=-1.0),
        "counts below zero": ending(wall_events=-1),
        "counts that are no numbers": ending(wall_events="a", pair_events=[1]),
    },
    "wrong balls in an ending": {"99": trace("stop.balls", (99,))},
    "wrong end, which is before an event": {"early": trace("stop.time", 0.1)},
    "wrong rows of its repeats": {
        "back": rows(lambda ends: ends[[0, 2, 1, 3]]),
        "beyond": rows(lambda ends: np.append(ends[:-1], 10**15)),
        "below": rows(lambda ends: np.append(-ends[-1], ends[1:])),
        "one time less": dataset(TIME, one_less),
    },
    "wrong lengths of the columns": {"one less": dataset(f"{layout.IMPULSE}/value", one_less)},
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
        "virtual": dataset(TIME, virtual),
        "another filter": dataset(
            TIME, lambda file, name, rows: file.create_dataset(name, (rows,), "f8", scaleoffset=3)
        ),
    },
    "it has a link to another place": {
        "soft": linked(h5py.SoftLink("/observables/impulse/value")),
        "external": linked(h5py.ExternalLink("/etc/passwd", "/data")),
        "own": linked(h5py.ExternalLink("repeats-0000-0002.h5", TIME)),
    },
    "too many links": {"groups": many_groups},
    "a group with two names": {"a circle": circle_of_groups},
    "a chunk has another size than it declares": {"a bomb": bomb(TIME)},
    " bytes, and ": {
        "4e8 events": all_declared(4 * 10**8),
        "1e15 events": all_declared(10**15),
        "large chunk": dataset(TIME, declared(None, 5 * 10**8)),
        "4e8 balls": dataset("particles/balls/radius", declared(4 * 10**8, 1000)),
        "wide text": dataset(
            layout.ENDINGS, lambda file, name, _: file.create_dataset(name, (3,), "S1000000000")
        ),
    },
}
"""Damages by a part of the reason why the file is refused."""

OTHERS: dict[str, Damage] = {
    "event: time 5e-324 of all": with_traces(tiny_times),
    "event: residual 1e149": event("residual", 1e149),
    "far: all times × 1e20": times(1e20),
    "fast: 1e150 m/s": scene("velocities", 1e150, 0),
    **{f"rule: shape {value!r}": rules(shape=value) for value in ("box", "none", [1], None)},
    "rule: unknown": rules(unknown=1),
    "container: place": scene("container_position", np.nan, 0),
    **{f"stop: balls {value}": trace("stop.balls", value) for value in ((-5,), ("a",), (10**30,))},
    "stop: no list": ending(balls=5),
    "stop: reason": ending(reason=ESCAPES),
    "stop: message": trace("stop.message", ESCAPES),
    "stop: no text": ending(message=[1]),
    **{
        f"ending: {text[:8]!r}": parameter("ending", np.array([text] * 3))
        for text in (b"{", b"[1]", DEEP.encode(), b'{"time": 1e999}')
    },
    "rows: none": parameter("rows", np.zeros(0, np.int64)),
    **{
        f"repeats: {numbers}": parameter("repeat", np.array(numbers, np.int64))
        for numbers in ([-1, 1, 2], [0, 0, 2], [0, 1, 2**62], [])
    },
    **{
        f"provenance: {name} {json.dumps(value)[:12]}": provenance(**{name: value})
        for name, values in {
            "point": ("0", -1, 10**30),
            "versions": (["a"],),
            "command": (ESCAPES,),
            "machine": (None,),
            "seconds": ("a",),
            "engine": (ESCAPES,),
            "engine_version": (10**30,),
            "digest": (ESCAPES,),
            "config": ("{", DEEP, "[]", '{"collisions": 1000000000000000}'),
            "unknown": (1,),
        }.items()
        for value in values
    },
    "provenance: not JSON": parameter("provenance", np.bytes_(b"{")),
    "provenance: deep": parameter("provenance", np.bytes_(DEEP.encode())),
    "provenance: an array": dataset(layout.PROVENANCE, filled(lambda _: np.zeros(1000))),
    "version: text": attribute("schema_version", ESCAPES),
    "scene: deep": attribute("scene", DEEP),
    "scene: a list": attribute("scene", "[1]"),
    "scene: bytes": attribute("scene", np.bytes_(b"\xff\x1b")),
    "storage: lost link": linked(h5py.SoftLink("/nowhere")),
    "storage: 1e15 times": dataset(TIME, declared(10**15, 65536)),
    "storage: 4e8 impulses": dataset(f"{layout.IMPULSE}/value", declared(4 * 10**8, None)),
    "storage: 4e8 repeats": dataset(layout.REPEATS, declared(4 * 10**8, 1000)),
    "storage: no array": dataset(TIME, filled(lambda _: 1.0)),
    "storage: a group": dataset(TIME, lambda file, name, _: file.create_group(name)),
    "file: empty": lambda path: path.write_bytes(b""),
    "file: noise": lambda path: path.write_bytes(bytes(range(256)) * 40),
    "file: signature": lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n" * 9),
    **{f"file: {share} of it": cut(share) for share in (0.2, 0.6, 0.95)},
    "file: a folder": folder,
    "file: a pipe": fifo,
    "file: a loop": loop,
}
"""Damages with other reasons, or of parts that not all commands read."""

REASONS = {f"{reason}: {name}": reason for reason, names in REFUSED.items() for name in names}
REPEATS = {f"{reason}: {name}": d for reason, group in REFUSED.items() for name, d in group.items()}
REPEATS |= OTHERS
"""By name; the file has three repeats of seven balls and up to 150 events each."""


def edges(*values: float) -> Damage:
    """Changes the lengths of the container of a box."""
    return dataset(f"{layout.BALLS}/box/edges", filled(lambda _: values))


def summary(name: str, make: Make) -> Damage:
    """Makes a column of the summary anew."""
    return dataset(f"{layout.SUMMARY}/{name}/value", make)


def no_pair_events(trace: Trace) -> Trace:
    assert trace.summary is not None
    changed = replace(trace.summary.series, pair_events=0 * trace.summary.series.pair_events)
    return replace(trace, summary=replace(trace.summary, series=changed))


KINDS: dict[str, dict[str, Damage]] = {
    "summary": {
        **{
            f"{name}: {value}": trace(f"summary.series.{name}", value, 1)
            for name in SERIES_UNITS
            for value in WRONG
        },
        **{
            f"last {name}: {value}": trace(f"summary.series.{name}", value, -1)
            for name in ("time", "wall_impulse", "pair_virial", "wall_events", "pair_events")
            for value in (0.0, 5e-324)
        },
        "all pair_events: 0.0": with_traces(no_pair_events),
        "first kinetic_energy": trace("summary.series.kinetic_energy", 0.0, 0),
        **{
            f"speed_histogram: {value}": trace("summary.speed_histogram", value, -1)
            for value in (-1, 10**6, 2**62)
        },
        "no rows": with_traces(no_rows),
        "one time": summary("time", filled(lambda _: [0.0])),
        "1e15 times": summary("time", declared(10**15, 65536)),
        "a bomb": bomb(f"{layout.SUMMARY}/time/value"),
        "counts in one column": summary("speed_histogram", declared(450, None)),
        "1e15 counts": summary("speed_histogram", declared(10**15, 65536)),
        "no repeats": parameter("rows", np.zeros(0, np.int64)),
        "repeats beyond": parameter("rows", np.array([0, 10**15])),
        "a box": rules(shape="box"),
        "half a file": cut(0.5),
    },
    **{
        shape: {
            **{f"edges {sides}": edges(*sides) for sides in ((), (20.0,), (0.0, 14.0))},
            **{f"edge {side}": edges(side, side) for side in (*WRONG, 1e-300)},
            **{
                f"a {other}": rules(shape=other)
                for other in ("circle", "box", "periodic")
                if other != shape
            },
            "slides": rules(slides=True),
            "partner": event("j", -2),
            "far": scene("positions", 1e300, 0),
            "fast": scene("velocities", 1e300, 0),
        }
        for shape in ("box", "periodic")
    },
}
"""Damages of a file with a summary, and of files in other containers."""


def of_checkpoint(change: Callable[[h5py.Group], object]) -> Damage:
    """Changes the checkpoint of a file; its hash, which needs the user's key, stays."""

    def damage(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            change(file[layout.CHECKPOINT])

    return damage


def with_large_indices(checkpoint: h5py.Group) -> None:
    """Kernels would write outside of their arrays."""
    for name in checkpoint:
        if checkpoint[name].dtype.kind == "i":
            checkpoint[name][...] = LARGE


CHECKPOINTS: dict[str, Damage] = {
    "indices": of_checkpoint(with_large_indices),
    "a number as hash": of_checkpoint(lambda group: group.attrs.__setitem__("content", 1)),
    "nothing": of_checkpoint(lambda group: group.clear()),
    "a bomb": bomb(f"{layout.CHECKPOINT}/bomb"),
}
"""Damages of a file with a checkpoint, of which only the checkpoint is wrong."""


def text(content: str | bytes) -> Damage:
    data = content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
    return lambda path: path.write_bytes(data)


def manifest(**values: Any) -> Damage:
    """Changes values of the manifest; those of ``experiment`` one by one."""

    def damage(path: Path) -> None:
        content = json.loads(path.read_text())
        inner = values.get("experiment")
        if isinstance(inner, dict):
            content["experiment"] |= inner
        path.write_text(json.dumps(content | {} if isinstance(inner, dict) else content | values))

    return damage


MANIFESTS: dict[str, Damage] = {
    "empty": text(""),
    "not JSON": text("{"),
    "deep": text(DEEP),
    "deep inside": text('{"experiment": ' + "[" * 900 + "]" * 900 + "}"),
    "bytes": text(b"\xff\xfe\x00"),
    "large": text('{"engine_version": 1e999, "experiment": {}}'),
    "many digits": text('{"engine_version": ' + "9" * 5000 + "}"),
    "escapes": text(json.dumps({ESCAPES: 1})),
    **{f"a {json.dumps(each)}": text(json.dumps(each)) for each in ([], None, 1, "a", {}, [[]])},
    **{
        f"{name} {json.dumps(value)[:20]}": manifest(**{name: value})
        for name, values in (
            ("experiment", (None, [], "a", 1, {"cor": 5}, {"repeats": 10**9}, {ESCAPES: 1})),
            ("experiment", ({"title": ESCAPES}, {"title": 5}, {"sweep": {ESCAPES: [1]}})),
            ("experiment", ({"balls": {"list": [{}] * 999}}, {f"key{n}": n for n in range(999)})),
            ("points", (None, [], [1], {}, [{"digest": ESCAPES}] * 2, [{}] * 2)),
            ("engine_version", (None, "a", 0, 10**30, 1e300, [])),
            ("engine", ("none", ESCAPES, {}, 1)),
            ("schema_version", (None, "a", 99, 10**30, 1e999, [], ESCAPES)),
        )
        for value in values
    },
    "a pipe": fifo,
    "a folder": folder,
    "a loop": loop,
}

BESIDE: dict[str, tuple[str, Damage]] = {
    f"{name} {content[:24]!r}": (name, text(content))
    for name in ("failures.jsonl", "analysis.json", "figures/energy.json")
    for content in (
        DEEP,
        "{",
        "[1, 2]",
        "null",
        '{"point": 1e999, "repeat": 0, "error": "a"}',
        '{"point": 0, "repeat": null, "error": []}',
        json.dumps({"point": 0, "repeat": 0, "error": ESCAPES}),
        json.dumps({"0": {"made_from": ESCAPES, "rows": 5, "notes": 5}}),
    )
}
"""Other files of a run, by name."""

GOOD = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 1, radius: 1.0, speed: 10.0}
cor: 0.85
collisions: 150
"""


def configs(size: int) -> dict[str, str | bytes]:
    """Texts of configs with about as many characters."""
    n = size // 8
    return {
        "deep": "[" * 8 * n,
        "deep mapping": "a: " * 3 + "{a: " * 2 * n,
        "wide": "a: [" + "[], " * 2 * n + "]",
        "laughs": "\n".join(f"a{k}: &a{k} [{f'*a{k - 1}, ' * 10}]" for k in range(12)),
        "unknown keys": GOOD + "".join(f"k{k}: 1\n" for k in range(n * 4 // 5)),
        "one key many times": GOOD + "cor: 1\n" * n,
        "keys with escapes": GOOD + json.dumps({ESCAPES: ESCAPES})[1:-1],
        "title with escapes": GOOD + f"title: {json.dumps(ESCAPES)}",
        "raw escapes": GOOD + "title: \x1b[2J",
        "many large numbers": "a: [" + "1e999, " * n + "]",
        "many digits": GOOD + "seed: " + "9" * 7 * n,
        "many balls": "cor: 1\nballs: {list: [" + "{}, " * 2 * n + "]}",
        "one too many bytes": GOOD + "#" * (1 << 18),
        "long line": GOOD + "title: " + "a" * 7 * n,
        "many documents": "---\n" * 2 * n,
        "many quotes": '"' * (7 * n + 1),
        "many question marks": "? " * 4 * n,
        "bytes": b"\xff\xfe\x00\x1b",
        "zeros": b"\0" * 8 * n,
        "empty": "",
    }


class Corpus:
    """Damaged files, made once from a good one.

    good : the file that is damaged
    folder : where they are kept
    """

    def __init__(self, good: Path, folder: Path, damages: dict[str, Damage]) -> None:
        self.folder, self.damages = folder, damages
        self.kept: dict[str, bytes] = {}
        for number, (name, damage) in enumerate(damages.items()):
            path = folder / str(number) / good.name
            path.parent.mkdir(parents=True)
            shutil.copy(good, path)
            damage(path)
            if path.is_file():
                self.kept[name] = path.read_bytes()

    def each(self, path: Path, chosen: slice) -> Iterator[str]:
        """The name of each of some damages, while the file at a path has it."""
        good = path.read_bytes()
        for name, damage in [*self.damages.items()][chosen]:
            if name in self.kept:
                path.write_bytes(self.kept[name])
            else:
                damage(path)
            yield name
            if path.is_dir():
                path.rmdir()
            path.unlink(missing_ok=True)
            path.write_bytes(good)
