"""How runs in cells end, in every container, and that what stands or drifts alone ends too."""

import importlib
from dataclasses import replace

import numpy as np
import pytest
from scenes import EPSILON, gas, report_scene, same_events, scene_of
from test_statistics import assert_nothing_comes_between

from snooker_cli.containers import Box, PeriodicBox
from snooker_cli.engine import replay, simulate, simulation
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, StopReason, Trace

SIMULATE = importlib.import_module("snooker_cli.engine.simulation")

CONTAINERS = {
    "circle": {},
    "light circle": {"container_mass": 5.0},
    "box": {"container": Box(20.0, 16.0)},
    "periodic": {"container": PeriodicBox(20.0, 16.0)},
}

UNLIKE = ("light circle", "box")
"""Where balls differ; elsewhere they are alike, lest another kind be compiled for this alone."""

# The arrays of one ball are of a kind of their own, too. Elsewhere a ball in the middle, which
# nothing meets, is company enough.
LONE = pytest.param(1, marks=pytest.mark.long)
AT_REST = (0.0, 0.0, 0.0, 0.0, 1.0, 1.0)

every_container = pytest.mark.parametrize("container", CONTAINERS)


def whom(trace: Trace) -> list[tuple[int, int]]:
    return list(zip(trace.events.i.tolist(), trace.events.j.tolist(), strict=True))


# --- what was asked for -----------------------------------------------------------------------


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(SIMULATE, "CHUNK", 7)


GASES = {
    "circle": lambda: gas("circle", 40, 0.3, cor=0.9),
    "light circle": lambda: gas("circle", 40, 0.3, mixed=True, cor=0.9, container_mass=20.0),
    "box": lambda: gas("box", 40, 0.3, mixed=True, cor=0.9),
    "periodic": lambda: gas("periodic", 40, 0.3, cor=0.9),
}


@pytest.fixture(params=GASES)
def scene(request) -> Scene:
    return GASES[request.param]()


def test_collisions(scene):
    trace = simulate(scene, collisions=500, engine="cells")
    assert trace.stop.reason is StopReason.COLLISIONS
    assert trace.collisions == len(trace.events) == 500
    assert trace.wall_events == np.sum(trace.events.j == CONTAINER)
    assert (trace.wall_events == 0) == (not scene.container.has_wall)
    assert trace.stop.time == trace.events.time[-1]
    assert np.all((trace.events.j > trace.events.i) | (trace.events.j == CONTAINER))


def test_time(scene):
    """The last collision before a time, which is no collision's, and the first after it."""
    whole = simulate(scene, collisions=301, engine="cells")
    middle = 0.5 * float(whole.events.time[299] + whole.events.time[300])
    trace = simulate(scene, time=middle, engine="cells")
    assert trace.stop.reason is StopReason.TIME
    assert trace.stop.time == middle
    assert len(trace.events) == 300
    assert np.array_equal(trace.finish.positions, replay(whole, [middle]).positions[0])


@pytest.mark.usefixtures("small_chunks")
def test_chunks_change_no_bit(scene, monkeypatch):
    parts = simulate(scene, collisions=1000, engine="cells")
    monkeypatch.undo()
    whole = simulate(scene, collisions=1000, engine="cells")
    assert same_events(parts.events, whole.events)
    assert np.array_equal(parts.finish.positions, whole.finish.positions)
    assert parts.stop == whole.stop


@every_container
def test_no_collisions_wanted(container):
    trace = simulate(GASES[container](), collisions=0, engine="cells", watch=lambda new: True)
    assert trace.stop.reason is StopReason.COLLISIONS
    assert trace.collisions == 0


# --- nothing left -----------------------------------------------------------------------------


@every_container
@pytest.mark.parametrize("number", [LONE, 3])
def test_nothing_left_at_rest(container, number):
    heavier = float(container in UNLIKE)
    balls = [(4.0 * k - 4.0, 1.0, 0.0, 0.0, 1.0, 1.0 + k * heavier) for k in range(number)]
    scene = scene_of(balls, **CONTAINERS[container])
    trace = simulate(scene, collisions=10, engine="cells")
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.stop.time == 0.0
    assert np.array_equal(trace.finish.positions, scene.positions)
    trace = simulate(scene, time=3.0, engine="cells")
    assert trace.stop.time == 3.0


@every_container
def test_nothing_left_after_two_balls_have_stopped_each_other(container):
    small, large = (0.5, 1.5) if container in UNLIKE else (1.0, 1.0)
    balls = [(-3.0, 0.0, 1.0, 0.0, small, 1.0), (3.0, 0.0, -1.0, 0.0, large, 1.0)]
    scene = scene_of(balls, restitution=0.0, **CONTAINERS[container])
    trace = simulate(scene, collisions=10, engine="cells")
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.events.time.tolist() == [2.0]
    assert trace.events.impulse.tolist() == [1.0]
    assert np.all(trace.finish.velocities == 0)


