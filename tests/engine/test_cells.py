"""Between two events, cells and queue are consistent, and no contact is missed.

Whether the queue is right follows from the balls' places and velocities alone. Of all pairs, and
with the wall, the balls that would touch next must come up in the queue before that.
"""

import math

import numpy as np
import pytest
from scenes import EPSILON, gas, lattice, scene_of

from snooker_cli.containers import SHAPES, Box, Circle
from snooker_cli.engine import cell_grid, cell_memory, cells, clock
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.simulation import InCells
from snooker_cli.scene import Scene

ROOM = 8192


def advance(engine: InCells, events: int) -> None:
    """Simulate this many events."""
    i, j, answers = np.zeros((3, 1, ROOM), dtype=np.int32)
    records = ks.Recorded(np.empty((1, ROOM)), i, j, np.empty((1, ROOM)))
    done = engine.state.collisions + events
    while engine.state.collisions < done:
        engine.advance(records, answers[0], done - engine.state.collisions)
        assert answers[0, 0] == clock.FULL


def places(engine: InCells, now: float) -> np.ndarray:
    """Where the balls are at a time, in the engine's order and as seen from its origin; (N, 2)."""
    rows = engine.state.balls
    return (rows[[ks.X, ks.Y]] + rows[[ks.U, ks.V]] * (now - rows[ks.CLOCK])).T


def rounding(engine: InCells, now: float) -> float:
    """Rounding of a place, m: of coordinates, clocks, times of contact, and each crossing since."""
    speeds = np.max(abs(engine.state.balls[[ks.U, ks.V]]), axis=0)
    away = float(np.max(abs(places(engine, now)))) if engine.scene.free else 0.0
    side = min(engine.cells.mesh.width, engine.cells.mesh.height)
    crossings = float(np.max(speeds * (now - engine.state.balls[ks.CLOCK]))) / side
    size = max(engine.scene.container.size) + away + float(speeds.max()) * now
    return (64 + crossings) * EPSILON * size


def assert_consistent(engine: InCells) -> None:
    """Assert all that holds between two events."""
    margin = engine.cells.margin
    renewal = math.inf if margin is None else float(margin.place[cells.UNTIL])
    # When the next thing happens; all balls are in their cells until then.
    now = min(float(engine.cells.tree.times[1]), renewal)
    assert engine.state.sums[ks.NOW] <= now < math.inf
    assert_members(engine)
    assert_in_their_cells(engine, now)
    assert_nothing_is_missed(engine, now, renewal)
    if margin is not None:
        brink = margin.brink[: margin.brinks[0]]
        assert np.array_equal(np.sort(brink), np.flatnonzero(engine.cells.links[cell_memory.BRINK]))


def assert_members(engine: InCells) -> None:
    """Every ball is in one cell once, and its links say where."""
    members, occupancy = engine.cells.members, engine.cells.occupancy
    assert np.all((occupancy >= 0) & (occupancy <= members.shape[1]))
    cell, place = np.nonzero(np.arange(members.shape[1]) < occupancy[:, np.newaxis])
    balls = members[cell, place]
    assert np.array_equal(np.sort(balls), np.arange(engine.scene.number))
    assert np.array_equal(engine.cells.links[cell_memory.CELL, balls], cell)
    assert np.array_equal(engine.cells.links[cell_memory.PLACE, balls], place)


def assert_in_their_cells(engine: InCells, now: float) -> None:
    """Each ball is inside its cell, and each such cell has cells all round it."""
    mesh, cell = engine.cells.mesh, engine.cells.links[cell_memory.CELL]
    slack = rounding(engine, now)
    width, height = engine.scene.container.size
    at = places(engine, now)
    for number, index, start, side, period, coordinate in (
        (mesh.columns, cell % (1 << mesh.shift), mesh.left, mesh.width, width, at[:, 0]),
        (mesh.rows, cell >> mesh.shift, mesh.bottom, mesh.height, height, at[:, 1]),
    ):
        outermost = 0 if not engine.scene.container.has_wall else 1
        assert np.all((index >= outermost) & (index < number - outermost))
        off = coordinate - (start + side * (index + 0.5))
        if not engine.scene.container.has_wall:
            off -= period * np.rint(off / period)
        assert np.max(abs(off)) <= 0.5 * side + slack


