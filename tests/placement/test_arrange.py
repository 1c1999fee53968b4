"""Starts of runs: the same doubles everywhere, random directions that are uniform, and errors."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from scenes import EPSILON, experiment
from scipy import stats

from snooker_cli.config import Experiment
from snooker_cli.containers import Box, Circle
from snooker_cli.errors import SceneError
from snooker_cli.placement.places import ring_positions, unit_polygon
from snooker_cli.placement.random_numbers import random_directions
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene, check

# --- rings ----------------------------------------------------------------------------------


def cosine(angle: Decimal) -> Decimal:
    """Taylor's series, to 70 digits, for an angle of a few radians."""
    total, term, order = Decimal(0), Decimal(1), 0
    while abs(term) > Decimal("1e-70"):
        total += term
        order += 2
        term *= -angle * angle / (order * (order - 1))
    return total


def machin_pi() -> Decimal:
    """16 atan(1/5) - 4 atan(1/239)."""

    def arctangent_of_inverse(n: int) -> Decimal:
        total, power, k = Decimal(0), Decimal(1) / n, 0
        while power > Decimal("1e-75"):
            total += power / (2 * k + 1) * (-1) ** k
            power /= n * n
            k += 1
        return total

    return 16 * arctangent_of_inverse(5) - 4 * arctangent_of_inverse(239)


@pytest.mark.parametrize("corners", [1, 2, 3, 5, 6, 12, 18, 24, 30, 60, 126, 600])
def test_polygons_are_correctly_rounded(corners):
    """The angle of each corner on its own, with 80 digits, where ``arrange`` turns 40-digit
    corners on. Float() of a decimal is correctly rounded."""
    with localcontext() as context:
        context.prec = 80
        turn = 2 * machin_pi()
        exact = []
        for k in range(corners):
            x, y = cosine(turn * k / corners), cosine(turn * k / corners - turn / 4)
            exact.append((float(round(x, 60)), float(round(y, 60))))
    assert list(unit_polygon(corners)) == exact


def test_polygon_with_six_thousand_corners():
    """As many as the outermost of 1000 rings: the last corner is as good as the first."""
    corners = unit_polygon(6000)
    assert corners[3000] == (-1.0, 0.0)
    assert corners[1500] == (0.0, 1.0)
    assert corners[1000][0] == corners[5000][0] == 0.5
    assert all(a == (b[0], -b[1]) for a, b in zip(corners[1:], corners[:0:-1], strict=True))


def test_rings():
    """1 + 3n(n + 1) balls: 6k on the ring of radius k/n of the extent."""
    for rings in (0, 1, 2, 3, 7):
        positions = ring_positions(rings, 8.0)
        assert positions.shape == (1 + 3 * rings * (rings + 1), 2)
        assert positions[0].tolist() == [0.0, 0.0]
        expected = [8.0 * k / rings for k in range(1, rings + 1) for _ in range(6 * k)]
        assert np.hypot(*positions[1:].T) == pytest.approx(expected, rel=2 * EPSILON)


def test_golden_positions():
    """For three rings of 8 m; these are what stored runs started from."""
    positions = starting_scene(experiment(), 0).positions
    assert positions[1].tolist() == [2.6666666666666665, 0.0]
    assert positions[2].tolist() == [1.3333333333333333, 2.309401076758503]
    assert positions[8].tolist() == [4.618802153517006, 2.6666666666666665]
    assert [x.hex() for x in positions[20].tolist()] == [
        "0x1.e11f642522d1cp+2",
        "0x1.5e3a8748a0bf5p+1",
    ]


# --- directions -----------------------------------------------------------------------------

GOLDEN = {  # seed, repeat -> the first directions
    (1, 0): [
        ("0x1.0affd677f88eep-1", "-0x1.b4deb3eeb99f8p-1"),
        ("0x1.41922ab5871b4p-1", "-0x1.8e6ac142b40e6p-1"),
        ("-0x1.6c749bb11601dp-1", "0x1.679b08a5401fap-1"),
    ],
    (7, 3): [
        ("-0x1.ff97df78ecaf6p-1", "0x1.4678bff620424p-5"),
        ("-0x1.fc400db8088cbp-1", "0x1.eed1cdaab8096p-4"),
    ],
}


@pytest.mark.parametrize(("seed", "repeat"), GOLDEN)
def test_golden_directions(seed, repeat):
    expected = GOLDEN[seed, repeat]
    directions = random_directions(len(expected), seed, repeat).tolist()
    assert [(u.hex(), v.hex()) for u, v in directions] == expected