def watched(looks: list[int], most: int = 5):
    """A watch that counts, and stops a run that goes on for long."""
    return lambda new: looks.append(new) or len(looks) == most


@pytest.mark.parametrize("container", ["light circle", "periodic"])
def test_balls_that_drift_with_all_there_is(container):
    """Nothing will ever happen, however long."""
    radius = 0.5 if container in UNLIKE else 1.0
    balls = [(0.0, 1.0, 7.0, 3.0, 1.0, 1.0), (4.0, 1.0, 7.0, 3.0, radius, 1.0)]
    changes = dict(CONTAINERS[container])
    if container == "light circle":
        changes["container_velocity"] = (7.0, 3.0)
    scene = scene_of(balls, **changes)
    looks: list[int] = []
    trace = simulate(scene, collisions=10, engine="cells", watch=watched(looks))
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert sum(looks) == trace.collisions == 0
    trace = simulate(scene, time=30.0, engine="cells")
    assert trace.stop.time == 30.0
    moved = trace.finish.positions - scene.positions - 30.0 * scene.velocities
    if container == "periodic":
        moved -= np.rint(moved / scene.container.size) * scene.container.size
    assert np.allclose(moved, 0.0, rtol=0, atol=8 * EPSILON * 30.0 * 7.0)


def test_ways_that_never_meet_can_be_stopped_and_end_in_time():
    """Two lanes of a periodic box: a run without an end, which nothing can foresee."""
    balls = [(0.0, -4.0, 7.0, 0.0, 1.0, 1.0), (4.0, 4.0, -3.0, 0.0, 1.0, 1.0)]
    scene = scene_of(balls, **CONTAINERS["periodic"])
    looks: list[int] = []
    trace = simulate(scene, collisions=10, engine="cells", watch=watched(looks))
    assert trace.stop.reason is StopReason.INTERRUPTED
    assert looks == [0] * 5
    assert len(trace.events) == 0
    trace = simulate(scene, time=1000.0, engine="cells")
    assert trace.stop.reason is StopReason.TIME
    assert trace.stop.time == 1000.0
    assert np.allclose(
        trace.finish.positions, [[0.0, -4.0], [4.0, 4.0]], rtol=0, atol=4 * EPSILON * 7000.0
    )


@pytest.mark.parametrize("limit", [{"collisions": 8}, {"time": 4.0}])
@pytest.mark.parametrize("container_mass", [5.0, 1e7])
def test_a_container_that_comes_to_balls_at_rest(container_mass, limit):
    """Nothing moves but the container: its wall is what happens next."""
    balls = [(0.0, 1.0, 0.0, 0.0, 1.0, 1.0), (3.0, -4.0, 0.0, 0.0, 0.5, 2.0)]
    scene = scene_of(balls, container_mass=container_mass, container_velocity=(9.0, 0.0))
    cells, pairs = (simulate(scene, **limit, engine=kind) for kind in ("cells", "allpairs"))
    assert len(pairs.events) >= 3
    assert whom(cells) == whom(pairs)
    assert np.allclose(cells.events.time, pairs.events.time, rtol=0, atol=1e-12)
    assert cells.stop.reason is pairs.stop.reason


def test_a_slow_ball_in_a_fast_container_until_a_time():
    """The ball's next crossing is long after the end, but the wall comes before it."""
    balls = [(0.0, 1.0, 1e-3, 0.0, 1.0, 1.0), (5.0, -4.0, 0.0, 0.0, 0.5, 2.0)]
    scene = scene_of(balls, container_mass=5.0, container_velocity=(9.0, 0.0))
    cells, pairs = (simulate(scene, time=1.5, engine=kind) for kind in ("cells", "allpairs"))
    assert len(pairs.events) == 1
    assert whom(cells) == whom(pairs)


# --- wall trap --------------------------------------------------------------------------------


def lone_bouncer() -> Scene:
    """A ball that is in a wall trap from its first hit, at 0.5 s, until 14.78 s."""
    inwards = 6.0 / 0.9
    ball = (9.0 - 0.5 * inwards, -4.0, inwards, 8.0, 1.0, 1.0)
    return scene_of([ball], wall_restitution=0.9)


@pytest.mark.long
def test_a_lone_ball_in_a_wall_trap():
    trace = simulate(lone_bouncer(), collisions=1000, engine="cells")
    assert trace.stop.reason is StopReason.WALL_TRAP
    assert trace.stop.balls == (0,)
    assert trace.stop.time < 0.5 + 14.284783441
    assert same_events(trace.events, simulate(lone_bouncer(), collisions=2, engine="cells").events)


@pytest.mark.long
def test_a_trap_does_not_end_a_run_whose_time_is_up_before_the_last_bounce():
    trace = simulate(lone_bouncer(), time=5.0, engine="cells")
    assert trace.stop.reason is StopReason.TIME
    assert len(trace.events) == 5


