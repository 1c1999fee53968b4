"""Decay constants: those put into synthetic runs come out, and real runs obey their symmetries."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import report_scene, scene_of
from scipy import stats

from snooker_cli.analysis import decay
from snooker_cli.analysis.decay import QUANTITIES, Decay
from snooker_cli.analysis.fitting import FitResult
from snooker_cli.analysis.goodness import LEAST_PROBABILITY, Samples, goodness, hotelling, ranges
from snooker_cli.analysis.measurement import measure
from snooker_cli.analysis.observables import mean_and_error
from snooker_cli.analysis.time_series import SKIPPED_COLLISIONS, series
from snooker_cli.engine import simulate
from snooker_cli.trace import SPEED_BINS, Events, Series, Stop, StopReason, Summary, Trace

END = 5.0
"""Of the synthetic runs, s; the edges of twenty windows are exact doubles."""

STEPS = 2000

AT_REST = scene_of([(-3, 0, 0, 0, 1, 1), (3, 0, 0, 0, 1, 1)], restitution=0.9)


def synthetic(kinetic_energy: np.ndarray, wall_impulse: np.ndarray) -> Trace:
    """A run whose energy and impulse are given on a grid of times, with collisions between them."""
    time = np.linspace(0.0, END, STEPS + 1)
    zero, one, events = np.zeros(STEPS + 1), np.ones(STEPS + 1), np.arange(STEPS + 1.0)
    found = Series(time, kinetic_energy, zero, wall_impulse, zero, events, zero, one, one)
    summary = Summary(found, np.zeros((STEPS + 1, SPEED_BINS), dtype=np.int64))
    stop = Stop(StopReason.TIME, END, (), "5 s reached")
    return Trace(AT_REST, AT_REST, stop, STEPS, 0, None, summary)


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
    return {(constant.quantity, constant.law): constant for constant in found}


def repeats(number: int, **changes: float) -> list[Trace]:
    """Real runs of nineteen balls in a heavy container."""
    settings = {"rings": 2, "cor": 0.95, "container_mass": 1e7} | changes
    return [simulate(report_scene(repeat, **settings), collisions=400) for repeat in range(number)]


# Synthetic runs


@pytest.mark.parametrize("rate", [0.05, 3.0])
def test_the_constants_put_in_come_out(rate: float) -> None:
    """Rounding of times and energies moves a constant by 1e-6.

    A group of points, here 16 at most, in which the logarithm falls by d, has a mean d²/24 above
    the law at its mean time. A pressure after fifty of these collisions has a share of the step.
    """
    slowing = rate * END / STEPS
    read = 1e-6 + (16 * slowing) ** 2 / 24 / min(1.0, rate * END)
    read += slowing / (16 * SKIPPED_COLLISIONS)
    for trace, quantities, rel in (
        (exponential(rate), ("kinetic_energy", "temperature"), read),
        (exponential(rate, TIME), ("local_pressure", "local_energy"), 1e-6),
    ):
        cooled = by_name(decay.decays([trace], quantities))
        for quantity in quantities:
            found = cooled[quantity, "exponential"]
            assert found.over_repeats.value == pytest.approx(rate, rel=rel)
    slowed = by_name(decay.decays([haff(rate)]))
    for quantity in ("kinetic_energy", "temperature", "pressure"):
        found = slowed[quantity, "haff"]
        assert found.over_repeats.value == pytest.approx(rate, rel=read)
    # A window that covers 1.5/α has a mean far from the value at its middle.
    slowed = by_name(decay.decays([haff(rate, TIME)], ("kinetic_energy", "local_energy")))
    assert slowed["local_energy", "haff"].over_repeats.value == pytest.approx(rate, rel=read)


def test_repeats_that_ended_early_are_counted() -> None:
    trace = exponential(0.4)
    reasons = [reason for reason in StopReason if reason is not StopReason.TIME]
    ended = [replace(trace, stop=trace.stop._replace(reason=reason)) for reason in reasons]
    found = decay.decays(ended)
    notes = decay.fit_notes(found)
    assert [(constant.quantity, constant.law) for constant in found] == [
        (name, law) for name, quantity in QUANTITIES.items() for law in quantity.laws
    ]
    assert {(constant.short, constant.over_repeats.repeats) for constant in found} == {(7, 9)}
    assert found[0].ended == dict.fromkeys(reasons, 1)
    assert {constant.as_json()["complete"] for constant in found} == {2}
    assert [one.note for one in notes] == [
        "7 of 9 repeats ended early, 1 in a wall trap, 1 in a collapse, 1 without a collision for "
        "very long, 1 with balls too slow for double precision, 1 too far away for double "
        "precision, 1 at an interruption and 1 before a number that no result can have; "
        "averages over collisions leave them out, the rest uses them to their end"
    ]


# The judgement of a law, on ln y


def noisy(alpha: float, number: int, seed: int, slow_from: float = END) -> list[Trace]:
    """Repeats with Haff's law of a time t + noise: a random walk, at the end 4 % of the time."""
    random = np.random.default_rng(seed)
    steps = random.normal(0.0, 0.04 * END / math.sqrt(STEPS), (number, STEPS))
    walks = TIME + np.concatenate([np.zeros((number, 1)), np.cumsum(steps, axis=1)], axis=1)
    walks = np.minimum(walks, slow_from) + 0.1 * np.maximum(walks - slow_from, 0.0)
    return [haff(alpha, np.maximum.accumulate(np.maximum(walk, 0.0))) for walk in walks]


