"""Comparisons with theory: what is measured when, what is missing, and what theory says."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes import gas

from snooker_cli import containers, theory, two_temperatures
from snooker_cli.analysis import comparison, decay, notes, observables, theories
from snooker_cli.analysis.comparison import Comparison
from snooker_cli.analysis.gas import floors
from snooker_cli.analysis.measurement import measure
from snooker_cli.analysis.observables import mean_and_error, reduced_speed_counts
from snooker_cli.analysis.quantities import CHI_SQUARE as CHI
from snooker_cli.analysis.quantities import SPECIES_RATIO, SPIN_RATIO, TEMPERATURE
from snooker_cli.config import parse
from snooker_cli.engine import simulate
from snooker_cli.engine.simulation import simulate_batch
from snooker_cli.laws import Viscoelastic
from snooker_cli.placement.starting_scene import starting_scene
from snooker_cli.scene import Scene
from snooker_cli.trace import CONTAINER, Events, Stop, StopReason, Trace

CHI_SQUARE = CHI.name

SCENE = """\
container: {radius: 10.0, mass: .inf}
balls: {rings: 2, radius: 1.0, mass: 1.0, speed: 10.0}
cor: 1.0
collisions: 600
"""

NUMBER = 19
FINITE = "hard disks, finite N"
RELAXING, LEAST = 143, 48
"""Ball-ball collisions in which nineteen balls have fifteen and five each."""

IDLE = Events(np.empty(0), np.empty(0, np.int32), np.empty(0, np.int32), np.empty(0))

Compared = tuple[list[Comparison], list[str]]


def compare(traces: list[Trace]) -> Compared:
    """The rows, and the sentences of the notes."""
    rows, notes = comparison.compare(traces)
    return rows, [row.note for row in notes]


def runs(number: int, *overrides: str, summary: bool = False) -> list[Trace]:
    config = parse(SCENE, overrides=overrides).config
    scenes = [starting_scene(config, repeat) for repeat in range(number)]
    collisions = config.collisions or 0
    return [simulate(scene, collisions=collisions, summary=summary) for scene in scenes]


@pytest.fixture(scope="module")
def elastic() -> list[Trace]:
    return runs(6)


@pytest.fixture(scope="module")
def cooling() -> list[Trace]:
    return runs(6, "cor=0.9", "wall_cor=1")


def row_of(found: Compared, quantity: str, model: str) -> Comparison:
    (only,) = [row for row in found[0] if (row.quantity, row.model) == (quantity, model)]
    return only


def quantities(found: Compared) -> set[str]:
    return {row.quantity for row in found[0]}


def models(found: Compared, quantity: str) -> dict[str, Comparison]:
    return {row.model: row for row in found[0] if row.quantity == quantity}


# What is measured


def test_equilibrium_is_measured_after_the_gas_has_relaxed(elastic: list[Trace]) -> None:
    """By hand, from the events: after as many of those between balls in each repeat."""
    pressures, pairs, walls = [], [], []
    skipped = min(RELAXING, int(np.mean([trace.pair_events for trace in elastic]) / 2))
    for trace in elastic:
        events = trace.events
        assert events is not None
        at_wall = events.j == CONTAINER
        since = events.time[np.flatnonzero(~at_wall)[skipped - 1]]
        later, length = events.time > since, trace.stop.time - since
        force = events.impulse[at_wall & later].sum() / length
        pressures.append(force / (2 * math.pi * 10.0))
        pairs.append(2 * np.sum(~at_wall & later) / length / NUMBER)
        walls.append(np.sum(at_wall & later) / length / NUMBER)
    found = compare(elastic)
    for quantity, model, expected in (
        ("pressure", "hard disks, finite N", pressures),
        ("ball-ball rate of a ball", "Enskog", pairs),
        ("wall rate of a ball", "ideal gas", walls),
    ):
        row = row_of(found, quantity, model)
        assert (row.measured, row.error) == pytest.approx(mean_and_error(np.array(expected)))
        assert (row.repeats, row.samples) == (6, None)
    note, steady, turning = found[1]
    assert steady.startswith("means over time: no change is found; some of up to")
    assert f"skip the first {skipped} ball-ball collisions of each repeat" in note
    assert turning == notes.TURNING
    # Elastic balls in a fixed container keep their temperature: it has no error.
    warm = row_of(found, "temperature", "ideal gas law, PV/N")
    assert warm.measured == pytest.approx(50, rel=1e-12)
    assert math.isnan(warm.error)


def test_the_error_of_a_difference_is_over_the_differences(cooling: list[Trace]) -> None:
    """Not that of the measured mean: a prediction follows the temperature of its repeat."""
    alone = [compare([trace]) for trace in cooling]
    smaller = 0
    for row in compare(cooling)[0]:
        if row.quantity in (CHI_SQUARE, "L/L_c"):
            continue
        rows = [row_of(found, row.quantity, row.model) for found in alone]
        differences = np.array([single.measured - single.predicted for single in rows])
        expected = differences.mean(), differences.std(ddof=1) / math.sqrt(6)
        assert (row.difference, row.difference_error) == pytest.approx(expected, rel=1e-9)
        smaller += row.difference_error < row.error / 2
    assert smaller > 2


def cut(trace: Trace, pairs: int, reason: StopReason = StopReason.COLLISIONS) -> Trace:
    """The trace up to this collision between balls."""
    events = trace.events
    assert events is not None
    last = int(np.flatnonzero(events.j != CONTAINER)[pairs - 1]) + 1
    stop = trace.stop._replace(time=float(events.time[last - 1]), reason=reason)
    counts = {"pair_events": pairs, "wall_events": last - pairs}
    return replace(trace, events=events[:last], stop=stop, **counts)


def test_too_short_repeats_have_no_relaxation(elastic: list[Trace]) -> None:
    """Of 96 collisions between balls, five of a ball are skipped and five are left; not of 95."""
    rows, notes = compare([cut(elastic[0], 2 * LEAST - 1)])
    assert rows == []
    assert notes[0].endswith(
        "the repeats have 95 ball-ball collisions on average, and the relaxation needs 96; "
        "make the run longer"
    )
    assert compare([cut(elastic[0], 2 * LEAST)])[0]


def test_a_repeat_that_ended_early_needs_five_collisions_of_a_ball(elastic: list[Trace]) -> None:
    """It does not choose the relaxation either."""
    whole, trap = cut(elastic[0], 2 * LEAST), StopReason.WALL_TRAP
    for pairs, counted in ((2 * LEAST, 2), (2 * LEAST - 1, 1), (3, 1)):
        rows, notes = compare([whole, cut(elastic[1], pairs, trap)])
        assert row_of((rows, notes), "pressure", "ideal gas law").repeats == counted
        (note,) = [note for note in notes if "relaxation" in note]
        assert ("left out: 1 of 2 repeats, which are too short" in note) == (counted == 1)


def test_cooling_is_compared_with_the_reports_own_constant(cooling: list[Trace]) -> None:
    found = compare(cooling)
    assert notes.EQUAL_SPEEDS in found[1]
    mixed = simulate(gas("circle", 19, 0.2, cor=0.9), collisions=200)  # with a Maxwellian's speeds
    assert notes.EQUAL_SPEEDS not in compare([mixed])[1]
    reported = decay.reported_constants(measure(cooling)).mean()
    energy = row_of(found, "decay constant of energy", "source report, −2 ln e/τ")
    pressure = row_of(found, "decay constant of pressure", "source report, −ln e/τ")
    assert energy.predicted == pytest.approx(reported, rel=1e-12)
    assert pressure.predicted == pytest.approx(reported / 2, rel=1e-12)
    fitted = {(row.quantity, row.law): row.over_repeats.value for row in decay.decays(cooling)}
    assert energy.measured == fitted["kinetic_energy", "exponential"]
    assert pressure.measured == fitted["pressure", "exponential"]
    haff = row_of(found, "Haff's α", "Enskog rates at the start")
    rates = theory.collision_rates(NUMBER, 50.0, 1.0, containers.Circle(10.0))
    assert haff.predicted == pytest.approx((1 - 0.81) * rates.ball_ball / 4, rel=0.01)
    assert haff.measured == fitted["kinetic_energy", "haff"]
    left = row_of(found, "energy left at the end", "by event count")
    expected = [(1 - (1 - 0.81) / (NUMBER + 0.5)) ** trace.pair_events for trace in cooling]
    assert left.predicted == pytest.approx(np.mean(expected), rel=1e-12)
    # Exactly 19 balls: walls attract them, so that they meet more often; a collision takes less.
    finite = row_of(found, "Haff's α", "hard disks, finite N")
    met = row_of(found, "ball-ball rate of a ball", "hard disks, finite N").predicted
    infinite = row_of(found, "ball-ball rate of a ball", "Enskog").predicted
    assert finite.predicted / haff.predicted == pytest.approx(met / infinite * 19 / 19.5, rel=1e-9)


# Speeds


def test_a_gas_is_compared_with_the_laws_of_speed(
    elastic: list[Trace], cooling: list[Trace]
) -> None:
    names = ["Maxwell-Boltzmann", "fixed energy", "homogeneous cooling, a2"]
    for traces, laws in ((elastic, names[:2]), (cooling, names)):
        found = compare(traces)
        assert list(models(found, CHI_SQUARE)) == list(models(found, "kurtosis of speeds")) == laws
    for row in models(compare(elastic), CHI_SQUARE).values():
        assert (row.repeats, row.samples % NUMBER) == (6, 0)
        assert 0 < row.samples < sum(reduced_speed_counts(trace).sum() for trace in elastic)
    a2 = theory.sonine_coefficient(0.9)
    kurtosis = row_of(found, "kurtosis of speeds", names[2]).predicted
    assert kurtosis == pytest.approx(2 * NUMBER / (NUMBER + 1) * (1 + a2))


# What is missing


def test_early_endings_and_idle_repeats_have_notes(elastic: list[Trace]) -> None:
    trapped = replace(elastic[0], stop=elastic[0].stop._replace(reason=StopReason.WALL_TRAP))
    stop = Stop(StopReason.TIME, 0.01, (), "0.01 s reached")
    idle = replace(elastic[1], events=IDLE, stop=stop, wall_events=0, pair_events=0)
    found = compare([trapped, idle, *elastic[2:]])
    assert found[1][0].startswith("1 of 6 repeats ended early")
    assert found[1][1] == "1 of 6 repeats has no collisions"
    assert {(row.complete, row.simulated) for row in found[0]} == {(5, 6)}
    assert row_of(found, "pressure", "ideal gas law").repeats == 5
    assert compare([idle]) == ([], ["the repeat has no collisions"])


def test_one_ball_has_no_ball_ball_rows() -> None:
    for cor in (1.0, 0.9):
        found = compare(runs(3, "balls.rings=0", f"cor={cor}"))
        assert quantities(found) == {"pressure", "temperature", "PV/NT", "wall rate of a ball"}
        assert set(models(found, "pressure")) == {"ideal gas law", "accessible area"}
        assert any(note.startswith("one ball meets no other") for note in found[1])


def test_one_ball_in_a_channel_has_no_theory_of_rates() -> None:
    """It keeps its momentum along the channel, so it has no independent velocity."""
    scene = gas("channel", 1, 0.01)
    traces = [simulate(scene, collisions=200, time=1e4), simulate(scene, collisions=1, time=1e300)]
    for trace in traces:
        found = compare([trace] * 3)
        assert "wall rate of a ball" not in quantities(found)
        assert any(note.startswith("one ball meets no other") for note in found[1])


@pytest.mark.parametrize(
    ("change", "cor", "last_missing"),
    [
        ("radii", 1.0, "mean free path"),
        ("masses", 1.0, "mean speed"),
        ("radii", 0.9, "mean speed and kurtosis ⟨v⁴⟩/⟨v²⟩²"),
    ],
)
def test_what_does_not_hold_for_unequal_balls_is_noted(
    change: str, cor: float, last_missing: str
) -> None:
    scene = starting_scene(parse(SCENE, overrides=[f"cor={cor}"]).config, 0)
    unequal = np.linspace(0.8, 1.0, NUMBER)
    found = compare([simulate(replace(scene, **{change: unequal}), collisions=1000)])
    assert found[1][-1].endswith(last_missing)
    assert set(models(found, "pressure")) == {"ideal gas law"}
    assert "mean free path" not in quantities(found)
    shown = {"mean speed", "kurtosis of speeds", CHI_SQUARE} & quantities(found)
    assert bool(shown) == (cor == 1.0)
    assert ("mean speed" in shown) == (change == "radii" and cor == 1.0)


def test_balls_that_are_no_fluid_are_noted() -> None:
    dense = runs(2, "balls.radius=1.85", "balls.ring_extent=0.775", "cor=0.95", "wall_cor=1")
    found = compare(dense)
    assert "0.65" in found[1][-1]
    assert "Haff's α" in found[1][-1]
    assert "Haff's α" not in quantities(found)
    assert set(models(found, "pressure")) == {"ideal gas law", "accessible area"}


@pytest.mark.filterwarnings("error")
def test_a_theory_without_a_value_is_noted(cooling: list[Trace]) -> None:
    packed = compare(runs(2, "balls.radius=1.64", "balls.ring_extent=0.8"))
    assert any("pressure (van der Waals)" in note for note in packed[1])
    sticky = compare(runs(2, "cor=0", "wall_cor=1", "collisions=150"))
    report = "decay constant of energy (source report, −2 ln e/τ)"
    assert any(report in note for note in sticky[1])
    # Balls at rest, and a gas that is some 1e-60 as warm as at its start.
    trace = simulate(gas("box", 60, 0.1, cor=0.9), collisions=40_000, summary=True)
    assert trace.summary is not None
    series = trace.summary.series
    nothing = np.zeros_like(series.time)
    at_rest = replace(series, kinetic_energy=nothing, mean_speed=nothing)
    still = compare([replace(trace, summary=replace(trace.summary, series=at_rest))])
    assert any("could not be measured" in note for note in still[1])
    for row in (*packed[0], *sticky[0], *still[0], *compare([trace])[0]):
        assert math.isfinite(row.measured)
        assert math.isfinite(row.predicted) or row.quantity == "L/L_c"


# Boxes and periodic boxes, against theory and published simulations


def test_a_periodic_gas_has_the_bulk_s_pressure_and_rates() -> None:
    """Exactly N balls have less than the bulk, also in the rate and so in the mean free path."""
    found = compare([simulate(gas("periodic", 256, 0.4), collisions=5000, summary=True)])
    ratio = row_of(found, "PV/NT", "hard disks, N → ∞")
    assert ratio.predicted == pytest.approx(1 + (2.82932 - 1) * 256 / 255, abs=1e-5)
    # By −η p''/(2N p') of Z, with p ∝ ηZ.
    missing = theory.missing_ratio(0.4, 256) * 256 / 255
    assert row_of(found, "PV/NT", FINITE).predicted == pytest.approx(ratio.predicted - missing)
    # There are no walls, and the virial's PV/NT is PV/NT itself.
    assert not {"wall rate of a ball", "PV/NT by the virial"} & quantities(found)
    assert "accessible area" not in models(found, "pressure")
    assert observables.NO_WALLS in found[1]
    # One velocity less is free.
    kurtosis = row_of(found, "kurtosis of speeds", "fixed energy")
    assert kurtosis.predicted == theory.fixed_energy_kurtosis(255)
    speed = row_of(found, "mean speed", "fixed energy")
    assert speed.predicted == pytest.approx(theory.fixed_energy_mean_speed(255, 50.0), rel=1e-9)
    rate = row_of(found, "ball-ball rate of a ball", FINITE).predicted
    path = row_of(found, "mean free path", FINITE).predicted
    assert path * rate == pytest.approx(speed.predicted, rel=1e-9)


def test_a_moving_centre_of_mass_has_no_law_at_fixed_energy() -> None:
    scene = gas("periodic", 64, 0.4)
    moving = replace(scene, velocities=scene.velocities + 3.0)
    found = compare([simulate(moving, collisions=3000, summary=True)] * 2)
    assert any("centre of mass moves on for ever" in note for note in found[1])
    assert list(models(found, "kurtosis of speeds")) == ["Maxwell-Boltzmann"]
    # Balls meet as they would without the common motion, of 9 of 59 J each.
    for which in (("ball-ball rate of a ball", "Enskog"), ("PV/NT", "hard disks, N → ∞")):
        row = row_of(found, *which)
        assert row.measured == pytest.approx(row.predicted, rel=0.05)
    still = theory.compressibility(0.4)
    assert row.predicted == pytest.approx(1 + (still - 1) * 50 * 64 / 63 / 59, rel=1e-6)


def test_published_values_appear_at_their_packings() -> None:
    half = math.pi / (2 * math.sqrt(3)) / 2
    ideal, disks, source = "ideal gas law", "hard disks, N → ∞", "Erpenbeck & Luban 1985"
    for packing, shown in (
        (half, {ideal, disks, FINITE, source}),
        (half * (1 + 1e-4), {ideal, disks, FINITE}),
        (0.7, {ideal, "Engel et al. 2013"}),  # no fluid
    ):
        found = compare([simulate(gas("periodic", 64, packing), collisions=2000, summary=True)])
        assert set(models(found, "PV/NT")) == shown
        if source in shown:
            expected = 1 + (3.4243 - 1) * 64 / 63
            assert row_of(found, "PV/NT", source).predicted == pytest.approx(expected, rel=1e-9)


def test_a_periodic_gas_cools_by_haff_s_law() -> None:
    scenes = [gas("periodic", 256, 0.2, cor=0.9, seed=seed) for seed in range(6)]
    traces = [simulate(scene, collisions=2560) for scene in scenes]
    found = compare(traces)
    alpha = row_of(found, "Haff's α", "Enskog rates at the start")
    rate = theory.ball_ball_rate(0.2 / math.pi, 1.0, 50 * 256 / 255, theory.contact_value(0.2))
    expected = theory.haff_rate(theory.cooling_rate(0.9, rate))
    assert alpha.predicted == pytest.approx(expected, rel=1e-9)

    # Balls meet at 256/255 of the mean temperature; impulses are 0.95 of those of elastic balls.
    added = 0.95 * (theory.compressibility(0.2) - 1) * 256 / 255
    large, finite = (row_of(found, "PV/NT", name) for name in ("hard disks, N → ∞", FINITE))
    fewer = 0.95 * theory.missing_ratio(0.2, 256) * 256 / 255
    assert large.predicted - 1 == pytest.approx(added, rel=1e-9)
    assert finite.predicted - 1 == pytest.approx(added - fewer, rel=1e-4)
    # The pressure decays with the energy.
    fits = decay.decays(traces)
    notes = decay.fit_notes(fits)
    alphas = {row.quantity: row.over_repeats.value for row in fits if row.law == "haff"}
    assert alphas["local_pressure"] == pytest.approx(alphas["local_energy"], rel=0.03)
    assert alphas["pressure"] == pytest.approx(alphas["kinetic_energy"], rel=0.1)
    walls, clusters = notes
    assert walls.note == observables.NO_WALLS
    assert ("without clusters" in clusters.note, clusters.model) == (True, "haff")


# What a scene conserves


def test_floors_are_of_what_the_shape_conserves() -> None:
    def floor(scene: Scene) -> float:
        return float(floors(measure([simulate(scene, collisions=0, time=0.0)]))[0])

    scene = gas("periodic", 64, 0.3)
    assert floor(scene) == pytest.approx(0, abs=1e-12)
    moving = replace(scene, velocities=scene.velocities + np.array([3.0, -4.0]))
    share = 64 * 25 / 2 / moving.kinetic_energy
    assert floor(moving) == pytest.approx(share, rel=1e-12)
    for unknown in (
        replace(moving, container=containers.Box(*moving.container.size)),
        replace(moving, velocities=0 * moving.velocities),
        gas("circle", 19, 0.2, container_mass=50.0),
    ):
        assert math.isnan(floor(unknown))
    circle = gas("circle", 19, 0.2)
    turning = replace(circle, velocities=circle.positions @ np.array([[0, 1.0], [-1.0, 0]]))
    assert floor(turning) == pytest.approx(1, rel=1e-12)  # a rigid rotation, of any masses
    assert floor(replace(turning, masses=np.arange(1.0, 20.0))) == pytest.approx(1, rel=1e-12)


def test_a_light_container_is_hit_more_often() -> None:
    """Its own thermal motion adds to the relative speed: by √(1 + m/M), √1.5 at 2 kg.

    Of 48 repeats, the rate is 1.7(1) % higher than predicted.
    """
    scenes = [gas("circle", 37, 0.1, container_mass=2.0, seed=seed) for seed in range(6)]
    found = compare([simulate(scene, collisions=20_000) for scene in scenes])
    row = row_of(found, "wall rate of a ball", "hard disks, finite N")
    assert row.measured == pytest.approx(row.predicted, rel=0.03)


def test_a_gas_whose_restitution_depends_on_speed_cools_as_predicted() -> None:
    """A dilute gas of Maxwell's speeds loses two thirds, at relative speeds up to v0 and above."""
    scene = replace(gas("periodic", 200, 0.01, cor=0.8), pair_law=Viscoelastic(0.8, 10.0))
    places = [gas("periodic", 200, 0.01, seed=seed) for seed in range(16)]
    scenes = [
        replace(scene, positions=other.positions, velocities=other.velocities) for other in places
    ]
    found = compare(simulate_batch(scenes, collisions=800))
    row = row_of(found, "energy left at the end", "Enskog rates, e(v)")
    assert 0.2 < row.predicted < 0.45
    assert abs(row.difference) < 4 * row.difference_error
    assert row.difference_error < 0.015 * row.predicted
    assert "Haff's α" not in quantities(found)