@pytest.fixture(scope="module")
def directions() -> np.ndarray:
    """100,000 of them."""
    return random_directions(100_000, 1, 0)


def test_directions_are_unit_vectors(directions):
    """To one unit in the last place, by exact arithmetic."""
    with localcontext() as context:
        context.prec = 60
        for u, v in directions[:2000].tolist():
            length = (Decimal(u) ** 2 + Decimal(v) ** 2).sqrt()
            assert abs(length - 1) <= EPSILON
    assert np.max(abs(np.hypot(*directions.T) - 1)) <= 2 * EPSILON


def test_directions_are_uniform(directions):
    """By Kolmogorov and Smirnov on the circle and on its first four harmonics."""
    angles = np.arctan2(directions[:, 1], directions[:, 0])
    assert stats.kstest(angles, stats.uniform(-math.pi, 2 * math.pi).cdf).pvalue > 0.001
    for harmonic in (1, 2, 3, 4):
        # The mean of n unit vectors has |mean|^2 n ~ exponential(1).
        resultant = abs(np.mean(np.exp(1j * harmonic * angles))) ** 2 * len(angles)
        assert resultant < -math.log(0.001)


def test_directions_of_neighbours_are_independent(directions):
    (u, v), n = directions.T, len(directions)
    for a, b in ((u[:-1], u[1:]), (v[:-1], v[1:]), (u[:-1], v[1:])):
        # Products of independent components have a variance of 1/4.
        assert abs(np.mean(a * b)) < 4 * 0.5 / math.sqrt(n)


def test_repeats_and_seeds_differ_and_come_again():
    first = random_directions(37, 1, 0)
    assert np.array_equal(first, random_directions(37, 1, 0))
    for other in ((1, 1), (2, 0)):
        assert not np.isin(first, random_directions(37, *other)).any()
    assert random_directions(0, 1, 0).shape == (0, 2)


def test_every_point_of_a_sweep_has_the_same_directions():
    """Common random numbers: what differs between points is not the luck of the start."""
    start = starting_scene(experiment(cor=1.0), 4)
    for changes in ({"cor": 0.3}, {"wall_cor": 0.5}, {"container_mass": 5.0}, {"radius": 0.1}):
        assert np.array_equal(start.velocities, starting_scene(experiment(**changes), 4).velocities)
    assert np.max(abs(np.hypot(*start.velocities.T) - 10.0)) <= 2 * 10 * EPSILON


# --- scenes ---------------------------------------------------------------------------------


def test_a_scene_of_rings():
    scene = starting_scene(experiment(radius=0.5, cor=0.8, container_mass=1e7), 0)
    assert scene.number == 37
    assert np.all(scene.radii == 0.5)
    assert np.all(scene.masses == 1.0)
    assert (scene.container, scene.container_mass) == (Circle(10.0), 1e7)
    assert (scene.restitution, scene.wall_restitution) == (0.8, 0.8)
    assert scene.kinetic_energy == pytest.approx(1850.0, rel=1e-14)
    assert scene.packing_fraction == pytest.approx(37 * 0.25 / 100, rel=1e-14)
    with pytest.raises(ValueError, match="read-only"):
        scene.positions[0, 0] = 1.0


def listed(*balls: dict, **container: object) -> Experiment:
    return Experiment.model_validate(
        {
            "container": container or {"radius": 10.0},
            "balls": {"list": balls},
            "cor": 0.5,
            "collisions": 1,
        }
    )


def ball(x: float, y: float, radius: float = 1.0) -> dict:
    return {"position": [x, y], "velocity": [1.0, 2.0], "radius": radius, "mass": 3.0}


def test_a_scene_of_listed_balls():
    scene = starting_scene(listed(ball(0, 0), ball(3, 4, 0.5)), 0)
    assert scene.positions.tolist() == [[0.0, 0.0], [3.0, 4.0]]
    assert scene.velocities.tolist() == [[1.0, 2.0], [1.0, 2.0]]
    assert scene.radii.tolist() == [1.0, 0.5]
    assert scene.masses.tolist() == [3.0, 3.0]
    assert not scene.free
    assert scene.container_energy == 0.0


def test_balls_may_touch():
    starting_scene(listed(ball(0, 0), ball(2, 0)), 0)
    starting_scene(listed(ball(9, 0)), 0)
    # At 45 degrees the coordinates are rounded: short of touching by that much is let pass.
    starting_scene(listed(ball(0, 0), ball(math.sqrt(2), math.sqrt(2))), 0)


