"""The engine against exact courses kept in ``tests/reference``, as far as chaos lets it follow.

A reference says for each event what a displacement in every collision before it grows to. That
times the engine's roundings is the event's tolerance. Where it reaches ``ORDERED`` of the mean time
between events, rounding may begin to decide who collides first, and the comparison ends.
"""

import make_reference
import numpy as np
import pytest
from make_reference import Reference
from scenes import EPSILON

from snooker_cli.engine import replay, simulate
from snooker_cli.trace import StopReason
from snooker_cli.validation.exact_twin import trajectory

ROUNDINGS = 8
"""An event rounds the quadratic's coefficients and root, a clock, a place and a velocity: eight
times half of epsilon, and twice that for unlucky signs. The exact course has none."""

ORDERED = 1e-3
"""Of a thousand events next to each other, rounding may then change the order of one pair."""

COMPARABLE = {
    "report": 400,
    "report-cor-0.8": 400,
    "report-fixed": 440,
    "dilute": 110,
    "dilute-fixed-cor-0.8": 120,
    "mixture": 200,
    "light-container": 80,
    "row": 60,
    "galperin": 310,
    "whispering-gallery": 500,
    "star": 500,
    "wall-trap": 140,
}
"""The number of events to compare at least, if the engine has as many."""


@pytest.fixture(params=sorted(COMPARABLE))
def name(request):
    return request.param


def tolerance(growth, itself):
    """What an event's value may be out by; the roundings of all events before may be one-sided."""
    one_sided = np.sqrt(np.arange(1, len(itself) + 1))
    return ROUNDINGS * EPSILON * one_sided * (np.maximum.accumulate(growth) + abs(itself))


def comparable(reference: Reference) -> int:
    """How many events come in an order that rounding cannot change."""
    time = reference.events.time
    late = tolerance(reference.growth.time, time) > ORDERED * time[-1] / len(time)
    return int(np.argmax(late)) if late.any() else len(time)


def test_every_file_is_used():
    assert {path.stem for path in make_reference.FOLDER.iterdir()} == set(COMPARABLE)


def test_the_engine_follows(name):
    reference = make_reference.read(name)
    truth, grown = reference.events, reference.growth
    count = comparable(reference)
    assert count >= COMPARABLE[name]
    trace = simulate(reference.scene, collisions=len(truth))
    if trace.stop.reason is StopReason.WALL_TRAP:
        count = min(count, len(trace.events))
    here = slice(count)
    assert trace.events.i[here].tolist() == truth.i[here].tolist()
    assert trace.events.j[here].tolist() == truth.j[here].tolist()
    for values, exact, growth in (
        (trace.events.time, truth.time, grown.time),
        (trace.events.impulse, truth.impulse, grown.impulse),
    ):
        assert np.all(abs(values[here] - exact[here]) <= tolerance(growth, exact)[here])
    size = np.full(len(truth), reference.scene.container.radius)
    for after, bodies in zip(reference.after, reference.states, strict=True):
        if after <= count:
            (places,) = replay(trace, trace.events.time[[after - 1]]).positions
            apart = np.abs(places - bodies[:-1, :2]).sum(axis=1)
            assert np.all(apart <= tolerance(grown.place, size)[after - 1])


def test_the_files_say_what_the_twin_computes(name):
    """To the last bit, for their first events."""
    reference = make_reference.read(name)
    truth, _ = trajectory(reference.scene, 5)
    for column in ("time", "i", "j", "impulse"):
        kept = getattr(reference.events, column)[:5]
        assert np.array_equal(kept, getattr(truth, column))