@pytest.mark.parametrize(
    ("start", "said"),
    [
        ("{rings: 3, radius: 0.5, speed: 5, ring_extent: 0.6}", True),
        ("{count: 19, radius: 1, speed: 5}", False),
        ("{count: 2, radius: 1, speed: 5}", False),
    ],
)
def test_the_note_on_rings_is_for_balls_that_start_on_them(start: str, said: bool) -> None:
    text = f"container: {{radius: 10}}\nballs: {start}\ncor: 1\ncollisions: 1\n"
    scene = starting_scene(parse(text).config, 0)
    assert (notes.TURNING in {note.note for note in notes.of_scene(scene)}) is said


MIXED = """\
container: {shape: periodic, packing: 0.02}
balls:
  - {count: 60, radius: 1.0, mass: 4.0, speed: 5.0, speeds: maxwell, start: random}
  - {count: 60, radius: 0.5, mass: 1.0, speed: 10.0, speeds: maxwell}
cor: 0.8
collisions: 2400
repeats: 40
"""
MAXWELL_APART = 0.025
"""How far T₁/T₂ may be below the theory of Maxwell's velocities at CoR 0.8: 0.020 in Boltzmann's
equation, see ``two_temperatures.species_ratio``, and 0.005 for 120 balls."""


def row_and_notes(text: str, quantity: str) -> tuple[Comparison, list[str]]:
    config = parse(text).config
    scenes = [starting_scene(config, repeat) for repeat in range(config.repeats)]
    limits = {"collisions": config.collisions, "summary": not config.keeps_events}
    rows, notes = comparison.compare(simulate_batch(scenes, **limits))
    found = [row for row in rows if row.quantity == quantity]
    return found[0] if found else None, [note.note for note in notes]  # type: ignore[return-value]


