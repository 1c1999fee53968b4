"""Scenes at the start: their data, and what is refused."""

import math

import numpy as np
import pytest
from scenes import EPSILON, experiment

from snooker_cli.config import Experiment
from snooker_cli.containers import Box, Circle
from snooker_cli.errors import SceneError
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene, check

BOX = {"shape": "box", "width": 20.0, "height": 10.0}
PERIODIC = {"shape": "periodic", "width": 20.0, "height": 12.0}


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


def error_of(start: Experiment) -> SceneError:
    with pytest.raises(SceneError) as caught:
        starting_scene(start, 0)
    return caught.value


def test_golden_positions():
    """Three rings of 8 m; stored runs started from these bits."""
    positions = starting_scene(experiment(), 0).positions
    assert positions[1].tolist() == [2.6666666666666665, 0.0]
    assert positions[2].tolist() == [1.3333333333333333, 2.309401076758503]
    assert positions[8].tolist() == [4.618802153517006, 2.6666666666666665]
    x, y = positions[20].tolist()
    assert (x.hex(), y.hex()) == ("0x1.e11f642522d1cp+2", "0x1.5e3a8748a0bf5p+1")


def test_every_point_of_a_sweep_has_the_same_directions():
    """Common random numbers: the start does not add to the difference between points."""
    start = starting_scene(experiment(cor=1.0), 4)
    for changes in ({"cor": 0.3}, {"wall_cor": 0.5}, {"container_mass": 5.0}, {"radius": 0.1}):
        assert np.array_equal(start.velocities, starting_scene(experiment(**changes), 4).velocities)
    assert np.max(abs(np.hypot(*start.velocities.T) - 10.0)) <= 2 * 10 * EPSILON


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


def test_balls_may_touch():
    starting_scene(listed(ball(0, 0), ball(2, 0)), 0)
    starting_scene(listed(ball(9, 0)), 0)
    # At 45 degrees the coordinates are rounded, and so much overlap is accepted.
    starting_scene(listed(ball(0, 0), ball(math.sqrt(2), math.sqrt(2))), 0)


def test_overlapping_balls_are_refused():
    error = error_of(listed(ball(0, 0), ball(-5, 0), ball(1.5, 0)))
    assert (error.key, error.ball) == ("balls.list[2]", 2)
    for part in ("balls 0 and 2", "overlap by 0.5 m", "1.5 m apart", "radii 1 m and 1 m"):
        assert part in str(error)
    error_of(listed(ball(0, 0), ball(1.9999999, 0)))


@pytest.mark.parametrize(
    ("place", "container"),
    [
        ((0, 9.25), {}),
        *((place, BOX) for place in [(9.25, 0), (-9.25, 0), (0, 4.25), (0, -4.25)]),
        ((10.25, 0), PERIODIC),
    ],
)
def test_a_ball_outside_is_refused(place, container):
    error = error_of(listed(ball(-3, 0), ball(*place), **container))
    assert (error.key, error.ball) == ("balls.list[1]", 1)
    assert "ball 1" in str(error)
    assert "0.25 m" in str(error)
    inside = tuple(0.9999999 * (abs(x) - 0.25) * np.sign(x) for x in place)
    starting_scene(listed(ball(-3, 0), ball(*inside), **container), 0)


@pytest.mark.parametrize(
    ("changes", "largest"),
    [({"radius": 1.5}, "1.3333333333333333 m"), ({"radius": 1.1, "ring_extent": 0.9}, "1.0 m")],
)
def test_rings_that_are_too_tight_are_refused_with_the_radius_that_fits(changes, largest):
    error = error_of(experiment(**changes))
    assert error.key == "balls.radius"
    assert str(error).endswith(largest)


def test_rings_fit_up_to_the_stated_radius():
    starting_scene(experiment(radius=4 / 3), 0)
    starting_scene(experiment(radius=1.0, ring_extent=0.9), 0)
    error_of(experiment(radius=4 / 3 + 1e-9))


def test_check_sees_the_container_where_it_is():
    scene = starting_scene(listed(ball(0, 0)), 0)
    moved = Scene(**(vars(scene) | {"container_position": np.array([9.5, 0.0])}))
    with pytest.raises(SceneError, match="sticks out"):
        check(moved)


@pytest.mark.parametrize(
    ("places", "apart"),
    [
        ([(9.25, 1), (-9.25, 1)], 1.5),
        ([(1, 5.25), (1, -5.25)], 1.5),
        ([(9.25, 5.25), (-9.75, -5.75)], math.sqrt(2)),
    ],
)
def test_overlaps_with_images_are_seen(places, apart):
    error = error_of(listed(*(ball(*place) for place in places), **PERIODIC))
    assert error.key == "balls.list[1]"
    assert f"{apart:.6g} m apart" in str(error)
    starting_scene(listed(*(ball(*place, 0.7) for place in places), **PERIODIC), 0)


def test_a_periodic_box_is_five_diameters_wide():
    """In a smaller one a ball could be next to another and to its image at once."""
    starting_scene(listed(ball(0, 0), shape="periodic", width=10.001), 0)
    error = error_of(listed(ball(0, 0), shape="periodic", width=19.0, height=9.9))
    assert error.key == "container.height"
