"""Sweeps, ranges and overrides: they are read as if their values were written in the file."""

from decimal import Decimal

import pytest
from config_texts import BASE, PAIR, config
from hypothesis import given, settings
from hypothesis import strategies as st

from snooker_cli.config import ConfigError, Rings, points

PAIRS = "{cor: [0.8, 0.9, 0.9], balls.radius: [0.1, 0.1, 1.0]}"
OTHERS = "{balls.mass: [1, 2], time: [1, 2]}"


def swept(sweep: str, *overrides: str) -> object:
    return config(BASE + f"sweep: {sweep}\n", *overrides).sweep


def parameters(sweep: str) -> list[list[tuple[str, object]]]:
    return [list(point.parameters) for point in points(config(BASE + f"sweep: {sweep}\n"))]


@pytest.mark.parametrize(
    ("written", "values"),
    [
        ("0.5:1.0:11", "[0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0]"),
        ('" 1 : 0.5 : 3 "', "[1, 0.75, 0.5]"),
        ("range(2)", "[0, 1]"),
    ],
)
def test_ranges_are_read_like_lists(written: str, values: str) -> None:
    for sweep in ("\n  cor: {}", "{{cor: {}}}", "{{zip: {{cor: {}}}}}"):
        assert swept(sweep.format(written)) == swept(f"{{cor: {values}}}")


@given(
    st.decimals(0, 10, places=3), st.decimals(0, 10, places=3), st.sampled_from([2, 3, 5, 6, 11])
)
@settings(derandomize=True, deadline=None)
def test_spaced_values_are_correctly_rounded(start: Decimal, stop: Decimal, count: int) -> None:
    """Against exact decimals; these counts divide a decimal into decimals."""
    if start == stop:
        return
    (((_, values),),) = config(BASE, f"balls.speed={start}:{stop}:{count}").sweep
    exact = [start + (stop - start) * step / (count - 1) for step in range(count)]
    assert list(values) == [float(str(value)) for value in exact]


def test_a_swept_key_needs_no_value_of_its_own() -> None:
    """Not in the file, and not with -o; a value that is there stays."""
    without = BASE.replace("cor: 0.8\n", "")
    whole = points(config(BASE, "cor=.8,.9"))
    for text, options in ((without, ["cor=.8,.9"]), (without + "sweep: {cor: [0.8, 0.9]}\n", [])):
        assert points(config(text, *options)) == whole
    unended = BASE.replace("collisions: 500\n", "sweep: {zip: {time: [1, 2]}}\n")
    assert [point.config.time for point in points(config(unended))] == [1.0, 2.0]


def test_a_zip_is_one_axis_of_the_grid_at_its_place() -> None:
    steps = [(0.8, 0.1), (0.9, 0.1), (0.9, 1.0)]
    assert parameters(f"{{balls.mass: [1, 2], zip: {PAIRS}, balls.rings: [1, 2]}}") == [
        [("balls.mass", mass), ("cor", cor), ("balls.radius", radius), ("balls.rings", rings)]
        for mass in (1.0, 2.0)
        for cor, radius in steps
        for rings in (1, 2)
    ]
    several = f'[{PAIRS}, {{balls.mass: [3]}}, {{balls.rings: "range(1, 3)", time: 1:2:2}}]'
    assert parameters(f"{{zip: {several}}}") == [
        [*pair, ("balls.mass", 3.0), ("balls.rings", rings), ("time", float(rings))]
        for pair in parameters(f"{{zip: {PAIRS}}}")
        for rings in (1, 2)
    ]
    assert swept("{zip: {cor: [0.1, 0.2]}}") == swept("{cor: [0.1, 0.2]}")
    assert swept("{zip: [{}]}") == swept("{zip: null}") == ()


def test_values_of_a_zip_are_checked_together() -> None:
    """Balls that slide need a fixed wall, which only the zip gives."""
    sweep = (
        "sweep: {zip: {collapse: [slide, stop], container.mass: [.inf, 1.0e7]}}\n"
        "collapse: {tc: 0.1}\n"
    )
    first, second = points(config(BASE + sweep))
    assert (first.config.collapse, second.config.collapse) == ("slide", "stop")
    with pytest.raises(ConfigError, match=r"sweep\.collapse\[0\]: slide"):
        config(BASE + sweep.replace("zip: {", "").replace("}}", "}"))


@pytest.mark.parametrize(
    ("override", "written"),
    [
        (" cor = 0.5 # half", BASE.replace("cor: 0.8", "cor: 0.5")),
        ("title='a, b: c = d'", BASE + "title: 'a, b: c = d'\n"),
        (f"sweep={{zip: {OTHERS}}}", BASE + f"sweep: {{zip: {OTHERS}}}\n"),
        ("balls.rings=range(7, 0, -3)", BASE + "sweep: {balls.rings: [7, 4, 1]}\n"),
        ("wall_cor=null, 1", BASE + "sweep: {wall_cor: [null, 1]}\n"),
    ],
)
def test_override_is_read_as_if_it_were_written(override: str, written: str) -> None:
    assert config(BASE, override) == config(written)


def test_overrides_reach_into_lists_and_build_mappings() -> None:
    assert config(PAIR, "balls.list[1].velocity=[3, 4]") == config(
        PAIR.replace("velocity: [0, 0]", "velocity: [3, 4]")
    )
    without = "container: {radius: 10}\ncor: 1\ntime: 1\n"
    read = config(without, "balls.rings=2", "balls.radius=0.5", "balls.speed=3")
    assert read.balls == Rings(rings=2, radius=0.5, speed=3.0)


KEYS = "{cor: [0.8, 0.9], balls.radius: [0.1, 1.0], balls.mass: [1, 2]}"
ZIPS = f"{{zip: [{PAIRS}, {OTHERS}]}}"


@pytest.mark.parametrize(
    ("sweep", "overrides", "left"),
    [
        (KEYS, ["cor=0.5"], "{balls.radius: [0.1, 1.0], balls.mass: [1, 2]}"),
        (KEYS, ["balls={rings: 1, radius: 1, speed: 1}"], "{cor: [0.8, 0.9]}"),
        (KEYS, ["cor=0.1,0.2", "seed=2"], KEYS.replace("0.8, 0.9", "0.1, 0.2")),
        (ZIPS, ["cor=1:0:3"], ZIPS.replace("0.8, 0.9, 0.9", "1, 0.5, 0")),
        (ZIPS, ["cor=0.5", "balls.radius=0.1"], f"{{zip: {OTHERS}}}"),
    ],
)
def test_override_replaces_a_sweep_at_its_place_or_ends_it(
    sweep: str, overrides: list[str], left: str
) -> None:
    assert swept(sweep, *overrides) == swept(left)