def test_averages_over_collisions_use_complete_repeats_only() -> None:
    trace = repeats(1)[0]
    trapped = replace(trace, stop=trace.stop._replace(reason=StopReason.WALL_TRAP))
    found = decay.reported_constants(measure([trace, trapped]))
    assert np.isnan(found).tolist() == [False, True]
    assert mean_and_error(np.array([2.0, math.nan, 4.0])) == (3.0, 1.0)
    assert all(map(math.isnan, mean_and_error(np.array([math.nan]))))


def test_a_law_is_judged_where_it_holds() -> None:
    """The energy falls 35-fold."""
    traces = noisy(1.0, 20, 1)
    found = by_name(decay.decays(traces, ["kinetic_energy", "local_energy"]))
    right, wrong = (found["kinetic_energy", law] for law in ("haff", "exponential"))
    assert right.goodness.holds_to == right.goodness.judged_to == pytest.approx(END, rel=0.01)
    assert right.goodness.end_over_fit == pytest.approx(
        1, abs=4 * right.goodness.end_over_fit_error
    )
    assert wrong.goodness.probability < 1e-6
    assert wrong.goodness.chi_squared_per_degree > 10
    assert 0 <= wrong.goodness.holds_to < 0.2 * END
    energies = [series(trace).kinetic_energy for trace in traces]
    ends = [math.log(energy[-1] / energy[0]) for energy in energies]
    gaps = [end + fit.value * END for end, fit in zip(ends, wrong.fits, strict=True)]
    assert wrong.goodness.end_over_fit == pytest.approx(math.exp(np.mean(gaps)), rel=0.01)
    assert wrong.goodness.end_over_fit > 3
    row = found["local_energy", "haff"].as_json()
    assert (row["holds_to"], row["probability"]) == (None, None)


def test_a_law_that_stops_holding_is_accepted_up_to_there() -> None:
    """From 3 s on the energy falls with a tenth of the speed; up to there it follows Haff's law."""
    stopped = noisy(0.5, 20, 2, slow_from=3.0)
    whole, short = (
        by_name(decay.decays(stopped, ["kinetic_energy"], until=until))["kinetic_energy", "haff"]
        for until in (math.inf, 2.9)
    )
    assert 2.0 < whole.goodness.holds_to < 3.5
    assert whole.goodness.judged_to > 4.9
    assert short.goodness.holds_to == short.goodness.judged_to == pytest.approx(2.9, rel=0.01)
    assert short.over_repeats.value == pytest.approx(0.5, rel=0.1)


def test_probabilities_are_fair() -> None:
    """Of 300 sets of ten repeats, as many as expected are below 0.05 and 0.5, to 4 sigma."""
    random = np.random.default_rng(3)
    time, found = np.tile(np.linspace(0.0, 1.0, 201), (10, 1)), []
    for _ in range(300):
        walks = np.cumsum(random.normal(0, 0.02, (10, 200)), axis=1)
        walks += random.normal(0, 0.1, (10, 1)) * time[:, 1:]  # each has its own constant
        logarithms = np.insert(walks, 0, 0.0, axis=1) - 0.7 * time
        samples = Samples(time, logarithms, np.ones_like(time))
        result = FitResult("exponential", True, "", 201, 0.0, 0.7, 0.0, 1.0)
        found.append(goodness(ranges(samples), [result] * 10).probability)
    for share in (0.05, 0.5):
        expected = 300 * share
        below = np.count_nonzero(np.array(found) < share)
        assert abs(below - expected) < 4 * math.sqrt(expected * (1 - share))


