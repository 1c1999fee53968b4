"""Rings, lattices and random places: correctly rounded, without overlaps, dense, uniform."""

import hashlib
import math
from dataclasses import replace

import numpy as np
import pytest
from flint import arb, ctx, fmpq
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import EPSILON, uniform
from scipy import stats

from snooker_cli.config import Config
from snooker_cli.containers import MOST_SPEED, SHAPES, Circle, Container, PeriodicBox
from snooker_cli.errors import SceneError
from snooker_cli.laws import Constant
from snooker_cli.placement.places import lattice, ring_positions, unit_polygon
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene, check

# Rings


@pytest.mark.parametrize("corners", [1, 2, 3, 5, 12, 126, 6000])
def test_polygons_are_correctly_rounded(corners):
    """Against the cosine and sine of each corner with 60 digits, rounded once."""
    with ctx.workdps(60):
        corners_of = [arb.sin_cos_pi_fmpq(fmpq(2 * k, corners)) for k in range(corners)]
        exact = [(float(cosine), float(sine)) for sine, cosine in corners_of]
    assert list(unit_polygon(corners)) == exact


def test_rings():
    """1 + 3n(n + 1) balls: 6k on the ring of radius k/n of the extent."""
    for rings in (0, 1, 2, 3, 7):
        positions = ring_positions(rings, 8.0)
        assert positions.shape == (1 + 3 * rings * (rings + 1), 2)
        assert positions[0].tolist() == [0.0, 0.0]
        expected = [8.0 * k / rings for k in range(1, rings + 1) for _ in range(6 * k)]
        assert np.hypot(*positions[1:].T) == pytest.approx(expected, rel=2 * EPSILON)


# Lattices


def of_size(shape: str, width: float, height: float) -> Container:
    lengths = [width / 2] if shape == "circle" else [width, height]
    return SHAPES[shape](*lengths[: len(SHAPES[shape].keys)])


def packed(container: Container, number: int) -> Scene:
    """Balls at the places of a lattice, as large as fit there."""
    positions, diameter = lattice(container, number)
    assert positions.shape == (number, 2)
    return Scene(
        positions=positions,
        velocities=np.zeros((number, 2)),
        radii=np.full(number, diameter / 2),
        masses=np.ones(number),
        container=container,
        container_mass=math.inf,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        pair_law=Constant(1.0),
        wall_law=Constant(1.0),
    )


@given(st.sampled_from(tuple(SHAPES)), st.integers(1, 2000), st.floats(-6, 6), st.floats(-1.5, 1.5))
@settings(derandomize=True, deadline=None, max_examples=150)
def test_balls_fit_up_to_the_stated_diameter(shape, number, scale, aspect):
    """They touch each other and the wall, up to the rounding that ``check`` accepts."""
    container = of_size(shape, 10.0**scale, 10.0 ** (scale + aspect))
    scene = packed(container, number)
    diameter = 2 * scene.radii[0]
    assert 0 < diameter <= min(container.size)
    # ``check`` refuses images that are nearer than five diameters.
    if container.period is None or min(container.period) > 5.001 * diameter:
        check(scene)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("number", [1003, 1999, 31_415])
def test_thousands_of_balls_reach_a_packing_of_0_85(shape, number):
    assert packed(of_size(shape, 1.0, 1.0), number).packing_fraction > 0.85


@pytest.mark.parametrize(
    ("number", "radius"),
    [(1, 1.0), (3, 1 / (1 + 2 / math.sqrt(3))), (19, 1 / 5)],
)
def test_closest_packings_in_a_circle(number, radius):
    """The best there are for 1 and 3 (Graham 1968), the hexagon for 19."""
    assert packed(Circle(1.0), number).radii[0] == pytest.approx(radius, rel=1e-14)


def test_commensurate_lattices_reach_the_closest_packing():
    """Twelve rows of ten, in a box that fits them: pi / sqrt(12)."""
    size = (10.0, 12 * math.sqrt(3) / 2)
    for box in (PeriodicBox(*size), PeriodicBox(*size[::-1])):
        closest = math.pi / math.sqrt(12)
        assert packed(box, 120).packing_fraction == pytest.approx(closest, rel=1e-13)


