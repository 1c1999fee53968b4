"""Whatever config and overrides a command gets, it ends with a documented code and plain lines.

The environment variable SNOOKER_FUZZ is the number of cases, in equal parts of four types; they
are then different each time.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from snooker_cli.config import schema

Snooker = Callable[..., Any]
Mapping = list[tuple[str, Any]]
"""Keys with their values: text, or the entries of a mapping. A key can occur twice."""

pytestmark = pytest.mark.filterwarnings("error")

CASES = int(os.environ.get("SNOOKER_FUZZ", "400"))

FUZZ = settings(
    derandomize="SNOOKER_FUZZ" not in os.environ,
    deadline=None,
    database=None,
    max_examples=max(1, CASES // 4),
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)

COMMANDS = st.sampled_from([("validate",), ("run", "--dry-run"), ("run", "--dry-run", "--json")])

MOST_LINES = 21
"""Of problems; the last line counts those that are not printed."""

LONGEST_LINE = 800


@pytest.fixture(autouse=True)
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)


def check(snooker: Snooker, command: tuple[str, ...], text: str, *overrides: str) -> int:
    """Run a command on a config and check how it ends; its exit code."""
    folder = Path.cwd()
    config = folder / "any.yaml"
    config.write_bytes(text.encode("utf-8", "surrogatepass"))
    name, *options = command
    ended = snooker(name, "any.yaml", *(f"--override={each}" for each in overrides), *options)
    assert ended.code in (0, 3), ended.err
    assert "Traceback" not in ended.err
    assert list(folder.iterdir()) == [config]
    if ended.code == 0:
        assert ended.err == ""
        assert ended.out
    else:
        assert ended.out == ""
        assert ended.err.startswith("snooker: ")
        lines = ended.err.removesuffix("\n").split("\n")
        assert len(lines) <= MOST_LINES
        assert all(line.isprintable() and len(line) <= LONGEST_LINE for line in lines), lines
    return int(ended.code)


def entries(**values: Any) -> Mapping:
    """The entries of a mapping, nested ones too."""
    return [
        (key, entries(**value) if isinstance(value, dict) else value)
        for key, value in values.items()
    ]


CIRCLE = {"shape": "circle", "radius": "10.0", "mass": "1.0e7"}
EVENTS = {"collisions": "500", "time": "10.0"}
GAS = {"mass": "1", "speed": "10", "speeds": "maxwell", "start": "lattice"}
BASES: list[Mapping] = [
    entries(
        title="demo",
        container=CIRCLE,
        balls={"rings": "2", "radius": "1.0", "mass": "1", "speed": "10", "ring_extent": "0.8"},
        cor="0.8",
        wall_cor="null",
        collapse={"tc": "0.01"},
        **EVENTS,
        repeats="3",
        seed="1",
        record="events",
        sweep={"cor": "[0.8, 0.9]", "balls.rings": "range(3)"},
    ),
    entries(
        container=CIRCLE | {"mass": ".inf"},
        balls={"list": "[{position: [0, 0], velocity: [1, 0], radius: 1, mass: 2}]"},
        cor="1",
        collapse="slide",
        **EVENTS,
        sweep={"balls.list[0].position": "[[0, 0], [0, 1]]"},
    ),
    entries(
        container={"shape": "box", "width": "10", "height": "5", "packing": "0.2"},
        balls=GAS | {"count": "20"},
        cor="0.9",
        collapse={"elastic_below": "1e-6"},
        collisions="100",
        record="summary",
        sweep={"zip": {"container.packing": "[0.1, 0.2]", "balls.count": "10:20:2"}},
    ),
    entries(
        container={"shape": "periodic", "width": "10"},
        balls=GAS | {"count": "20", "packing": "0.3"},
        cor="0.9",
        collisions="100",
        sweep={"zip": "[{cor: [0.1, 0.2], time: [1, 2]}, {balls.speed: [1, 2]}]"},
    ),
    entries(
        container={"shape": "periodic", "packing": "0.4"},
        balls="[{count: 5, radius: 1.0, speed: 1}, {count: 90, radius: 0.5, speed: 2}]",
        cor="0.9",
        time="10.0",
        sweep={"zip": "{container.packing: [0.1, 0.2], 'balls[1].count': [80, 90]}"},
    ),
]


def written(mapping: Mapping, ends: str = "{}", joint: str = ", ") -> str:
    """A mapping as YAML."""
    lines = [
        f"'{key}': {written(value) if isinstance(value, list) else value}" for key, value in mapping
    ]
    return f"{ends[:1]}{joint.join(lines)}{ends[1:]}"


FILES = [written(base, "", "\n") for base in BASES]

# What a wrong key press or a YAML expert would put in: indicators, keys, extreme scalars.
TOKENS = r"""
{ } [ ] , : - ? & * ! | > ' " % @ ` # ~ << .. ... --- .inf -.inf .nan 1e999 -1 0 0x1f null true no
1_000 &a *a !!int !x <<: "\ud800" "\U00110000" %YAML cor balls list rings sweep container radius
mass count packing shape width box 0.5 range(1,3)
collisions balls.rings cor[0] list[0] balls.list[1].mass time repeats title range(3) zip 1:2:3
"""
SPACES = ["\t", "\n", " ", "\n  ", "\n- ", ": ", "\0", "\ud800", "\x85", "\u2028", "\ufeff"]
SNIPPETS = st.sampled_from([*TOKENS.split(), *SPACES, "9" * 5000])
TEXTS = st.text(max_size=60) | st.lists(SNIPPETS | st.text(max_size=3), max_size=15).map(" ".join)
EDITS = st.lists(
    st.tuples(st.integers(0, 400), st.integers(0, 12), SNIPPETS | st.text(max_size=3)),
    min_size=1,
    max_size=3,
)
"""Places, how many characters to remove there, and what to insert."""

KEYS = """
cor wall_cor title seed balls balls.rings balls.list balls.list[0].mass balls.list[0].position
balls[1].radius balls.count container container.mass
container.shape sweep sweep.cor sweep.zip collisions time record nothing cor.x a..b [0]
"""
DATA = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)
OVERRIDES = st.lists(
    st.builds(
        "{}={}".format,
        st.sampled_from(KEYS.split()) | st.text(max_size=5),
        st.lists(SNIPPETS, max_size=5).map("".join) | DATA.map(json.dumps),
    ),
    min_size=1,
    max_size=3,
)


@given(COMMANDS, TEXTS)
@example(("validate",), "a: &a [*a]")
@example(("validate",), "? ")
@example(("validate",), "sweep: [[cor, [1]]]")
@example(("validate",), "balls: {list: {rings: 1}}")
@example(("validate",), "[" * 10_000)
@example(("validate",), "\n".join(f"a{n}: &a{n} [{f'*a{n - 1}, ' * 10}]" for n in range(12)))
@FUZZ
def test_texts(snooker: Snooker, command: tuple[str, ...], text: str) -> None:
    check(snooker, command, text)


@given(COMMANDS, st.sampled_from(FILES), EDITS)
@FUZZ
def test_edited_texts(
    snooker: Snooker, command: tuple[str, ...], text: str, edits: list[tuple[int, int, str]]
) -> None:
    for start, length, replacement in edits:
        start %= len(text) + 1
        text = text[:start] + replacement + text[start + length :]
    check(snooker, command, text)


@given(COMMANDS, st.sampled_from(FILES), OVERRIDES)
@FUZZ
def test_overrides(
    snooker: Snooker, command: tuple[str, ...], text: str, overrides: list[str]
) -> None:
    check(snooker, command, text, *overrides)


# Changes key by key


def paths(mapping: Mapping, before: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """The keys of a mapping and of those inside it."""
    for key, value in mapping:
        yield (*before, key)
        if isinstance(value, list):
            yield from paths(value, (*before, key))


PLACES = [(number, path) for number, base in enumerate(BASES) for path in paths(base)]

EXTREMES = """
0 -0.0 -1 1 2 0.5 1.5 5e-324 1e-300 1e300 -1e300 1.7976931348623157e308 1e309 -1e309 1e-400
1000000000 9223372036854775807 9223372036854775808 0x7fffffffffffffff .inf -.inf .nan 1e12
null true false ~ text '' "\\0" 'range(3)' 0:1:3 1:0:2 circle box periodic stop slide random maxwell
summary [] [1] {} [[]] [[0,0]] [[1e308,0]] {a:} [null] [.nan] [true,1] {tc:1} {zip:[]} &a *a !!int
<<
"""
VALUES = st.sampled_from([*EXTREMES.split(), "1" + "0" * 400, "[" * 30 + "]" * 30, "x" * 500])
CHANGES = st.sampled_from(["remove", "double", "misspell"]) | VALUES


def changed(mapping: Mapping, path: tuple[str, ...], change: str) -> Mapping:
    """A mapping after a change at one of its keys, or unchanged if the key is gone."""
    found: Mapping = []
    for key, value in mapping:
        if key != path[0]:
            found.append((key, value))
        elif len(path) > 1:
            inside = changed(value, path[1:], change) if isinstance(value, list) else value
            found.append((key, inside))
        elif change == "double":
            found += [(key, value), (key, value)]
        elif change == "misspell":
            found.append((f"{key}x", value))
        elif change != "remove":
            found.append((key, change))
    return found


def test_the_bases_have_every_key_and_are_valid(snooker: Snooker) -> None:
    document = schema()
    homes = [document, *document["$defs"].values()]
    known = {key for home in homes for key in home["properties"]}
    keys = {key for _, path in PLACES for key in path}
    assert known - keys == {"position", "velocity"}  # of single balls, which are one text
    for text in FILES:
        assert check(snooker, ("validate",), text) == 0


@given(
    COMMANDS,
    st.sampled_from(PLACES),
    CHANGES,
    st.none() | st.tuples(st.sampled_from(PLACES), CHANGES),
)
@FUZZ
def test_changes_key_by_key(
    snooker: Snooker,
    command: tuple[str, ...],
    place: tuple[int, tuple[str, ...]],
    change: str,
    another: tuple[tuple[int, tuple[str, ...]], str] | None,
) -> None:
    number, path = place
    config = changed(BASES[number], path, change)
    if another is not None:
        (_, path), change = another
        config = changed(config, path, change)
    check(snooker, command, written(config, "", "\n"))
