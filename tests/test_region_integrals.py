"""Geometry in numbers, for shapes without formulas: beside the formulas of those that have them."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import pytest

from snooker_cli import region_integrals
from snooker_cli.containers import AccessibleRegion, Box, Channel, Circle, Container, PeriodicBox
from snooker_cli.engine.boundaries import fixed_boundary
from snooker_cli.errors import SceneError, UserError
from snooker_cli.live_page.page import check_shape
from snooker_cli.placement.places import lattice

SHAPES = [
    Circle(3.0),
    Box(4.0, 3.0),
    Box(2.0, 6.0),
    PeriodicBox(5.0, 4.0),
    Channel(4.0, 7.0),
    Channel(7.0, 3.0),
]
RADIUS = 0.3
every_shape = pytest.mark.parametrize("shape", SHAPES, ids=str)


@every_shape
def test_the_longest_wave(shape: Container) -> None:
    found = region_integrals.longest_wave(shape)
    assert found == pytest.approx(shape.longest_wave, rel=0.01)


@every_shape
def test_shares_of_rings(shape: Container) -> None:
    """Each of four walls cuts an arc with two ends, each right to half of a step of the angle."""
    places = region_integrals.even_places(shape, RADIUS)[:60]
    rings = np.linspace(0.1, 1.4, 9)
    found = region_integrals.ring_shares(shape, places, rings, RADIUS)
    formula = shape.ring_shares(places, rings, RADIUS)
    assert np.max(abs(found - formula)) <= 4 / region_integrals.ANGLES


@every_shape
def test_the_density_of_distances(shape: Container) -> None:
    """The share of pairs that are nearer than a distance, to a hundredth."""
    longest = shape.longest_distance(RADIUS)
    edges = np.linspace(0.0, longest, 2001)
    middles, width = (edges[1:] + edges[:-1]) / 2, longest / 2000
    found = np.cumsum(region_integrals.distance_density(shape, middles, RADIUS)) * width
    formula = np.cumsum(shape.distance_density(middles, RADIUS)) * width
    assert found[-1] == pytest.approx(1.0, abs=0.01)
    assert np.max(abs(found - formula)) <= 0.01


@every_shape
def test_the_longest_distance(shape: Container) -> None:
    found = region_integrals.longest_distance(shape, RADIUS)
    assert found == pytest.approx(shape.longest_distance(RADIUS), rel=0.01)


@pytest.mark.parametrize("shape", [shape for shape in SHAPES if shape.has_wall], ids=str)
def test_directions_to_the_wall(shape: Container) -> None:
    places = region_integrals.even_places(shape, RADIUS)[:200]
    found, formula = Container.wall_directions(shape, places), shape.wall_directions(places)
    along = np.sum(found * formula, axis=1) / np.hypot(*found.T) / np.hypot(*formula.T)
    assert np.all(along > 1 - 1e-9)


class Diamond(Container):
    """A square that stands on a corner, with this half of its height; it has no formula here."""

    name: ClassVar[str] = "diamond"
    title: ClassVar[str] = "diamond"
    keys: ClassVar[tuple[str, ...]] = ("half",)

    def __init__(self, *lengths: float) -> None:
        (self.half,) = lengths

    @property
    def size(self) -> tuple[float, float]:
        return (2 * self.half, 2 * self.half)

    @property
    def outline(self):
        return self.half * np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])

    def accessible(self, radius: float) -> AccessibleRegion:
        side = (self.half - math.sqrt(2) * radius) * math.sqrt(2)
        return AccessibleRegion(side**2, 4 * side, 8.0)

    def wall_gaps(self, places, radii):
        return (self.half - np.sum(abs(places), axis=-1)) / math.sqrt(2) - radii

    def put_inside(self, places, radii) -> None:
        raise NotImplementedError


def turned(places):
    """Places in the diamond as they are in the square, turned by 45°."""
    x, y = places.T / math.sqrt(2)
    return np.column_stack([x - y, x + y])


def test_a_shape_without_formulas_has_what_the_same_shape_turned_has() -> None:
    diamond, square = Diamond(2.0), Box(2 * math.sqrt(2), 2 * math.sqrt(2))
    assert diamond.longest_wave == pytest.approx(square.longest_wave, rel=0.01)
    longest = square.longest_distance(RADIUS)
    assert diamond.longest_distance(RADIUS) == pytest.approx(longest, rel=0.01)
    distances = (np.arange(1000) + 0.5) * longest / 1000
    pairs = (shape.distance_density(distances, RADIUS) for shape in (diamond, square))
    shares = [np.cumsum(density) * longest / 1000 for density in pairs]
    assert np.max(abs(shares[0] - shares[1])) <= 0.01
    places = region_integrals.even_places(diamond, RADIUS)[:60]
    rings = np.linspace(0.1, 1.4, 9)
    found = diamond.ring_shares(places, rings, RADIUS)
    formula = square.ring_shares(turned(places), rings, RADIUS)
    assert np.max(abs(found - formula)) <= 4 / region_integrals.ANGLES
    along = turned(diamond.wall_directions(places))
    assert np.all(np.argmax(abs(along), axis=1) == np.argmax(abs(turned(places)), axis=1))
    assert diamond.wall_lines.shape == (4, 2, 2)
    assert diamond.side_lengths(RADIUS) == {}


def test_what_draws_across_refuses_a_shape_that_has_no_such_direction() -> None:
    assert Diamond(2.0).across is None
    assert Circle(2.0).across == "radius"
    assert Box(1.0, 2.0).across == Channel(1.0, 2.0).across == "x"


def test_other_parts_refuse_it_and_name_the_file() -> None:
    with pytest.raises(SceneError, match=r"engine/boundaries\.py"):
        fixed_boundary(Diamond(2.0))
    with pytest.raises(SceneError, match=r"placement/places\.py"):
        lattice(Diamond(2.0), 3)
    with pytest.raises(UserError) as error:
        check_shape(Diamond(2.0))
    assert "pages/arena.js" in str(error.value)
