"""Decay constants: those put into synthetic runs come out, and real runs obey their symmetries."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from snooker_cli.analysis import decay
from snooker_cli.analysis.decay import LAWS, QUANTITIES, SKIPPED_COLLISIONS, WINDOWS, Decay
from snooker_cli.analysis.fitting import NOTHING_DECAYS
from snooker_cli.analysis.observables import energy_ratio, series, temperature
from snooker_cli.config import parse
from snooker_cli.containers import Circle
from snooker_cli.engine import simulate
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import EPSILON, Scene
from snooker_cli.trace import SPEED_BINS, Events, Series, Stop, StopReason, Summary, Trace

RADIUS, END = 8.0, 5.0
"""Of the synthetic runs, m and s; the edges of twenty windows are exact doubles."""

STEPS = 2000

SCENE = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 2, radius: 1.0, mass: 1.0, speed: 10.0}
cor: 0.95
collisions: 400
"""


def at_rest() -> Scene:
    """Two balls that do not move in a fixed container."""
    return Scene(
        positions=np.array([[-3.0, 0.0], [3.0, 0.0]]),
        velocities=np.zeros((2, 2)),
        radii=np.ones(2),
        masses=np.ones(2),
        container=Circle(RADIUS),
        container_mass=math.inf,
        container_position=np.zeros(2),
        container_velocity=np.zeros(2),
        restitution=0.9,
        wall_restitution=0.9,
    )


def synthetic(kinetic_energy: np.ndarray, wall_impulse: np.ndarray, collisions: int = 1) -> Trace:
    """A run whose energy and impulse are given on a grid of times, with collisions between them."""
    time = np.linspace(0.0, END, STEPS + 1)
    found = Series(
        time=time,
        kinetic_energy=kinetic_energy,
        container_energy=np.zeros(STEPS + 1),
        wall_impulse=wall_impulse,
        pair_virial=np.zeros(STEPS + 1),
        wall_events=np.arange(STEPS + 1.0) * collisions,
        pair_events=np.zeros(STEPS + 1),
        mean_speed=np.ones(STEPS + 1),
        energy_moment=np.ones(STEPS + 1),
    )
    summary = Summary(found, np.zeros((STEPS + 1, SPEED_BINS), dtype=np.int64))
    stop = Stop(StopReason.TIME, END, (), "5 s reached")
    return Trace(at_rest(), at_rest(), stop, STEPS * collisions, 0, None, summary)


TIME = np.linspace(0.0, END, STEPS + 1)

STAIRS = np.maximum(0.0, TIME - END / STEPS / 2)
"""When the last collision before each row was, if each is in the middle between two rows."""


def exponential(rate: float, time: np.ndarray = STAIRS) -> Trace:
    """Energy e^-kt; the force on the wall, and so the mean of it in any window, falls likewise."""
    return synthetic(3.0 * np.exp(-rate * time), (1 - np.exp(-rate * time)) / rate)


def haff(rate: float, time: np.ndarray = STAIRS) -> Trace:
    """Haff's law: energy 1/(1 + at)^2, the impulse so far t/(1 + at)."""
    return synthetic(3.0 / (1 + rate * time) ** 2, time / (1 + rate * time))


def by_name(found: list[Decay]) -> dict[tuple[str, str], Decay]:
    return {(each.quantity, each.law): each for each in found}


def repeats(number: int, *overrides: str) -> list[Trace]:
    """Real runs of nineteen balls."""
    experiment = parse(SCENE, overrides=overrides).experiment
    return [
        simulate(starting_scene(experiment, repeat), collisions=experiment.collisions)
        for repeat in range(number)
    ]


@pytest.fixture(scope="module")
def cooling() -> list[Trace]:
    return repeats(4)


# Synthetic runs