def species_row(text: str) -> tuple[Comparison, list[str]]:
    return row_and_notes(text, SPECIES_RATIO.name)


def test_two_species_have_the_temperatures_of_equal_cooling_rates() -> None:
    row, notes = species_row(MIXED)
    assert row.model == two_temperatures.EQUAL_RATES
    assert row.repeats == 40
    assert row.error < 0.015
    assert -MAXWELL_APART - 4 * row.error < row.difference < 4 * row.error
    assert row.measured > 1 + 5 * row.error
    species = (
        "T₁/T₂: mean after the relaxation, without the flow; 1 is r = 1 m, m = 4 kg, 2 is r = 0.5 m"
    )
    assert any(text.startswith(species) for text in notes)
    assert not any("still changes" in text for text in notes)


def test_two_elastic_species_share_the_energy_but_for_the_momentum_they_keep() -> None:
    """T₁/T₂ = (1 − m₁/M)/(1 − m₂/M), which is 0.914 for 4 and 20 balls here."""
    text = MIXED.replace("cor: 0.8", "cor: 1.0").replace(
        "count: 60, radius: 1.0", "count: 4, radius: 1"
    )
    row, _ = species_row(
        text.replace("count: 60", "count: 20").replace("repeats: 40", "repeats: 60")
    )
    assert row.predicted == pytest.approx((1 - 4 / 36) / (1 - 1 / 36), rel=1e-12)
    assert abs(row.difference) < 4 * row.error
    assert row.measured < 1 - 3 * row.error


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("shape: periodic, packing: 0.02", "shape: box, width: 100, height: 100"),
        ("cor: 0.8", "cor: 0.8\ncollapse: {tc: 0.01}"),
        ("cor: 0.8", "cor: 0.8\ncor_speed: 5.0"),
        ("radius: 0.5, mass: 1.0", "radius: 1.0, mass: 4.0"),
    ],
)
def test_without_a_theory_the_ratio_of_species_is_measured(old: str, new: str) -> None:
    """Where both species cool; balls of one species have no such ratio."""
    assert old in MIXED
    row, notes = species_row(MIXED.replace(old, new).replace("repeats: 40", "repeats: 1"))
    if "mass: 4.0" in new:
        assert row is None
        assert not any(text.startswith("T₁/T₂") for text in notes)
    else:
        assert row.model == theories.NO_THEORY
        assert math.isnan(row.predicted)


