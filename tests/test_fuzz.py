"""Whatever config and overrides a command gets, it ends with a documented code and plain lines.

The environment variable SNOOKER_FUZZ is the number of cases of each type; they are then different
each time.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from command_line import Snooker
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from snooker_cli.config.template_configs import SCHEMA_FILE

pytestmark = pytest.mark.filterwarnings("error")

CASES = int(os.environ.get("SNOOKER_FUZZ", "25"))

FUZZ = settings(
    derandomize="SNOOKER_FUZZ" not in os.environ,
    deadline=None,
    database=None,
    max_examples=CASES,
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
    ended = snooker(
        name, "any.yaml", *(f"--override={override}" for override in overrides), *options
    )
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


BASES = [
    """\
title: demo
container: {shape: circle, radius: 10.0, mass: 1.0e7, velocity: [1, 0]}
balls:
  {rings: 2, radius: 1.0, mass: 1, speed: 10, ring_extent: 0.8, common_rotation: false, spin: 1}
cor: 0.8
law: null
wall_law: null
wall_cor: null
tangential_cor: 0.5
friction: 0.2
wall_tangential_cor: -1
wall_friction: 0.1
inertia: 0.4
collapse: {tc: 0.01}
collisions: 500
time: 10.0
repeats: 3
seed: 1
record: events
sweep: {cor: [0.8, 0.9], balls.rings: 'range(1, 3)'}
""",
    """\
container: {radius: 10.0, mass: .inf}
balls:
  list:
    - {position: [0, 0], velocity: [1, 0], radius: 1, mass: 2, spin: -3}
start:
  {run: a, point: 0, repeat: 1, time: 2.5, rounding: 1e-12,
   content: 0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef}
cor: 1
tangential_cor: 1
wall_friction: 0
collapse: slide
collisions: 500
sweep: {'balls.list[0].position': [[0, 0], [0, 1]]}
""",
    """\
container: {shape: box, width: 10, height: 5, packing: 0.2}
balls: {count: 20, mass: 1, speed: 10, speeds: maxwell, start: lattice}
cor: 0.9
cor_speed: 5
wall_speed: {left: 1, bottom: 0.5}
wall_temperature: {right: 1, top: 0.5}
wall_key: 7
collapse: {elastic_below: 1e-6}
common_random: true
collisions: 100
record: summary
sweep:
  zip: {container.packing: [0.1, 0.2], balls.count: 10:20:2}
""",
    """\
container: {shape: channel, packing: 0.2}
balls: {count: 20, radius: 1, speed: 10}
cor: 0.9
wall_cor_speed: 5
collisions: 100
record: snapshots
snapshots: {per_decade: 3}
""",
    """\
container: {shape: periodic, packing: 0.4}
balls:
  - {count: 5, radius: 1.0, speed: 1, spin: {temperature: 2}}
  - {count: 90, radius: 0.5, speed: 2}
