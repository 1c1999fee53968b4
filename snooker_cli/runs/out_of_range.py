"""Repeats with numbers that no result can have: they end before the first of these numbers.

``store.value_ranges`` says what a result can have. A repeat that leaves these ranges is simulated
again, up to the last collision after which it can be stored.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from snooker_cli import store
from snooker_cli.engine import simulate
from snooker_cli.engine.simulation import Watch
from snooker_cli.errors import UnsoundError
from snooker_cli.formatting import counted
from snooker_cli.scene import Scene
from snooker_cli.trace import StopReason, Trace


@dataclass(frozen=True)
class Limits:
    """What decides how a repeat is simulated and recorded; as the arguments of ``simulate``."""

    collisions: int | None
    time: float | None
    summary: bool
    snapshots: Sequence[float] = ()


def fault_of(scene: Scene, limits: Limits, watch: Watch = lambda *_: False) -> str:
    """Why a repeat cannot be stored; empty if it can.

    watch : as of ``simulate``; it may raise to end the search
    """
    check = store.EventCheck.from_start(scene)
    try:
        trace = simulate(
            scene,
            collisions=limits.collisions,
            time=limits.time,
            summary=limits.summary,
            snapshots=limits.snapshots,
            watch=watch,
            sink=check.take,
            states=lambda _, state: store.check_snapshot(scene, state),
        )
        store.check_repeats([trace])
        if not limits.summary:
            check.end(trace)
    except UnsoundError as error:
        return error.problem
    return ""


def sound_collisions(scene: Scene, limits: Limits, watch: Watch) -> int:
    """After how many collisions a repeat can be stored that cannot be stored as a whole.

    watch : as of ``fault_of``

    Raises ``UnsoundError`` if not even its start can be stored.
    """
    check = store.EventCheck.from_start(scene)
    with suppress(UnsoundError):
        simulate(
            scene, collisions=limits.collisions, time=limits.time, watch=watch, sink=check.take
        )
    # Nearly always these are all collisions before the first wrong one. Else they are halved.
    sound, wrong, tried = -1, check.number + 1, check.number
    while wrong - sound > 1:
        if fault := fault_of(scene, replace(limits, collisions=tried, time=None), watch):
            wrong = tried
        else:
            sound = tried
        tried = (sound + wrong) // 2
    if sound < 0:
        raise UnsoundError(fault)
    return sound


def refusal(error: UnsoundError) -> str:
    """The sentence on a repeat of which no part can be stored."""
    advice = "choose units in which lengths, masses, speeds and times are nearer to 1"
    return f"its result cannot be stored ({error.problem}); {advice}"


def ended_before(trace: Trace, fault: str) -> Trace:
    """The beginning of a repeat with the ending that it has because of what follows."""
    number = counted(trace.collisions, "collision")
    message = (
        f"out of range: after {number}, at {trace.stop.time:.9g} s, a number follows that no "
        f"result can have ({fault}); {number} {'is' if trace.collisions == 1 else 'are'} saved"
    )
    stop = trace.stop._replace(
        reason=StopReason.OUT_OF_RANGE,
        balls=(),
        message=message,
        accumulation_time=None,
        impulse_to_come=None,
    )
    return replace(trace, stop=stop)


def sound_part(trace: Trace, limits: Limits, watch: Watch) -> Trace:
    """A repeat in memory, or its beginning if it cannot be stored as a whole.

    Raises ``UnsoundError`` if not even its start can be stored.
    """
    fault = store.fault_of(trace)
    if not fault:
        return trace
    most = sound_collisions(trace.start, limits, watch)
    return ended_before(simulate(trace.start, collisions=most, summary=limits.summary), fault)