def test_a_summary_has_no_temperatures_of_species() -> None:
    row, notes = species_row(MIXED.replace("repeats: 40", "repeats: 1\nrecord: summary"))
    assert row is None
    missing = "T₁/T₂ (equal cooling rates) is missing: no state of the balls after the relaxation"
    assert any(f"{missing} is stored; run the config with `record: events`" in t for t in notes)


ROUGH = """\
container: {shape: periodic, packing: 0.01}
balls: {count: 100, radius: 1.0, speed: 5.0, speeds: maxwell, start: random}
cor: 1.0
tangential_cor: 1.0
collisions: 6000
repeats: 30
record: summary
"""


def spin_row(*changes: tuple[str, str]) -> tuple[Comparison, list[str]]:
    text = ROUGH
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return row_and_notes(text, SPIN_RATIO.name)


def test_perfectly_rough_elastic_balls_share_the_energy_evenly() -> None:
    row, notes = spin_row()
    assert row.model == two_temperatures.MEAN_FIELD
    assert row.predicted == pytest.approx(1.0, abs=1e-9)
    assert abs(row.difference) < 4 * row.difference_error < 0.1
    assert "spins take a part of the energy" in "".join(notes)


def test_cooling_rough_balls_have_the_ratio_of_the_mean_field() -> None:
    """The theory is up to 5 % above, see docs/accuracy.md."""
    row, notes = spin_row(
        ("\ncor: 1.0\n", "\ncor: 0.9\n"), ("tangential_cor: 1.0", "tangential_cor: 0")
    )
    assert row.predicted == pytest.approx(two_temperatures.rough_ratio(0.9, 0.0, 0.5), rel=0.01)
    assert -0.05 * row.predicted - 4 * row.difference_error < row.difference
    assert row.difference < 4 * row.difference_error < 0.1
    assert any("Haff's α, energy left" in text for text in notes)


