"""How runs end in every container; and that watching changes nothing.

That both searches end alike is shown in ``test_one_trajectory``.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from exact import exact_events
from scenes import (
    EPSILON,
    EVERYONE,
    NEIGHBOURS,
    gas,
    lone_bouncer,
    report_scene,
    same_events,
    scene_of,
    trap_sums,
)

from snooker_cli.config import parse
from snooker_cli.containers import Box, Channel, PeriodicBox
from snooker_cli.engine import clock, contact, replay, simulate, simulation, sliding, stands_still
from snooker_cli.errors import SceneError
from snooker_cli.laws import Constant
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.trace import CONTAINER, StopReason, Trace

CHUNK = clock.LEAST_EVENTS  # of few balls a chunk is an epoch

CONTAINERS = {
    "circle": {},
    "light circle": {"container_mass": 5.0},
    "box": {"container": Box(20.0, 16.0)},
    "channel": {"container": Channel(20.0, 16.0)},
    "periodic": {"container": PeriodicBox(20.0, 16.0)},
}
every_container = pytest.mark.parametrize("container", CONTAINERS)

UNEQUAL = ("light circle", "box")
"""Where balls differ; elsewhere they are equal, so that no other kernel is compiled."""

AT_REST = (0.0, 0.0, 0.0, 0.0, 1.0, 1.0)
"""Nothing meets it. A single ball in cells would need a kernel of its own."""


def partners(trace: Trace) -> list[tuple[int, int]]:
    return list(zip(trace.events.i.tolist(), trace.events.j.tolist(), strict=True))


# --- limits -----------------------------------------------------------------------------------


def test_a_collision_at_the_very_end_is_in():
    """9 m at 4.5 m/s take 2 s."""
    scene = scene_of([(0.0, 0.0, 4.5, 0.0, 1.0, 1.0)])
    trace = simulate(scene, time=2.0)
    assert trace.stop.reason is StopReason.TIME
    assert trace.events.time.tolist() == [2.0]
    assert trace.finish.velocities.tolist() == [[-4.5, 0.0]]


def test_whichever_limit_comes_first():
    scene = report_scene()
    before = scene.positions.copy(), scene.velocities.copy()
    assert simulate(scene, collisions=10, time=1.0).stop.reason is StopReason.COLLISIONS
    by_time = simulate(scene, collisions=10_000, time=1.0)
    assert by_time.stop.reason is StopReason.TIME
    assert same_events(by_time.events, simulate(scene, time=1.0).events)
    assert by_time.start is scene
    assert np.array_equal((scene.positions, scene.velocities), before)
    none = simulate(scene, collisions=0)
    assert (none.collisions, none.stop.reason) == (0, StopReason.COLLISIONS)
    with pytest.raises(ValueError, match="collisions or a time"):
        simulate(scene)


# --- chunks -----------------------------------------------------------------------------------


def test_watch_counts_the_events_and_can_stop_the_run():
    scene = report_scene(cor=0.95, wall_cor=1.0)
    seen: list[tuple[int, float]] = []
    count = 2 * CHUNK + 1000
    watched = simulate(scene, collisions=count, watch=lambda *news: seen.append(news) or False)
    ends = CHUNK / count, 2 * CHUNK / count, 1.0
    assert seen == list(zip([CHUNK, CHUNK, 1000], map(pytest.approx, ends), strict=True))
    stopped = simulate(scene, collisions=count, watch=lambda *_: True)
    assert stopped.stop.reason is StopReason.INTERRUPTED
    assert stopped.stop.time == stopped.events.time[-1]
    assert same_events(stopped.events, watched.events[:CHUNK])
    complete = simulate(scene, collisions=CHUNK, watch=lambda *_: True)
    assert complete.stop.reason is StopReason.COLLISIONS


# --- nothing left -----------------------------------------------------------------------------


@every_container
def test_nothing_left_after_two_balls_have_stopped_each_other(container):
    small, large = (0.5, 1.5) if container in UNEQUAL else (1.0, 1.0)
    balls = [(-3.0, 0.0, 1.0, 0.0, small, 1.0), (3.0, 0.0, -1.0, 0.0, large, 1.0)]
    trace = simulate(scene_of(balls, restitution=0.0, **CONTAINERS[container]), collisions=10)
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.events.time.tolist() == [2.0]
    assert trace.events.impulse.tolist() == [1.0]
    assert np.all(trace.finish.velocities == 0)


@pytest.mark.parametrize("container", ["light circle", "periodic"])
def test_balls_and_container_that_move_as_one(container):
    """Nothing will ever happen, however long."""
    velocity = (7.0, 3.0)
    radius = 0.5 if container in UNEQUAL else 1.0
    balls = [(0.0, 1.0, *velocity, 1.0, 1.0), (4.0, 1.0, *velocity, radius, 1.0)]
    scene = scene_of(balls, **CONTAINERS[container])
    if scene.free:
        scene = replace(scene, container_velocity=np.array(velocity))
    trace = simulate(scene, collisions=10)
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    trace = simulate(scene, time=30.0)
    assert trace.stop.time == 30.0
    offsets = trace.finish.positions - scene.positions - 30.0 * scene.velocities
    moved = scene.container.nearest_image(offsets)
    assert np.allclose(moved, 0.0, rtol=0, atol=8 * EPSILON * 30.0 * 7.0)


# Relative velocities in a periodic box of 20 m x 16 m, with the distance of parallel images' paths.
CLOSED = [
    ((1.0, 0.0), 16.0),
    ((0.0, -3.0), 20.0),
    ((5.0, 4.0), 320 / math.hypot(20.0, 16.0)),
    ((-5.0, 2.0), 320 / math.hypot(40.0, 16.0)),
    ((7.0, 3.0), 320 / math.hypot(7 * 80.0, 3 * 80.0)),  # 28 times across, 15 times up
]


@pytest.mark.parametrize(("velocity", "apart"), CLOSED)
def test_paths_that_never_meet(velocity, apart):
    """By the distance of a straight path from the nearest image, over many images."""
    images = np.stack(np.meshgrid(20.0 * np.arange(-99, 100), 16.0 * np.arange(-99, 100)), axis=-1)
    u, v = velocity
    for x, y in [(3.0, 5.0), (8.0, -2.5), (-1.75, 0.5)]:
        ball, other = (x - u, y - v, u, v, -1.0), (3.0, -6.0, 0.0, 0.0, 7.0)
        offsets = images - (x - 3.0, y + 6.0)
        nearest = np.min(np.abs(offsets[..., 0] * v - offsets[..., 1] * u)) / math.hypot(u, v)
        assert nearest <= apart / 2 * (1 + EPSILON)
        for distance in (0.5 * nearest, 0.999 * nearest, 1.001 * nearest, apart):
            never = contact.never_meet(ball, other, float(distance), [20.0, 16.0])
            assert never == (distance <= nearest)


def test_balls_that_pass_by_for_ever():
    """In a periodic box, 2.3 m apart."""
    u, v = 5.0, 4.0
    balls = [(1.0, 0.0, u, v, 1.0, 1.0), (1.0, 3.0, -u, -v, 1.0, 1.0)]
    balls.append((9.0, 3.0 + 8.0 * v / u, -u, -v, 1.0, 1.0))  # behind the second one
    scene = scene_of(balls, **CONTAINERS["periodic"])
    trace = simulate(scene, collisions=10)
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.collisions == trace.stop.time == 0
    ended = simulate(scene, time=1000.0)
    assert ended.stop.reason is StopReason.TIME  # after too few crossings for a proof
    assert ended.collisions == 0
    # In the way of the first one, the third is hit.
    balls[2] = (9.0, 1.0 + 8.0 * v / u, -u, -v, 1.0, 1.0)
    assert len(simulate(scene_of(balls, **CONTAINERS["periodic"]), collisions=3).events) == 3


def test_a_proof_that_nothing_meets_can_be_stopped(monkeypatch):
    """Of 41 balls in lanes, 820 pairs are looked at: at most 100 until the user is asked."""
    lanes = [(0.0, 4.0 * k, 3.0 + 0.1 * k, 0.0, 1.0, 1.0) for k in range(-20, 21)]
    scene = scene_of(lanes, container=PeriodicBox(200.0, 200.0))
    looked_at, at_once = [], []

    def counted(*pair):
        looked_at.append(pair)
        return contact.never_meet(*pair)

    def watch(*_):
        at_once.append(len(looked_at) - sum(at_once))

    monkeypatch.setattr(simulation, "PAIRS_AT_ONCE", 100)
    monkeypatch.setattr(simulation, "never_meet", counted)
    trace = simulate(scene, collisions=10, watch=watch)
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert (max(at_once), sum(at_once)) == (100, 41 * 40 // 2)
    stopped = simulate(scene, collisions=10, watch=lambda *_: True)
    assert stopped.stop.reason is StopReason.INTERRUPTED


def test_two_balls_without_rebound_stop():
    """Each collision leaves the motion along the contact, until its square would be no double."""
    config = "container: {shape: periodic, packing: 0.02}\ncor: 0\ncollisions: 500\nseed: 2\n"
    balls = "balls: {count: 2, radius: 1, speed: 10, start: random}\n"
    trace = simulate(starting_scene(parse(config + balls).config, 0), collisions=500)
    assert trace.stop.reason is StopReason.REST
    assert trace.stop.message.startswith("all balls are slower than 2e-154 m/s after")
    assert 0.0 < trace.finish.kinetic_energy < 1e-300
    assert not trace.stop.reason.complete


def test_the_energy_falls_and_balls_stay_inside_until_they_are_too_slow():
    """Also of rough balls, whose places were once outside of the circle."""
    config = (
        "container: {radius: 10}\ncor: 0.95\nwall_cor: 1\ntangential_cor: 0.5\ncollisions: 50000\n"
    )
    balls = "balls: {count: 7, radius: 1, speed: 5, start: random}\n"
    trace = simulate(starting_scene(parse(config + balls).config, 0), collisions=50_000)
    assert trace.stop.reason is StopReason.REST
    assert len(trace.events) > 10_000
    states = replay(trace, trace.events.time[-1000:])
    assert np.hypot(*np.moveaxis(states.positions, 2, 0)).max() <= 9.0 * (1 + 1e-12)
    energies = np.sum(states.velocities**2, axis=(1, 2)) + 0.5 * np.sum(states.spins**2, axis=1)
    assert np.all(np.diff(energies) <= 1e-12 * energies[1:])


def test_very_many_crossings_without_a_collision(monkeypatch):
    """Two balls approach by a rounding a second, while both cross the box: it may be for ever."""
    monkeypatch.setattr(simulation, "IDLE_CALLS", 3)
    balls = [(0.0, 0.0, 7.0, 3.0, 1.0, 1.0), (5.0, 0.5, math.nextafter(7.0, 0.0), 3.0, 1.0, 1.0)]
    scene, counted = scene_of(balls, **CONTAINERS["periodic"]), []
    trace = simulate(scene, collisions=10, watch=lambda new, _: counted.append(new))
    assert trace.stop.reason is StopReason.IDLE
    assert not trace.stop.reason.complete
    assert counted == [0, 0, 0]
    assert "no collision in 3,000,000 crossings" in trace.stop.message
    # A time to end at is waited for.
    assert simulate(scene, time=1e6).stop.reason is StopReason.TIME


# --- wall trap --------------------------------------------------------------------------------


def test_a_lone_ball_in_a_wall_trap():
    trace = simulate(lone_bouncer(), collisions=1000)
    assert trace.stop.reason is StopReason.WALL_TRAP
    assert trace.stop.balls == (0,)
    assert trace.stop.time < 0.5 + 14.284783441
    # Both of two wanted collisions are there: the run is complete.
    assert simulate(lone_bouncer(), collisions=2).stop.reason is StopReason.COLLISIONS
    # Until 5 s there are but five bounces, of the infinitely many until 14.8 s.
    until = simulate(lone_bouncer(), time=5.0)
    assert until.stop.reason is StopReason.TIME
    assert len(until.events) == 5


def test_what_a_wall_trap_in_a_light_container_still_does():
    """The exact twin bounces on, 80 times. After these, chords and impulses are geometric."""
    wall_cor = 0.9
    scene = scene_of(
        [(2.0, -4.0, 3.0, 7.0, 1.0, 3.0)], wall_restitution=wall_cor, container_mass=5.0
    )
    trace = simulate(scene, collisions=1000)
    bounces = exact_events(scene, len(trace.events) + 80)[len(trace.events) :]
    last, rest = bounces[-1], wall_cor / (1.0 - wall_cor)
    expected = float(last.time + rest * (last.time - bounces[-2].time))
    assert trace.stop.accumulation_time == pytest.approx(expected, rel=1e-9)
    expected = float(sum(bounce.impulse for bounce in bounces) + rest * last.impulse)
    assert trace.stop.impulse_to_come == pytest.approx(expected, rel=1e-9)
    assert f"until {trace.stop.accumulation_time:.9g} s" in trace.stop.message
    assert f"gives it {trace.stop.impulse_to_come:.6g} kg m/s more" in trace.stop.message


@pytest.mark.parametrize("q", [1e-12, 0.3, 3.7, 1e10])
def test_the_sum_of_chords(q, monkeypatch):
    """By terms, and by the formula for an almost elastic wall, which has no number of terms."""
    for e in (1e-9, 0.5, 0.9):
        expected = trap_sums(q, 1.0, e, 0.5).duration
        assert sliding.chord_sum(q, e) == pytest.approx(expected, rel=1e-14)
    by_formula = sliding.chord_sum(q, 0.9995)
    monkeypatch.setattr(sliding, "NEARLY_ELASTIC", 0.0)
    assert by_formula == pytest.approx(sliding.chord_sum(q, 0.9995), rel=1e-13)


def test_an_almost_elastic_wall_is_no_endless_sum():
    assert math.isfinite(sliding.chord_sum(1e200, 1 - 2.0**-52))
    assert sliding.chord_sum(math.inf, 0.5) == math.inf


def test_a_wall_that_takes_the_rebound_traps_at_once():
    """In a circle the ball would slide for ever; in a box it slides to a corner and stays there."""
    ball = (0.0, -5.0, 4.5, 1.0, 1.0, 1.0)
    trace = simulate(scene_of([ball, AT_REST], wall_restitution=0.0), collisions=10)
    assert trace.stop.reason is StopReason.WALL_TRAP
    assert (trace.stop.accumulation_time, trace.stop.impulse_to_come) == (trace.stop.time, 0.0)
    assert "ball 0 stays at the wall, because the wall CoR is 0" in trace.stop.message
    assert len(trace.events) == 1
    (x, y), (u, v) = trace.finish.positions[0], trace.finish.velocities[0]
    assert x * u + y * v == pytest.approx(0.0, abs=1e-14)
    scene = scene_of([ball, AT_REST], wall_restitution=0.0, **CONTAINERS["box"])
    trace = simulate(scene, collisions=10)
    assert trace.stop.reason is StopReason.NOTHING_LEFT
    assert trace.events.time == pytest.approx([2.0, 12.0])
    assert trace.finish.positions[0] == pytest.approx([9.0, 7.0])
    assert np.all(trace.finish.velocities == 0)


def test_no_trap_on_a_diameter_nor_at_an_elastic_wall():
    """Without a tangential speed there is no end to how long the bounces take."""
    scene = scene_of([(0.0, 0.0, 4.5, 0.0, 1.0, 1.0)], wall_restitution=0.5)
    trace = simulate(scene, collisions=40)
    assert trace.stop.reason is StopReason.COLLISIONS
    expected = 2.0 + np.concatenate([[0.0], np.cumsum(18.0 / (4.5 * 0.5 ** np.arange(1, 40)))])
    assert np.allclose(trace.events.time, expected, rtol=40 * EPSILON, atol=0)
    elastic = simulate(replace(lone_bouncer(), wall_law=Constant(1.0)), collisions=1000)
    assert elastic.stop.reason is StopReason.COLLISIONS


def test_two_balls_that_are_trapped_together_end_the_run():
    """Opposite each other they bounce in step, ever more weakly, until 14.78 s. The run must not go
    on with impulses that are nothing but rounding while the clock creeps."""
    inwards = 6.0 / 0.9
    scene = lone_bouncer((0.5 * inwards - 9.0, 4.0, -inwards, -8.0, 1.0, 1.0))
    trace = simulate(scene, collisions=3000)
    assert trace.stop.reason.collapsed
    assert trace.stop.time < 0.5 + 14.284783441 + 1e-9


def test_a_light_container_carries_the_wall_to_another_ball():
    """The ball that bounces along the wall pushes the container into the one at rest, before it
    has bounced infinitely often: it is not trapped."""
    balls = [(7.0, -4.0, 2.0, 4.0, 1.0, 1.0), (-7.546, -6.331, 0.0, 0.0, 0.1, 1.0)]
    scene = scene_of(balls, container_mass=0.5, wall_restitution=0.8)
    truth = [(event.i, event.j) for event in exact_events(scene, 10)]
    assert truth[2:] == [*[(0, CONTAINER)] * 7, (1, CONTAINER)]
    trace = simulate(scene, collisions=10)
    assert partners(trace) == truth
    assert trace.stop.reason is StopReason.COLLISIONS


def test_nothing_comes_between_the_bounces_of_a_wall_trap():
    """The exact twin goes on from a trap: no other ball reaches the one that bounces."""
    for repeat in range(3):
        scene = report_scene(repeat, radius=0.1, cor=0.8)
        trace = simulate(scene, collisions=2000, search=NEIGHBOURS)
        assert trace.stop.reason is StopReason.WALL_TRAP
        ball = trace.events.i[-1]
        assert trace.stop.balls == (ball,)
        assert trace.events.j[-1] == CONTAINER
        events = [(event.i, event.j) for event in exact_events(trace.finish, 40)]
        assert {pair for pair in events if ball in pair} == {(ball, CONTAINER)}
        assert events.count((ball, CONTAINER)) > 20


# --- the clock stops -------------------------------------------------------------------


def test_few_balls_of_a_large_gas_collapse():
    """Of 1,000 dilute balls: before the limit for them few collide, in no time."""
    config = parse("""
    container: {shape: periodic, packing: 0.05}
    balls: {count: 1000, radius: 1.0, speed: 10.0}
    cor: 0.2
    collisions: 10000
    """).config
    for repeat in (0, 1):
        trace = simulate(starting_scene(config, repeat), collisions=10_000)
        assert trace.stop.reason is StopReason.COLLAPSE
        last = trace.events[-300:]
        assert len({*last.i.tolist(), *last.j.tolist()}) <= 7
        assert last.time[-1] - last.time[0] <= 300 * clock.CLOCK_DIGITS * last.time[-1]
        assert stands_still(trace.start, trace.events)
        assert not stands_still(trace.start, trace.events[:-1])


# Finite racks: many collisions in one instant, which are no collapse.


@pytest.mark.parametrize("cor", [1.0, 0.95])
def test_a_row_in_which_each_meets_each(cor):
    """n balls that touch, each faster than the next: n (n - 1)/2 collisions, each pair once.

    With losses they are endless below tan^2(pi/4 (1 - 1/n)), which is 0.978 for 140 (Bernu &
    Mazighi, J. Phys. A 23, 5745 (1990)).
    """
    number = 140
    balls = [(2.0 * k - number, 0.0, 0.7 - 0.01 * k, 0.0, 1.0, 1.0) for k in range(number)]
    scene = scene_of(balls, restitution=cor, container=PeriodicBox(8.0 * number, 12.0))
    trace = simulate(scene, collisions=100_000, time=1.0)
    if cor < math.tan(math.pi / 4 * (1 - 1 / number)) ** 2:
        assert trace.stop.reason is StopReason.COLLAPSE
    else:
        assert trace.stop.reason is StopReason.TIME
        assert len(trace.events) == number * (number - 1) // 2
        assert trace.events.time[-1] == 0.0
        assert not stands_still(scene, trace.events[:-1])


def test_a_ball_along_an_elastic_wall_touches_it_at_every_moment():
    balls = [(9.0, 0.0, 0.0, 10.0, 1.0, 1.0), AT_REST]
    scene = scene_of(balls, restitution=0.5)
    trace = simulate(scene, collisions=1000)
    assert trace.stop.reason is StopReason.COLLAPSE
    assert trace.stop.balls == (0,)
    assert "inelastic" not in trace.stop.message
    assert math.fsum(trace.events.impulse) == 0.0
    assert trace.finish.kinetic_energy == scene.kinetic_energy


# --- what is modelled -------------------------------------------------------------------------


def test_the_faster_search_is_chosen():
    for packing in (0.1, 0.001):
        few = simulation.few_at(gas("circle", 10, packing).packing_fraction, free=False)
        assert simulation.usual_search(gas("circle", few, packing)) is EVERYONE
        assert simulation.usual_search(gas("circle", few + 1, packing)) is NEIGHBOURS
    assert simulation.usual_search(gas("box", 2, 0.01)) is NEIGHBOURS
    models = simulation.specialisation(gas("box", 9, 0.1, mixed=True))
    assert {name for name, needed in models.items() if needed} >= {"cells", "unequal balls"}
    small = scene_of([(0.0, 0.0, 1.0, 0.0, 1.0, 1.0)], container=PeriodicBox(20.0, 9.9))
    with pytest.raises(SceneError, match="engine needs 5 cells each way"):
        simulate(small, collisions=1)


@pytest.mark.parametrize("ratio", [1e2, 1e4])
@pytest.mark.parametrize("cor", [1.0, 0.99])
def test_a_light_ball_between_heavy_ones(ratio, cor):
    """They touch. An angle theta has pi/theta collisions (Galperin 2003), or with losses, if
    sin(theta) < (1 - e)/(1 + e), infinitely many."""
    balls = [(-4.0, 0.0, 1.0, 0.0, 1.0, 1.0), (-2.0, 0.0, 0.0, 0.0, 1.0, 1 / ratio)]
    balls.append((0.0, 0.0, 0.0, 0.0, 1.0, 1.0))
    scene = scene_of(balls, restitution=cor, container=Box(20.0, 16.0))
    trace = simulate(scene, collisions=1_000_000, time=4.0)
    angle = math.acos(ratio / (1 + ratio))
    if math.sin(angle) < (1 - cor) / (1 + cor):
        assert trace.stop.reason is StopReason.COLLAPSE
    else:
        assert trace.stop.reason is StopReason.TIME
        most = int(math.pi / angle)
        assert len(trace.events) == most if cor == 1.0 else most <= len(trace.events) < 2 * most
        assert trace.events.time[-1] == trace.events.time[0]
