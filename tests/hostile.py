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


def event(name: str, value: float, row: int = 5) -> Damage:
    """Changes a number of one event."""

    def change(trace: Trace) -> Trace:
        assert trace.events is not None
        column = getattr(trace.events, name)
        column = np.zeros(len(trace.events)) if column is None else column.copy()
        column[row] = value
        return replace(trace, events=replace(trace.events, **{name: column}))

    return with_traces(change)


def scene(name: str, value: Any) -> Damage:
    """Changes a value of the start and the finish; of arrays the first number."""

    def changed(before: Any) -> Any:
        if not isinstance(before, np.ndarray):
            return value
        values = before.copy()
        values.flat[0] = value
        return values

    def change(trace: Trace) -> Trace:
        start, finish = (
            replace(each, **{name: changed(getattr(each, name))})
            for each in (trace.start, trace.finish)
        )
        return replace(trace, start=start, finish=finish)

    return with_traces(change)


def times(factor: float) -> Damage:
    """Multiplies all times."""

    def change(trace: Trace) -> Trace:
        assert trace.events is not None
        later = replace(trace.events, time=factor * trace.events.time)
        return replace(trace, events=later, stop=replace(trace.stop, time=factor * trace.stop.time))

    return with_traces(change)


def at_rest(trace: Trace) -> Trace:
    start, finish = (
        replace(each, velocities=np.zeros_like(each.velocities))
        for each in (trace.start, trace.finish)
    )
    return replace(trace, start=start, finish=finish)


def finish(name: str, value: float) -> Damage:
    """Changes the first number of an array at the finish."""

    def change(trace: Trace) -> Trace:
        values = getattr(trace.finish, name).copy()
        values.flat[0] = value
        return replace(trace, finish=replace(trace.finish, **{name: values}))

    return with_traces(change)


def stop(**values: Any) -> Damage:
    return with_traces(lambda trace: replace(trace, stop=replace(trace.stop, **values)))


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


