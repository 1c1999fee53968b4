"""Scenes at the start: rings, lists and counts of balls, their speeds, and what is refused."""

import math
import re

import numpy as np
import pytest
from scenes import EPSILON, config

from snooker_cli.analysis.observables import total_momentum
from snooker_cli.config import Config, parse, points
from snooker_cli.containers import SHAPES, Box
from snooker_cli.engine import simulate
from snooker_cli.errors import SceneError
from snooker_cli.placement.random_numbers import (
    random_directions,
)
from snooker_cli.placement.starting_scene import starting_scene, starting_scenes
from snooker_cli.scene import Scene, check

BOX = {"shape": "box", "width": 20.0, "height": 10.0}
PERIODIC = {"shape": "periodic", "width": 20.0, "height": 12.0}
MIXTURE = (
    "shape: periodic, packing: 0.3",
    "[{count: 30, radius: 1, speed: 1, start: random}, {count: 60, radius: 0.5, speed: 1}]",
)


def listed(*balls: dict, **container: object) -> Config:
    data = {"container": container or {"radius": 10.0}, "balls": {"list": balls}}
    return Config.model_validate(data | {"cor": 0.5, "collisions": 1})


def ball(x: float, y: float, radius: float = 1.0) -> dict:
    return {"position": [x, y], "velocity": [1.0, 2.0], "radius": radius, "mass": 3.0}


def counted(container: str, balls: str, *overrides: str) -> Config:
    text = f"container: {{{container}}}\nballs: {balls}\ncor: 0.9\ntime: 1\n"
    return parse(text, "gas.yaml", overrides).config


def gas(container: str, balls: str, repeat: int = 0) -> Scene:
    return starting_scene(counted(container, balls), repeat)


def error_of(start: Config) -> SceneError:
    with pytest.raises(SceneError) as caught:
        starting_scene(start, 0)
    return caught.value


# Rings and lists


def test_golden_positions():
    """Three rings of 8 m; stored runs started from these bits."""
    positions = starting_scene(config(), 0).positions
    assert positions[1].tolist() == [2.6666666666666665, 0.0]
    assert positions[2].tolist() == [1.3333333333333333, 2.309401076758503]
    assert positions[8].tolist() == [4.618802153517006, 2.6666666666666665]
    x, y = positions[20].tolist()
    assert (x.hex(), y.hex()) == ("0x1.e11f642522d1cp+2", "0x1.5e3a8748a0bf5p+1")


SWEPT = "radius: 10", "{count: 20, radius: 0.3, speed: 5, speeds: maxwell}"


def starts(*overrides: str, speeds: str = "5,10,20") -> list[Scene]:
    """The starts of the points of a sweep over the speed, for repeat 2."""
    swept = points(counted(*SWEPT, f"balls.speed={speeds}", *overrides))
    return [starting_scene(point.config, 2) for point in swept]


@pytest.mark.parametrize("override", ["cor=1", "balls.start=random"])
def test_points_have_random_numbers_of_their_own(override):
    """A gas of another speed is not the same gas played faster."""
    scenes = starts(override)
    collisions = [simulate(scene, collisions=50).events for scene in scenes]
    for k, other in ((0, 1), (0, 2), (1, 2)):
        assert not np.array_equal(collisions[k].i, collisions[other].i)
        directions = [
            (velocities := scenes[n].velocities) / np.hypot(*velocities.T)[:, None]
            for n in (k, other)
        ]
        # Independent, the cosine of the angle between two directions has variance 1/2.
        assert abs(np.sum(directions[0] * directions[1])) < 4 * math.sqrt(20 / 2)
        same = np.array_equal(scenes[k].positions, scenes[other].positions)
        assert same != (override == "balls.start=random")


def test_a_point_keeps_its_random_numbers():
    """Beside other points or alone, and however long its repeats and what they record."""
    changes = ("time=9", "collisions=5", "record=summary", "title=more", "repeats=7")
    more = starts(*changes, speeds="3,5,7,10,20")
    for scene, again in zip(starts(), (more[1], more[3], more[4]), strict=True):
        assert np.array_equal(scene.velocities, again.velocities)
    (alone,) = starts(speeds="10")
    assert np.array_equal(alone.velocities, more[3].velocities)
    assert not np.array_equal(alone.velocities, starts("seed=2")[1].velocities)