tangential_cor: -0.5
cor: 0.9
time: 10.0
record: snapshots
snapshots: [1.0, 2.5]
sweep: {zip: {container.packing: [0.1, 0.2], 'balls[1].count': [80, 90]}}
""",
]
# What a wrong key press or a YAML expert would put in: indicators, keys, extreme scalars.
TOKENS = r"""
{ } [ ] , : - ? & * ! | > ' " % @ ` # ~ << .. ... --- .inf -.inf .nan 1e999 -1 0 0x1f null true no
1_000 &a *a !!int !x <<: "\ud800" "\U00110000" %YAML cor balls list rings sweep container radius
mass count packing shape width box 0.5 range(1,3)
collisions balls.rings cor[0] list[0] balls.list[1].mass time repeats title range(3) zip 1:2:3
"""
SPACES = ["\t", "\n", " ", "\n  ", "\n- ", ": ", "\0", "\ud800", "\x85", "\u2028", "\ufeff"]
SNIPPETS = st.sampled_from([*TOKENS.split(), *SPACES, "9" * 5000])
EDITS = st.lists(
    st.tuples(st.integers(0, 400), st.integers(0, 12), SNIPPETS | st.text(max_size=3)),
    min_size=1,
    max_size=3,
)
"""Places, how many characters to remove there, and what to insert."""

KEYS = """
balls.list[0].mass balls.list[0].position balls[1].radius balls.zip sweep.cor sweep.zip nothing
cor.x a..b [0] title wall_cor
"""
EXTREMES = """
0 -0.0 -1 1 2 0.5 1.5 5e-324 1e-300 1e300 -1e300 1.7976931348623157e308 1e309 -1e309 1e-400
1000000000 9223372036854775807 9223372036854775808 0x7fffffffffffffff .inf -.inf .nan 1e12
null true false ~ text '' "\\0" range(3) 0:1:3 1:0:2 circle box periodic stop slide random maxwell
summary [] [1] {} [[]] [[0,0]] [[1e308,0]] {a:} [null] [.nan] [true,1] {tc:1} {zip:[]} &a *a !!int
<<
"""
DATA = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)
VALUES = (
    st.sampled_from([*EXTREMES.split(), "1" + "0" * 400, "[" * 30 + "]" * 30, "x" * 500])
    | st.lists(SNIPPETS, max_size=5).map("".join)
    | DATA.map(json.dumps)
)
SCHEMA = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))
SWEPT = [*SCHEMA["properties"], *SCHEMA["properties"]["sweep"]["properties"]]
OVERRIDES = st.lists(
    st.builds("{}={}".format, st.sampled_from(SWEPT + KEYS.split()) | st.text(max_size=5), VALUES),
    min_size=1,
    max_size=3,
)


def test_the_bases_have_every_key_and_are_valid(snooker: Snooker) -> None:
    homes = [SCHEMA, *SCHEMA["$defs"].values()]
    text = "".join(BASES)
    assert all(
        f"{key}: " in text or f"{key}:\n" in text for home in homes for key in home["properties"]
    )
    for base in BASES:
        assert check(snooker, ("validate",), base) == 0


@given(COMMANDS, st.sampled_from(BASES), EDITS)
@FUZZ
def test_edited_texts(
    snooker: Snooker, command: tuple[str, ...], text: str, edits: list[tuple[int, int, str]]
) -> None:
    for start, length, replacement in edits:
        start %= len(text) + 1
        text = text[:start] + replacement + text[start + length :]
    check(snooker, command, text)


@given(COMMANDS, st.sampled_from(BASES), OVERRIDES)
@FUZZ
def test_overrides(
    snooker: Snooker, command: tuple[str, ...], text: str, overrides: list[str]
) -> None:
    check(snooker, command, text, *overrides)


CALM = """\
container: {radius: 10}
balls: [{count: 20, radius: 0.3, speed: 10}, {count: 5, radius: 0.2, mass: 5, speed: 0}]
cor: 1
time: 0.001
"""
"""Nothing happens, and balls of one species do not move."""

ALONE = """\
container: {radius: 10}
balls: {count: 1, radius: 0.01, speed: 1}
cor: 0.5
wall_cor: 0
collapse: {elastic_below: 0.01}
collisions: 2000
"""
"""After the first collision it slides along the wall: the pressure falls, the energy stays."""

SLOWING = """\
container: {shape: box, width: 10, height: 40}
balls: {count: 2, radius: 0.3, speed: 1}
cor: 0.5
collisions: 2000
repeats: 5
"""
"""Haff's law with a rate whose square is no double."""


SPINNING = """\
container: {radius: 10}
balls: {count: 1, radius: 0.5, speed: 10, spin: 5}
cor: 0.9
tangential_cor: 0.5
friction: 0.3
collisions: 300
repeats: 2
"""
"""It is soon in a trap, whose sums are bounds."""

SOFT_WALL = """\
container: {radius: 10}
balls: {count: 1, radius: 0.5, speed: 10}
cor: 0.9
wall_cor_speed: 20
collisions: 300
"""
"""So is it here."""

TURNING = """\
container: {radius: 10}
balls: {count: 5, radius: 0.5, speed: 0, spin: 7}
cor: 0.9
tangential_cor: 0.5
collisions: 300
"""
"""Balls that spin and do not meet."""


@pytest.mark.parametrize("text", [CALM, ALONE, SLOWING, SPINNING, SOFT_WALL, TURNING])
def test_results_of_small_runs_have_no_warnings(snooker: Snooker, text: str) -> None:
    """Few balls or events leave means empty and errors unknown."""
    Path("small.yaml").write_text(text)
    assert snooker("run", "small.yaml", "--no-progress", "--out", "small").code == 0
    for command in ("fit small --all", "compare small --all", "plot small --list"):
        ended = snooker(*command.split())
        assert ended.code == 0, (command, ended.err)
