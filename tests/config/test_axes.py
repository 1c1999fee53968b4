"""Sweeps, ranges and overrides: they are read as if their values were written in the file."""

from decimal import Decimal

import pytest
from config_texts import BASE, PAIR, experiment
from hypothesis import given, settings
from hypothesis import strategies as st

from snooker_cli.config import ConfigError, Rings, points

PAIRS = "{cor: [0.8, 0.9, 0.9], balls.radius: [0.1, 0.1, 1.0]}"
OTHERS = "{balls.mass: [1, 2], time: [1, 2]}"


def swept(sweep: str, *overrides: str) -> object:
    return experiment(BASE + f"sweep: {sweep}\n", *overrides).sweep


def parameters(sweep: str) -> list[list[tuple[str, object]]]:
    return [list(point.parameters) for point in points(experiment(BASE + f"sweep: {sweep}\n"))]


# Ranges


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
    (((_, values),),) = experiment(BASE, f"balls.speed={start}:{stop}:{count}").sweep
    exact = [start + (stop - start) * step / (count - 1) for step in range(count)]
    assert list(values) == [float(str(value)) for value in exact]


# Sweeps


def test_a_swept_key_needs_no_value_of_its_own() -> None:
    """Not in the file, and not with -o; a value that is there stays."""
    without = BASE.replace("cor: 0.8\n", "")
    whole = points(experiment(BASE, "cor=.8,.9"))
    for text, options in ((without, ["cor=.8,.9"]), (without + "sweep: {cor: [0.8, 0.9]}\n", [])):
        assert points(experiment(text, *options)) == whole
    unended = BASE.replace("collisions: 500\n", "sweep: {zip: {time: [1, 2]}}\n")
    assert [point.experiment.time for point in points(experiment(unended))] == [1.0, 2.0]
    assert experiment(BASE, "cor=.9,1").cor == 0.8


def test_a_zip_is_one_axis_of_the_grid_at_its_place() -> None:
    steps = [(0.8, 0.1), (0.9, 0.1), (0.9, 1.0)]
    assert parameters(f"{{balls.mass: [1, 2], zip: {PAIRS}, balls.rings: [1, 2]}}") == [
        [("balls.mass", mass), ("cor", cor), ("balls.radius", radius), ("balls.rings", rings)]
        for mass in (1.0, 2.0)
        for cor, radius in steps
        for rings in (1, 2)
    ]
    assert parameters(f"{{zip: {PAIRS}}}") == [
        [("cor", cor), ("balls.radius", radius)] for cor, radius in steps
    ]


def test_several_zips_are_consecutive_axes() -> None:
    zips = f'[{PAIRS}, {{balls.mass: [3, 4]}}, {{balls.rings: "range(1, 3)", time: 1:2:2}}]'
    assert parameters(f"{{zip: {zips}}}") == [
        [*pair, ("balls.mass", mass), ("balls.rings", rings), ("time", float(rings))]
        for pair in parameters(f"{{zip: {PAIRS}}}")
        for mass in (3.0, 4.0)
        for rings in (1, 2)
    ]


def test_a_zip_of_one_key_is_that_key() -> None:
    for sweep, same in {
        "{zip: {cor: [0.1, 0.2]}}": "{cor: [0.1, 0.2]}",
        "{zip: [{cor: [0.1]}, {balls.mass: [1, 2]}]}": "{cor: [0.1], balls.mass: [1, 2]}",
        "{zip: {}, cor: [0.1]}": "{cor: [0.1]}",
        "{zip: null}": "{}",
        "{zip: [{}]}": "",
        f"{{zip: [{PAIRS}]}}": f"{{zip: {PAIRS}}}",
    }.items():
        assert swept(sweep) == swept(same)