def test_points_have_the_same_directions_with_common_random():
    first, *others = starts("common_random=true", "balls.start=random")
    for factor, scene in zip((2, 4), others, strict=True):
        assert np.allclose(scene.velocities, factor * first.velocities, rtol=1e-15, atol=0)
        assert np.array_equal(scene.positions, first.positions)
    start = starting_scene(config(cor=1.0), 4)
    for changes in ({"cor": 0.3}, {"wall_cor": 0.5}, {"container_mass": 5.0}, {"radius": 0.1}):
        assert np.array_equal(start.velocities, starting_scene(config(**changes), 4).velocities)
    assert np.max(abs(np.hypot(*start.velocities.T) - 10.0)) <= 2 * 10 * EPSILON
    assert np.array_equal(start.velocities, 10.0 * random_directions(37, 1, [4])[0])


def test_a_scene_of_listed_balls():
    scene = starting_scene(listed(ball(0, 0), ball(3, 4, 0.5)), 0)
    assert scene.positions.tolist() == [[0.0, 0.0], [3.0, 4.0]]
    assert scene.velocities.tolist() == [[1.0, 2.0], [1.0, 2.0]]
    assert scene.radii.tolist() == [1.0, 0.5]
    assert scene.masses.tolist() == [3.0, 3.0]
    assert not scene.free
    assert scene.container_energy == 0.0
    assert starting_scene(listed(ball(0, 0), **BOX), 0).container == Box(20.0, 10.0)
    square = listed(ball(0, 0), shape="box", width=20.0)
    assert starting_scene(square, 0).container == Box(20.0, 20.0)


# Balls that overlap or stick out


def test_balls_may_touch_but_not_overlap():
    starting_scene(listed(ball(0, 0), ball(2, 0)), 0)
    starting_scene(listed(ball(9, 0)), 0)
    # At 45 degrees the coordinates are rounded, and this much overlap is accepted.
    starting_scene(listed(ball(0, 0), ball(math.sqrt(2), math.sqrt(2))), 0)
    error = error_of(listed(ball(0, 0), ball(-5, 0), ball(1.5, 0)))
    assert (error.key, error.ball) == ("balls.list[2]", 2)
    for part in ("balls 0 and 2", "overlap by 0.5 m", "1.5 m apart"):
        assert part in str(error)
    error_of(listed(ball(0, 0), ball(1.9999999, 0)))


@pytest.mark.parametrize(
    ("place", "container"),
    [
        ((0, 9.25), {}),
        *((place, BOX) for place in [(9.25, 0), (0, -4.25)]),
        ((10.25, 0), PERIODIC),
    ],
)
def test_a_ball_outside_is_refused(place, container):
    error = error_of(listed(ball(-3, 0), ball(*place), **container))
    assert (error.key, error.ball) == ("balls.list[1]", 1)
    assert "0.25 m" in str(error)
    inside = tuple(0.9999999 * (abs(x) - 0.25) * np.sign(x) for x in place)
    starting_scene(listed(ball(-3, 0), ball(*inside), **container), 0)


@pytest.mark.parametrize(
    "changes",
    [{"rings": 30}, {"rings": 1, "radius": 3.0}, {"radius": 1.1, "rings": 4}],
)
def test_rings_that_are_too_tight_are_refused_with_what_fits(changes):
    """Each size in the sentence fits to its four digits, and one that is worse does not."""
    error = error_of(config(**changes))
    assert error.key == "balls"
    assert str(error).startswith(f"rings: {changes.get('rings', 3)} with balls of radius ")
    advice = dict(re.findall(r"set ([a-z.]+) to ([0-9.]+) or (?:less|more)", str(error)))
    largest = float(advice["balls.radius"])
    starting_scene(config(**(changes | {"radius": 0.999 * largest})), 0)
    error_of(config(**(changes | {"radius": 1.001 * largest})))
    rings = {"rings": changes.get("rings", 3), "radius": changes.get("radius", 1.0), "speed": 1.0}
    size, data = float(advice["container.radius"]), {"balls": rings, "cor": 1.0, "time": 1.0}
    starting_scene(Config.model_validate(data | {"container": {"radius": 1.001 * size}}), 0)
    error_of(Config.model_validate(data | {"container": {"radius": 0.999 * size}}))
    if "rings" in advice:
        starting_scene(config(**(changes | {"rings": int(advice["rings"])})), 0)
        error_of(config(**(changes | {"rings": int(advice["rings"]) + 1})))


def test_rings_that_reach_beyond_the_container_have_advice_on_their_extent():
    assert "; lower ring_extent" in str(error_of(config(ring_extent=1.0)))


def test_check_sees_the_container_where_it_is():
    scene = starting_scene(listed(ball(0, 0)), 0)
    with pytest.raises(SceneError, match="sticks out"):
        check(Scene(**(vars(scene) | {"container_position": np.array([9.5, 0.0])})))