def assert_nothing_is_missed(engine: InCells, now: float, renewal: float) -> None:
    """Of two balls that would touch, one comes up by then, perhaps only to be predicted again.

    So does a ball that would touch the wall, unless everything is predicted again before.
    """
    scene, labels = engine.scene, engine.state.labels
    radii = scene.radii[labels] if len(labels) else scene.radii
    at, speeds = places(engine, now), engine.state.balls[[ks.U, ks.V]].T
    leaves = len(engine.cells.tree.times) // 2
    entries = engine.cells.tree.times[leaves : leaves + scene.number]
    slack = rounding(engine, now)

    i, j = np.triu_indices(scene.number, 1)
    offsets, relative = at[j] - at[i], speeds[j] - speeds[i]
    if not engine.scene.container.has_wall:
        offsets = engine.scene.container.nearest_image(offsets)
    contact = radii[i] + radii[j]
    b = np.sum(offsets * relative, axis=1)
    # Deeper by the rounding of a place, so that touching balls that part are not taken to meet.
    c = np.sum(offsets**2, axis=1) - (contact - slack) ** 2
    w2 = np.sum(relative**2, axis=1)
    root = b * b - w2 * c
    meet = (b < 0) & (root > 0)
    delay = c[meet] / (np.sqrt(root[meet]) - b[meet])
    due = now + np.maximum(delay, 0.0)
    assert np.all(np.minimum(entries[i[meet]], entries[j[meet]]) <= due)

    due = now + wall_delays(engine, now, at, speeds, radii, slack)
    assert np.all(np.minimum(entries, renewal) <= due)


def wall_delays(
    engine: InCells,
    now: float,
    at: np.ndarray,
    speeds: np.ndarray,
    radii: np.ndarray,
    slack: float,
) -> np.ndarray:
    """Time until each ball is as far outside of the wall as a place is rounded; s."""
    scene = engine.scene
    with np.errstate(divide="ignore", invalid="ignore"):
        if not scene.container.has_wall:
            return np.full(scene.number, math.inf)
        if isinstance(scene.container, Box):
            halves = np.array(scene.container.size) / 2 - radii[:, np.newaxis] + slack
            delays = (np.copysign(halves, speeds) - at) / speeds
            return np.min(np.where(speeds != 0, delays, math.inf), axis=1)
        reach = scene.container.radius - radii + slack
        if engine.scene.free:
            x, y, u, v, clock = engine.state.boundary.motion
            at = at - np.array([x, y]) - np.array([u, v]) * (now - clock)
            speeds = speeds - np.array([u, v])
        b, w2 = np.sum(at * speeds, axis=1), np.sum(speeds**2, axis=1)
        c = np.sum(at**2, axis=1) - reach**2
        return np.where(w2 > 0, (np.sqrt(b * b - w2 * c) - b) / w2, math.inf)


CONTAINERS = {
    "circle": {"shape": "circle"},
    "light circle": {"shape": "circle", "container_mass": 20.0},
    "box": {"shape": "box", "aspect": 1.7},
    "periodic": {"shape": "periodic", "aspect": 1.7},
}
RARE = {("light circle", False), ("circle", True), ("periodic", True)}
"""Types of scene that would be compiled for this."""


