"""Balls given by count: sizes that follow, lattices, speeds, errors, and sweeps over them."""

import math
import re

import numpy as np
import pytest
from scipy import stats

from snooker_cli.analysis.observables import total_momentum
from snooker_cli.config import Experiment, digest, parse, points, to_json
from snooker_cli.errors import SceneError
from snooker_cli.placement.random_numbers import random_directions
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene

SHAPES = ("circle", "box", "periodic")


def experiment(container: str, balls: str, *overrides: str) -> Experiment:
    text = f"container: {{{container}}}\nballs: {balls}\ncor: 0.9\ntime: 1\n"
    return parse(text, "gas.yaml", overrides).experiment


def gas(container: str, balls: str, repeat: int = 0) -> Scene:
    return starting_scene(experiment(container, balls), repeat)


# Sizes


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


def test_packing_of_the_container_is_that_of_the_balls():
    """Both mean the same for one species; several have only that of the container."""
    one = gas("shape: box, packing: 0.3", "{count: 40, radius: 1, speed: 1}")
    other = gas("shape: box", "{count: 40, packing: 0.3, radius: 1, speed: 1}")
    assert one.container == other.container
    two = "[{count: 30, radius: 1, speed: 1}, {count: 60, radius: 0.5, speed: 1}]"
    mixed = gas("shape: box, packing: 0.3", two)
    assert mixed.container.area == pytest.approx((30 + 60 / 4) * math.pi / 0.3, rel=1e-14)


def test_species_without_radii_share_one():
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
    assert np.array_equal(*(np.unique(each.positions, axis=0) for each in (scene, other)))


# Lattices


