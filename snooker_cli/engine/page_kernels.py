"""The kernels of the live page: the program's engine, as ``webassembly`` makes it for a browser.

They simulate many events in a call, and keep of each what the page shows.
"""

from collections.abc import Sequence, Set
from typing import Any, NamedTuple

import numpy as np

from snooker_cli.containers import Circle
from snooker_cli.engine import boundaries, clock, event_loop, everyone, restitution, sampling
from snooker_cli.engine import kernel_state as ks
from snooker_cli.engine.bit_tricks import earlier
from snooker_cli.engine.contact import NEVER
from snooker_cli.engine.everyone import Everyone
from snooker_cli.engine.frames import MovingFrame
from snooker_cli.engine.jit import inlined, kernel
from snooker_cli.engine.kernel_state import Floats, Records, State, U, V, X, Y
from snooker_cli.engine.package_laws import package_laws
from snooker_cli.engine.sliding import SlidingCircle, bounces_to_come
from snooker_cli.engine.surfaces import Rough, SurfaceNumbers
from snooker_cli.fields import CARRIED, EVENT_COLUMNS, MOVING, record_type
from snooker_cli.laws import Law
from snooker_cli.scene import Scene
from snooker_cli.trace import SLIDE

EVENTS = 256
"""Rows of ``Followed``: the most events of a call."""

SEARCHES = 20_000
"""Turns of the event loop in a call without an event, some ms, after which it returns."""

# Elements of ``Page.answers``: why ``follow`` stopped, see ``clock``; the number of events; a time
# before which there is no other, s. Of ``trap``: how long all bounces last, s; their impulse.
REASON, EVENTS_DONE, REACHED, LASTS, GIVEN, ANSWERS = range(6)

# Columns of ``Followed.sums``: energy of the balls' motion, of their spins, and of a free
# container, J; the impulse on the wall, kg m/s, and the virial, kg m^2/s, since the start.
ENERGY, SPIN_ENERGY, CONTAINER_ENERGY, WALL_IMPULSE, PAIR_VIRIAL, FOLLOWED_SUMS = range(6)


class Followed(NamedTuple):
    """The events of a call, a row for each.

    events : as they are hashed, with times since the start of the repeat
    sums : (EVENTS, FOLLOWED_SUMS), after the event
    places : (EVENTS, 4), of ball i, and of ball j or the centre of the container, m
    velocities : (EVENTS, 4), of the same after the event, m/s
    """

    events: Records
    sums: Floats
    places: Floats
    velocities: Floats


class Page(NamedTuple):
    """All that the kernels of the page read and write.

    turned : (*N*,), rad: up to a time t after the last event, a ball with the spin w has turned by
        w t + turned
    flights : (*N* + 1, 4), place (m) and velocity (m/s) of each ball and of the container
    answers : (ANSWERS,)
    limit : the most events of a call of ``follow``, up to EVENTS
    until : s, up to when ``follow`` simulates, or at which ``show`` shows the balls
    """

    state: State
    search: Everyone
    followed: Followed
    turned: Floats
    flights: Floats
    answers: Floats
    limit: int
    until: float


CIRCLES: dict[str, Any] = {
    "fixed_circle": lambda _: boundaries.FixedCircle(1.0),
    "free_circle": lambda _: boundaries.FreeCircle(
        1.0, 1.0, 1.0, np.zeros(boundaries.LAST_HIT + 1)
    ),
    "sliding_circle": lambda number: SlidingCircle(
        boundaries.FixedCircle(1.0), np.zeros(number, dtype=np.int64)
    ),
}
"""An example of each boundary of a circle for a number of balls; all others have its types."""


def boundary_names() -> tuple[str, ...]:
    """The names of all boundaries; of a shape that is no circle, its word."""
    return (*CIRCLES, *boundaries.BOUNDARIES)


def boundaries_of(shapes: Set[str]) -> set[str]:
    """The boundaries that containers of some shapes can have: any circle may be free, or slide."""
    return {name for name in boundary_names() if name.split("_")[-1] in shapes}


def boundary_name(scene: Scene) -> str:
    """The boundary of a scene, as ``boundaryOf`` of engine.js."""
    if not isinstance(scene.container, Circle):
        return scene.container.name
    if scene.free:
        return "free_circle"
    return "sliding_circle" if scene.slides else "fixed_circle"


def _boundary(name: str, number: int) -> Any:
    return CIRCLES[name](number) if name in CIRCLES else boundaries.BOUNDARIES[name](1.0, 1.0)


