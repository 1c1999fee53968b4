"""Lattices: places inside the container, as far apart as claimed, and dense."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snooker_cli.containers import SHAPES, Container
from snooker_cli.placement.places import lattice
from snooker_cli.scene import Scene, check


def container_of(shape: str, size: tuple[float, float]) -> Container:
    return SHAPES[shape](*([size[0] / 2] if shape == "circle" else size))


def packed(shape: str, size: tuple[float, float], number: int, part: float = 1.0) -> Scene:
    """Balls at the places of a lattice, as large as fit there, or a part of that."""
    container = container_of(shape, size)
    positions, diameter = lattice(container, number)
    assert positions.shape == (number, 2)
    return Scene(
        positions=positions,
        velocities=np.zeros((number, 2)),
        radii=np.full(number, part * diameter / 2),
        masses=np.ones(number),
        container=container,
        container_mass=math.inf,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        restitution=1.0,
        wall_restitution=1.0,
    )


@given(
    st.sampled_from(tuple(SHAPES)),
    st.integers(1, 2000),
    st.floats(-6, 6),
    st.floats(-1.5, 1.5),
)
@settings(derandomize=True, deadline=None, max_examples=150)
def test_balls_fit_up_to_the_diameter_stated(shape, number, scale, aspect):
    """Touching each other and the wall, to the rounding that ``check`` lets pass."""
    width = 10.0**scale
    size = (width, width if shape == "circle" else width * 10.0**aspect)
    scene = packed(shape, size, number)
    diameter = 2 * scene.radii[0]
    assert 0 < diameter <= min(size)
    # A periodic box needs five diameters, which its own check tells.
    if shape != "periodic" or min(size) > 5.001 * diameter:
        check(scene)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("number", [1000, 1003, 1055, 1120, 1999, 4096, 10_000, 31_415])
def test_thousands_of_balls_reach_a_packing_of_0_85(shape, number):
    assert packed(shape, (1.0, 1.0), number).packing_fraction > 0.85


@pytest.mark.parametrize(
    ("number", "radius"),
    [(1, 1.0), (2, 1 / 2), (3, 1 / (1 + 2 / math.sqrt(3))), (7, 1 / 3), (19, 1 / 5)],
)
def test_closest_packings_in_a_circle(number, radius):
    """The best there are for 1, 2, 3 and 7 (Graham 1968), the hexagon for 19."""
    assert packed("circle", (2.0, 2.0), number).radii[0] == pytest.approx(radius, rel=1e-14)


def test_commensurate_lattices_reach_the_closest_packing():
    """Twelve rows of ten, in a box that fits them: pi / sqrt(12)."""
    size = (10.0, 12 * math.sqrt(3) / 2)
    closest = math.pi / math.sqrt(12)
    assert packed("periodic", size, 120).packing_fraction == pytest.approx(closest, rel=1e-13)
    lying = packed("periodic", size[::-1], 120)
    assert lying.packing_fraction == pytest.approx(closest, rel=1e-13)


def test_rows_in_a_box():
    """Three rows of 3, 2 and 3 in the box that they fill, and a row along a channel."""
    size = (3.0, 1 + math.sqrt(3))
    scene = packed("box", size, 8)
    assert 2 * scene.radii[0] == pytest.approx(1.0, rel=1e-14)
    assert np.sort(scene.positions[:, 0]) == pytest.approx([-1, -1, -0.5, 0, 0, 0.5, 1, 1])
    channel = packed("box", (1.0, 5.0), 5)
    assert 2 * channel.radii[0] == pytest.approx(1.0, rel=1e-14)
    assert np.sort(channel.positions[:, 1]) == pytest.approx([-2, -1, 0, 1, 2])


@pytest.mark.parametrize("shape", SHAPES)
def test_the_lattice_fills_the_whole_container(shape):
    """The middle of the balls is that of the container and their spread that of a uniform gas."""
    positions = lattice(container_of(shape, (2.0, 2.0)), 1000).positions
    assert np.mean(positions, axis=0) == pytest.approx([0, 0], abs=0.02)
    uniform = 1 / 4 if shape == "circle" else 1 / 3
    assert np.mean(positions**2, axis=0) == pytest.approx([uniform, uniform], rel=0.06)


def test_empty_places_are_spread_evenly():
    """93 balls in a square have places to spare; every quarter has its share of them."""
    positions = lattice(container_of("periodic", (1.0, 1.0)), 93).positions
    quarters = np.histogram2d(*positions.T, bins=2)[0]
    assert np.all(abs(quarters - 93 / 4) < 4)
