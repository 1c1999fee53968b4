"""Containers: their geometry against random points, and what they refuse."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import DARTS, report_scene, uniform
from scipy.special import jv

from snooker_cli.containers import SHAPES, Box, Channel, Circle, PeriodicBox
from snooker_cli.engine.boundaries import BOUNDARIES
from snooker_cli.errors import SceneError

CONTAINERS = [shape(*(7.0, 4.0)[: len(shape.keys)]) for shape in SHAPES.values()]
every_container = pytest.mark.parametrize("container", CONTAINERS, ids=list(SHAPES))

ERRORS = 5.0
"""Standard errors that a mean over random points may be off."""


@every_container
def test_areas_are_those_of_random_points(container):
    radius = 0.5
    width, height = container.size
    part = len(uniform(container, radius, 0)) / DARTS
    error = math.sqrt(part * (1 - part) / DARTS)
    area = container.accessible(radius).area
    assert abs(area / (width * height) - part) <= ERRORS * error + 1e-12
    assert container.area == pytest.approx(container.accessible(0.0).area, rel=1e-15)


@every_container
def test_the_wall_is_the_growth_of_the_area(container):
    """And the edge's own growth is ``spreading``."""
    step = 1e-4
    less, more = (container.accessible(0.5 + sign * step) for sign in (1, -1))
    here = container.accessible(0.5)
    assert (more.area - less.area) / (2 * step) == pytest.approx(here.edge, rel=1e-9)
    assert (more.edge - less.edge) / (2 * step) == pytest.approx(here.spreading, rel=1e-9)
    assert container.accessible(0.0).edge == pytest.approx(container.wall_length, rel=1e-15)
    assert (container.wall_length > 0) == container.has_wall


@every_container
def test_a_packing_gives_back_its_sizes(container):
    radius = container.ball_radius(0.3, 12)
    squares = 12 * radius**2
    assert container.packing_fraction(squares) == pytest.approx(0.3, rel=1e-14)
    made = type(container).for_packing(0.3, squares)
    assert made.area == pytest.approx(container.area, rel=1e-14)
    assert len(set(made.lengths.values())) == 1
    assert container.scaled(2.0).area == pytest.approx(4 * container.area, rel=1e-14)
    assert container.scaled(2.0).size == tuple(2 * side for side in container.size)


@every_container
def test_a_step_of_the_gap_in_the_direction_of_the_wall_ends_at_it(container):
    places = uniform(container, 0.2, 1)[:1000]
    directions = container.wall_directions(places)
    lengths = np.hypot(*directions.T)
    gaps = container.wall_gaps(places, np.full(len(places), 0.2))
    at_wall = places + directions * (gaps / lengths)[:, None]
    np.testing.assert_allclose(
        container.wall_gaps(at_wall, np.full(len(places), 0.2)), 0, atol=1e-14
    )


@every_container
def test_balls_are_put_inside(container):
    generator = np.random.default_rng(2)
    places = generator.normal(0.0, 3.0, (1000, 2))
    radii = generator.uniform(0.0, 1.0, 1000)
    before = places.copy()
    container.put_inside(places, radii)
    gaps = container.wall_gaps(places, radii)
    assert gaps.min() >= -1e-14
    if container.has_wall:
        inside = container.wall_gaps(before, radii) >= 0
        walls = ~np.array(container.periodic)
        np.testing.assert_array_equal(places[inside][:, walls], before[inside][:, walls])
        assert np.max(gaps[~inside]) <= 1e-14
    repeats = np.flatnonzero(container.periodic)
    steps = (places - before)[:, repeats] / np.array(container.size)[repeats]
    np.testing.assert_allclose(steps, np.rint(steps), atol=1e-14)
    assert np.all(abs(places[:, repeats]) <= np.array(container.size)[repeats] / 2)


@every_container
def test_distances_of_random_places_have_their_density(container):
    """Compared by cumulative fractions, whose error is at most 1/(2√n)."""
    radius = 0.3
    first, second = uniform(container, radius, 3), uniform(container, radius, 4)
    number = min(len(first), len(second))
    offsets = container.nearest_image(first[:number] - second[:number])
    longest = container.longest_distance(radius)
    distances = np.hypot(*offsets.T)
    assert distances.max() <= longest
    grid = np.linspace(0.0, longest, 2001)
    middles = (grid[1:] + grid[:-1]) / 2
    fractions = np.cumsum(container.distance_density(middles, radius)) * grid[1]
    assert fractions[-1] == pytest.approx(1.0, abs=1e-3)
    found = np.searchsorted(np.sort(distances), grid[1:]) / number
    assert np.max(np.abs(found - fractions)) <= ERRORS / (2 * math.sqrt(number)) + 1e-3