@pytest.mark.parametrize(
    ("places", "apart"),
    [
        ([(1, 5.25), (1, -5.25)], 1.5),
        ([(9.25, 5.25), (-9.75, -5.75)], math.sqrt(2)),
    ],
)
def test_overlaps_with_images_are_seen(places, apart):
    error = error_of(listed(*(ball(*place) for place in places), **PERIODIC))
    assert error.key == "balls.list[1]"
    assert f"{apart:.6g} m apart" in str(error)
    starting_scene(listed(*(ball(*place, 0.7) for place in places), **PERIODIC), 0)


@pytest.mark.parametrize("speed", [1e-160, 1e150])
@pytest.mark.parametrize(
    ("container", "balls"),
    [
        ("radius: 1e9", "{count: 9, radius: 1, mass: 1e50, speed: SPEED, speeds: maxwell}"),
        ("shape: periodic, width: 20", "{count: 9, radius: 1, mass: 1e50, speed: SPEED}"),
    ],
)
def test_speeds_beyond_the_squares_of_doubles_are_refused(container, balls, speed):
    error = error_of(counted(container, balls.replace("SPEED", str(speed))))
    assert error.key == "balls"
    assert "nearer to 1" in str(error)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("spin", ["1e155", "1e308", "{temperature: 1e308}"])
def test_spins_beyond_the_squares_of_doubles_are_refused(spin):
    balls = f"{{count: 9, radius: 1, mass: 1e-50, speed: 1, spin: {spin}}}"
    error = error_of(counted("radius: 10", balls, "tangential_cor=0.5"))
    assert error.key == "balls"
    assert "m/s with its spin" in str(error)


# Balls by count: of size, radius and packing the third follows


@pytest.mark.parametrize(
    ("shape", "size", "area"),
    [
        ("circle", "radius: 10.0", 100 * math.pi),
        ("box", "width: 20.0, height: 30.0", 600.0),
        ("periodic", "width: 20.0", 400.0),
    ],
)
def test_of_size_radius_and_packing_the_third_follows(shape, size, area):
    given = gas(f"shape: {shape}, {size}", "{count: 50, radius: 1.0, speed: 2}")
    assert given.container.area == pytest.approx(area, rel=1e-15)
    assert given.packing_fraction == pytest.approx(50 * math.pi / area, rel=1e-15)
    packed = gas(f"shape: {shape}, {size}", "{count: 50, packing: 0.2, speed: 2}")
    assert packed.container.area == given.container.area
    assert packed.packing_fraction == pytest.approx(0.2, rel=1e-14)
    assert np.all(packed.radii == packed.radii[0])
    grown = gas(f"shape: {shape}", "{count: 50, packing: 0.2, radius: 1.0, speed: 2}")
    assert np.all(grown.radii == 1.0)
    assert grown.container.area == pytest.approx(50 * math.pi / 0.2, rel=1e-14)
    assert grown.container.size[0] == grown.container.size[1]


def test_packing_of_several_species():
    """The size, or one radius for all, follows from the packing of the container."""
    two = "[{count: 30, radius: 1, speed: 1}, {count: 60, radius: 0.5, speed: 1}]"
    mixed = gas("shape: box, packing: 0.3", two)
    assert mixed.container.area == pytest.approx((30 + 60 / 4) * math.pi / 0.3, rel=1e-14)
    species = "[{count: 30, mass: 1, speed: 2}, {count: 60, mass: 4, speed: 1}]"
    scene = gas("radius: 10, packing: 0.4", species)
    assert np.all(scene.radii == scene.radii[0])
    assert scene.radii[0] == pytest.approx(math.sqrt(0.4 * 100 / 90), rel=1e-14)
    assert scene.masses.tolist() == 30 * [1.0] + 60 * [4.0]


def test_species_are_mixed_on_a_lattice():
    """Every repeat has the same places, and assigns them to the balls at random."""
    species = "[{count: 300, radius: 1, speed: 1}, {count: 300, radius: 0.5, speed: 1}]"
    scene, other = (gas("shape: periodic, packing: 0.3", species, repeat) for repeat in (0, 1))
    means = abs(np.mean(scene.positions[:300], axis=0))
    assert np.all(means < 4 * np.array(scene.container.size) / math.sqrt(12 * 300))
    assert not np.array_equal(scene.positions, other.positions)
    assert np.array_equal(*(np.unique(start.positions, axis=0) for start in (scene, other)))