def example(boundary: str, number: int, laws: Sequence[Law] = ()) -> Page:
    """A page with arrays and numbers of the types and shapes of all pages with this boundary.

    laws : of packages, that the page can have

    One module has all sizes of balls, all laws, and rough balls, so that there are few. Smooth
    balls have no friction, and between walls nothing is kept in the frame.
    """
    state = State(
        setup=ks.Setup(
            laws=np.zeros((restitution.LAWS, restitution.COLUMNS)),
            contact_path=0.0,
            elastic_below=0.0,
            traps=True,
            package_laws=package_laws(laws, restitution.LAWS),
            settling=1.0,
        ),
        balls=np.zeros((ks.BALL_ROWS, number)),
        history=np.zeros((ks.HISTORY_ROWS, number), dtype=np.int32),
        boundary=_boundary(boundary, number),
        sizes=ks.UnequalBalls(np.zeros(number), np.zeros(number)),
        surface=Rough(
            SurfaceNumbers(0.5, -1.0, 0.0, -1.0, 0.0),
            np.zeros(1),
            *(np.zeros(field.shape(number)) for field in MOVING[CARRIED:]),
        ),
        frame=MovingFrame(np.zeros(ks.BALL_ROWS), 0.0, 0.0),
        labels=np.zeros(0, dtype=np.int32),
        sums=np.zeros(ks.SUMS),
        counts=np.zeros(ks.COUNTS + 1, dtype=np.int64),
        account=np.zeros(ks.ACCOUNT),
        scratch=np.zeros((ks.BALL_ROWS, number)),
    )
    search = everyone.new_search(1, number).of_repeat(0)
    events = np.zeros(EVENTS, record_type([column.name for column in EVENT_COLUMNS]))
    sums, (places, velocities) = np.zeros((EVENTS, FOLLOWED_SUMS)), np.zeros((2, EVENTS, 4))
    followed = Followed(events, sums, places, velocities)
    flights, answers = np.zeros((number + 1, 4)), np.zeros(ANSWERS)
    return Page(state, search, followed, np.zeros(number), flights, answers, 0, 0.0)


# What they do


@inlined
def events_of(state: State) -> int:
    """How many events the repeat has had."""
    return int(state.counts[ks.WALL_EVENTS] + state.counts[ks.PAIR_EVENTS])


@inlined
def gained(account: Floats) -> float:
    """The energy that the balls have gained in collisions since the account began, J."""
    sums = account[ks.FROM_WALLS] - account[ks.LOST]
    return float(sums + (account[ks.FROM_WALLS_REST] - account[ks.LOST_REST]))


@inlined
def spin_energy(state: State) -> float:
    """The energy of all spins, J."""
    total = 0.0
    for k in range(state.balls.shape[1]):
        total += 0.5 * state.sizes.mass_of(k) * state.surface.twice_spin_energy(k, state)
    return total


@inlined
def note_turn(row: int, page: Page) -> float:
    """Note in ``turned`` that an event has changed spins; what they gained by it, J.

    A ball turns by the sum of its changes of spin, each times the time since then.
    """
    event, surface, gained = page.followed.events[row], page.state.surface, 0.0
    given = event["tangential"]
    if given == 0.0:
        return gained
    for ball in (event["i"], event["j"]):
        if ball >= 0:
            r, m = page.state.sizes.radius_of(ball), page.state.sizes.mass_of(ball)
            lost = given / (surface.law.inertia * m * r)
            page.turned[ball] += lost * event["time"]
            gained -= 0.5 * given * r * (2.0 * surface.spins[ball] + lost)
    return gained


@inlined
def shown(
    x: float, y: float, u: float, v: float, now: float, state: State
) -> tuple[float, float, float, float]:
    """Place (m) and velocity (m/s) at a time (s) in the laboratory, of the inner image."""
    x, y, u, v = state.frame.in_laboratory(state.boundary, x, y, u, v, now)
    x, y = state.boundary.nearest_image(x, y)
    return x, y, u, v


