"""Sweeps and overrides: which points they give, and that they read as if written in the file."""

import pickle

import pytest
from config_texts import BASE, PAIR, experiment

from snooker_cli.config import (
    BallList,
    ConfigError,
    Experiment,
    Rings,
    digest,
    parse,
    points,
    to_json,
)

# Sweeps


def test_without_a_sweep_there_is_one_point() -> None:
    (point,) = points(experiment())
    assert (point.index, point.parameters, point.experiment) == (0, (), experiment())


def test_last_key_runs_fastest() -> None:
    grid = points(experiment(BASE + "sweep: {cor: [0.8, 1], balls.radius: [0.1, 1.0, 0.5]}\n"))
    assert [point.index for point in grid] == list(range(6))
    assert [point.parameters for point in grid] == [
        (("cor", cor), ("balls.radius", radius)) for cor in (0.8, 1.0) for radius in (0.1, 1.0, 0.5)
    ]
    for point in grid:
        assert isinstance(point.experiment.balls, Rings)
        assert (("cor", point.experiment.cor), ("balls.radius", point.experiment.balls.radius)) == (
            point.parameters
        )
        assert point.experiment.sweep == ()


def test_point_is_the_experiment_with_the_values_written_in() -> None:
    grid = points(experiment(BASE + "sweep: {balls.rings: [1.0, 2]}\n"))
    for rings, point in zip((1, 2), grid, strict=True):
        assert point.experiment == experiment(BASE.replace("rings: 3", f"rings: {rings}"))
        assert type(point.parameters[0][1]) is int


def test_sweep_over_a_coordinate_and_a_pair() -> None:
    text = (
        PAIR
        + "sweep:\n  balls.list[0].position[1]: [0.1, 0.2]\n  balls.list[1].velocity: [[0, 1]]\n"
    )
    first, second = points(experiment(text))
    assert first.parameters == (
        ("balls.list[0].position[1]", 0.1),
        ("balls.list[1].velocity", (0.0, 1.0)),
    )
    assert isinstance(second.experiment.balls, BallList)
    assert second.experiment.balls.list[0].position == (-1.0, 0.2)
    assert second.experiment.balls.list[1].velocity == (0.0, 1.0)
    assert second.experiment.balls.list[1].position == (1.0, 0.25)


def test_sweep_over_an_absent_key() -> None:
    first, second = points(experiment(BASE + "sweep: {wall_cor: [null, 1.0]}\n"))
    assert (first.experiment.effective_wall_cor, second.experiment.effective_wall_cor) == (0.8, 1.0)


def test_empty_sweep_is_none() -> None:
    assert experiment(BASE + "sweep:\n") == experiment(BASE + "sweep: {}\n") == experiment()


def test_points_of_a_hand_made_experiment_are_checked() -> None:
    made = Experiment.model_validate(dict(experiment()) | {"sweep": {"cor": [0.8, 2.0]}})
    with pytest.raises(ConfigError, match=r"^cor: 2.0 is given .* \(at the point cor=2.0\)"):
        points(made)


def test_points_of_a_loaded_experiment() -> None:
    loaded = parse(BASE + "sweep: {cor: [0.8, 1]}\n")
    assert loaded.points() == points(loaded.experiment)


def test_points_can_be_sent_to_other_processes() -> None:
    grid = points(experiment(BASE + "sweep: {cor: [0.8, 1]}\n"))
    assert pickle.loads(pickle.dumps(grid)) == grid


@pytest.mark.parametrize(
    ("written", "values"),
    [
        ("0.5:1.0:11", "[0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0]"),
        ('" 1 : 0.5 : 3 "', "[1, 0.75, 0.5]"),
        ("range(2)", "[0, 1]"),
    ],
)
def test_ranges_in_a_sweep_are_as_if_their_values_were_listed(written: str, values: str) -> None:
    for sweep in ("sweep:\n  cor: {}\n", "sweep: {{cor: {}}}\n", "sweep: {{zip: {{cor: {}}}}}\n"):
        read = experiment(BASE + sweep.format(written))
        assert read == experiment(BASE + f"sweep: {{cor: {values}}}\n")


# Values that walk together

PAIRS = "{cor: [0.8, 0.9, 0.9], balls.radius: [0.1, 0.1, 1.0]}"


def settings(text: str, *overrides: str) -> list[dict[str, object]]:
    return [dict(point.parameters) for point in points(experiment(text, *overrides))]


def test_a_zip_is_one_axis_of_the_grid_where_it_stands() -> None:
    walked = [(0.8, 0.1), (0.9, 0.1), (0.9, 1.0)]
    inside = f"sweep: {{balls.mass: [1, 2], zip: {PAIRS}, balls.rings: [1, 2]}}\n"
    assert settings(BASE + inside) == [
        {"balls.mass": mass, "cor": cor, "balls.radius": radius, "balls.rings": rings}
        for mass in (1.0, 2.0)
        for cor, radius in walked
        for rings in (1, 2)
    ]
    (point, *_) = points(experiment(BASE + inside))
    assert [key for key, _ in point.parameters] == [
        "balls.mass",
        "cor",
        "balls.radius",
        "balls.rings",
    ]
    assert settings(BASE + f"sweep: {{zip: {PAIRS}}}\n") == [
        {"cor": cor, "balls.radius": radius} for cor, radius in walked
    ]


