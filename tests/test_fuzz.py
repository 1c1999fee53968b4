"""Whatever the command line is given, it ends with a documented code and a few plain lines.

SNOOKER_FUZZ in the environment is how many cases are tried, in equal parts of four sorts; they are
then others each time.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from mutations import EDITS, FILES, OVERRIDES, SNIPPETS, edited

from snooker_cli.config import schema

Snooker = Callable[..., Any]

pytestmark = pytest.mark.filterwarnings("error")

CASES = int(os.environ.get("SNOOKER_FUZZ", "60"))

FUZZ = settings(
    derandomize="SNOOKER_FUZZ" not in os.environ,
    deadline=None,
    database=None,
    max_examples=max(1, CASES // 4),
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)

COMMANDS = st.sampled_from([("validate",), ("run", "--dry-run"), ("run", "--dry-run", "--json")])

MOST_LINES = 21
"""Of what is wrong; the last one counts those that are not told."""

LONGEST_LINE = 800


@pytest.fixture(autouse=True)
def empty(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)


def check(snooker: Snooker, command: tuple[str, ...], text: str, *overrides: str) -> int:
    """Have a command read a config, and see that it ends as it should; its code."""
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


# Texts


@given(COMMANDS, st.text(max_size=60) | st.lists(SNIPPETS | st.text(max_size=3)).map(" ".join))
@example(("validate",), "[" * 10_000)
@example(("validate",), "\n".join(f"a{n}: &a{n} [{f'*a{n - 1}, ' * 10}]" for n in range(12)))
@FUZZ
def test_texts(snooker: Snooker, command: tuple[str, ...], text: str) -> None:
    check(snooker, command, text)


@given(COMMANDS, FILES, EDITS)
@FUZZ
def test_edited_texts(snooker: Snooker, command: tuple[str, ...], text: str, edits: Any) -> None:
    check(snooker, command, edited(text, edits))


@given(COMMANDS, FILES, OVERRIDES)
@FUZZ
def test_overrides(
    snooker: Snooker, command: tuple[str, ...], text: str, overrides: list[str]
) -> None:
    check(snooker, command, text, *overrides)


# Key by key


class Entry(NamedTuple):
    """A key and what stands beside it: text, or the entries of a mapping."""

    key: str
    value: Any


def entries(**values: Any) -> list[Entry]:
    """The entries of a mapping, nested ones too."""
    return [
        Entry(key, entries(**value) if isinstance(value, dict) else value)
        for key, value in values.items()
    ]


CIRCLE = {"shape": "circle", "radius": "10.0", "mass": "1.0e7"}
EVENTS = {"collisions": "500", "time": "10.0"}
GAS = {"mass": "1", "speed": "10", "speeds": "maxwell", "start": "lattice"}
BASES: list[list[Entry]] = [
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
]


def paths(mapping: list[Entry], before: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
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


def changed(mapping: list[Entry], path: tuple[str, ...], change: str) -> list[Entry]:
    """A mapping after a change at one of its keys, or as it is where the key has gone."""
    found: list[Entry] = []
    for key, value in mapping:
        if key != path[0]:
            found.append(Entry(key, value))
        elif len(path) > 1:
            inside = changed(value, path[1:], change) if isinstance(value, list) else value
            found.append(Entry(key, inside))
        elif change == "double":
            found += [Entry(key, value), Entry(key, value)]
        elif change == "misspell":
            found.append(Entry(f"{key}x", value))
        elif change != "remove":
            found.append(Entry(key, change))
    return found


def written(mapping: list[Entry], ends: str = "{}", joint: str = ", ") -> str:
    """A mapping as YAML."""
    lines = [
        f"'{key}': {written(value) if isinstance(value, list) else value}" for key, value in mapping
    ]
    return f"{ends[:1]}{joint.join(lines)}{ends[1:]}"


def test_the_bases_have_every_key_there_is() -> None:
    document = schema()
    keys = {key for _, path in PLACES for key in path}
    homes = [document, *document["$defs"].values()]
    known = {key for home in homes for key in home["properties"]}
    assert known - keys == {"position", "velocity"}  # of single balls, in a text of their own


def test_the_bases_are_sound(snooker: Snooker) -> None:
    for base in BASES:
        assert check(snooker, ("validate",), written(base, "", "\n")) == 0


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
