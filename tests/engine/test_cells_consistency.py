"""The cells' own books at any moment: who is in which cell, what is queued, what is overlooked.

That what is queued is right is asked of nothing but the balls' places and velocities: whoever would
touch next, of all pairs and with the wall, has to come up in the queue before that.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scenes import EPSILON, gas, lattice, scene_of

from snooker_cli.containers import SHAPES, Box, Circle
from snooker_cli.engine import cell_grid, clock, sampling
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.event_queue import CHILDREN
from snooker_cli.engine.simulation import InCells
from snooker_cli.scene import Scene

ROOM = 8192


def advance(engine: InCells, events: int) -> None:
    """Simulate so many events, or until time has come to an end."""
    recorded, grid = ks.new_record(ROOM), sampling.no_grid()
    done = engine.state.collisions + events
    while engine.state.collisions < done:
        assert engine.advance(recorded, grid, done - engine.state.collisions) == clock.FULL


def places(engine: InCells, now: float) -> np.ndarray:
    """Where the balls are at a time, in the engine's order and as seen from its origin; (N, 2)."""
    rows = engine.state.balls
    return (rows[[ks.X, ks.Y]] + rows[[ks.U, ks.V]] * (now - rows[ks.CLOCK])).T


def rounding(engine: InCells, now: float) -> float:
    """What a place is off by, m: coordinates, clocks and times of contact are rounded, and the time
    of a crossing is, on a straight way, the last one's and a cell's, with another rounding."""
    speeds = np.max(abs(engine.state.balls[[ks.U, ks.V]]), axis=0)
    away = float(np.max(abs(places(engine, now)))) if engine.state.container is not None else 0.0
    side = min(engine.cells.mesh.width, engine.cells.mesh.height)
    crossings = float(np.max(speeds * (now - engine.state.balls[ks.CLOCK]))) / side
    size = max(engine.scene.container.size) + away + float(speeds.max()) * now
    return (64 + crossings) * EPSILON * size


def assert_consistent(engine: InCells) -> None:
    """Assert all that holds between two events."""
    # When the next thing happens; all balls are in their cells until then.
    now = min(float(engine.cells.tree.times[1]), renewal(engine))
    assert now < math.inf
    assert now >= engine.state.sums[ks.NOW]
    assert_lines(engine)
    assert_members(engine)
    assert_in_their_cells(engine, now)
    assert_queue(engine, now)
    assert_nothing_is_overlooked(engine, now)
    if engine.cells.margin is not None:
        brink = engine.cells.margin.brink[: engine.cells.margin.brinks[0]]
        assert np.array_equal(np.sort(brink), np.flatnonzero(engine.cells.links[cell_grid.BRINK]))


def renewal(engine: InCells) -> float:
    """When all is put into cells anew, because a free container has moved too far; s."""
    return (
        math.inf
        if engine.cells.margin is None
        else float(engine.cells.margin.place[cell_grid.UNTIL])
    )


def assert_lines(engine: InCells) -> None:
    """Each ball has a line of the cache, and four children of the tree lie in one."""
    for memory in (engine.state.balls, engine.cells.tree.times):
        assert memory.ctypes.data % ks.LINE == 0
    assert engine.state.balls.strides == (8, ks.LINE)
    assert np.shares_memory(engine.state.balls, engine.cells.tags)


def assert_members(engine: InCells) -> None:
    """Every ball is in one cell once, and its links say where."""
    members, occupancy = engine.cells.members, engine.cells.occupancy
    assert np.all((occupancy >= 0) & (occupancy <= members.shape[1]))
    cell, place = np.nonzero(np.arange(members.shape[1]) < occupancy[:, np.newaxis])
    balls = members[cell, place]
    assert np.array_equal(np.sort(balls), np.arange(engine.scene.number))
    assert np.array_equal(engine.cells.links[cell_grid.CELL, balls], cell)
    assert np.array_equal(engine.cells.links[cell_grid.PLACE, balls], place)


def assert_in_their_cells(engine: InCells, now: float) -> None:
    """Nobody is outside of its cell, nor in a cell without others all round it."""
    mesh, cell = engine.cells.mesh, engine.cells.links[cell_grid.CELL]
    slack = rounding(engine, now)
    width, height = engine.scene.container.size
    at = places(engine, now)
    for number, index, start, side, period, coordinate in (
        (mesh.columns, cell % (1 << mesh.shift), mesh.left, mesh.width, width, at[:, 0]),
        (mesh.rows, cell >> mesh.shift, mesh.bottom, mesh.height, height, at[:, 1]),
    ):
        outermost = 0 if engine.state.period is not None else 1
        assert np.all((index >= outermost) & (index < number - outermost))
        off = coordinate - (start + side * (index + 0.5))
        if engine.state.period is not None:
            off -= period * np.rint(off / period)
        assert np.max(abs(off)) <= 0.5 * side + slack


def assert_queue(engine: InCells, now: float) -> None:
    """A ball's entry is its earliest event, unless that is past; nodes are the earliest below."""
    times, rows = engine.cells.tree.times, engine.state.balls
    leaves = len(times) // 2
    number = engine.scene.number
    earliest = np.min(rows[[cell_grid.CONTACT_TIME, cell_grid.CROSSING_TIME]], axis=0)
    entries = times[leaves : leaves + number]
    assert np.all((entries == earliest) | ((entries > earliest) & (entries <= now)))
    assert np.all(times[leaves + number :] == math.inf)
    first = 1  # of a level, which has so many nodes too
    while first < leaves:
        below = CHILDREN * first
        children = times[below : 2 * below].reshape(first, CHILDREN)
        assert np.array_equal(times[first : 2 * first], children.min(axis=1))
        first = below