@pytest.mark.parametrize("repeat", range(3))
def test_a_gas_in_a_wall_trap(repeat):
    scene = report_scene(repeat, radius=0.1, cor=0.8)
    trace = simulate(scene, collisions=2000, engine="cells")
    assert trace.stop.reason is StopReason.WALL_TRAP
    assert trace.stop.balls == (trace.events.i[-1],)
    assert trace.events.j[-1] == CONTAINER
    assert_nothing_comes_between(trace)


def test_a_wall_trap_among_balls_that_have_changed_places(monkeypatch):
    """In memory, that is: who is trapped is told by the scene's number."""
    monkeypatch.setattr(simulation, "REORDERED", 4)
    scene = gas("circle", 37, 0.004, mixed=True, cor=0.8, container_mass=1e7)
    trace = simulate(scene, collisions=5000, engine="cells")
    assert trace.stop.reason is StopReason.WALL_TRAP
    assert trace.stop.balls == (trace.events.i[-1],)
    assert f"ball {trace.events.i[-1]} " in trace.stop.message


def test_a_wall_that_swallows_the_rebound():
    """In a circle the ball slides for ever, in a box to the corner: there it stays."""
    ball = (0.0, -5.0, 4.5, 1.0, 1.0, 1.0)
    trace = simulate(scene_of([ball, AT_REST], wall_restitution=0.0), collisions=10, engine="cells")
    assert trace.stop.reason is StopReason.WALL_TRAP
    assert len(trace.events) == 1
    scene = scene_of([ball, AT_REST], wall_restitution=0.0, **CONTAINERS["box"])
    trace = simulate(scene, collisions=10, engine="cells")
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.events.time == pytest.approx([2.0, 12.0])
    assert trace.finish.positions[0] == pytest.approx([9.0, 7.0])
    assert np.all(trace.finish.velocities == 0)


# --- inelastic collapse -----------------------------------------------------------------------


@every_container
def test_collapse_of_three_in_a_line(container):
    """Below e = 7 - 4 sqrt(3) = 0.0718 the outer two hit the middle one infinitely often."""
    radii = (1.5, 0.5, 1.5) if container in UNLIKE else (1.0, 1.0, 1.0)
    balls = [(4.0 * k, 0.0, -float(k), 0.0, radii[k + 1], 1.0) for k in (-1, 0, 1)]
    balls[0] = (-3.5, *balls[0][1:])
    scene = scene_of(balls, restitution=0.05, **CONTAINERS[container])
    trace = simulate(scene, collisions=100_000, engine="cells")
    assert trace.stop.reason is StopReason.COLLAPSE
    assert len(trace.events) < 1000
    assert trace.stop.time < 2.6  # the outer two are in touch with the middle one from 2.0 s on
    assert set(trace.stop.balls) in ({0, 1}, {1, 2})


def test_collapse_of_a_ball_between_walls_that_it_touches():
    """It moves along a channel as wide as itself, and a little across."""
    balls = [(0.0, 0.0, 3.0, 0.1, 1.0, 1.0), (-5.0, 0.0, 0.0, 0.0, 0.5, 1.0)]
    scene = scene_of(balls, container=Box(12.0, 2.0))
    trace = simulate(scene, collisions=1000)
    assert trace.stop.reason is StopReason.COLLAPSE
    assert trace.stop.time == 0.0
    assert np.all(trace.events.impulse == 0.2)
    assert trace.finish.velocities[0, 0] == 3.0


@pytest.mark.parametrize("cor", [0.0, 0.1])
@every_container
def test_a_pair_that_has_parted_does_not_meet_again_by_itself(container, cor):
    """Straight ways cross once, in a small part of a box: one of the two met something else since.

    Without any rebound the two stay side by side, and rounding must not let them collide.
    """
    scene = replace(GASES[container](), restitution=cor, wall_restitution=1.0)
    trace = simulate(scene, collisions=3000, engine="cells")
    assert len(trace.events) > 100
    last: dict[int, int] = {}
    for i, j in whom(trace):
        if j == CONTAINER:
            last[i] = CONTAINER
        else:
            assert not (last.get(i) == j and last.get(j) == i)
            last[i], last[j] = j, i


# --- what is modelled -------------------------------------------------------------------------


def test_which_engine_suits():
    for packing in (0.1, 0.001):
        few = simulation.few_at(gas("circle", 10, packing).packing_fraction, free=False)
        assert simulation.engine_for(gas("circle", few, packing)) is simulation.AllPairs
        assert simulation.engine_for(gas("circle", few + 1, packing)) is simulation.InCells
    assert simulation.engine_for(gas("box", 2, 0.01)) is simulation.InCells
    with pytest.raises(ValueError, match="allpairs knows no periodic"):
        simulate(gas("periodic", 20, 0.1), collisions=1, engine="allpairs")


def test_a_periodic_box_that_is_too_small_is_refused():
    balls = [(0.0, 0.0, 1.0, 0.0, 1.0, 1.0)]
    scene = scene_of(balls, container=PeriodicBox(20.0, 9.9))
    with pytest.raises(ValueError, match="five diameters"):
        simulate(scene, collisions=1)