@pytest.mark.parametrize(("number", "packing"), [(2, 0.01), (40, 0.3), (201, 0.002), (600, 0.5)])
@pytest.mark.parametrize(
    ("name", "mixed"),
    [
        pytest.param(name, mixed, marks=[pytest.mark.long] if (name, mixed) in RARE else [])
        for name in CONTAINERS
        for mixed in (False, True)
    ],
)
def test_a_gas(name, mixed, number, packing):
    """The masses of a light container's balls are up to a quarter of its own."""
    if name == "periodic" and number == 2:
        number = 16  # a periodic box is five balls wide
    packing = min(packing, 0.35) if mixed else packing
    changes = {"number": number, "packing": packing, "mixed": mixed, **CONTAINERS[name]}
    scene = gas(**changes, cor=0.97, wall_cor=1.0)
    engine = InCells([scene], ROOM, None)
    dice = np.random.default_rng(number)
    assert_consistent(engine)
    for events in dice.integers(1, 6 * number + 6, size=8):
        advance(engine, int(events))
        assert_consistent(engine)


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


def crowd(shape: str, *, container_mass: float = math.inf, drift: float = 0.0) -> Scene:
    """One ball of 3 m among small ones: cells are as wide as it, and there are 8 or so in one."""
    side = 34.0
    places = lattice(240, side, side, 3.0 if shape == "circle" else None)
    places = places[np.hypot(*places.T) > 3.5]
    velocities = np.random.default_rng(5).normal((drift, 0.0), 7.0, size=(len(places) + 1, 2))[1:]
    small = np.broadcast_to([0.3, 1.0], places.shape)
    return scene_of(
        [(0.0, 0.0, drift, 0.0, 3.0, 10.0), *np.hstack([places, velocities, small]).tolist()],
        container=Circle(side / 2) if shape == "circle" else SHAPES[shape](side, side),
        container_mass=container_mass,
        container_velocity=(drift, 0.0),
        restitution=0.95,
    )


@pytest.mark.parametrize(
    ("shape", "container_mass", "drift"),
    [
        ("circle", 100.0, 0.0),
        # Between two events it is elsewhere than at the last.
        pytest.param("circle", 100.0, 1e4, marks=pytest.mark.long),
        ("box", math.inf, 0.0),
        pytest.param("circle", math.inf, 0.0, marks=pytest.mark.long),
        pytest.param("periodic", math.inf, 0.0, marks=pytest.mark.long),
    ],
)
def test_cells_that_overflow_get_more_room(shape, container_mass, drift):
    scene = crowd(shape, container_mass=container_mass, drift=drift)
    engine = InCells([scene], ROOM, None)
    assert engine.cells.members.shape[1] > 4  # they overflowed when they were filled
    overflows = 0
    for _ in range(100):
        # Leave cells no more room than the fullest needs: soon one will overflow.
        room = int(engine.cells.occupancy.max())
        engine._fill(room)
        advance(engine, 2)
        overflows += engine.cells.members.shape[1] > room
        assert_consistent(engine)
    assert overflows > 5
    if drift > 0:
        assert engine.state.boundary.motion[ks.X] > 100 * engine.cells.mesh.width


def test_balls_that_seldom_meet_take_no_memory():
    """Balls of 1 m in a box of 18,000 km: millions of crossings between two collisions."""
    engine = InCells([gas("periodic", 4, 4e-14)], 3, None)
    calls = 0
    while len(engine.active):
        engine.chunk()
        calls += 1
    (kept,) = engine.chunks
    assert calls > 5 * 3
    assert [len(events) for events in kept if len(events)] == [1] * 3
    assert len(kept) <= 4
    held = [events.i if events.i.base is None else events.i.base for events in kept]
    assert sum(each.size for each in held) <= 2 * 3


@pytest.mark.parametrize("name", ["box", "periodic"])
def test_a_slender_box_has_no_more_cells_than_its_balls_need(name):
    scene = gas(name, 6, 1e-18, aspect=1e12)
    mesh = InCells([scene], 10, None).cells.mesh
    assert 100 < mesh.columns <= cell_grid.MOST_IN_ROW * scene.number + 2
