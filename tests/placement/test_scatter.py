"""Random starts: no overlaps in any container, uniform, up to what is stated, and the same bits."""

import hashlib
import math

import numpy as np
import pytest
from scipy import stats

from snooker_cli.config import Experiment
from snooker_cli.errors import SceneError
from snooker_cli.neighbours import near_pairs
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene

SHAPES = ("circle", "box", "periodic")


def experiment(shape: str, *species: dict, packing: float, **more: object) -> Experiment:
    balls = [{"speed": 1.0, "radius": 1.0, "start": "random"} | each for each in species]
    return Experiment.model_validate(
        {
            "container": {"shape": shape, "packing": packing},
            "balls": balls,
            "cor": 1.0,
            "time": 1.0,
            **more,
        }
    )


def scattered(shape: str, *species: dict, packing: float, repeat: int = 0) -> Scene:
    """Its overlaps have been looked for by ``arrange``."""
    return starting_scene(experiment(shape, *species, packing=packing), repeat)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("packing", [1e-6, 0.05, 0.4, 0.5, 0.7])
@pytest.mark.parametrize("number", [30, 1500])
def test_any_number_of_equal_balls(shape, packing, number):
    scene = scattered(shape, {"count": number}, packing=packing)
    assert scene.number == number
    assert scene.packing_fraction == pytest.approx(packing, rel=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("packing", [0.3, 0.75])
def test_species_of_different_sizes(shape, packing):
    """In the order given, each with its radius; the small ones fit between the large ones."""
    small, large = {"count": 900, "radius": 0.2}, {"count": 300, "radius": 1.0}
    scene = scattered(shape, small, large, packing=packing)
    assert scene.radii.tolist() == 900 * [0.2] + 300 * [1.0]
    assert scene.packing_fraction == pytest.approx(packing, rel=1e-12)


def test_a_few_balls_as_dense_as_random_places_get():
    """Seven balls reach 7/9 around one in the middle; pushed apart they come to 0.7 of that."""
    for repeat in range(5):
        scattered("circle", {"count": 7}, packing=0.7 * 7 / 9, repeat=repeat)
        scattered("circle", {"count": 1}, packing=0.8, repeat=repeat)


@pytest.mark.parametrize("shape", SHAPES)
def test_thin_gases_are_uniform(shape):
    """By Kolmogorov and Smirnov; centres of a ball in a room that it hardly fills."""
    scene = scattered(shape, {"count": 20_000}, packing=1e-4)
    x, y = (scene.positions / (np.array(scene.container.size) / 2)).T
    if shape == "circle":
        squares, angles = x * x + y * y, np.arctan2(y, x)
        assert stats.kstest(squares, stats.uniform(0, 1).cdf).pvalue > 0.001
        assert stats.kstest(angles, stats.uniform(-math.pi, 2 * math.pi).cdf).pvalue > 0.001
    else:
        for axis in (x, y):
            assert stats.kstest(axis, stats.uniform(-1, 2).cdf).pvalue > 0.001
        assert abs(np.mean(x * y)) < 4 / 3 / math.sqrt(scene.number)


def test_pairs_of_a_thin_gas_are_independent():
    """Each ball has packing * (k^2 - 4) others within k radii, as they only exclude each other."""
    packing, reach, number = 0.01, 10, 20_000
    scene = scattered("periodic", {"count": number}, packing=packing)
    pairs = sum(
        len(i)
        for i, _, _ in near_pairs(scene.positions, scene.radii, reach - 2, scene.container.period)
    )
    expected = number / 2 * packing * (reach**2 - 4)
    # Nearly Poisson's; the next virial coefficient adds less than the packing to the number.
    assert abs(pairs - expected) < 4 * math.sqrt(expected) + packing * expected


def test_repeats_have_places_of_their_own_and_points_share_them():
    first = scattered("box", {"count": 50}, packing=0.3)
    again = scattered("box", {"count": 50}, packing=0.3)
    other = scattered("box", {"count": 50}, packing=0.3, repeat=1)
    assert np.array_equal(first.positions, again.positions)
    assert not np.isin(first.positions, other.positions).any()
    point = starting_scene(experiment("box", {"count": 50, "speed": 9.0}, packing=0.3, cor=0.5), 0)
    assert np.array_equal(first.positions, point.positions)


GOLDEN = {
    # Inserted, and inserted and grown.
    ("circle", 0.3): "f1b64c6a71b79b74",
    ("box", 0.3): "deec34d516fb13bb",
    ("periodic", 0.3): "9d0ccdd488abd8d1",
    ("circle", 0.6): "afec19e3b963d212",
    ("box", 0.6): "8e83a587e2ea30c4",
    ("periodic", 0.6): "c83ddd0b4d34b1c0",
}


@pytest.mark.parametrize(("shape", "packing"), GOLDEN)
def test_golden_places(shape, packing):
    """What stored runs started from, to the last bit on any machine: +, -, *, / and roots only."""
    mixed = {"count": 100}, {"count": 100, "radius": 0.5}
    scene = scattered(shape, *mixed, packing=packing)
    digest = hashlib.sha256(scene.positions.astype("<f8").tobytes()).hexdigest()
    assert digest[:16] == GOLDEN[shape, packing]


@pytest.mark.parametrize("shape", SHAPES)
def test_what_is_too_dense_is_refused_with_what_is_reached(shape):
    with pytest.raises(SceneError, match=r"^1,000 balls put in at random and grown in") as caught:
        scattered(shape, {"count": 1000}, packing=0.83)
    assert caught.value.key == "container.packing"
    assert "reach a packing of 0.8200, and 0.83 is asked for; lower it, or set start: lattice" in (
        str(caught.value)
    )


def test_a_few_balls_in_a_box_jam_before():
    """Twenty in a square: rows from wall to wall reach 0.79 in no order, but 0.69 or so."""
    with pytest.raises(SceneError, match=r"reach a packing of 0\.[67]\d+, and 0\.81 is asked for"):
        scattered("box", {"count": 20}, packing=0.81)


def test_a_ball_wider_than_its_box_is_refused():
    wide = Experiment.model_validate(
        {
            "container": {"shape": "box", "width": 100.0, "height": 1.0},
            "balls": {"count": 3, "radius": 1.0, "speed": 1.0, "start": "random"},
            "cor": 1.0,
            "time": 1.0,
        }
    )
    with pytest.raises(SceneError, match=r"reach a packing of 0\.0235, and 0\.09425") as caught:
        starting_scene(wide, 0)
    assert caught.value.key == "balls.radius"