def attribute(name: str, value: Any) -> Damage:
    def damage(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            text = isinstance(value, str)
            file[layout.PARAMETERS].attrs[name] = np.bytes_(value.encode()) if text else value

    return damage


def typed(place: str, kind: Any) -> Damage:
    """Gives an object an attribute of this type."""

    def damage(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            file.require_group(place).attrs["scene"] = h5py.Empty(kind)

    return damage


def rules(**values: Any) -> Damage:
    """Changes the JSON of the scene."""

    def damage(path: Path) -> None:
        with h5py.File(path, "r+") as file:
            held = file[layout.PARAMETERS].attrs
            held["scene"] = np.bytes_(json.dumps(json.loads(held["scene"]) | values), "ascii")

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


SIZES = (0.0, -1.0, np.nan, np.inf, 5e-324, 1e300)

REPEATS: dict[str, Damage] = {
    **{f"event: i = {each}": event("i", each) for each in (LARGE, 7, -1, -(2**31))},
    **{f"event: j = {each}": event("j", each) for each in (LARGE, 7, -2, -3, -(2**31))},
    **{f"event: time {each}": event("time", each) for each in (np.nan, np.inf, -1.0, 1e300)},
    **{f"event: impulse {each}": event("impulse", each) for each in (np.nan, np.inf, -1.0, 1e300)},
    **{f"times: {each} of them": times(each) for each in (5e-324, 1e-300)},
    "ball: at rest": with_traces(at_rest),
    "ball: fast": scene("velocities", 1e200),
    "event: residual": event("residual", np.nan),
    **{f"ball at {each}": scene("positions", each) for each in (np.nan, np.inf)},
    **{f"ball far, at {each}": scene("positions", each) for each in (1e3, 1e20, 1e300)},
    "ball: speed": scene("velocities", np.inf),
    **{
        f"finish: {name} {value}": finish(name, value)
        for name in ("positions", "velocities", "container_position", "container_velocity")
        for value in (np.nan, 1e20, 1e300)
    },
    "container: away": scene("container_position", 1.0),
    "container: moves": scene("container_velocity", 1.0),
    **{f"ball: radius {each}": scene("radii", each) for each in SIZES},
    **{f"ball: mass {each}": scene("masses", each) for each in SIZES},
    "container: place": scene("container_position", np.nan),
    **{f"container: mass {each}": scene("container_mass", each) for each in (-1.0, 0.0, np.nan)},
    **{
        f"rule: {name} {value!r}": rules(**{name: value})
        for name, values in (
            ("restitution", (2.0, -1.0, "a", None, [], True)),
            ("slides", (True, 2)),
            ("contact_duration", (-1.0, 1.5, math.inf, {})),
            ("shape", ("box", "periodic", "none", [1], None)),
            ("unknown", (1,)),
        )
        for value in values
    },
    "rules: slides": scene("slides", True),
    "too many events": with_traces(lambda trace: replace(trace, wall_events=10**9)),
    "counts below zero": ending(wall_events=-1),
    "counts that are no numbers": ending(wall_events="a", pair_events=[1]),
    **{f"stop: balls {each}": stop(balls=each) for each in ((99,), (-5,), ("a",), (10**30,))},
    "stop: no list": ending(balls=5),
    **{f"stop: time {each}": stop(time=each) for each in (np.nan, np.inf, -1.0, 5e-324)},
    "stop: early": with_traces(
        lambda trace: replace(trace, stop=replace(trace.stop, time=0.9 * trace.stop.time))
    ),
    "stop: no time": ending(reason="time", time=0.0),
    "stop: impulse": ending(reason="wall_trap", accumulation_time=1e9, impulse_to_come=-1.0),
    "counts: at the wall": ending(wall_events=0, pair_events=150),
    "stop: time as text": ending(time=ESCAPES),
    "stop: reason": ending(reason=ESCAPES),
    "stop: message": stop(message=ESCAPES),
    "stop: no text": ending(message=[1]),
    "ending: not JSON": parameter("ending", np.array([b"{"] * 3)),
    "ending: a list": parameter("ending", np.array([b"[1]"] * 3)),
    "ending: deep": parameter("ending", np.array([DEEP.encode()] * 3)),
    "ending: large": parameter("ending", np.array([b'{"time": 1e999}'] * 3)),
    "rows: back": rows(lambda ends: ends[[0, 2, 1, 3]]),
    "rows: beyond": rows(lambda ends: np.append(ends[:-1], 10**15)),
    "rows: below": rows(lambda ends: np.append(-ends[-1], ends[1:])),
    "rows: none": parameter("rows", np.zeros(0, np.int64)),
    "repeats: below": parameter("repeat", np.array([-1, 1, 2])),
    "repeats: twice": parameter("repeat", np.array([0, 0, 2])),
    "repeats: large": parameter("repeat", np.array([0, 1, 2**62])),
    "repeats: none": parameter("repeat", np.zeros(0, np.int64)),
    **{
        f"provenance: {name} {json.dumps(value)[:12]}": provenance(**{name: value})
        for name, value in (
            ("point", "0"),
            ("point", -1),
            ("point", 10**30),
            ("versions", ["a"]),
            ("command", ESCAPES),
            ("machine", None),
            ("seconds", "a"),
            ("engine", {}),
            ("engine", ESCAPES),
            ("engine_version", 10**30),
            ("digest", ESCAPES),
            ("config", "{"),
            ("config", DEEP),
            ("config", "[]"),
            ("config", '{"collisions": 1000000000000000}'),
            ("unknown", 1),
        )
    },
    "provenance: not JSON": parameter("provenance", np.bytes_(b"{")),
    "provenance: deep": parameter("provenance", np.bytes_(DEEP.encode())),
    "provenance: an array": dataset(
        layout.PROVENANCE, lambda file, name, _: file.create_dataset(name, data=np.zeros(1000))
    ),
    "version: text": attribute("schema_version", ESCAPES),
    "scene: deep": attribute("scene", DEEP),
    "scene: a list": attribute("scene", "[1]"),
    "scene: shape": attribute("scene", json.dumps({"shape": [1]})),
    "scene: bytes": attribute("scene", np.bytes_(b"\xff\x1b")),
    **{
        f"type: {name} of {place}": typed(place, kind)
        for place in (layout.PARAMETERS, "unread")
        for name, kind in (
            ("text", h5py.string_dtype()),
            ("sequence", h5py.vlen_dtype("i1")),
            ("compound", np.dtype("f8, S9")),
        )
    },
    "type: by name": parameter("named", np.dtype("f8")),
    "storage: external": dataset(TIME, external),
    "storage: virtual": dataset(TIME, virtual),
    "storage: soft link": linked(h5py.SoftLink("/observables/impulse/value")),
    "storage: lost link": linked(h5py.SoftLink("/nowhere")),
    "storage: external link": linked(h5py.ExternalLink("/etc/passwd", "/data")),
    "storage: own link": linked(h5py.ExternalLink("repeats-0000-0002.h5", TIME)),
    "storage: 4e8 rows": all_declared(4 * 10**8),
    "storage: 1e15 rows": all_declared(10**15),
    "storage: 4e8 times": dataset(TIME, declared(4 * 10**8, 65536)),
    "storage: 1e15 times": dataset(TIME, declared(10**15, 65536)),
    "storage: 4e8 impulses": dataset(f"{layout.IMPULSE}/value", declared(4 * 10**8, None)),
    "storage: a bomb": bomb(TIME),
    "storage: large chunk": dataset(TIME, declared(None, 5 * 10**8)),
    "storage: 4e8 balls": dataset("particles/balls/radius", declared(4 * 10**8, 1000)),
    "storage: 4e8 repeats": dataset(layout.REPEATS, declared(4 * 10**8, 1000)),
    "storage: wide text": dataset(
        layout.ENDINGS, lambda file, name, _: file.create_dataset(name, (3,), "S1000000000")
    ),
    "storage: text": dataset(
        TIME, lambda file, name, rows: file.create_dataset(name, data=["a"] * rows)
    ),
    "storage: another filter": dataset(
        TIME, lambda file, name, rows: file.create_dataset(name, (rows,), "f8", scaleoffset=3)
    ),
    "storage: no array": dataset(TIME, lambda file, name, _: file.create_dataset(name, data=1.0)),
    "storage: a group": dataset(TIME, lambda file, name, _: file.create_group(name)),
    "storage: compound": dataset(
        TIME, lambda file, name, rows: file.create_dataset(name, data=np.zeros(rows, "f8, S9"))
    ),
    **{
        f"storage: one {each} less": dataset(
            name, lambda file, name, rows: file.create_dataset(name, data=np.arange(rows - 1.0))
        )
        for each, name in (("time", TIME), ("impulse", f"{layout.IMPULSE}/value"))
    },
    "storage: groups": many_groups,
    "storage: a circle": circle_of_groups,
    "file: empty": lambda path: path.write_bytes(b""),
    "file: noise": lambda path: path.write_bytes(bytes(range(256)) * 40),
    "file: signature": lambda path: path.write_bytes(b"\x89HDF\r\n\x1a\n" * 9),
    **{f"file: {share} of it": cut(share) for share in (0.2, 0.6, 0.95)},
    "file: a folder": folder,
    "file: a pipe": fifo,
    "file: a loop": loop,
}
"""By name; the file has three repeats of seven balls and up to 150 events each."""


def edges(*values: float) -> Damage:
    """Changes the lengths of the container of a box."""
    return dataset(
        f"{layout.BALLS}/box/edges", lambda file, name, _: file.create_dataset(name, data=values)
    )


def summary(name: str, make: Make) -> Damage:
    """Makes a column of the summary anew."""
    return dataset(f"{layout.SUMMARY}/{name}/value", make)


def series(name: str, value: float, row: int = 1) -> Damage:
    """Changes a number in a column of each summary."""

    def change(trace: Trace) -> Trace:
        assert trace.summary is not None
        values = getattr(trace.summary.series, name).copy()
        values[row] = value
        changed = replace(trace.summary.series, **{name: values})
        return replace(trace, summary=replace(trace.summary, series=changed))

    return with_traces(change)


def histogram(value: int) -> Damage:
    """Changes a number of balls in each summary."""

    def change(trace: Trace) -> Trace:
        assert trace.summary is not None
        counts = trace.summary.speed_histogram.copy()
        counts[1, 0] = value
        return replace(trace, summary=replace(trace.summary, speed_histogram=counts))

    return with_traces(change)


def no_rows(trace: Trace) -> Trace:
    assert trace.summary is not None
    columns = {name: values[:0] for name, values in vars(trace.summary.series).items()}
    counts = trace.summary.speed_histogram[:0]
    return replace(trace, summary=Summary(Series(**columns), counts))


KINDS: dict[str, dict[str, Damage]] = {
    "summary": {
        **{
            f"{name}: {value}": series(name, value)
            for name in SERIES_UNITS
            for value in (np.nan, np.inf, -1.0, 1e300)
        },
        **{
            f"last {name}: {value}": series(name, value, -1)
            for name in ("time", "wall_impulse", "pair_virial", "wall_events", "pair_events")
            for value in (0.0, 5e-324)
        },
        "first kinetic_energy": series("kinetic_energy", 0.0, 0),
        **{f"speed_histogram: {value}": histogram(value) for value in (-1, 10**6, 2**62)},
        "no rows": with_traces(no_rows),
        "one time": summary("time", lambda file, name, _: file.create_dataset(name, data=[0.0])),
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
            **{f"edges {each}": edges(*each) for each in ((), (20.0,), (0.0, 14.0))},
            **{f"edge {each}": edges(each, each) for each in (np.nan, np.inf, -1.0, 1e300, 1e-300)},
            **{
                f"a {other}": rules(shape=other)
                for other in ("circle", "box", "periodic")
                if other != shape
            },
            "slides": rules(slides=True),
            "ball": event("i", LARGE),
            "partner": event("j", -2),
            "place": scene("positions", np.nan),
            "far": scene("positions", 1e300),
            "fast": scene("velocities", 1e300),
            "a bomb": bomb(TIME),
            "half a file": cut(0.5),
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
    "no hash": of_checkpoint(lambda group: group.attrs.__delitem__("content")),
    "the hash of another key": of_checkpoint(
        lambda group: group.attrs.__setitem__("content", np.bytes_(b"0" * 64))
    ),
    "a number as hash": of_checkpoint(lambda group: group.attrs.__setitem__("content", 1)),
    "nothing": of_checkpoint(lambda group: group.clear()),
    "a bomb": bomb(f"{layout.CHECKPOINT}/bomb"),
    "1e15 rows": of_checkpoint(lambda group: declared(10**15, None)(group, "rows", 0)),
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