@inlined
def write_row(row: int, energy: float, spinning: float, followed: Followed, state: State) -> None:
    """Complete the row of the event that has just happened."""
    event, time, balls = followed.events[row], state.sums[ks.NOW], state.balls
    i, j = event["i"], event["j"]
    x, y, u, v = state.boundary.container_flight(time, state.frame)
    if j >= 0:
        x, y, u, v = shown(balls[X, j], balls[Y, j], balls[U, j], balls[V, j], time, state)
    xi, yi, ui, vi = shown(balls[X, i], balls[Y, i], balls[U, i], balls[V, i], time, state)
    sums, places, velocities = followed.sums, followed.places, followed.velocities
    sums[row, ENERGY], sums[row, SPIN_ENERGY] = energy, spinning
    sums[row, CONTAINER_ENERGY] = state.boundary.energy(state)
    sums[row, WALL_IMPULSE] = state.sums[ks.WALL_IMPULSE] + state.sums[ks.WALL_IMPULSE_REST]
    sums[row, PAIR_VIRIAL] = state.sums[ks.PAIR_VIRIAL] + state.sums[ks.PAIR_VIRIAL_REST]
    places[row, 0], places[row, 1] = xi, yi
    places[row, 2], places[row, 3] = x, y
    velocities[row, 0], velocities[row, 1] = ui, vi
    velocities[row, 2], velocities[row, 3] = u, v


@inlined
def begin_epoch(state: State, search: Everyone) -> None:
    """Set all clocks back, as ``Simulation.chunk`` does between two chunks."""
    following, shift = clock.following(state.sums[ks.EPOCH], state.sums[ks.NOW])
    ks.begin_epoch(state, following, shift)
    search.begun[0] = False


@kernel
def follow(page: Page) -> None:
    """Simulate at most ``limit`` events, none later than ``until``; the rest is in ``answers``.

    The reason is FULL if the repeat continues, also if a call made too many searches for an event.
    """
    state, search, followed = page.state, page.search, page.followed
    number, sums, answers = state.balls.shape[1], state.sums, page.answers
    energy, spinning, account, reason, done = 0.0, 0.0, state.account, clock.FULL, 0
    answers[REACHED] = page.until
    while done < page.limit and reason == clock.FULL:
        before = events_of(state)
        until = min(page.until - sums[ks.EPOCH], sums[ks.TIME_LIMIT])
        reason = event_loop.simulate_repeat(
            state, search, followed.events[done:], sampling.NoSamples(None), 1, until, SEARCHES
        )
        if events_of(state) == before:
            if reason == clock.TIME and until < sums[ks.TIME_LIMIT]:
                reason = clock.FULL
            elif reason == clock.FULL:
                following = NEVER
                for k in range(number):
                    following = earlier(following, search.times[ks.NEXT_TIME, k])
                answers[REACHED] = sums[ks.EPOCH] + following
            break
        # Over more collisions the energy may fall by orders of magnitude, and the account would not
        # be exact enough. It leaves out what a ball loses until it slides.
        followed.events[done]["time"] = sums[ks.EPOCH] + sums[ks.NOW]
        spinning += note_turn(done, page)
        if done % number == 0 or followed.events[done]["j"] == SLIDE:
            spinning, account[:] = spin_energy(state), 0.0
            energy = sampling.totals(state)[0] + spinning
        write_row(done, energy + gained(account) - spinning, spinning, followed, state)
        done += 1
        if events_of(state) % clock.length(number) == 0:
            begin_epoch(state, search)
    if done > 0 and done == page.limit:
        answers[REACHED] = followed.events[done - 1]["time"]
    answers[REASON], answers[EVENTS_DONE] = reason, done


@kernel
def show(page: Page) -> None:
    """Write into ``flights`` where all balls are at a time, and how fast; images are the inner."""
    state, flights = page.state, page.flights
    boundary, number = state.boundary, state.balls.shape[1]
    now = page.until - state.sums[ks.EPOCH]
    for i in range(number):
        x, y, u, v = boundary.flight(i, now, state)
        x, y, u, v = shown(x, y, u, v, now, state)
        flights[i, X], flights[i, Y], flights[i, U], flights[i, V] = x, y, u, v
    x, y, u, v = boundary.container_flight(now, state.frame)
    flights[number, X], flights[number, Y], flights[number, U], flights[number, V] = x, y, u, v


@kernel
def trap(page: Page) -> None:
    """Write into ``answers`` how long the bounces of the trapped ball last, and their impulse."""
    lasts, given = bounces_to_come(page.state.counts[ks.FIRST], page.state)
    page.answers[LASTS], page.answers[GIVEN] = lasts, given


KERNELS = (follow, show, trap)


def kernels_of(boundary: str) -> tuple[Any, ...]:
    """The kernels that a page with a boundary calls: balls are trapped in circles only."""
    return KERNELS if boundary.endswith("circle") else KERNELS[:-1]