def test_several_zips_are_axes_one_after_the_other() -> None:
    sweep = f"""\
sweep:
  zip:
    - {PAIRS}
    - {{balls.mass: [3, 4]}}
    - {{balls.rings: "range(1, 3)", balls.speed: 1:2:2}}
"""
    assert settings(BASE + sweep) == [
        {
            "cor": cor,
            "balls.radius": radius,
            "balls.mass": mass,
            "balls.rings": rings,
            "balls.speed": speed,
        }
        for cor, radius in [(0.8, 0.1), (0.9, 0.1), (0.9, 1.0)]
        for mass in (3.0, 4.0)
        for rings, speed in ((1, 1.0), (2, 2.0))
    ]


@pytest.mark.parametrize(
    ("sweep", "same"),
    [
        ("{zip: {cor: [0.1, 0.2]}}", "{cor: [0.1, 0.2]}"),
        (
            "{zip: [{cor: [0.1, 0.2]}, {balls.mass: [1, 2]}]}",
            "{cor: [0.1, 0.2], balls.mass: [1, 2]}",
        ),
        ("{zip: {}, cor: [0.1]}", "{cor: [0.1]}"),
        ("{zip: null}", "{}"),
        ("{zip: [{}]}", "{}"),
        (f"{{zip: [{PAIRS}]}}", f"{{zip: {PAIRS}}}"),
    ],
)
def test_a_zip_of_one_key_is_that_key(sweep: str, same: str) -> None:
    assert experiment(BASE + f"sweep: {sweep}\n") == experiment(BASE + f"sweep: {same}\n")


@pytest.mark.parametrize(
    "sweep",
    [
        f"{{zip: {PAIRS}}}",
        f"{{time: [1, 2], zip: {PAIRS}, balls.mass: [1, 2]}}",
        f"{{zip: [{PAIRS}, {{time: [1, 2]}}, {{container.mass: [.inf, 1], balls.mass: [1, 2]}}]}}",
    ],
)
def test_a_zip_is_written_and_read_back(sweep: str) -> None:
    read = experiment(BASE + f"sweep: {sweep}\n")
    again = parse(to_json(read)).experiment
    assert again == read
    assert points(again) == points(read)


def test_points_of_a_zip_are_those_of_a_grid_bit_by_bit() -> None:
    zipped = points(experiment(BASE + f"sweep: {{zip: {PAIRS}}}\n"))
    grid = points(experiment(BASE + "sweep: {cor: [0.8, 0.9], balls.radius: [0.1, 1.0]}\n"))
    identities = [digest(point.experiment) for point in grid]
    assert [digest(point.experiment) for point in zipped] == [identities[k] for k in (0, 2, 3)]


def test_values_of_a_zip_are_tried_together() -> None:
    """Balls that slide need the wall fixed, which it is not otherwise."""
    sweep = (
        "sweep: {zip: {collapse: [slide, stop], container.mass: [.inf, 1.0e7]}}\n"
        "collapse: {tc: 0.1}\n"
    )
    first, second = points(experiment(BASE + sweep))
    assert (first.experiment.collapse, second.experiment.collapse) == ("slide", "stop")
    with pytest.raises(ConfigError, match=r"sweep\.collapse\[0\]: slide needs a fixed wall"):
        experiment(BASE + sweep.replace("zip: {", "").replace("}}", "}"))


def test_positions_of_a_zip() -> None:
    loaded = parse(BASE + f"sweep:\n  zip:\n    - {PAIRS}\n", "run.yaml")
    assert str(loaded.locate("cor")) == "run.yaml:8:13"
    assert str(loaded.locate("balls.radius")) == "run.yaml:8:44"


def test_overrides_of_a_zip() -> None:
    swept = BASE + f"sweep: {{zip: [{PAIRS}, {{balls.mass: [1, 2], time: [1, 2]}}]}}\n"
    others = "{balls.mass: [1, 2], time: [1, 2]}"

    def zipped(*overrides: str) -> object:
        return experiment(swept, *overrides).sweep

    def written(sweep: str) -> object:
        return experiment(BASE + f"sweep: {sweep}\n").sweep

    assert zipped("cor=1:0:3") == written(
        f"{{zip: [{PAIRS.replace('0.8, 0.9, 0.9', '1, 0.5, 0')}, {others}]}}"
    )
    assert zipped("cor=0.5", "balls.radius=0.1") == written(f"{{zip: {others}}}")
    assert zipped(f"sweep.zip={others}") == written(f"{{zip: {others}}}")
    assert zipped("sweep.zip=null") == ()
    with pytest.raises(ConfigError, match=r"there are 3 of cor, 2 of balls\.radius; add"):
        zipped("balls.radius=1,2")
    assert experiment(BASE, f"sweep.zip={others}") == experiment(BASE, f"sweep={{zip: {others}}}")