def test_a_ratio_that_still_changes_in_its_mean_says_so() -> None:
    """Nearly smooth balls without spins: after 30 collisions per ball T_rot is still far below."""
    changed = ("\ncor: 1.0\n", "\ncor: 0.9\n"), ("repeats: 30", "repeats: 8")
    short = ("collisions: 6000", "collisions: 3000")
    _, notes = spin_row(*changed, short, ("tangential_cor: 1.0", "tangential_cor: -0.9"))
    assert any(text.startswith("T_rot/T_tr: it is not steady") for text in notes)
    _, notes = spin_row(*changed, ("tangential_cor: 1.0", "tangential_cor: 0"))
    assert not any("still changes" in text for text in notes)


@pytest.mark.parametrize(
    "change",
    [
        ("tangential_cor: 1.0", "tangential_cor: 1.0\nfriction: 0.3"),
        ("tangential_cor: 1.0", "tangential_cor: 1.0\ncollapse: {tc: 0.01}"),
        ("\ncor: 1.0\n", "\ncor: 0.9\ncor_speed: 5.0\n"),
        ("shape: periodic, packing: 0.01", "shape: box, width: 180, height: 180"),
    ],
)
def test_other_rough_balls_have_a_ratio_without_theory(change: tuple[str, str]) -> None:
    row, _ = spin_row(change, ("repeats: 30", "repeats: 2"))
    assert row.model == theories.NO_THEORY
    assert 0.1 < row.measured < 2
    assert math.isnan(row.predicted)