def test_curves_of_a_synthetic_run() -> None:
    trace, middles = exponential(0.4), STAIRS[1:]
    # Speeds fall by a part of 2.5e-4 between rows, which moves a collision by its square at most.
    near = {"rtol": 0, "atol": END / STEPS * 2.5e-4}
    for quantity in ("kinetic_energy", "temperature"):
        found = decay.curve(trace, quantity)
        np.testing.assert_allclose(found.time, [0.0, *middles], **near)
        np.testing.assert_allclose(found.value, np.exp(-0.4 * STAIRS), rtol=4 * EPSILON)
    pressure = decay.curve(trace, "pressure")
    np.testing.assert_allclose(pressure.time, middles[SKIPPED_COLLISIONS - 1 :], **near)
    assert pressure.value[0] == 1
    smooth = exponential(0.4, TIME)
    for quantity in ("local_pressure", "local_energy"):
        local = decay.curve(smooth, quantity)
        assert local.time.tolist() == ((np.arange(WINDOWS) + 0.5) * END / WINDOWS).tolist()
        assert local.value.max() == local.value[0]
        np.testing.assert_allclose(
            local.value / local.value[0], np.exp(-0.4 * (local.time - local.time[0])), rtol=1e-12
        )


@pytest.mark.parametrize("rate", [0.05, 0.4, 3.0])
def test_the_constants_put_in_come_out(rate: float) -> None:
    """To what the search for the least squares settles at, 1e-12, times what it loses by squares.

    A minimum is known to the root of its accuracy at worst: 1e-6. A collision between two rows, in
    which speeds fall by dt rate/2, is read a sixteenth of dt^2 rate off the middle: in units of the
    decay's time (dt rate)^2 at most, and for a mean over time, a share of its first time.
    """
    slowing = rate * END / STEPS
    read = 1e-6 + slowing**2 + slowing / (16 * SKIPPED_COLLISIONS)
    for trace, quantities, rel in (
        (exponential(rate), ("kinetic_energy", "temperature"), read),
        (exponential(rate, TIME), ("local_pressure", "local_energy"), 1e-6),
    ):
        cooled = by_name(decay.decays([trace], quantities))
        for quantity in quantities:
            found = cooled[quantity, "exponential"]
            assert found.over_repeats.mean == pytest.approx(rate, rel=rel)
            assert found.r_squared == pytest.approx(1, abs=1e-9)
            assert found.rms_residual < 1e-5
    slowed = by_name(decay.decays([haff(rate)]))
    for quantity in ("kinetic_energy", "temperature", "pressure"):
        found = slowed[quantity, "haff"]
        assert found.over_repeats.mean == pytest.approx(rate, rel=read)
        assert found.r_squared == pytest.approx(1, abs=1e-9)


def test_the_wrong_law_fits_worse() -> None:
    for trace, right, wrong in (
        (exponential(0.6), "exponential", "haff"),
        (haff(0.6), "haff", "exponential"),
    ):
        found = by_name(decay.decays([trace], ["kinetic_energy"]))
        assert (
            found["kinetic_energy", wrong].rms_residual
            > 100 * found["kinetic_energy", right].rms_residual
        )


def test_repeats_are_fitted_one_by_one_and_averaged() -> None:
    rates = (0.3, 0.4, 0.8)
    found = decay.decays(map(exponential, rates), ["kinetic_energy"])[0]
    assert [each.value for each in found.fits] == pytest.approx(rates, rel=1e-5)
    over = found.over_repeats
    assert (over.count, over.failed, found.short) == (3, 0, 0)
    assert over.mean == pytest.approx(np.mean(rates), rel=1e-5)
    assert over.standard_error == pytest.approx(np.std(rates, ddof=1) / math.sqrt(3), rel=1e-5)
    assert over.max_min_half_range == pytest.approx(0.25, rel=1e-5)


def test_every_quantity_is_fitted_with_every_law() -> None:
    found = decay.decays([exponential(0.4), exponential(0.5)])
    assert [(each.quantity, each.law) for each in found] == [
        (quantity, law) for quantity in QUANTITIES for law in LAWS
    ]
    assert all(len(each.fits) == 2 for each in found)
    (one, other) = decay.decays([exponential(0.4)], ["pressure"])
    assert (one.quantity, other.quantity) == ("pressure", "pressure")


