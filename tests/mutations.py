"""What is thrown at the config room and the command line: texts, overrides, data of any shape."""

import math

from hypothesis import strategies as st

VALID = """\
title: "demo"
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 3, radius: 1.0, mass: 1.0, speed: 10.0, ring_extent: 0.8}
cor: 0.8
wall_cor: null
collisions: 500
sweep:
  cor: [0.8, 0.9, 1.0]
  balls.radius:
    - 0.1
    - 1.0
"""

LISTED = """\
container: {radius: 10}
balls:
  list:
    - {position: [0, 0], velocity: [1, 0], radius: 0.1}
    - {position: [1, 1], velocity: [0, 1], radius: 0.1, mass: 2}
cor: 1
time: 10.0
sweep: {"balls.list[0].position[1]": [0.1, 0.2]}
"""

MIXED = """\
container: {shape: periodic, packing: 0.4}
balls:
  - {count: 5, radius: 1.0, speed: 1, start: random}
  - {count: 50, radius: 0.5, mass: 0.25, speed: 2, speeds: maxwell}
cor: 0.9
time: 10.0
sweep: {zip: {container.packing: [0.1, 0.2], "balls[1].count": [1, 2]}}
"""

FILES = st.sampled_from([VALID, LISTED, MIXED])

# What a mistyping hand or a YAML expert would put in: indicators, keys, extreme scalars.
TOKENS = r"""
{ } [ ] , : - ? & * ! | > ' " % @ ` # ~ << .. ... --- .inf -.inf .nan 1e999 -1 0 0x1f null true no
1_000 &a *a !!int !x <<: "\ud800" "\U00110000" %YAML cor balls list rings sweep container radius
mass count packing shape width box
collisions balls.rings cor[0] list[0] balls.list[1].mass time repeats title range(3) zip 1:2:3
"""
SPACES = ["\t", "\n", " ", "\n  ", "\n- ", ": ", "\0", "\ud800", "\x85", "\u2028", "\ufeff"]
SNIPPETS = st.sampled_from([*TOKENS.split(), *SPACES, "9" * 5000])

KEY_WORDS = """
cor wall_cor title seed balls balls.rings balls.list balls.list[0].mass balls.list[0].position
balls[1].radius balls.count container container.mass
container.shape sweep sweep.cor sweep.zip collisions time record nothing cor.x a..b [0]
"""
KEYS = st.sampled_from(KEY_WORDS.split())
VALUES = st.lists(SNIPPETS | st.sampled_from(["0.5", "1:2:3", "range(1,3)", "{", "}"]), max_size=5)

EDITS = st.lists(
    st.tuples(st.integers(0, 400), st.integers(0, 12), SNIPPETS | st.text(max_size=3)),
    min_size=1,
    max_size=3,
)
"""Places, how many characters to take away there, and what to put in."""

OVERRIDES = st.lists(
    st.builds("{}={}".format, KEYS | st.text(max_size=5), VALUES.map("".join)),
    min_size=1,
    max_size=3,
)


def edited(text: str, edits: list[tuple[int, int, str]]) -> str:
    """A text after edits."""
    for start, length, replacement in edits:
        start %= len(text) + 1
        text = text[:start] + replacement + text[start + length :]
    return text


DATA = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)


def flow(value: object) -> str:
    """Data as YAML on one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{flow(key)}: {flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else (".inf" if value > 0 else "-.inf")
    return str(value).lower().replace("none", "null")
