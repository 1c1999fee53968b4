"""Every theory and every figure on every type of gas: shown only where their needs hold."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figure_runs import check_caption, made
from gas_kinds import KINDS, scene_of, text_of

from snooker_cli import facts
from snooker_cli.analysis import quantities as q
from snooker_cli.analysis import theories
from snooker_cli.analysis.decay import decays_of
from snooker_cli.analysis.gas import Gas
from snooker_cli.analysis.measurement import measure
from snooker_cli.analysis.profiles import measured_profile
from snooker_cli.config import parse
from snooker_cli.errors import FigureError
from snooker_cli.figures.figure_data import FigureData
from snooker_cli.figures.registry import FIGURES
from snooker_cli.laws import Constant
from snooker_cli.runs import RunFolder
from snooker_cli.runs.selection import Selection
from snooker_cli.theory import FINITE, INFINITE
from snooker_cli.two_temperatures import EQUAL_RATES, MEAN_FIELD

GOLDEN = Path(__file__).parent / "golden" / "theories.json"

OF_FIGURES: dict[str, list[tuple[q.Quantity, str]]] = {
    "pressure": [(q.RATIO, FINITE)],
    "cooling": [(q.HAFF_RATE, theories.START_RATES)],
    "event-decay": [(q.ENERGY_LEFT, theories.BY_COUNT)],
    "pair-correlation": [(q.CONTACT, theories.CHI)],
    "structure-factor": [(q.STRUCTURE, theories.COMPRESSIBILITY)],
    "velocity-correlations": [
        (q.NEIGHBOURS, theories.FIXED_MOMENTUM),
        (q.NEIGHBOURS, theories.INDEPENDENT),
    ],
    "a2": [(q.SONINE, theories.FIXED), (q.SONINE, theories.COOLING)],
    "species-temperature": [(q.SPECIES_RATIO, EQUAL_RATES)],
    "rotation": [(q.SPIN_RATIO, MEAN_FIELD)],
    "stationary": [(q.TEMPERATURE, theories.WALLS), (q.TEMPERATURE, theories.BALANCE)],
    "equation-of-state": [(q.RATIO, INFINITE), (q.RATIO, FINITE)],
    "heat-flux": [(q.HEAT_FLUX, theories.CONDUCTIVITY)],
}
"""The theories that figures draw, and record."""


@pytest.fixture(scope="module", params=KINDS)
def finished(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The name of a type of gas and a small run of it."""
    return request.param, made(
        tmp_path_factory.mktemp("kinds") / "run", text=text_of(request.param)
    )


def test_which_theories_a_gas_has(request: pytest.FixtureRequest) -> None:
    """The saved table was checked by hand, theory by theory."""
    kinds_of = {f"{entry.quantity.name}: {entry.model}": list[str]() for entry in theories.OWN}
    alone = (quantity.name for quantity in q.QUANTITIES.values() if quantity.alone is not None)
    kinds_of |= {f"{name}: {theories.NO_THEORY}": list[str]() for name in alone}
    for kind in KINDS:
        for entry in theories.holding(scene_of(kind)):
            kinds_of[f"{entry.quantity.name}: {entry.model}"].append(kind)
    if request.config.getoption("--write-goldens"):
        texts = {
            json.dumps(name, ensure_ascii=False): json.dumps(kinds_of[name]) for name in kinds_of
        }
        lines = ",\n".join(f" {name}: {kinds}" for name, kinds in texts.items())
        GOLDEN.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    assert kinds_of == json.loads(GOLDEN.read_text(encoding="utf-8"))


def test_each_theory_has_a_source_and_needs_that_are_facts() -> None:
    for entry in theories.OWN:
        assert entry.source
        assert {*entry.needs} <= facts.FACTS.keys()
    for spec in FIGURES.values():
        assert {*spec.requires} <= facts.FACTS.keys()


@pytest.mark.parametrize("kind", KINDS)
def test_a_config_says_of_a_gas_what_its_scene_says(kind: str) -> None:
    """But for packing, and for the momentum between walls, which no fact asks for."""
    (point,) = parse(text_of(kind)).points()
    scene = facts.traits_of(scene_of(kind))
    unknown = {name: getattr(scene, name) for name in ("packing", "crowding", "published")}
    config = facts.traits_of(point.config)._replace(**unknown)
    if config.walls:
        config = config._replace(at_rest=scene.at_rest)
    assert config == scene


def test_one_ball_between_elastic_walls_keeps_its_energy() -> None:
    scene = replace(scene_of("one ball"), wall_law=Constant(1.0))
    assert scene.restitution < 1
    assert facts.gas_type(facts.traits_of(scene)) == "elastic"


@pytest.mark.parametrize("kind", [kind for kind in KINDS if "rough" in kind or kind == "tc"])
def test_no_theory_of_smooth_balls_is_that_of_rough_ones(kind: str) -> None:
    models = {entry.model for entry in theories.holding(scene_of(kind))}
    of_smooth = {FINITE, theories.FIXED, theories.COOLING, theories.START_RATES, theories.BALANCE}
    assert not models & of_smooth


def test_theories_have_a_value_wherever_their_needs_hold(finished: tuple[str, RunFolder]) -> None:
    _, run = finished
    (point,) = run.points
    measurement = measure(run.traces(point))
    fitted = {
        (decay.quantity, decay.law): np.array([fit.value for fit in decay.fits])
        for decay in decays_of(measurement)
    }
    is_warm = facts.hold(measurement.scene, "warm_walls")
    profile = None
    if facts.hold(measurement.scene, "hot_ends"):
        halves = ((trace, trace.stop.time / 2) for trace in run.traces(point))
        profile = measured_profile(measurement.scene, halves, bins=10, times=500)
    gas = Gas(measurement, fitted, first_window=10 if is_warm else None, profile=profile)
    for entry in theories.holding(measurement.scene):
        if entry.model != theories.NO_THEORY:
            value = np.asarray(entry.value(gas))
            assert np.isfinite(value).any() or np.isnan(gas.means.length).all(), entry


def test_a_theory_that_is_missing_has_a_reason() -> None:
    """Each says what fails, or is of another type of gas."""
    for kind in KINDS:
        scene = scene_of(kind)
        known = facts.traits_of(scene)
        notes = [note.note for note in theories.absences(scene)]
        for note in notes:
            failing = [fact for fact in facts.FACTS.values() if note.startswith(fact.words(known))]
            assert any(not fact.holds(known) for fact in failing), note


@pytest.mark.parametrize("name", FIGURES)
def test_figures_show_theory_only_where_its_needs_hold(
    name: str, finished: tuple[str, RunFolder]
) -> None:
    _, run = finished
    spec, (point,) = FIGURES[name], run.points
    absent = facts.missing(facts.traits_of(point.config), spec.requires)
    found, why = None, ""
    try:
        found = spec.make(run, Selection())
    except FigureError as error:
        why = str(error)
    if found is not None:
        check_caption(found)
    if absent is not None:
        assert why == absent.reason(facts.traits_of(point.config))
    elif found is not None and name in OF_FIGURES:
        scene = next(run.traces(point)).start
        holds = any(theories.theory_of(scene, *about) for about in OF_FIGURES[name])
        assert holds or not _has_theory(found)


def _has_theory(found: FigureData) -> bool:
    """Whether a figure's numbers have a value of theory."""
    result = FIGURES[found.kind].result
    key = (result and result.theory) or "theory"
    values = [found.numbers.get(key)]
    values += [row.get(key) for row in found.numbers.get("points", ())]
    return any(value not in (None, [], math.nan) for value in values)