def test_repeats_that_ended_early_are_counted() -> None:
    trace = exponential(0.4)
    ended = [
        replace(trace, stop=replace(trace.stop, reason=reason))
        for reason in (
            StopReason.COLLISIONS,
            StopReason.NOTHING_LEFT,
            StopReason.WALL_TRAP,
            StopReason.COLLAPSE,
            StopReason.INTERRUPTED,
        )
    ]
    for found in decay.decays(ended, ["temperature"]):
        assert found.short == 3
        assert found.over_repeats.count == 5
        assert found.ended == dict.fromkeys((trace.stop.reason for trace in ended), 1)
    assert decay.notes(decay.decays(ended, ["temperature"])) == [
        "3 of 5 repeats ended early, 1 in a wall trap, 1 in a collapse and 1 at an interruption; "
        "their data are used"
    ]


def test_a_wall_that_is_first_hit_late_still_has_a_pressure() -> None:
    """In large containers the first fifty collisions can all be between balls."""
    impulse = np.where(TIME < 0.5, 0.0, TIME / (1 + 0.7 * TIME))
    trace = synthetic(np.ones(STEPS + 1), impulse)
    with np.errstate(all="raise"):
        found = by_name(decay.decays([trace], ["pressure"]))
    for law in LAWS:
        assert found["pressure", law].over_repeats.count == 1
        assert math.isfinite(found["pressure", law].over_repeats.mean)


# Records


KEYS = {
    "parameters",
    "quantity",
    "model",
    "value",
    "error",
    "repeats",
    "failed",
    "short",
    "reason",
    "unit",
    "standard_deviation",
    "bootstrap_error",
    "bootstrap_interval",
    "max_min_half_range",
    "r_squared",
    "rms_residual",
}


def test_a_record_says_what_was_found(cooling: list[Trace]) -> None:
    for found in decay.decays(cooling):
        record = json.loads(json.dumps(decay.record(found, {"cor": 0.95}), allow_nan=False))
        assert set(record) == KEYS
        over = found.over_repeats
        assert (record["quantity"], record["model"]) == (found.quantity, found.law)
        assert (record["parameters"], record["unit"]) == ({"cor": 0.95}, "s-1")
        assert (record["value"], record["error"]) == (over.mean, over.standard_error)
        assert (record["repeats"], record["failed"], record["short"]) == (4, 0, 0)
        assert record["reason"] is None
        low, high = record["bootstrap_interval"]
        assert low <= record["value"] <= high
        assert record["rms_residual"] == found.rms_residual


NOTHING = Events(np.empty(0), np.empty(0, np.int32), np.empty(0, np.int32), np.empty(0))


def no_events(trace: Trace, end: float) -> Trace:
    stop = Stop(StopReason.NOTHING_LEFT, end, (), "no collision lies ahead")
    return replace(trace, stop=stop, events=NOTHING, summary=None, wall_events=0, pair_events=0)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "traces",
    [
        [],
        [no_events(exponential(0.4), 0.0)],
        [no_events(exponential(0.4), 5.0)] * 2,
        [synthetic(np.zeros(STEPS + 1), np.zeros(STEPS + 1))],
        [synthetic(np.ones(STEPS + 1), np.zeros(STEPS + 1))] * 2,
        [exponential(0.4)],
    ],
    ids=["no repeat", "nothing happens", "at rest", "no energy", "no decay", "one repeat"],
)
def test_a_record_has_no_nan_whatever_was_fitted(traces: list[Trace]) -> None:
    found = decay.decays(traces)
    assert len(found) == len(QUANTITIES) * len(LAWS)
    for each in found:
        record = decay.record(each, {})
        assert json.loads(json.dumps(record, allow_nan=False)) == record
        assert set(record) == KEYS
        assert record["repeats"] + record["failed"] == len(traces)
        assert (record["value"] is None) == (record["repeats"] == 0)
        assert (record["reason"] is None) == (record["failed"] == 0)
        assert (record["error"] is None) == (record["repeats"] < 2)


# Real runs


