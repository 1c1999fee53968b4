"""Cells have room for all balls, reach the wall, and take no more memory than balls need.

That cells miss no contact follows from ``test_twin`` and ``test_one_trajectory``.
"""

import numpy as np
import pytest
from scenes import EVERYONE, NEIGHBOURS, gas, lattice, scene_of
from test_one_trajectory import assert_same

from snooker_cli.containers import SHAPES, Circle
from snooker_cli.engine import cell_grid, cell_memory, cells, prefetch, simulate

WALLED = {name: shape for name, shape in SHAPES.items() if shape.has_wall}


@pytest.mark.parametrize("name", WALLED)
@pytest.mark.parametrize("side", [2.0, 3.7])
def test_a_ball_at_the_wall_is_in_a_cell_at_the_wall(name, side):
    """Else no hit is predicted, and the ball leaves all cells."""
    container = WALLED[name](*(70.0, 40.0)[: len(WALLED[name].keys)])
    scene = scene_of([(0.0, 0.0, 0.0, 0.0, 1.0, 1.0)], container=container)
    mesh = cell_grid.new_mesh(scene, side)
    flags = cell_grid.cells_at_wall(scene, mesh, 0.0)
    places = np.random.default_rng(0).normal(0.0, 100.0, (20_000, 2))
    radii = np.ones(len(places))
    outside = container.wall_gaps(places, radii) < 0
    container.put_inside(places, radii)
    column = np.floor((places[outside, 0] - mesh.left) / mesh.width).astype(int)
    row = np.floor((places[outside, 1] - mesh.bottom) / mesh.height).astype(int)
    assert len(row) > 1000
    assert 0 <= column.min() <= column.max() < mesh.columns
    assert 0 <= row.min() <= row.max() < mesh.rows
    assert np.all(flags[(row << mesh.shift) + column])
    assert not np.all(flags)


def test_cells_that_overflow_get_more_room():
    """One ball of 3 m among small ones: cells are as wide as it, and there are 8 or so in one."""
    side = 34.0
    positions = lattice(240, side, side, 3.0)
    positions = positions[np.hypot(*positions.T) > 3.5]
    velocities = np.random.default_rng(5).normal(0.0, 7.0, size=positions.shape)
    small = np.broadcast_to([0.3, 1.0], positions.shape)
    scene = scene_of(
        [(0.0, 0.0, 0.0, 0.0, 3.0, 10.0), *np.hstack([positions, velocities, small]).tolist()],
        container=Circle(side / 2),
        container_mass=100.0,
        restitution=0.95,
    )
    assert NEIGHBOURS([scene], 1, None).search.cells.members.shape[1] > cell_memory.LEAST_MEMBERS
    expected = simulate(scene, collisions=1500, search=EVERYONE)
    assert_same(expected, simulate(scene, collisions=1500, search=NEIGHBOURS))


def test_balls_that_seldom_meet_take_no_memory():
    """Balls of 1 m in a box of 18,000 km: millions of crossings between two collisions."""
    run = NEIGHBOURS([gas("periodic", 4, 4e-14)], 3, None)
    calls = 0
    while len(run.active):
        run.chunk()
        calls += 1
    (kept,) = run.chunks
    assert calls > 5 * 3
    assert [len(events) for events in kept if len(events)] == [1] * 3
    assert len(kept) <= 4
    held = [events.i if events.i.base is None else events.i.base for events in kept]
    assert sum(column.size for column in held) <= 2 * 3


def test_a_call_has_a_bounded_number_of_crossings():
    """Also with rare collisions between them; there are 60,000 collisions to come."""
    run = NEIGHBOURS([gas("periodic", 6, 1e-11)], 60_000, None, True)
    rare = 0
    while rare < 5:
        new, crossings = run.chunk(), run.search.progress[prefetch.CROSSINGS]
        assert crossings <= cells.CROSSINGS_AT_ONCE
        rare += 0 < new < 100 and crossings == cells.CROSSINGS_AT_ONCE


@pytest.mark.parametrize("name", ["box", "periodic"])
def test_a_slender_box_has_no_more_cells_than_its_balls_need(name):
    scene = gas(name, 6, 1e-18, aspect=1e12)
    mesh = NEIGHBOURS([scene], 10, None).search.cells.mesh
    assert 100 < mesh.columns <= cell_grid.MOST_IN_ROW * scene.number + 2