PLACED = "{position: [-3, 1], velocity: [0, 5], radius: 2, mass: 20}"
SIZES = {
    "circle": "radius: 8",
    "box": "width: 16",
    "periodic": "width: 21",
    "channel": "width: 20.5",
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("start", ["lattice", "random"])
def test_a_gas_surrounds_placed_balls(shape, start):
    """``check`` in ``starting_scenes`` finds overlaps; large balls are pushed apart."""
    placed = f"{PLACED}, {{position: [4, -2], velocity: [0, 0], radius: 1.5}}"
    radius = 0.49
    of_gas = f"{{count: 150, radius: {radius}, mass: 2, speed: 3, start: {start}}}"
    scene = gas(f"shape: {shape}, {SIZES[shape]}", f"[{placed}, {of_gas}]")
    assert scene.positions[:2].tolist() == [[-3.0, 1.0], [4.0, -2.0]]
    assert scene.velocities[:2].tolist() == [[0.0, 5.0], [0.0, 0.0]]
    assert scene.radii.tolist() == [2.0, 1.5] + 150 * [radius]
    assert scene.masses.tolist() == [20.0, 1.0] + 150 * [2.0]
    moving = scene.velocities[2:]
    assert np.sum(moving**2) == pytest.approx(150 * 9, rel=1e-13)
    if shape == "periodic":
        assert np.sum(moving, axis=0) == pytest.approx([0, 0], abs=1e-12)
    reach = np.array(scene.container.size) / 2 - radius
    for side in (-1, 1):  # it is all around, not on one side
        assert np.all(np.max(side * scene.positions[2:], axis=0) > 0.75 * reach)


@pytest.mark.parametrize("start", ["lattice", "random"])
def test_placed_balls_that_do_not_fit_are_named(start):
    other = "{position: [0, 1], velocity: [0, 0], radius: 2}"
    of_gas = f"{{count: 150, radius: 0.5, speed: 3, start: {start}}}"
    overlap = error_of(counted("radius: 9", f"[{PLACED}, {other}, {of_gas}]"))
    assert (overlap.key, overlap.ball) == ("balls[1]", 1)
    assert "balls 0 and 1 overlap by 1 m" in str(overlap)
    outside = error_of(counted("radius: 5", f"[{PLACED}, {of_gas}]"))
    assert outside.key == "balls[0]"
    crowd = error_of(counted("radius: 7", f"[{PLACED}, {of_gas}]"))
    assert crowd.key == "balls[1].radius"
    assert f"151 balls with start: {start} in a circle reach a packing of 0." in str(crowd)


@pytest.mark.parametrize(
    ("container", "balls", "key", "reached"),
    [
        ("radius: 3", "{count: 7, radius: 1.1, speed: 1}", "balls.radius", 0.7777),
        (
            "shape: periodic, packing: 0.9",
            "[{count: 100, radius: 1, speed: 1}, {count: 100, radius: 0.5, speed: 1}]",
            "container.packing",
            0.5287,  # that of 200 equal balls, 0.846, times (1 + 1/4)/2
        ),
        (
            "shape: box, width: 3",
            "[{count: 2, radius: 0.1, speed: 1}, {count: 2, radius: 1, speed: 1}]",
            "balls[1].radius",
            0.2722,
        ),
    ],
)
def test_too_dense_a_lattice_is_refused_with_the_packing_reached(container, balls, key, reached):
    error = error_of(counted(container, balls))
    assert f"reach a packing of {reached}, " in str(error)
    assert error.key == key


def test_the_stated_factor_and_packing_fit():
    error = error_of(counted("shape: box, width: 10", "{count: 30, radius: 1.1, speed: 1}"))
    reached, factor = (float(x) for x in re.findall(r"\d\.\d{4}", str(error)))
    gas("shape: box, width: 10", f"{{count: 30, radius: {1.1 * factor}, speed: 1}}")
    gas("shape: box", f"{{count: 30, radius: 1, packing: {reached}, speed: 1}}")


@pytest.mark.parametrize("start", ["lattice", "random"])
def test_a_periodic_box_is_five_diameters_wide(start):
    """In a smaller one a ball could be next to another and to its image at once."""
    balls = f"{{count: 9, packing: 0.5, radius: 1, speed: 1, start: {start}}}"
    error = error_of(counted("shape: periodic", balls))
    assert error.key == "container.width"
    assert "this engine needs 5 cells each way, each a ball wide" in str(error)
    starting_scene(listed(ball(0, 0), shape="periodic", width=10.001), 0)
    error = error_of(listed(ball(0, 0), shape="periodic", width=19.0, height=9.9))
    assert error.key == "container.height"


# Speeds


@pytest.mark.parametrize("shape", SHAPES)
def test_every_species_has_the_energy_of_its_speed(shape):
    """Where images are, only the sum has; its momentum is zero, or the gas would drift."""
    species = (
        "[{count: 20, radius: 1, mass: 4, speed: 5, speeds: maxwell}, "
        "{count: 30, radius: 1, speed: 8}, {count: 50, radius: 1, speed: 10, speeds: maxwell}]"
    )
    energies = np.array([20 * 4 * 25, 30 * 64, 50 * 100]) / 2
    scene = gas(f"shape: {shape}, packing: 0.1", species)
    measured = np.add.reduceat(
        0.5 * scene.masses * np.sum(scene.velocities**2, axis=1), [0, 20, 50]
    )
    assert np.sum(measured) == pytest.approx(np.sum(energies), rel=1e-14)
    walls = scene.container.period is None
    assert measured == pytest.approx(energies, rel=1e-14 if walls else 0.2)
    at_rest = abs(total_momentum(scene)) < 1e-10
    assert np.array_equal(at_rest, scene.container.periodic)


ROTATING = {
    "rings": "{rings: 3, radius: 1, mass: 2, speed: 10}",
    "count": "{count: 60, radius: 0.4, speed: 3, start: random, speeds: maxwell}",
    "two": "{count: 2, radius: 1, speed: 3}",
    "mixed": f"[{PLACED}, {{count: 9, radius: 0.5, speed: 3}}, {{count: 9, radius: 1, speed: 1}}]",
}


@pytest.mark.parametrize("balls", ROTATING.values(), ids=ROTATING)
def test_a_start_without_a_common_rotation(balls):
    """The same draws less a rigid rotation, times one factor; listed velocities stay."""
    end = balls.rindex("}")
    without = f"{balls[:end]}, common_rotation: false{balls[end:]}"
    drawn, scene = (
        starting_scene(counted("radius: 10", text, "common_random=true"), 5)
        for text in (balls, without)
    )
    first = 1 if "position" in balls else 0
    assert np.array_equal(scene.positions, drawn.positions)
    assert np.array_equal(scene.velocities[:first], drawn.velocities[:first])
    (x, y), masses = scene.positions[first:].T, scene.masses[first:]
    (u, v), (u0, v0) = (start.velocities[first:].T for start in (scene, drawn))
    momenta, inertia = masses * np.hypot(x, y) * np.hypot(u, v), masses @ (x**2 + y**2)
    # Each velocity has a few roundings.
    assert abs(math.fsum(masses * (x * v - y * u))) < 8 * EPSILON * math.fsum(momenta)
    before = math.fsum(masses * (u0**2 + v0**2))
    assert math.fsum(masses * (u**2 + v**2)) == pytest.approx(before, rel=8 * EPSILON)
    rate = masses @ (x * v0 - y * u0) / inertia
    rest = before - rate**2 * inertia
    expected = np.column_stack([u0 + rate * y, v0 - rate * x]) * math.sqrt(before / rest)
    assert scene.velocities[first:] == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert rate**2 * inertia > 1e-6 * before  # there was a rotation


# All repeats of a point at once


@pytest.mark.parametrize(
    "start",
    [
        config(),
        listed(ball(0, 0), ball(3, 4, 0.5)),
        counted(
            "radius: 10",
            "{count: 20, radius: 0.3, speed: 2, start: random, common_rotation: false}",
        ),
        counted("shape: box, width: 9", "{count: 30, radius: 0.3, speed: 2, speeds: maxwell}"),
        counted(*MIXTURE),
    ],
    ids=lambda start: f"{start.container.shape}, {type(start.balls).__name__}",
)
def test_all_repeats_at_once(start):
    repeats = [7, 0, 1, 2, 3, 4, 5, 6, 40]
    scenes = starting_scenes(start, repeats)
    for repeat, scene in zip(repeats, scenes, strict=True):
        alone = starting_scene(start, repeat)
        for name, expected in vars(alone).items():
            assert np.array_equal(getattr(scene, name), expected), name
        for array in (scene.positions, scene.velocities, scene.radii, scene.masses):
            assert not array.flags.writeable


def test_repeats_with_a_given_key_of_the_wall_have_keys_of_their_own() -> None:
    text = "container: {radius: 10}\nballs: {rings: 1, radius: 1, speed: 1}\ncor: 1\ntime: 1\n"
    given = parse(f"{text}wall_temperature: 2\nwall_key: 7\n", "gas.yaml").config
    scenes = starting_scenes(given, [0, 1, 5])
    assert [scene.wall_key for scene in scenes] == [7, 8, 12]