def test_twice_the_speed_doubles_every_constant(cooling: list[Trace]) -> None:
    """Time has no scale but that of the speed, and doubling is exact in binary."""
    fast = repeats(4, "balls.speed=20")
    for slow_trace, fast_trace in zip(cooling, fast, strict=True):
        assert fast_trace.stop.time == slow_trace.stop.time / 2
    for slow, quick in zip(decay.decays(cooling), decay.decays(fast), strict=True):
        for one, other in zip(slow.fits, quick.fits, strict=True):
            assert one.converged
            assert other.value == pytest.approx(2 * one.value, rel=1e-9), slow.quantity
            assert other.error == pytest.approx(2 * one.error, rel=1e-6)


def test_nothing_decays_without_losses() -> None:
    """Each collision rounds the energies of two balls: by a few epsilon of the whole at most."""
    lossless = repeats(6, "cor=1")
    drift = decay.COLLISION_ROUNDING * 400
    found = by_name(decay.decays(lossless))
    for trace in lossless:
        assert np.max(np.abs(energy_ratio(series(trace)) - 1)) <= drift
    for law in LAWS:
        for quantity in ("kinetic_energy", "local_energy"):
            failed = found[quantity, law]
            assert (failed.over_repeats.count, failed.over_repeats.failed) == (0, 6)
            assert failed.reason == NOTHING_DECAYS
            record = decay.record(failed, {})
            assert (record["value"], record["reason"]) == (None, NOTHING_DECAYS)
        # Student's t with five degrees of freedom is above 5 in size once in 240 cases.
        local = found["local_pressure", law].over_repeats
        assert abs(local.mean) <= 5 * local.standard_error
        assert local.standard_error < found_rate(law) / 3
    assert decay.notes(list(found.values())) == [
        f"no fit of kinetic energy and local energy in 6 of 6 repeats: {NOTHING_DECAYS}"
    ]


def test_a_small_loss_is_no_rounding() -> None:
    """At a CoR of 1 - 1e-9 each collision takes some 1e-10 of the energy: far above rounding."""
    found = [
        decay.decays(repeats(2, f"cor={1 - loss}"), ["kinetic_energy"]) for loss in (1e-9, 1e-6)
    ]
    for weak, strong in zip(*found, strict=True):
        one, other = weak.over_repeats, strong.over_repeats
        assert one.count == 2
        # The losses, 1 - e^2, have the same ratio until trajectories part; rounding is 1e-5 of it.
        assert 1000 * one.mean == pytest.approx(other.mean, rel=0.2)


def test_one_ball_that_bounces_evenly_has_equal_windows() -> None:
    """An elastic ball on a diameter: each of twenty windows holds ten of its two hundred hits."""
    (lone,) = repeats(1, "balls.rings=0", "cor=1", "container.mass=.inf", "collisions=200")
    hits = np.diff(lone.events.time)
    end = lone.events.time[-1] + hits[0] / 2
    even = replace(lone, stop=replace(lone.stop, time=end))
    found = decay.decays([even], ["local_pressure"])
    assert [each.reason for each in found] == [NOTHING_DECAYS] * len(LAWS)


def found_rate(law: str) -> float:
    """The rate at which a CoR of 0.8 cools the same balls, for comparison."""
    found = by_name(decay.decays(repeats(2, "cor=0.8"), ["kinetic_energy"]))
    return found["kinetic_energy", law].over_repeats.mean


def test_a_heavy_container_takes_no_part_in_the_energy(cooling: list[Trace]) -> None:
    """Energy ratio and temperature differ by the container's share alone, and so do their fits.

    To first order the constants differ by the projection of that difference on the fit's slope,
    at most the ratio of their norms (Cauchy-Schwarz); twice that leaves room for the rest.
    """
    found = by_name(decay.decays(cooling))
    for k, trace in enumerate(cooling):
        seen = series(trace)
        start = seen.kinetic_energy[0]
        share = seen.container_energy / start
        assert 0 < share.max() < 1e-4
        ratio = temperature(seen, 19) / temperature(seen, 19)[0]
        np.testing.assert_allclose(energy_ratio(seen) - ratio, share, rtol=0, atol=4 * EPSILON)
        for law in LAWS:
            energy = found["kinetic_energy", law].fits[k]
            heat = found["temperature", law].fits[k]
            assert energy.value > 0
            slope = seen.time * np.exp(-2 * energy.value * seen.time)
            allowed = 2 * np.linalg.norm(share) / np.linalg.norm(slope)
            assert abs(energy.value - heat.value) <= allowed < 1e-4 * energy.value