def test_the_nearest_image_is_the_shortest_of_all():
    box = PeriodicBox(7.0, 4.0)
    offsets = np.random.default_rng(5).uniform(-9.0, 9.0, (1000, 2))
    steps = np.array([[7.0 * i, 4.0 * j] for i in range(-3, 4) for j in range(-3, 4)])
    shortest = np.min(np.hypot(*np.moveaxis(offsets[:, None] + steps, -1, 0)), axis=1)
    np.testing.assert_allclose(np.hypot(*box.nearest_image(offsets).T), shortest, rtol=1e-14)
    assert box.period == box.size
    for container in (Circle(3.0), Box(7.0, 4.0)):
        assert container.period is None
        np.testing.assert_array_equal(container.nearest_image(offsets), offsets)


@every_container
def test_an_outline_encloses_the_area(container):
    x, y = container.outline.T
    enclosed = 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    assert enclosed == pytest.approx(container.area, rel=1e-3)
    assert tuple(np.ptp(container.outline, axis=0)) == pytest.approx(container.size, rel=1e-15)


@pytest.mark.parametrize(
    ("container", "radii", "key", "ball"),
    [
        (Circle(3.0), [1.0, 3.0], "balls", 1),
        (PeriodicBox(9.99, 12.0), [0.5, 1.0], "container.width", None),
        (PeriodicBox(12.0, 9.99), [1.0], "container.height", None),
        (Channel(3.0, 9.99), [1.0], "container.height", None),
    ],
)
def test_balls_that_are_too_large_are_refused(container, radii, key, ball):
    with pytest.raises(SceneError) as caught:
        container.check_radii(np.array(radii))
    assert (caught.value.key, caught.value.ball) == (key, ball)


def test_the_largest_balls_are_accepted():
    Circle(3.0).check_radii(np.array([math.nextafter(3.0, 0.0)]))
    Box(2.0, 7.0).check_radii(np.array([1.0]))
    PeriodicBox(10.001, 10.001).check_radii(np.array([1.0]))


@every_container
def test_the_longest_shear_wave_feels_no_stress_at_smooth_walls(container):
    """∇⁴ψ = −k²∇²ψ with ψ = 0 and no shear stress on the wall, by differences of ψ."""
    k = 2 * math.pi / container.longest_wave
    if isinstance(container, Circle):
        x = k * container.radius

        def flow(r):  # ψ of two vortices along the line through both
            return float(jv(1, k * r) - jv(1, x) * r / container.radius)

        h, edge = 1e-3, container.radius
        slope = (flow(edge + h) - flow(edge - h)) / (2 * h)
        bend = (flow(edge + h) - 2 * flow(edge) + flow(edge - h)) / h**2
        # r ∂(u/r)/∂r = 0 with u = −∂ψ/∂r; a slower mode would have an edge nearer to zero.
        assert bend == pytest.approx(slope / edge, abs=1e-6)
        assert k * edge == pytest.approx(3.0542, abs=1e-4)
    elif container.keeps_drift():
        between = container.size[container.periodic.index(False)]
        assert k * between == pytest.approx(math.pi)  # v = sin(kx): no stress at k x = π/2
    elif container.has_wall:
        width, height = container.size
        assert k**2 == pytest.approx((math.pi / width) ** 2 + (math.pi / height) ** 2)
    else:
        assert k == pytest.approx(2 * math.pi / 7.0)


@every_container
def test_each_side_has_its_length(container):
    """Together they are the edge, of which sides of a channel have a half each."""
    lengths, edge = container.side_lengths(0.2), container.accessible(0.2).edge
    assert (*lengths,) == container.sides, f"side_lengths of {container.title} in containers.py"
    if lengths:
        assert sum(lengths.values()) == pytest.approx(edge)
    if container.keeps_drift():
        assert [*lengths.values()] == pytest.approx([edge / 2] * 2)


def test_each_shape_has_a_boundary() -> None:
    missing = SHAPES.keys() - BOUNDARIES.keys() - {Circle.name}
    assert not missing, f"add {missing} to BOUNDARIES in snooker_cli/engine/boundaries.py"


def test_a_path_in_a_dilute_gas_ends_at_a_ball_or_the_wall() -> None:
    """20 balls of 0.1 m in a circle of 10 m: 1/(2√2 n d + L/(π A)) with n = N/A and L = 2πR."""
    scene = replace(report_scene(radius=0.1), container=Circle(10.0))
    number, area = scene.number, 100 * math.pi
    expected = area / (2 * math.sqrt(2) * number * 0.2 + 20)
    assert scene.mean_free_path == pytest.approx(expected)
