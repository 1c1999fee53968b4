"""Whatever is thrown at the config room, it answers with an Experiment or a ConfigError."""

import math
from decimal import Decimal

from hypothesis import example, given, settings
from hypothesis import strategies as st

from snooker_cli.config import (
    Ball,
    BallList,
    ConfigError,
    Container,
    Experiment,
    Gas,
    Rings,
    Species,
    digest,
    parse,
    points,
    to_json,
    to_yaml,
)

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
sweep: {container.packing: [0.1, 0.2], "balls[1].count": [1, 2]}
"""

FILES = st.sampled_from([VALID, LISTED, MIXED])

STEADY = settings(derandomize=True, deadline=None)

# What a mistyping hand or a YAML expert would put in: indicators, keys, extreme scalars.
TOKENS = r"""
{ } [ ] , : - ? & * ! | > ' " % @ ` # ~ << .. ... --- .inf -.inf .nan 1e999 -1 0 0x1f null true no
1_000 &a *a !!int !x <<: "\ud800" "\U00110000" %YAML cor balls list rings sweep container radius
mass count packing shape width box
collisions balls.rings cor[0] list[0] balls.list[1].mass time repeats title range(3)
"""
SPACES = ["\t", "\n", " ", "\n  ", "\n- ", ": ", "\0", "\ud800", "\x85", "\u2028", "\ufeff"]
SNIPPETS = st.sampled_from([*TOKENS.split(), *SPACES, "9" * 5000])


def answered(text: str, *overrides: str) -> Experiment | None:
    """The experiment, or None when it was refused in plain, printable lines."""
    try:
        return parse(text, "any.yaml", overrides).experiment
    except ConfigError as caught:
        error = caught
    assert error.problems
    for problem in error.problems:
        assert problem.sentence.isprintable()
        assert str(problem).startswith(("any.yaml", "-o "))
    assert len(str(error).splitlines()) == len(error.problems)
    return None


@given(st.text(max_size=60))
@example("a: &a [*a]")
@example("? ")
@example("!")
@example("sweep: [[cor, [1]]]")
@example("balls: {list: {rings: 1}}")
@STEADY
def test_random_text(text: str) -> None:
    answered(text)


@given(st.lists(SNIPPETS | st.text(max_size=3), max_size=15))
@STEADY
def test_random_tokens(tokens: list[str]) -> None:
    answered("".join(tokens))
    answered(" ".join(tokens))


@given(
    FILES,
    st.lists(
        st.tuples(st.integers(0, 400), st.integers(0, 12), SNIPPETS | st.text(max_size=3)),
        min_size=1,
        max_size=3,
    ),
)
@settings(STEADY, max_examples=300)
def test_mutations_of_a_valid_file(text: str, mutations: list[tuple[int, int, str]]) -> None:
    for start, length, replacement in mutations:
        start %= len(text) + 1
        text = text[:start] + replacement + text[start + length :]
    experiment = answered(text)
    if experiment is not None:
        assert answered(to_yaml(experiment)) == experiment
        assert answered(to_json(experiment)) == experiment


KEY_WORDS = """
cor wall_cor title seed balls balls.rings balls.list balls.list[0].mass balls.list[0].position
balls[1].radius balls.count container container.mass
container.shape sweep sweep.cor collisions time record nothing cor.x a..b [0]
"""
KEYS = st.sampled_from(KEY_WORDS.split())
VALUES = st.lists(SNIPPETS | st.sampled_from(["0.5", "1:2:3", "range(1,3)", "{", "}"]), max_size=5)


@given(
    FILES,
    st.lists(st.tuples(KEYS | st.text(max_size=5), VALUES), min_size=1, max_size=3),
)
@settings(STEADY, max_examples=300)
def test_random_overrides(text: str, overrides: list[tuple[str, list[str]]]) -> None:
    answered(text, *(f"{key}={''.join(value)}" for key, value in overrides))


DATA = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=5,
)


@given(st.sampled_from(sorted(Experiment.model_fields)), DATA)
@STEADY
def test_any_data_at_any_key(key: str, value: object) -> None:
    """Data of every shape where something else is meant, by way of flow YAML."""
    answered(VALID, f"{key}={_flow(value)}")


def _flow(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_flow(key)}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    if isinstance(value, str):
        return "'" + value.replace("'", "''") + "'"
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else (".inf" if value > 0 else "-.inf")
    return str(value).lower().replace("none", "null")


POSITIVE = st.floats(min_value=0, exclude_min=True, allow_infinity=False)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
RESTITUTION = st.floats(0, 1)
TITLES = st.text(st.characters(exclude_categories=["C", "Z"]) | st.just(" "), min_size=1)
SPEEDS = st.floats(min_value=0, allow_infinity=False)
FRACTIONS = st.floats(0, 1, exclude_min=True)
CIRCLES = st.builds(Container, radius=POSITIVE, mass=POSITIVE | st.just(math.inf))
RINGS = st.builds(
    Rings,
    rings=st.integers(0, 1000),
    radius=POSITIVE,
    mass=POSITIVE,
    speed=SPEEDS,
    ring_extent=FRACTIONS,
)
LISTS = st.builds(
    BallList,
    list=st.lists(
        st.builds(
            Ball,
            position=st.tuples(FINITE, FINITE),
            velocity=st.tuples(FINITE, FINITE),
            radius=POSITIVE,
            mass=POSITIVE,
        ),
        min_size=1,
        max_size=3,
    ),
)
OF_SPECIES = {
    "count": st.integers(2, 1_000_000),
    "mass": POSITIVE,
    "speed": SPEEDS,
    "speeds": st.sampled_from(["equal", "maxwell"]),
}
STARTS = st.none() | st.sampled_from(["lattice", "random"])
BOXES = st.sampled_from(["box", "periodic"])
# Two of the container's size, the radius and packing; and places in a container with a size.
FILLED = (
    st.tuples(CIRCLES, RINGS | LISTS)
    | st.tuples(
        st.builds(Container, shape=BOXES, width=POSITIVE, height=st.none() | POSITIVE),
        LISTS | st.builds(Gas, **OF_SPECIES, start=STARTS, packing=FRACTIONS),
    )
    | st.tuples(
        st.builds(Container, shape=BOXES | st.just("circle"), packing=FRACTIONS),
        st.builds(Gas, **OF_SPECIES, start=STARTS, radius=POSITIVE)
        | st.tuples(
            st.builds(Species, **OF_SPECIES, radius=POSITIVE),
            st.builds(Species, **OF_SPECIES, start=STARTS, radius=POSITIVE),
        ),
    )
)
KEYWORDS = {
    "title": st.none()
    | TITLES
    | st.sampled_from(["no", "1e6", "null", "0o7", "~", "- x", "a: b", "'"]),
    "cor": RESTITUTION,
    "wall_cor": st.none() | RESTITUTION,
    "collisions": st.integers(1, 2**63 - 1),
    "time": st.none() | POSITIVE,
    "repeats": st.integers(1, 2**63 - 1),
    "seed": st.integers(0, 2**63 - 1),
    "record": st.sampled_from(["events", "summary"]),
    "sweep": st.dictionaries(
        st.sampled_from(["cor", "wall_cor"]), st.lists(RESTITUTION, min_size=1, unique=True)
    ),
}
EXPERIMENTS = FILLED.flatmap(
    lambda filled: st.builds(
        Experiment, container=st.just(filled[0]), balls=st.just(filled[1]), **KEYWORDS
    )
)


@given(EXPERIMENTS)
@STEADY
def test_every_experiment_can_be_written_and_read_back(experiment: Experiment) -> None:
    for text in (to_yaml(experiment), to_json(experiment)):
        copy = parse(text).experiment
        assert copy == experiment
        assert digest(copy) == digest(experiment)


@given(EXPERIMENTS)
@STEADY
def test_points_are_distinct_experiments_of_their_own(experiment: Experiment) -> None:
    grid = points(experiment)
    assert len(grid) == math.prod(len(values) for _, values in experiment.sweep)
    assert len({point.experiment for point in grid}) == len(grid)
    for point in grid:
        assert points(point.experiment)[0].experiment == point.experiment


@given(
    st.decimals(0, 10, places=3),
    st.decimals(0, 10, places=3),
    st.sampled_from([2, 3, 5, 6, 11, 101]),
)
@STEADY
def test_spaced_values_are_correctly_rounded(start: Decimal, stop: Decimal, count: int) -> None:
    """Against exact rational arithmetic; these counts divide a decimal into decimals."""
    if start == stop:
        return
    ((_, values),) = parse(
        VALID, "any", ["sweep=null", f"balls.speed={start}:{stop}:{count}"]
    ).experiment.sweep
    exact = [start + (stop - start) * step / (count - 1) for step in range(count)]
    assert list(values) == [float(str(value)) for value in exact]