def test_more_loss_decays_faster() -> None:
    rates = [
        by_name(decay.decays(repeats(3, f"cor={cor}"), ["kinetic_energy"]))[
            "kinetic_energy", "exponential"
        ].over_repeats.mean
        for cor in (0.99, 0.95, 0.85)
    ]
    assert 0 < rates[0] < rates[1] < rates[2]


# What is recorded, and the source report's constant

REPORT_SCENE = """\
container: {radius: 10.0, mass: 1.0e7}
balls: {rings: 3, radius: 1.0, mass: 1.0, speed: 10.0, ring_extent: 0.8}
cor: 0.95
collisions: 500
"""


@pytest.fixture(scope="module", params=["0.8", "0.95"])
def both_records(request: pytest.FixtureRequest) -> tuple[list[Trace], list[Trace]]:
    """Twenty repeats of the report's scene, every collision of them and a summary."""
    experiment = parse(REPORT_SCENE, overrides=[f"cor={request.param}"]).experiment
    scenes = [starting_scene(experiment, repeat) for repeat in range(20)]
    return (
        [simulate(scene, collisions=500) for scene in scenes],
        [simulate(scene, collisions=500, summary=True) for scene in scenes],
    )


def test_summaries_and_events_give_the_same_constants(
    both_records: tuple[list[Trace], list[Trace]],
) -> None:
    """The difference of the two means over 20 repeats is a tenth of their standard error at most.

    In windows of time it is half of it: an edge of a window is anywhere between two of the some 400
    rows, and the hits between those, one in two windows or so, may be in either.
    """
    full, grid = (by_name(decay.decays(traces)) for traces in both_records)
    for (quantity, law), one in full.items():
        other = grid[quantity, law]
        assert one.over_repeats.count == other.over_repeats.count == 20
        allowed = 0.5 if quantity == "local_pressure" else 0.1
        difference = other.over_repeats.mean - one.over_repeats.mean
        assert abs(difference) <= allowed * one.over_repeats.standard_error, (quantity, law)
        if quantity in ("kinetic_energy", "temperature", "pressure"):
            assert all(each.points <= 501 for each in (*one.fits, *other.fits))
            assert [each.points for each in one.fits] == [each.points for each in other.fits]


# The report's constant


def test_the_reported_constant_is_the_reports_formula(
    both_records: tuple[list[Trace], list[Trace]],
) -> None:
    for trace, summary in zip(*both_records, strict=True):
        speed = series(trace).mean_speed[1:].mean()
        density = 37 / (math.pi * 10.0**2)
        path = 1 / (math.sqrt(2) * density * 2 * math.pi * 1.0)
        expected = -2 * math.log(trace.start.restitution) * speed / path
        assert decay.reported_constant(trace) == pytest.approx(expected, rel=1e-12)
        # The 400 rows of a grid have as many collisions between them: a fifth of a percent of 500.
        assert decay.reported_constant(summary) == pytest.approx(expected, rel=0.002)


def test_where_the_report_has_no_constant() -> None:
    trace = simulate(starting_scene(parse(REPORT_SCENE).experiment, 0), collisions=100)
    scene = trace.start
    unequal = np.linspace(0.9, 1.0, scene.number)
    for start in (
        replace(scene, restitution=0.0),
        replace(scene, radii=unequal),
        replace(scene, masses=unequal),
    ):
        assert math.isnan(decay.reported_constant(replace(trace, start=start)))
    idle = replace(trace, stop=replace(trace.stop, time=0.01), events=NOTHING)
    assert math.isnan(decay.reported_constant(idle))
    elastic = replace(trace, start=replace(scene, restitution=1.0))
    assert decay.reported_constant(elastic) == 0
    assert math.copysign(1, decay.reported_constant(elastic)) == 1
