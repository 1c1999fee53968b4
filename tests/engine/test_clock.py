"""Clocks and sums that last: as fine after any number of epochs as in the first."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import EPSILON, gas

from snooker_cli.engine import clock, series, simulate
from snooker_cli.engine.kernel_state import X, Y
from snooker_cli.engine.replay import Replay

positive = st.floats(1e-300, 1e300)


@given(epoch=positive, clocks=st.lists(positive, min_size=1, max_size=20))
@settings(derandomize=True, deadline=None)
def test_time_and_residual_hold_the_clock(epoch, clocks):
    clocks = np.array(sorted(clocks))
    time, residual = clock.times(epoch, clocks)
    assert np.array_equal((time - epoch) + residual, clocks)
    exact = [Fraction(epoch) + Fraction(clock) for clock in clocks.tolist()]
    assert time.tolist() == [float(instant) for instant in exact]


@given(epoch=st.just(0.0) | positive, now=st.just(0.0) | positive)
@settings(derandomize=True, deadline=None)
def test_an_epoch_begins_no_later_than_its_last_event(epoch, now):
    new, shift = clock.following(epoch, now)
    assert 0.0 <= shift <= now
    assert Fraction(now) - Fraction(shift) <= Fraction(math.ulp(new))
    if now <= epoch:
        assert Fraction(new) == Fraction(epoch) + Fraction(shift)


@pytest.fixture(scope="module")
def long_trace():
    """Thirty-seven balls for some sixteen epochs."""
    return simulate(gas("circle", 37, 0.37), collisions=16 * clock.LEAST_EVENTS + 100)


def test_contacts_are_as_exact_late_as_early(long_trace):
    """Two balls touch, to the roundings of their places and of the epoch's clock.

    A place of at most R has three roundings, a flight of v t two; without epochs the clock would be
    ten times as long at the end, and the last contacts ten times as far out as the bound.
    """
    trace, size = long_trace, clock.length(37)
    again, worst = Replay(trace), []
    fastest = float(np.max(np.hypot(*trace.start.velocities.T))) * math.sqrt(37)
    for first in (size - 300, 15 * size - 300):
        gaps = []
        for event in range(first, first + 300):
            again.advance(event + 1)
            i, j = int(trace.events.i[event]), int(trace.events.j[event])
            if j >= 0:
                x, y = again.state.balls[[X, Y], i] - again.state.balls[[X, Y], j]
                gaps.append(abs(math.hypot(x, y) - 2 * trace.start.radii[0]))
        worst.append(max(gaps))
    latest = float(np.diff(trace.events.time[size - 1 :: size]).max())
    assert max(worst) <= EPSILON * (3 * trace.start.container.radius + 2 * fastest * latest)
    assert worst[1] <= 4 * worst[0]


def test_times_never_decrease(long_trace):
    assert np.all(np.diff(long_trace.events.time) >= 0)
    assert len(long_trace.events.residual) == len(long_trace.events)
    assert not long_trace.events.residual[: clock.length(37)].any()
    assert np.all(abs(long_trace.events.residual) <= np.spacing(long_trace.events.time))


def test_sums_are_exact_to_a_rounding(long_trace):
    """Of a quarter of a million terms: to a unit in the last place, as their exact sum is."""
    events = long_trace.events
    summary = simulate(gas("circle", 37, 0.37), collisions=len(events), summary=True).summary
    for last in (series(long_trace, 2), summary.series):
        pairs = events.impulse[~events.at_wall] * (2 * long_trace.start.radii[0])
        for sums, terms in (
            (last.wall_impulse, events.impulse[events.at_wall]),
            (last.pair_virial, pairs),
        ):
            assert abs(sums[-1] - math.fsum(terms)) <= math.ulp(sums[-1])
    added_up = np.cumsum(events.impulse[events.at_wall])[-1]
    assert abs(added_up - math.fsum(events.impulse[events.at_wall])) > 4 * math.ulp(added_up)


def test_a_repeat_ends_at_its_time_after_any_number_of_epochs():
    scene, many = gas("circle", 37, 0.37), 3 * clock.LEAST_EVENTS
    end = float(simulate(scene, collisions=many).events.time[-2:].mean())
    trace = simulate(scene, time=end, collisions=2 * many)
    assert trace.stop.time == end
    assert len(trace.events) == many - 1