def test_heated_rough_balls_gain_as_much_rotation_as_they_lose() -> None:
    """η/(1 − η/q) is 1/2 at β = 1/2; speeds that are not Maxwell's may add 5 %."""
    row, _ = spin_row(
        ("shape: periodic, packing: 0.01", "radius: 80"),
        ("\ncor: 1.0\n", "\ncor: 0.95\nwall_temperature: 20\n"),
        ("tangential_cor: 1.0", "tangential_cor: 0.5"),
        ("collisions: 6000", "collisions: 20000"),
    )
    assert row.predicted == pytest.approx(0.5)
    assert abs(row.difference) < 0.05 * row.predicted + 4 * row.difference_error
    assert row.difference_error < 0.01


@pytest.mark.parametrize(("wall", "known"), [(1, True), (0, False), (-1, True)])
def test_a_gas_is_as_warm_as_the_only_walls_that_change_its_energy(wall: int, known: bool) -> None:
    """Not where others rub energy away."""
    text = ROUGH.replace("shape: periodic, packing: 0.01", "shape: box, width: 180, height: 180")
    text = f"{text}wall_tangential_cor: {wall}\nwall_temperature: {{left: 20, right: 20}}\n"
    scene = starting_scene(parse(text).points()[0].config, 0)
    assert theories.values_of(scene, TEMPERATURE, theories.WALLS) == (
        {theories.WALLS: 20} if known else {}
    )


@pytest.mark.parametrize(("right", "known"), [(20, True), (40, False)])
def test_rough_balls_between_warm_sides_have_a_theory_at_one_temperature(
    right: float, known: bool
) -> None:
    """A wall with a temperature is smooth, on all sides or on each."""
    row, _ = spin_row(
        ("shape: periodic, packing: 0.01", "shape: channel, width: 60, height: 60"),
        ("\ncor: 1.0\n", f"\ncor: 0.95\nwall_temperature: {{left: 20, right: {right}}}\n"),
        ("tangential_cor: 1.0", "tangential_cor: 0.5"),
        ("repeats: 30", "repeats: 6"),
    )
    assert (row.model == two_temperatures.MEAN_FIELD) is known