# Overrides


@pytest.mark.parametrize(
    ("override", "written"),
    [
        ("cor=0.5", BASE.replace("cor: 0.8", "cor: 0.5")),
        (" cor = 0.5 # half", BASE.replace("cor: 0.8", "cor: 0.5")),
        ("container.mass=.inf", BASE.replace("1.0e7", ".inf")),
        ("balls.rings=4", BASE.replace("rings: 3", "rings: 4")),
        ("time=1e1", BASE + "time: 10\n"),
        ("collisions=1e6", BASE.replace("500", "1000000")),
        ("wall_cor=null", BASE),
        ("title='a, b: c = d'", BASE + "title: 'a, b: c = d'\n"),
        ("title=no", BASE + "title: 'no'\n"),
        ("container={radius: 5}", BASE.replace("{radius: 10.0, mass: 1.0e7}", "{radius: 5}")),
        ("sweep={cor: [0.1, 0.2]}", BASE + "sweep: {cor: [0.1, 0.2]}\n"),
        ("cor=0.1, 0.2", BASE + "sweep: {cor: [0.1, 0.2]}\n"),
        ("balls.rings=range(1,6)", BASE + "sweep: {balls.rings: [1, 2, 3, 4, 5]}\n"),
        ("balls.rings=range(2)", BASE + "sweep: {balls.rings: [0, 1]}\n"),
        ("balls.rings=range(7, 0, -3)", BASE + "sweep: {balls.rings: [7, 4, 1]}\n"),
        ("balls.rings=1:5:3", BASE + "sweep: {balls.rings: [1, 3, 5]}\n"),
        ("cor=1.0:0.5:3", BASE + "sweep: {cor: [1.0, 0.75, 0.5]}\n"),
        ("wall_cor=null, 1", BASE + "sweep: {wall_cor: [null, 1]}\n"),
    ],
)
def test_override_is_as_if_it_had_been_written(override: str, written: str) -> None:
    assert experiment(BASE, override) == experiment(written)


def test_override_inside_a_list() -> None:
    assert experiment(PAIR, "balls.list[1].velocity=[3, 4]") == experiment(
        PAIR.replace("velocity: [0, 0]", "velocity: [3, 4]")
    )


def test_override_builds_balls_by_paths() -> None:
    without = "container: {radius: 10}\ncor: 1\ntime: 1\n"
    read = experiment(without, "balls.rings=2", "balls.radius=0.5", "balls.speed=3")
    assert read.balls == Rings(rings=2, radius=0.5, speed=3.0)


def test_spaced_values_are_the_doubles_of_their_decimals() -> None:
    (((_, values),),) = experiment(BASE, "cor=0.5:1.0:11").sweep
    assert repr(values) == "(0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 1.0)"
    (((_, values),),) = experiment(BASE, "balls.radius=0.1:0.3:3").sweep
    assert repr(values) == "(0.1, 0.2, 0.3)"
    (((_, values),),) = experiment(BASE, "cor=0:1:4").sweep
    assert values == (0.0, 1 / 3, 2 / 3, 1.0)
    (((_, values),),) = experiment(BASE, "balls.radius=1e-300:1e300:3").sweep
    assert values == (1e-300, 5e299, 1e300)


def test_plain_override_ends_sweeps_of_the_key_and_inside_it() -> None:
    swept = BASE + "sweep: {cor: [0.8, 0.9], balls.radius: [0.1, 1.0], balls.mass: [1, 2]}\n"
    assert experiment(swept, "cor=0.5").sweep == (
        (("balls.radius", (0.1, 1.0)),),
        (("balls.mass", (1.0, 2.0)),),
    )
    whole = experiment(swept, "balls={rings: 1, radius: 1, speed: 1}")
    assert whole.sweep == ((("cor", (0.8, 0.9)),),)
    assert experiment(swept, "balls.speed=1").sweep == experiment(swept).sweep
    assert experiment(swept, "sweep=null").sweep == ()


def test_multiple_override_replaces_the_sweep_in_its_place() -> None:
    swept = BASE + "sweep: {cor: [0.8, 0.9], balls.radius: [0.1, 1.0]}\n"
    assert experiment(swept, "cor=0.1,0.2", "seed=2").sweep == (
        (("cor", (0.1, 0.2)),),
        (("balls.radius", (0.1, 1.0)),),
    )


def test_later_overrides_win() -> None:
    assert experiment(BASE, "cor=0.1", "cor=0.2") == experiment(BASE, "cor=0.2")
    assert experiment(BASE, "cor=0.1,0.2", "cor=0.8") == experiment()