@pytest.mark.parametrize(
    ("container", "balls", "key", "reached"),
    [
        ("shape: circle", "{count: 7, packing: 0.8, radius: 1, speed: 1}", "balls.packing", 0.7777),
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
    with pytest.raises(SceneError, match=f"reach a packing of {reached}, ") as caught:
        gas(container, balls)
    assert caught.value.key == key


def test_the_stated_factor_and_packing_fit():
    with pytest.raises(SceneError) as caught:
        gas("shape: box, width: 10", "{count: 30, radius: 1.1, speed: 1}")
    reached, factor = (float(x) for x in re.findall(r"\d\.\d{4}", str(caught.value)))
    gas("shape: box, width: 10", f"{{count: 30, radius: {1.1 * factor}, speed: 1}}")
    gas("shape: box", f"{{count: 30, radius: 1, packing: {reached}, speed: 1}}")


@pytest.mark.parametrize("start", ["lattice", "random"])
def test_a_periodic_box_that_is_too_small_is_refused(start):
    balls = f"{{count: 9, packing: 0.5, radius: 1, speed: 1, start: {start}}}"
    with pytest.raises(SceneError, match="is under 5 diameters") as caught:
        gas("shape: periodic", balls)
    assert caught.value.key == "container.width"


# Speeds


def test_equal_speeds_have_the_directions_of_rings():
    scene = gas("radius: 10", "{count: 37, radius: 1, speed: 10}", 3)
    assert np.array_equal(scene.velocities, 10.0 * random_directions(37, 1, 3))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("speeds", ["equal", "maxwell"])
def test_the_energy_is_that_of_the_speed(shape, speeds):
    balls = f"{{count: 500, radius: 1, mass: 3, speed: 7, packing: 0.1, speeds: {speeds}}}"
    scene = gas(f"shape: {shape}", balls)
    assert scene.kinetic_energy == pytest.approx(500 * 3 * 49 / 2, rel=1e-14)
    # Without walls momentum is conserved: zero, or the gas would drift for ever.
    total = np.hypot(*total_momentum(scene))
    drift = 3 * 7 * math.sqrt(500)
    assert (total < 1e-12 * drift) == (shape == "periodic")


def test_every_species_has_the_energy_of_its_speed():
    """In a periodic box only the sum has."""
    species = (
        "[{count: 20, radius: 1, mass: 4, speed: 5, speeds: maxwell}, "
        "{count: 30, radius: 1, speed: 8}, {count: 50, radius: 1, speed: 10, speeds: maxwell}]"
    )
    energies = np.array([20 * 4 * 25, 30 * 64, 50 * 100]) / 2
    for shape in SHAPES:
        scene = gas(f"shape: {shape}, packing: 0.1", species)
        each = 0.5 * scene.masses * np.sum(scene.velocities**2, axis=1)
        measured = np.add.reduceat(each, [0, 20, 50])
        assert np.sum(measured) == pytest.approx(np.sum(energies), rel=1e-14)
        if shape == "periodic":
            assert np.hypot(*total_momentum(scene)) < 1e-10
            assert measured == pytest.approx(energies, rel=0.2)
        else:
            assert measured == pytest.approx(energies, rel=1e-14)


@pytest.mark.parametrize("speeds", ["equal", "maxwell"])
def test_balls_may_be_at_rest(speeds):
    balls = f"{{count: 50, radius: 1, speed: 0, packing: 0.1, speeds: {speeds}}}"
    assert np.all(gas("shape: periodic", balls).velocities == 0.0)


def test_speeds_have_maxwells_distribution():
    scene = gas("radius: 1", "{count: 20000, packing: 1.0e-4, speed: 3, speeds: maxwell}")
    speeds = np.hypot(*scene.velocities.T)
    assert stats.kstest(speeds, stats.rayleigh(scale=3 / math.sqrt(2)).cdf).pvalue > 0.001


# Configs

MIXTURE = (
    "shape: periodic, packing: 0.3",
    "[{count: 30, radius: 1, speed: 1, start: random}, {count: 60, radius: 0.5, speed: 1}]",
)


def test_one_species_gives_the_start_for_all():
    assert experiment(*MIXTURE).start == "random"
    assert experiment(*MIXTURE, "balls[0].start=null").start == "lattice"
    assert experiment("radius: 1", "{count: 3, packing: 0.1, speed: 1}").start == "lattice"


def test_absent_keys_are_not_written():
    written = to_json(experiment("shape: box, width: 3.0", "{count: 30, packing: 0.1, speed: 1}"))
    assert "height" not in written
    assert "shape" not in to_json(experiment("radius: 1", "{rings: 1, radius: 0.1, speed: 1}"))


def test_digests_tell_scenes_apart_and_nothing_else():
    plain = experiment("radius: 9", "{count: 30, packing: 0.1, speed: 1}")
    for override in (
        "container.shape=circle",
        "container.height=null",
        "balls.radius=null",
        "balls.start=lattice",
        "balls.speeds=equal",
        "balls.mass=1",
    ):
        same = experiment("radius: 9", "{count: 30, packing: 0.1, speed: 1}", override)
        assert digest(same) == digest(plain), override
    for override in ("balls.count=31", "balls.start=random", "balls.speeds=maxwell"):
        other = experiment("radius: 9", "{count: 30, packing: 0.1, speed: 1}", override)
        assert digest(other) != digest(plain), override


def test_every_key_can_be_swept():
    """The shape too, where the size follows."""
    base = "shape: circle", "{count: 60, packing: 0.2, radius: 1, speed: 1}"
    swept = experiment(
        *base,
        "container.shape=circle,box,periodic",
        "balls.count=60,70",
        "balls.packing=0.1:0.3:2",
        "balls.start=lattice,random",
        "balls.speeds=equal,maxwell",
    )
    scenes = [starting_scene(point.experiment, 0) for point in points(swept)]
    assert len(scenes) == 48
    assert {scene.container.name for scene in scenes} == set(SHAPES)
    assert {round(scene.packing_fraction, 9) for scene in scenes} == {0.1, 0.3}
    mixed = experiment(*MIXTURE, "balls[1].count=60,6", "container.packing=0.2,0.3")
    numbers = [starting_scene(point.experiment, 0).number for point in points(mixed)]
    assert numbers == [90, 90, 36, 36]
