"""Whatever is thrown at the config room, it answers with an Experiment or a ConfigError."""

import math
from decimal import Decimal

from hypothesis import example, given, settings
from hypothesis import strategies as st
from mutations import DATA, EDITS, FILES, OVERRIDES, SNIPPETS, VALID, edited, flow

from snooker_cli.config import (
    Ball,
    BallCount,
    BallList,
    ConfigError,
    ContainerConfig,
    Experiment,
    Rings,
    Species,
    digest,
    parse,
    points,
    to_json,
)

STEADY = settings(derandomize=True, deadline=None)


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
    assert len(str(error).splitlines()) == min(len(error.problems), 21)
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


@given(FILES, EDITS)
@settings(STEADY, max_examples=150)
def test_mutations_of_a_valid_file(text: str, edits: list[tuple[int, int, str]]) -> None:
    text = edited(text, edits)
    experiment = answered(text)
    if experiment is not None:
        assert answered(to_json(experiment)) == experiment


@given(FILES, OVERRIDES)
@settings(STEADY, max_examples=150)
def test_random_overrides(text: str, overrides: list[str]) -> None:
    answered(text, *overrides)


@given(st.sampled_from(sorted(Experiment.model_fields)), DATA)
@STEADY
def test_any_data_at_any_key(key: str, value: object) -> None:
    """Data of every shape where something else is meant, by way of flow YAML."""
    answered(VALID, f"{key}={flow(value)}")


POSITIVE = st.floats(min_value=0, exclude_min=True, allow_infinity=False)
FINITE = st.floats(allow_nan=False, allow_infinity=False)
RESTITUTION = st.floats(0, 1)
TITLES = st.text(st.characters(exclude_categories=["C", "Z"]) | st.just(" "), min_size=1)
SPEEDS = st.floats(min_value=0, allow_infinity=False)
MASSES = st.floats(1e-100, 1e100)
FRACTIONS = st.floats(0, 1, exclude_min=True)
CIRCLES = st.builds(ContainerConfig, radius=POSITIVE, mass=POSITIVE | st.just(math.inf))
RINGS = st.builds(
    Rings,
    rings=st.integers(0, 1000),
    radius=POSITIVE,
    mass=MASSES,
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
            mass=MASSES,
        ),
        min_size=1,
        max_size=3,
    ),
)
OF_SPECIES = {
    "count": st.integers(2, 1_000_000),
    "mass": MASSES,
    "speed": SPEEDS,
    "speeds": st.sampled_from(["equal", "maxwell"]),
}
STARTS = st.none() | st.sampled_from(["lattice", "random"])
BOXES = st.sampled_from(["box", "periodic"])
# Two of the container's size, the radius and packing; and places in a container with a size.
FILLED = (
    st.tuples(CIRCLES, RINGS | LISTS)
    | st.tuples(
        st.builds(ContainerConfig, shape=BOXES, width=POSITIVE, height=st.none() | POSITIVE),
        LISTS | st.builds(BallCount, **OF_SPECIES, start=STARTS, packing=FRACTIONS),
    )
    | st.tuples(
        st.builds(ContainerConfig, shape=BOXES | st.just("circle"), packing=FRACTIONS),
        st.builds(BallCount, **OF_SPECIES, start=STARTS, radius=POSITIVE)
        | st.tuples(
            st.builds(Species, **OF_SPECIES, radius=POSITIVE),
            st.builds(Species, **OF_SPECIES, start=STARTS, radius=POSITIVE),
        ),
    )
)
AXES = st.lists(RESTITUTION, min_size=1, max_size=9, unique=True)
STEPS = st.lists(st.tuples(RESTITUTION, RESTITUTION), min_size=1, max_size=9, unique=True)
ZIPS = STEPS.map(
    lambda steps: dict(zip(("cor", "wall_cor"), zip(*steps, strict=True), strict=True))
)
SWEEPS = (
    st.dictionaries(st.sampled_from(["cor", "wall_cor"]), AXES)
    | ZIPS.map(lambda group: {"zip": group})
    | ZIPS.map(lambda group: {"collisions": [1, 2], "zip": [group, {"time": [1, 2]}]})
)
KEYWORDS = {
    "title": st.none()
    | TITLES
    | st.sampled_from(["no", "1e6", "null", "0o7", "~", "- x", "a: b", "'"]),
    "cor": RESTITUTION,
    "wall_cor": st.none() | RESTITUTION,
    "collisions": st.integers(1, 2**63 - 1),
    "time": st.none() | POSITIVE,
    "repeats": st.integers(1, 1000),
    "seed": st.integers(0, 2**63 - 1),
    "record": st.sampled_from(["events", "summary"]),
    "sweep": st.none() | SWEEPS,
}
EXPERIMENTS = FILLED.flatmap(
    lambda filled: st.builds(
        Experiment, container=st.just(filled[0]), balls=st.just(filled[1]), **KEYWORDS
    )
)


@given(EXPERIMENTS)
@STEADY
def test_every_experiment_can_be_written_and_read_back(experiment: Experiment) -> None:
    copy = parse(to_json(experiment)).experiment
    assert copy == experiment
    assert digest(copy) == digest(experiment)


@given(EXPERIMENTS)
@STEADY
def test_points_are_distinct_experiments_of_their_own(experiment: Experiment) -> None:
    grid = points(experiment)
    assert len(grid) == math.prod(len(axis[0][1]) for axis in experiment.sweep)
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
    (((_, values),),) = parse(
        VALID, "any", ["sweep=null", f"balls.speed={start}:{stop}:{count}"]
    ).experiment.sweep
    exact = [start + (stop - start) * step / (count - 1) for step in range(count)]
    assert list(values) == [float(str(value)) for value in exact]