def test_values_of_a_zip_are_checked_together() -> None:
    """Balls that slide need a fixed wall, which only the zip gives."""
    sweep = (
        "sweep: {zip: {collapse: [slide, stop], container.mass: [.inf, 1.0e7]}}\n"
        "collapse: {tc: 0.1}\n"
    )
    first, second = points(experiment(BASE + sweep))
    assert (first.experiment.collapse, second.experiment.collapse) == ("slide", "stop")
    with pytest.raises(ConfigError, match=r"sweep\.collapse\[0\]: slide"):
        experiment(BASE + sweep.replace("zip: {", "").replace("}}", "}"))


# Overrides


@pytest.mark.parametrize(
    ("override", "written"),
    [
        (" cor = 0.5 # half", BASE.replace("cor: 0.8", "cor: 0.5")),
        ("balls.speed=1e-300:1e150:3", BASE + "sweep: {balls.speed: [1e-300, 5e149, 1e150]}\n"),
        ("container.mass=.inf", BASE.replace("1.0e7", ".inf")),
        ("wall_cor=null", BASE),
        ("title='a, b: c = d'", BASE + "title: 'a, b: c = d'\n"),
        ("container={radius: 5}", BASE.replace("{radius: 10.0, mass: 1.0e7}", "{radius: 5}")),
        (f"sweep={{zip: {OTHERS}}}", BASE + f"sweep: {{zip: {OTHERS}}}\n"),
        ("cor=0.1, 0.2", BASE + "sweep: {cor: [0.1, 0.2]}\n"),
        ("balls.rings=range(1,6)", BASE + "sweep: {balls.rings: [1, 2, 3, 4, 5]}\n"),
        ("balls.rings=range(7, 0, -3)", BASE + "sweep: {balls.rings: [7, 4, 1]}\n"),
        ("wall_cor=null, 1", BASE + "sweep: {wall_cor: [null, 1]}\n"),
    ],
)
def test_override_is_read_as_if_it_were_written(override: str, written: str) -> None:
    assert experiment(BASE, override) == experiment(written)


def test_overrides_reach_into_lists_and_build_mappings() -> None:
    assert experiment(PAIR, "balls.list[1].velocity=[3, 4]") == experiment(
        PAIR.replace("velocity: [0, 0]", "velocity: [3, 4]")
    )
    without = "container: {radius: 10}\ncor: 1\ntime: 1\n"
    read = experiment(without, "balls.rings=2", "balls.radius=0.5", "balls.speed=3")
    assert read.balls == Rings(rings=2, radius=0.5, speed=3.0)


KEYS = "{cor: [0.8, 0.9], balls.radius: [0.1, 1.0], balls.mass: [1, 2]}"
ZIPS = f"{{zip: [{PAIRS}, {OTHERS}]}}"


@pytest.mark.parametrize(
    ("sweep", "overrides", "left"),
    [
        (KEYS, ["cor=0.5"], "{balls.radius: [0.1, 1.0], balls.mass: [1, 2]}"),
        (KEYS, ["balls={rings: 1, radius: 1, speed: 1}"], "{cor: [0.8, 0.9]}"),
        (KEYS, ["balls.speed=1"], KEYS),
        (KEYS, ["sweep=null"], "{}"),
        (KEYS, ["cor=0.1,0.2", "seed=2"], KEYS.replace("0.8, 0.9", "0.1, 0.2")),
        (ZIPS, ["cor=1:0:3"], ZIPS.replace("0.8, 0.9, 0.9", "1, 0.5, 0")),
        (ZIPS, ["cor=0.5", "balls.radius=0.1"], f"{{zip: {OTHERS}}}"),
    ],
)
def test_override_replaces_a_sweep_at_its_place_or_ends_it(
    sweep: str, overrides: list[str], left: str
) -> None:
    assert swept(sweep, *overrides) == swept(left)


def test_overrides_are_applied_in_order() -> None:
    whole, part = "balls={rings: 1, radius: 1, speed: 1}", "balls.speed=2"
    assert experiment(BASE, whole, part) == experiment(BASE, whole.replace("speed: 1", "speed: 2"))
    assert experiment(BASE, part, whole) == experiment(BASE, whole)
    with pytest.raises(ConfigError, match=r"there are 3 of cor, 2 of balls\.radius"):
        swept(ZIPS, "balls.radius=1,2")