def test_only_complete_repeats_judge_a_law() -> None:
    traces = noisy(0.7, 6, 4)
    trapped = Stop(StopReason.WALL_TRAP, 0.1, (), "trapped")
    for early, judged, until in ((3, 3, END), (4, 6, 0.1)):
        cut = [
            replace(trace, stop=trapped, summary=Summary(part, np.zeros((41, SPEED_BINS), int)))
            for trace in traces[:early]
            for part in [series(trace)[:41]]
        ]
        found = decay.decays([*cut, *traces[early:]], ["kinetic_energy"])[1].goodness
        assert found.judged_repeats == judged
        assert found.judged_to == pytest.approx(until, rel=0.02)
        assert math.isnan(found.holds_to) or found.probability > LEAST_PROBABILITY


def test_a_later_start_frees_the_amplitude() -> None:
    """Then only the shape of the law counts: here the energy is halved at once."""
    energy = 3.0 / (1 + 0.6 * STAIRS) ** 2
    energy[1:] /= 2
    trace = synthetic(energy, np.zeros(STEPS + 1))
    for law, since, amplitude in (("haff", 0.0, 1.0), ("haff", 1.0, 0.5)):
        found = by_name(decay.decays([trace], ["kinetic_energy"], since))["kinetic_energy", law]
        assert found.fits[0].amplitude == pytest.approx(amplitude, rel=1e-3)
        assert (found.fits[0].value == pytest.approx(0.6, rel=1e-3)) == (since > 0)


# Rows of a table of fits


NOTHING = Events(np.empty(0), np.empty(0, np.int32), np.empty(0, np.int32), np.empty(0))


def no_events(end: float) -> Trace:
    stop = Stop(StopReason.NOTHING_LEFT, end, (), "no collision lies ahead")
    return Trace(AT_REST, AT_REST, stop, 0, 0, NOTHING, None)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "traces",
    [
        [no_events(0.0)],
        [no_events(5.0)] * 2,
        [synthetic(np.zeros(STEPS + 1), np.zeros(STEPS + 1))],
        [synthetic(np.ones(STEPS + 1), np.zeros(STEPS + 1))] * 2,
    ],
    ids=["nothing happens", "at rest", "no energy", "no decay"],
)
def test_a_row_has_no_nan_whatever_was_fitted(traces: list[Trace]) -> None:
    found = decay.decays(traces)
    assert len(found) == sum(len(constant.laws) for constant in QUANTITIES.values())
    for constant in found:
        row = constant.as_json()
        assert json.loads(json.dumps(row, allow_nan=False)) == row
        assert row["repeats"] + row["failed"] == len(traces)
        assert (row["value"] is None) == (row["repeats"] == 0)
        assert (row["reason"] is None) == (row["failed"] == 0)
        assert (row["error"] is None) == (row["repeats"] < 2)


# Real runs


def test_nothing_decays_without_losses() -> None:
    """Each collision rounds the energies of two balls: by a few epsilon of the whole at most.

    The noise of a pressure, or of a light container's share of the energy, is no decay either.
    """
    for mass in (1e7, 20.0):
        lossless = repeats(6, cor=1.0, container_mass=mass)
        for trace in lossless:
            columns = series(trace)
            energy = columns.kinetic_energy + columns.container_energy
            drift = np.max(np.abs(energy / energy[0] - 1))
            assert drift <= decay.COLLISION_ROUNDING * 400
        rows = decay.decays(lossless)
        for one in rows:
            row = one.as_json()
            assert (row["elastic"], row["value"], row["repeats"], row["failed"]) == (
                *(True, None, 0, 6),
            )
            assert one.reason == decay.NO_LOSSES
        assert decay.fit_notes(rows) == [decay.Note(decay.NO_LOSSES)]


# Summaries


def test_the_constant_of_the_source_report_by_hand() -> None:
    scenes = [report_scene(repeat, cor=0.8, container_mass=1e7) for repeat in range(3)]
    full, grid = (
        [simulate(scene, collisions=500, summary=summary) for scene in scenes]
        for summary in (False, True)
    )
    speeds = np.array([series(trace).mean_speed[1:].mean() for trace in full])
    path = 1 / (math.sqrt(2) * 37 / (math.pi * 10.0**2) * 2 * math.pi * 1.0)
    expected = -2 * math.log(0.8) * speeds / path
    assert decay.reported_constants(measure(full)) == pytest.approx(expected, rel=1e-12)
    # The 400 rows of a grid have as many collisions between them: a fifth of a percent of 500.
    assert decay.reported_constants(measure(grid)) == pytest.approx(expected, rel=0.002)


def test_hotelling_s_test_of_one_mean_is_student_s() -> None:
    values = np.array([0.3, 0.5, -0.1, 0.7, 0.2])
    expected = stats.ttest_1samp(values, 0.0)
    ratio, chance = hotelling(float(expected.statistic) ** 2, 1, len(values))
    assert ratio == pytest.approx(float(expected.statistic) ** 2)
    assert chance == pytest.approx(float(expected.pvalue))