def error_of(start: Experiment) -> SceneError:
    with pytest.raises(SceneError) as caught:
        starting_scene(start, 0)
    return caught.value


def test_overlapping_balls_are_refused():
    error = error_of(listed(ball(0, 0), ball(-5, 0), ball(1.5, 0)))
    assert error.key == "balls.list[2]"
    assert "rings" not in str(error)
    for part in ("balls 0 and 2", "overlap by 0.5 m", "1.5 m apart", "radii 1 m and 1 m"):
        assert part in str(error)
    error_of(listed(ball(0, 0), ball(1.9999999, 0)))


def test_a_ball_that_sticks_out_is_refused():
    error = error_of(listed(ball(0, 0), ball(0, 9.25)))
    assert error.key == "balls.list[1]"
    for part in ("ball 1", "by 0.25 m", "is 1 m", "[0, 9.25] m from the centre", "radius 10 m"):
        assert part in str(error)
    error_of(listed(ball(0, 9.0000001)))


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        (
            {"radius": 1.5},
            ("3 rings", "2.66667 m apart", "2 m to the wall", "is 1.3333333333333333 m"),
        ),
        ({"radius": 1.1, "ring_extent": 0.9}, ("1 m to the wall", "radius 1.1 m", "is 1.0 m")),
    ],
)
def test_rings_that_are_too_tight_are_refused_with_the_radius_that_fits(changes, parts):
    error = error_of(experiment(**changes))
    assert error.key == "balls.radius"
    for part in parts:
        assert part in str(error)


def test_rings_fit_up_to_the_stated_radius():
    starting_scene(experiment(radius=4 / 3), 0)
    starting_scene(experiment(radius=1.0, ring_extent=0.9), 0)
    error_of(experiment(radius=4 / 3 + 1e-9))


def test_check_sees_the_container_where_it_is():
    scene = starting_scene(listed(ball(0, 0)), 0)
    moved = Scene(**(vars(scene) | {"container_position": np.array([9.5, 0.0])}))
    with pytest.raises(SceneError, match="sticks out"):
        check(moved)


# --- boxes ----------------------------------------------------------------------------------


def test_a_box_of_listed_balls():
    scene = starting_scene(listed(ball(9, -4), shape="box", width=20.0, height=10.0), 0)
    assert (scene.container, scene.free) == (Box(20.0, 10.0), False)
    square = starting_scene(listed(ball(0, 0), shape="box", width=20.0), 0)
    assert square.container == Box(20.0, 20.0)


@pytest.mark.parametrize("place", [(9.25, 0), (-9.25, 0), (0, 4.25), (0, -4.25)])
def test_a_ball_that_sticks_out_of_a_box_is_refused(place):
    error = error_of(listed(ball(0, 0), ball(*place), shape="box", width=20.0, height=10.0))
    assert error.key == "balls.list[1]"
    for part in (
        "ball 1 sticks out",
        "by 0.25 m",
        f"[{place[0]}, {place[1]}] m",
        "20 m by 10 m",
    ):
        assert part in str(error)


def test_a_periodic_box_has_no_wall_but_an_edge():
    box = {"shape": "periodic", "width": 20.0, "height": 12.0}
    scene = starting_scene(listed(ball(10, -6), ball(-8, 6), **box), 0)
    assert scene.container.period == (20.0, 12.0)
    error = error_of(listed(ball(10.25, 0), **box))
    assert "the centre of ball 0 is 0.25 m outside" in str(error)


@pytest.mark.parametrize(
    "places", [[(9.25, 1), (-9.25, 1)], [(1, 5.25), (1, -5.25)], [(9.25, 5.25), (-9.75, -5.75)]]
)
def test_overlaps_with_images_are_seen(places):
    box = {"width": 20.0, "height": 12.0}
    error = error_of(listed(*(ball(*place) for place in places), shape="periodic", **box))
    assert error.key == "balls.list[1]"
    apart = 1.5 if 1 in (*places[0], *places[1]) else math.sqrt(2)
    assert f"{apart:.6g} m apart" in str(error)
    small = [ball(*place, 0.7) for place in places]
    starting_scene(listed(*small, shape="periodic", **box), 0)


def test_a_periodic_box_is_five_diameters_wide():
    """Less, and a ball could be next to another and to its image at once."""
    starting_scene(listed(ball(0, 0), shape="periodic", width=10.001), 0)
    error = error_of(listed(ball(0, 0), shape="periodic", width=19.0, height=9.9))
    assert error.key == "container.height"
    assert "9.9 m in height, which is under 5 diameters of its largest ball, 2 m each" in str(error)