def assert_nothing_is_overlooked(engine: InCells, now: float) -> None:
    """Of two balls that would touch, one comes up by then, be it only to look again; at the wall,
    the ball itself, or all is looked at anew before. By textbook formulas."""
    scene, labels = engine.scene, engine.state.labels
    radii = scene.radii[labels] if len(labels) else scene.radii
    at, speeds = places(engine, now), engine.state.balls[[ks.U, ks.V]].T
    leaves = len(engine.cells.tree.times) // 2
    entries = engine.cells.tree.times[leaves : leaves + scene.number]
    slack = rounding(engine, now)

    i, j = np.triu_indices(scene.number, 1)
    offsets, relative = at[j] - at[i], speeds[j] - speeds[i]
    if engine.state.period is not None:
        offsets -= engine.state.period * np.rint(offsets / engine.state.period)
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
    assert np.all(np.minimum(entries, renewal(engine)) <= due)


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
        if engine.state.container is not None:
            x, y, u, v, clock = engine.state.container
            at = at - np.array([x, y]) - np.array([u, v]) * (now - clock)
            speeds = speeds - np.array([u, v])
        b, w2 = np.sum(at * speeds, axis=1), np.sum(speeds**2, axis=1)
        c = np.sum(at**2, axis=1) - reach**2
        return np.where(w2 > 0, (np.sqrt(b * b - w2 * c) - b) / w2, math.inf)


def begun(scene: Scene) -> InCells:
    return InCells(scene, ks.Setup.of(scene))


CONTAINERS = {
    "circle": {"shape": "circle"},
    "light circle": {"shape": "circle", "container_mass": 20.0},
    "box": {"shape": "box", "aspect": 1.7},
    "periodic": {"shape": "periodic", "aspect": 1.7},
}
RARE = {("light circle", False), ("circle", True), ("periodic", True)}
"""Kinds that would be compiled for this, as is one ball."""


def gases() -> Iterator[pytest.param]:
    for name, container in CONTAINERS.items():
        for mixed in (False, True):
            for number, packing in ((1, 0.1), (2, 0.01), (40, 0.3), (201, 0.002), (600, 0.5)):
                if name == "periodic" and number < 16:
                    continue
                changes = {**container, "mixed": mixed, "number": number, "packing": packing}
                rare = number == 1 or (name, mixed) in RARE
                marks = [pytest.mark.long] if rare else []
                yield pytest.param(changes, id=f"{name}-{mixed}-{number}", marks=marks)


@pytest.mark.parametrize("changes", list(gases()))
def test_books_are_right_after_any_number_of_events(changes):
    """The masses of a light container's balls are up to a quarter of its own."""
    if changes["packing"] == 0.5 and changes["mixed"]:
        changes = {**changes, "packing": 0.35}
    engine = begun(gas(**changes, cor=0.97, wall_cor=1.0))
    dice = np.random.default_rng(changes["number"])
    assert_consistent(engine)
    for events in dice.integers(1, 6 * changes["number"] + 6, size=8):
        advance(engine, int(events))
        assert_consistent(engine)


# --- what is seen to between events -------------------------------------------------------------


def crowd(shape: str, *, container_mass: float = math.inf, drift: float = 0.0) -> Scene:
    """One ball of 3 m among small ones: cells are as wide as it, and there are 8 or so in one."""
    side = 34.0
    places = lattice(240, side, side, 3.0 if shape == "circle" else None)
    places = places[np.hypot(*places.T) > 3.5]
    dice = np.random.default_rng(5)
    number = len(places) + 1
    velocities = dice.normal(0.0, 7.0, size=(number, 2)) + np.array([drift, 0.0])
    return replace(
        scene_of([(0.0, 0.0, drift, 0.0, 3.0, 10.0)]),
        positions=np.vstack([[0.0, 0.0], places]),
        velocities=velocities,
        radii=np.append(3.0, np.full(number - 1, 0.3)),
        masses=np.append(10.0, np.full(number - 1, 1.0)),
        container=Circle(side / 2) if shape == "circle" else SHAPES[shape](side, side),
        container_mass=container_mass,
        container_velocity=np.array([drift, 0.0]),
        restitution=0.95,
    )


@pytest.mark.parametrize(
    ("shape", "container_mass"),
    [
        pytest.param("circle", math.inf, marks=pytest.mark.long),
        ("circle", 100.0),
        ("box", math.inf),
        pytest.param("periodic", math.inf, marks=pytest.mark.long),
    ],
)
def test_cells_that_overflow_get_more_room(shape, container_mass):
    engine = begun(crowd(shape, container_mass=container_mass))
    at_first = engine.capacity
    assert at_first > 4  # they overflowed when they were filled
    for _ in range(40):
        advance(engine, 500)
        assert_consistent(engine)
        if engine.capacity > at_first:  # and on the way
            break
    assert engine.capacity > at_first
    for _ in range(5):
        advance(engine, 300)
        assert_consistent(engine)


def tighten(engine: InCells) -> None:
    """Leave cells no more room than the fullest needs: soon one will overflow."""
    engine._set_capacity(int(engine.cells.occupancy.max()))
    engine._fill()


@pytest.mark.parametrize(("drift", "turns"), [(0.0, 200), (1e4, 80)])
def test_cells_overflow_again_and_again_in_a_container_that_moves(drift, turns):
    """On a journey it is, between two events, often elsewhere than where it was at the last."""
    engine = begun(crowd("circle", container_mass=100.0, drift=drift))
    overflows = 0
    for _ in range(turns):
        tighten(engine)
        room = engine.capacity
        advance(engine, 2)
        overflows += engine.capacity > room
        assert_consistent(engine)
    assert overflows > 10
    if drift > 0:
        assert engine.state.container[ks.X] > 100 * engine.cells.mesh.width