@pytest.mark.parametrize("speed", [5e151, 1e149])
def test_a_container_is_as_fast_as_files_allow(speed):
    scene = packed(Circle(10.0), 7)
    moving = replace(scene, container_mass=1.0, container_velocity=np.array([speed, 0.0]))
    if speed < MOST_SPEED:
        check(moving)
        return
    with pytest.raises(SceneError, match="it is above"):
        check(moving)


# Random places; ``starting_scene`` checks that they do not overlap


def gas(
    shape: str, *species: dict, packing: float | None, repeat: int = 0, **more: object
) -> Scene:
    """Balls of 1 m at random places, with common_random: the golden places are of these bits."""
    data = {
        "container": {"shape": shape, "packing": packing},
        "balls": [{"speed": 1.0, "radius": 1.0, "start": "random"} | count for count in species],
        "cor": 1.0,
        "time": 1.0,
        "common_random": True,
    }
    return starting_scene(Config.model_validate(data | more), repeat)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("packing", [1e-6, 0.5, 0.75])
@pytest.mark.parametrize("numbers", [(40, 0), (900, 300)])
def test_balls_of_one_or_two_sizes(shape, packing, numbers):
    """In the given order, each with its radius; small balls fit between large ones."""
    sizes = [(number, radius) for number, radius in zip(numbers, (0.2, 1.0), strict=True) if number]
    packing = min(packing, 0.7) if sum(numbers) < 100 else packing
    scene = gas(shape, *({"count": n, "radius": radius} for n, radius in sizes), packing=packing)
    assert scene.radii.tolist() == [radius for n, radius in sizes for _ in range(n)]
    assert scene.packing_fraction == pytest.approx(packing, rel=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_dilute_gases_are_uniform(shape):
    """By Kolmogorov and Smirnov, beside random places by rejection."""
    scene = gas(shape, {"count": 20_000}, packing=1e-4)
    found, expected = scene.positions.T, uniform(scene.container, 1.0, 0).T
    for x, y in ((1.0, 0.0), (0.0, 1.0), (0.6, 0.8), (0.8, -0.6)):
        along, as_expected = x * found[0] + y * found[1], x * expected[0] + y * expected[1]
        assert stats.kstest(along, as_expected).pvalue > 0.001
    assert stats.kstest(np.hypot(*found), np.hypot(*expected)).pvalue > 0.001


GOLDEN = {
    # Inserted, and inserted and pushed apart.
    ("circle", 0.3): "f1b64c6a71b79b74",
    ("box", 0.3): "deec34d516fb13bb",
    ("periodic", 0.3): "9d0ccdd488abd8d1",
    ("circle", 0.6): "afec19e3b963d212",
    ("box", 0.6): "8e83a587e2ea30c4",
    ("periodic", 0.6): "c83ddd0b4d34b1c0",
}


@pytest.mark.parametrize(("shape", "packing"), GOLDEN)
def test_golden_places(shape, packing):
    """The bits from which stored runs started, on any machine."""
    scene = gas(shape, {"count": 100}, {"count": 100, "radius": 0.5}, packing=packing)
    digest = hashlib.sha256(scene.positions.astype("<f8").tobytes()).hexdigest()
    assert digest[:16] == GOLDEN[shape, packing]


@pytest.mark.parametrize(
    ("shape", "number", "size", "key", "reached"),
    [
        *((shape, 1000, {"packing": 0.83}, "container.packing", "0.8200") for shape in SHAPES),
        # Twenty balls in a square jam at about 0.69.
        ("box", 20, {"packing": 0.81}, "container.packing", r"0\.[67]\d+"),
        ("box", 3, {"width": 100.0, "height": 1.0}, "balls[0].radius", "0.0235"),
    ],
)
def test_too_dense_a_gas_is_refused_with_the_packing_reached(shape, number, size, key, reached):
    with pytest.raises(SceneError, match=f"reach a packing of {reached}") as caught:
        gas(shape, {"count": number}, packing=None, container={"shape": shape, **size})
    assert caught.value.key == key
