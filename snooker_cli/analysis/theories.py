"""All theories that results are compared with: what a theory says, and which gases it is for.

A row of `snooker compare` is a theory whose needs the gas meets. If several entries have the same
quantity and model, the first one that holds counts.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import chain
from typing import NamedTuple, TypeAlias

import numpy as np

from snooker_cli import facts, theory, two_temperatures
from snooker_cli.analysis import diffusion
from snooker_cli.analysis import gas as gas_numbers
from snooker_cli.analysis import quantities as q
from snooker_cli.analysis.decay import Note, reported_constants
from snooker_cli.analysis.gas import Array, DiskRatio, Gas, SpeedLaw
from snooker_cli.analysis.profiles import expected_jumps
from snooker_cli.analysis.quantities import (
    QUANTITIES,
    Quantity,
    Source,
    has_numbers,
    wrong_return,
)
from snooker_cli.analysis.structure import Observable
from snooker_cli.facts import FACTS, Traits
from snooker_cli.formatting import listed
from snooker_cli.plugins import PluginError, Table, check_function
from snooker_cli.scene import Scene
from snooker_cli.theory import FINITE, IDEAL, INFINITE

Value: TypeAlias = Callable[[Gas], Array | float]

TheoryRow: TypeAlias = tuple[Quantity, str, Array, Array | float]
"""A quantity and a model; the measured and the predicted values of the repeats, or of all alike."""


class Theory(NamedTuple):
    """What a theory says about a quantity.

    quantity, model : what it is about, and its name in tables
    source : where its formula is from
    needs : the facts that must be true of a gas, those that choose the type of gas first
    value : of each repeat, or of all alike, in the unit of the quantity
    """

    quantity: Quantity
    model: str
    source: str
    needs: tuple[str, ...]
    value: Value

    @property
    def name(self) -> str:
        """Its quantity and its model."""
        return f"{self.quantity.name}: {self.model}"

    def predicted(self, gas: Gas, repeats: int | None = None) -> Array | float:
        """Its value, of each repeat or of all alike.

        repeats : their number; ``None`` of a gas that is a scene alone

        Raises ``PluginError`` if a package returns anything else.
        """
        found = self.value(gas)
        if has_numbers(found, ()) or (repeats is not None and has_numbers(found, (repeats,))):
            return found
        each = "" if repeats is None else f", or an array of one for each repeat, here {repeats}"
        raise wrong_return("theory", THEORIES, self.name, "value", found, f"a number{each}")


NO_THEORY = "no theory"
"""The model of a row that has a measured value only."""

WALLS, BALANCE = "temperature of the wall", "balance of energy"
BOLTZMANN, ENSKOG, START_RATES = "Boltzmann", "Enskog", "Enskog rates at the start"
MAXWELL, FIXED, COOLING = "Maxwell-Boltzmann", "fixed energy", "homogeneous cooling, a2"
CRITICAL, BY_COUNT = "critical length", "by event count"
ABOVE_ROTATION, ABOVE_DRIFT = f"{BY_COUNT}, above L²/2I", f"{BY_COUNT}, above p²/2M"
CHI, COMPRESSIBILITY = "contact value χ", "compressibility, k → 0"
CONDUCTIVITY = "Enskog's conductivity"
JUMP = "Maxwell's jump"
FIXED_MOMENTUM, INDEPENDENT = "fixed momentum", "independent velocities"
SOURCE_REPORT = "source report"
"""How models of the source report begin, which only --all prints."""

# What several theories need.

EQUAL = "several", "equal_balls"
FLUID = *EQUAL, "fluid"
LARGE = *FLUID, "no_common_drift", "one_cor"
FINITE_FLUID = *FLUID, "closed", "room"
FINITE_DISKS = *FINITE_FLUID, "one_cor", "smooth"
SPEEDS = "cold", "several", "equal_or_elastic"
FIXED_ENERGY = *SPEEDS, "smooth", "closed", "three_or_walls", "one_mass_or_walls", "at_rest"
COOLING_LAW = "cooling", "equal_balls", "one_cor", "one_wall_cor", "lossy_cor", "bouncing"
DECAYS = "cooling", *EQUAL, "smooth"
ONE_COR = *DECAYS, "one_cor", "one_wall_cor"
COOLING_FLUID = *ONE_COR, "fluid", "closed", "room", "moves"
VELOCITIES = "several", "one_mass"
EQUILIBRIUM = "warm_walls", "one_wall_temperature", "elastic_pairs"
PUBLISHED = "no_walls", "equal_balls", "elastic"
OF_RATES: tuple[tuple[str, tuple[str, ...]], ...] = (
    (BOLTZMANN, ("cold", *FLUID, "closed")),
    (BOLTZMANN, ("warm_walls", *EQUAL)),
    (ENSKOG, ("cold", *FLUID, "closed")),
    (ENSKOG, ("warm_walls", *FLUID)),
)
"""Theories of the rate between balls, and of the path from one collision to the next."""


DISK_RATIOS: dict[str, Callable[[Scene], DiskRatio]] = {
    INFINITE: gas_numbers.large_ratio,
    FINITE: gas_numbers.scene_ratio,
}
"""PV/NT of hard disks of a scene, by the name of the theory."""


def _as_met(gas: Gas, ratio: float) -> Array:
    """PV/NT with T of all motion. Without walls, balls meet at another temperature."""
    return 1 + (ratio - 1) * gas.meeting_ratio


def _infinite(gas: Gas) -> Array:
    return _as_met(gas, gas_numbers.large_ratio(gas.scene).pressure)


def _finite(gas: Gas) -> Array:
    return _as_met(gas, gas_numbers.scene_ratio(gas.scene).pressure)


def _van_der_waals(gas: Gas) -> Array:
    size = gas.container.area, gas.radius
    excluded = theory.van_der_waals_pressure(gas.number, 1.0, *size) / gas.density
    return _as_met(gas, excluded) * gas.ideal_pressure


def _accessible(gas: Gas) -> Array:
    size = gas.radius, gas.container
    return theory.accessible_wall_pressure(gas.number, 1.0, *size) * gas.temperature


def _published(gas: Gas) -> Array:
    known = theory.published_ratio(gas.scene.packing_fraction)
    assert known is not None
    return _as_met(gas, known.ratio)


def _ideal_wall_rate(gas: Gas) -> Array:
    speed = gas.fixed_speed * theory.wall_speed_ratio(gas.mass, gas.scene.container_mass)
    return theory.wall_rate(speed, gas.container.accessible(gas.radius))


def _warm_wall_rate(gas: Gas) -> Array:
    speed = theory.maxwell_mean_speed(1.0, gas.mass)
    return theory.wall_rate(speed, gas.container.accessible(gas.radius)) * gas.root_temperature


def _contact(gas: Gas, model: str) -> float:
    """χ of a theory of rates."""
    return 1.0 if model == BOLTZMANN else float(theory.contact_value(gas.scene.packing_fraction))


def _pair_rate(model: str, gas: Gas) -> Array:
    rate = theory.ball_ball_rate(gas.density, gas.radius, 1.0, _contact(gas, model), gas.mass)
    return rate * gas.means.root_meeting


def _path(model: str, gas: Gas) -> float:
    return theory.mean_free_path(gas.density, gas.radius, _contact(gas, model))


def _finite_pair_rate(gas: Gas) -> Array:
    return gas_numbers.finite_pair_rate(gas.scene) * gas.means.root_meeting


def _maxwell_speed(gas: Gas) -> float:
    """At T = 1 J."""
    return theory.maxwell_mean_speed(1.0, gas.mass)


def _wall_temperature(scene: Scene) -> float:
    return facts.traits_of(scene).wall_temperature


def _kurtosis(law: Callable[[Scene], SpeedLaw], gas: Gas) -> float:
    return law(gas.scene).kurtosis


def _collision_loss(gas: Gas) -> Array:
    temperature = gas.temperature
    share = theory.mean_loss(gas.scene.pair_law, float(temperature.mean()), gas.mass)
    return share * temperature


def _cooling_spins(gas: Gas) -> Array:
    return gas_numbers.late_ratio(
        gas_numbers.temperatures(gas.measurement)[0], gas_numbers.cooling_spins(gas.measurement)
    )


DISKS = (
    "Clisby & McCoy 2006; Helfand, Frisch & Lebowitz 1961; Lebowitz & Percus 1961; "
    "Jenkins & Richman 1985"
)
VIRIALS = "Clisby & McCoy 2006; Jenkins & Richman 1985"
KINETIC = "Chapman & Cowling 1970"
ROTATION = "Huthmann & Zippelius 1997; Luding et al. 1998"

SPEED_LAWS: tuple[tuple[str, tuple[str, ...], Callable[[Scene], SpeedLaw], str], ...] = (
    (MAXWELL, SPEEDS, gas_numbers.maxwell_law, KINETIC),
    (FIXED, FIXED_ENERGY, gas_numbers.fixed_energy_law, "exact"),
    (
        COOLING,
        (*FIXED_ENERGY, *COOLING_LAW),
        gas_numbers.finite_cooling_law,
        "van Noije & Ernst 1998",
    ),
    (
        COOLING,
        (*SPEEDS, "smooth", *COOLING_LAW),
        gas_numbers.cooling_law,
        "van Noije & Ernst 1998",
    ),
)
"""Laws of the speeds after the relaxation: model, needs, the law of a scene, and its source."""


OWN: tuple[Theory, ...] = (
    Theory(q.TEMPERATURE, WALLS, "equilibrium", EQUILIBRIUM, lambda g: _wall_temperature(g.scene)),
    Theory(
        *(q.TEMPERATURE, BALANCE, "Kumaran 1998"),
        (
            *("warm_walls", "no_equilibrium", "one_hot_law", *FLUID, "one_cor", "smooth"),
            *("balanced_walls", "lossy", "room"),
        ),
        lambda g: gas_numbers.balance_temperature(g.scene),
    ),
    Theory(q.PRESSURE, IDEAL, "N T/V", (), lambda g: g.ideal_pressure),
    Theory(q.TEMPERATURE, f"{IDEAL}, PV/N", "N T/V", ("cold",), lambda g: g.pressure / g.density),
    Theory(q.RATIO, IDEAL, "N T/V", (), lambda g: 1.0),
    Theory(
        *(q.PRESSURE, "accessible area", "exact"), ("cold", "walls", "equal_balls"), _accessible
    ),
    Theory(
        *(q.PRESSURE, "van der Waals", "second virial coefficient"),
        ("cold", *FLUID, "closed"),
        _van_der_waals,
    ),
    Theory(
        *(q.PRESSURE, INFINITE, VIRIALS, LARGE),
        lambda g: _infinite(g) * g.ideal_pressure,
    ),
    Theory(
        *(q.PRESSURE, FINITE, DISKS, FINITE_DISKS),
        lambda g: _finite(g) * g.ideal_pressure,
    ),
    Theory(
        *(q.VIRIAL_PRESSURE, INFINITE, VIRIALS, ("warm_walls", *LARGE)),
        lambda g: gas_numbers.large_ratio(g.scene).virial * g.ideal_pressure,
    ),
    Theory(
        *(q.VIRIAL_PRESSURE, FINITE, DISKS, ("warm_walls", *FINITE_DISKS)),
        lambda g: gas_numbers.scene_ratio(g.scene).virial * g.ideal_pressure,
    ),
    Theory(q.RATIO, INFINITE, VIRIALS, LARGE, _infinite),
    Theory(q.RATIO, FINITE, DISKS, FINITE_DISKS, _finite),
    Theory(
        *(q.VIRIAL_RATIO, INFINITE, VIRIALS, ("walls", *LARGE)),
        lambda g: gas_numbers.large_ratio(g.scene).virial,
    ),
    Theory(
        *(q.VIRIAL_RATIO, FINITE, DISKS, ("walls", *FINITE_DISKS)),
        lambda g: gas_numbers.scene_ratio(g.scene).virial,
    ),
    Theory(
        *(q.RATIO, "Erpenbeck & Luban 1985", "Erpenbeck & Luban 1985"),
        (*PUBLISHED, "published_1985"),
        _published,
    ),
    Theory(
        *(q.RATIO, "Engel et al. 2013", "Engel et al. 2013"),
        (*PUBLISHED, "published_2013"),
        _published,
    ),
    Theory(
        *(q.WALL_RATE, "ideal gas", KINETIC),
        ("cold", "walls", "equal_balls", "shared_speed"),
        _ideal_wall_rate,
    ),
    Theory(q.WALL_RATE, "ideal gas", KINETIC, ("warm_walls", "equal_balls"), _warm_wall_rate),
    *(
        Theory(
            *(q.WALL_RATE, FINITE, DISKS, needs),
            lambda g: gas_numbers.enskog_rates(g.scene).wall * g.root_temperature,
        )
        for needs in (("cold", "walls", *FINITE_FLUID, "smooth"), (*EQUILIBRIUM, *FINITE_FLUID))
    ),
    *(
        Theory(q.PAIR_RATE, model, KINETIC, needs, partial(_pair_rate, model))
        for model, needs in OF_RATES
    ),
    Theory(*(q.PAIR_RATE, FINITE, DISKS), ("cold", *FINITE_FLUID, "smooth"), _finite_pair_rate),
    *(
        Theory(q.FREE_PATH, model, KINETIC, needs, partial(_path, model))
        for model, needs in OF_RATES
    ),
    Theory(
        *(q.FREE_PATH, FINITE, DISKS, ("cold", *FINITE_FLUID, "at_rest", "smooth")),
        lambda g: g.fixed_speed / _finite_pair_rate(g),
    ),
    Theory(
        *(q.FREE_PATH, f"{SOURCE_REPORT}, 1/(√2 n 2πr)", "source report, equation 7"),
        ("cold", *FLUID, "closed"),
        lambda g: theory.source_mean_free_path(g.density, g.radius),
    ),
    Theory(
        *(q.SPECIES_RATIO, two_temperatures.EQUAL_RATES, "Garzó & Dufty 1999"),
        (
            *("two_species", "no_walls", "cold", "every_loss", "one_cor", "one_wall_cor"),
            *("smooth", "fluid", "moves"),
        ),
        lambda g: gas_numbers.species_ratio(g.scene),
    ),
    Theory(
        *(q.SPIN_RATIO, two_temperatures.MEAN_FIELD, ROTATION),
        (
            *("rough", "cold", *EQUAL, "one_cor", "no_friction", "every_loss"),
            *("smooth_wall", "elastic_wall"),
        ),
        _cooling_spins,
    ),
    Theory(
        *(q.SPIN_RATIO, two_temperatures.MEAN_FIELD, ROTATION),
        (
            *("rough", "warm_walls", "equal_balls", "one_hot_law", "no_friction"),
            *("smooth_wall", "rubbing_pairs"),
        ),
        lambda g: gas_numbers.heated_ratio(g.scene),
    ),
    Theory(
        *(q.GIVEN, "taken by collisions", "conservation of energy"),
        ("warm_walls", "several", "lossy_pairs"),
        lambda g: g.means.lost_energy / g.means.length,
    ),
    Theory(
        *(q.COLLISION_LOSS, MAXWELL, "Haff 1983"),
        ("warm_walls", "several", "lossy_pairs", "equal_balls", "smooth", "known_losses"),
        _collision_loss,
    ),
    Theory(
        *(q.MEAN_SPEED, MAXWELL, KINETIC, (*SPEEDS, "one_mass")),
        lambda g: _maxwell_speed(g) * g.root_temperature,
    ),
    Theory(
        *(q.MEAN_SPEED, MAXWELL, KINETIC, (*EQUILIBRIUM, "one_mass")),
        lambda g: _maxwell_speed(g) * math.sqrt(_wall_temperature(g.scene)),
    ),
    Theory(
        *(q.MEAN_SPEED, MAXWELL, KINETIC, ("warm_walls", "one_mass")),
        lambda g: _maxwell_speed(g) * np.sqrt(g.temperature),
    ),
    Theory(*(q.MEAN_SPEED, FIXED, "exact", (*FIXED_ENERGY, "one_mass")), lambda g: g.fixed_speed),
    *(
        Theory(q.KURTOSIS, model, source, needs, partial(_kurtosis, law))
        for model, needs, law, source in SPEED_LAWS
    ),
    Theory(q.KURTOSIS, MAXWELL, KINETIC, ("warm_walls", "one_mass"), lambda g: 2.0),
    Theory(q.ACROSS, "equal parts", "equipartition", ("warm_walls", "across"), lambda g: 1.0),
    Theory(
        *(q.ENERGY_DECAY, f"{SOURCE_REPORT}, −2 ln e/τ", "source report, equation 6", ONE_COR),
        lambda g: reported_constants(g.measurement),
    ),
    Theory(
        *(q.PRESSURE_DECAY, f"{SOURCE_REPORT}, −ln e/τ", "source report, equation 9", ONE_COR),
        lambda g: reported_constants(g.measurement) / 2,
    ),
    Theory(
        *(q.HAFF_RATE, START_RATES, "Haff 1983", COOLING_FLUID),
        lambda g: gas_numbers.haff_rate(g.scene) * g.starting_speed_ratio,
    ),
    Theory(
        *(q.HAFF_RATE, FINITE, DISKS, COOLING_FLUID),
        lambda g: gas_numbers.finite_haff_rate(g.scene) * g.starting_speed_ratio,
    ),
    Theory(
        *(q.ENERGY_LEFT, BY_COUNT, "exact for independent collisions"),
        (*DECAYS, "constant_cor"),
        Gas.left_by_count,
    ),
    *(
        Theory(
            *(q.ENERGY_LEFT, model, "exact for independent collisions"),
            (*DECAYS, "constant_cor", *kept),
            Gas.left_above_floor,
        )
        for model, kept in (
            (ABOVE_ROTATION, ("keeps_turning",)),
            (ABOVE_DRIFT, ("drifts",)),
        )
    ),
    Theory(
        *(q.ENERGY_LEFT, "Enskog rates, e(v)", KINETIC),
        (*DECAYS, "cor_by_speed", *FINITE_FLUID, "one_wall_law", "known_losses"),
        Gas.left_by_rates,
    ),
    Theory(
        *(q.CRITICAL_RATIO, CRITICAL, "Brito & Ernst 1998", facts.VORTICES),
        lambda g: theory.critical_ratio(g.scene, g.scene.restitution),
    ),
    Theory(
        *(q.SONINE, FIXED, "exact"),
        ("elastic", "smooth", "closed", "three_or_walls", "one_mass_or_walls", "at_rest"),
        lambda g: theory.fixed_energy_kurtosis(gas_numbers.independent_velocities(g.scene)) / 2 - 1,
    ),
    Theory(
        *(q.SONINE, COOLING, "van Noije & Ernst 1998"),
        (*EQUAL, "one_cor", "one_wall_cor", "smooth", "lossy_cor", "bouncing"),
        lambda g: gas_numbers.finite_cooling_kurtosis(g.scene) / 2 - 1,
    ),
    Theory(
        *(q.CONTACT, CHI, VIRIALS, ("elastic", *FINITE_FLUID)),
        lambda g: theory.contact_value(gas_numbers.fluid_state(g.scene).bulk_packing),
    ),
    Theory(
        *(q.STRUCTURE, COMPRESSIBILITY, VIRIALS, ("elastic", *FINITE_FLUID)),
        lambda g: theory.structure_at_zero(g.scene.packing_fraction),
    ),
    Theory(
        *(q.NEIGHBOURS, FIXED_MOMENTUM, "exact: −1/(N − 1)"),
        ("elastic", *VELOCITIES, "no_walls"),
        lambda g: -1 / (g.number - 1),
    ),
    Theory(
        *(q.NEIGHBOURS, INDEPENDENT, "exact"),
        ("elastic", *VELOCITIES, "walls", "closed", "no_turning"),
        lambda g: 0.0,
    ),
    Theory(
        *(q.DIFFUSION, ENSKOG, KINETIC, ("elastic", "smooth", "several", "moves")),
        lambda g: diffusion.expected(g.scene, 0).coefficient,
    ),
    Theory(
        *(q.HEAT_FLUX, CONDUCTIVITY, "Gass 1971", ("warm_walls", "hot_ends", *FLUID, "smooth")),
        lambda g: g.conduction.middle,
    ),
    Theory(
        *(q.TEMPERATURE_JUMP, JUMP, "Maxwell 1879"),
        ("warm_walls", "hot_ends", *FLUID, "smooth"),
        lambda g: expected_jumps(g.scene, g.profile, g.heat_through),
    ),
)
"""The theories of snooker, in the order of the rows of `snooker compare`."""


def _by_name(entries: Iterable[Theory]) -> dict[str, tuple[Theory, ...]]:
    """Theories by quantity and model. Those of one name are for different gases."""
    named: dict[str, tuple[Theory, ...]] = {}
    for entry in entries:
        named[entry.name] = *named.get(entry.name, ()), entry
    return named


def _taken(thing: object) -> tuple[str, tuple[Theory, ...]]:
    """What a distribution adds to ``THEORIES``. Raises ``PluginError``."""
    if not isinstance(thing, Theory):
        raise PluginError("it is no Theory", "name an object of this class")
    if QUANTITIES.get(thing.quantity.name) is not thing.quantity:
        name = thing.quantity.name
        raise PluginError(f"its quantity {name} is in no table", "add it to snooker.quantities")
    check_function(thing.value, "value", "gas")
    for name in thing.needs:
        if name not in FACTS:
            raise PluginError(f"there is no fact {name} that `needs` may name")
    if not thing.source:
        raise PluginError("it has no source", "say where its formula is from")
    return thing.name, (thing,)


THEORIES = Table("snooker.theories", _by_name(OWN), _taken)
"""Every theory by its quantity and model; several if each is for other gases."""


def every_theory() -> Iterator[Theory]:
    """All theories, in the order of rows."""
    return chain.from_iterable(THEORIES.values())


def holding(gas: Traits | Scene) -> Iterator[Theory]:
    """The theories that hold for a gas, one for each quantity and model.

    A quantity that is shown without a theory, and has none here, has the model ``NO_THEORY``.
    """
    traits = gas if isinstance(gas, Traits) else facts.traits_of(gas)
    placed: dict[tuple[str, str], tuple[int, Theory]] = {}
    entries = [*every_theory()]
    for place, entry in enumerate(entries):
        names = entry.quantity.name, entry.model
        if names not in placed and facts.missing(traits, entry.needs) is None:
            placed[names] = place, entry
    known = {name for name, _ in placed}
    first = {entry.quantity: place for place, entry in reversed([*enumerate(entries)])}
    for quantity in QUANTITIES.values():
        needs = quantity.alone
        if needs is None or quantity.name in known or facts.missing(traits, needs):
            continue
        alone = Theory(quantity, NO_THEORY, "", needs, lambda gas: math.nan)
        placed[quantity.name, NO_THEORY] = first.get(quantity, len(entries)), alone
    for _, entry in sorted(placed.values(), key=lambda pair: pair[0]):
        yield entry


def theory_of(gas: Traits | Scene, quantity: Quantity, model: str) -> Theory | None:
    """The theory of a quantity with this name, if it holds for a gas."""
    wanted = quantity, model
    return next((entry for entry in holding(gas) if (entry.quantity, entry.model) == wanted), None)


def known_models(gas: Traits | Scene, quantity: Quantity) -> list[str]:
    """The models that predict a quantity of a gas, without ``NO_THEORY``."""
    entries = (entry for entry in holding(gas) if entry.quantity == quantity)
    return [entry.model for entry in entries if entry.model != NO_THEORY]


def rows(gas: Gas, *sources: Source) -> Iterator[TheoryRow]:
    """The rows of quantities that are measured from one of these."""
    for entry in holding(gas.scene):
        if entry.quantity.has_values and entry.quantity.source in sources:
            measured = entry.quantity.values(gas)
            yield entry.quantity, entry.model, measured, entry.predicted(gas, len(measured))


def observables(scene: Scene) -> dict[str, Observable]:
    """What rows of a gas have that is measured in single states, by the names of the quantities."""
    quantities = dict.fromkeys(entry.quantity for entry in holding(scene))
    return {entry.name: entry.in_state for entry in quantities if entry.of_state is not None}


def absences(scene: Scene) -> Iterator[Note]:
    """Why theories say nothing about a gas: the words of the first need of each that fails.

    Theories of other types of gas, and those of the source report, are left out.
    """
    traits = facts.traits_of(scene)
    known = {(entry.quantity.name, entry.model) for entry in holding(traits)}
    shown = {name for name, _ in known}
    reasons: dict[str, dict[Quantity, list[str]]] = {}
    for entry in every_theory():
        has_row = entry.quantity.has_values or entry.model == CRITICAL
        is_known = (entry.quantity.name, entry.model) in known
        if is_known or not has_row or entry.model.startswith(SOURCE_REPORT):
            continue
        failing = [FACTS[name] for name in entry.needs if not FACTS[name].holds(traits)]
        if any(fact.of_type for fact in failing):
            continue
        lacking = reasons.setdefault(failing[0].words(traits), {})
        lacking.setdefault(entry.quantity, []).append(entry.model)
    for why, lacking in reasons.items():
        rows = [
            quantity.words + (f" ({_models(models)})" if quantity.name in shown else "")
            for quantity, models in lacking.items()
        ]
        are = "this row is" if len(rows) == 1 else "these rows are"
        about = ", ".join(quantity.name for quantity in lacking)
        yield Note(f"{why}, so {are} missing: {listed(rows)}", about)


def _models(models: Sequence[str]) -> str:
    """Models in a sentence; both theories of hard disks have one name."""
    names = dict.fromkeys(models)
    if INFINITE in names and FINITE in names:
        names = dict.fromkeys(
            "hard disks" if name in (INFINITE, FINITE) else name for name in names
        )
    return listed([*names])


# What figures and reports draw of a scene. Where no theory holds, there is ``None`` or nothing.


def values_of(scene: Scene, quantity: Quantity, *models: str) -> dict[str, float]:
    """The values of theories that need only a scene, by their names."""
    entries = (
        entry for entry in holding(scene) if entry.quantity == quantity and entry.model in models
    )
    return {entry.model: float(entry.predicted(Gas(scene))) for entry in entries}


def value_of(scene: Scene, quantity: Quantity, model: str) -> float | None:
    """The value of a theory that needs only a scene; ``None`` where it does not hold."""
    return values_of(scene, quantity, model).get(model)


def value_of_start(scene: Scene, quantity: Quantity, model: str, collisions: float) -> float | None:
    """The value of a theory in the state of a start, without what was measured.

    collisions : of a ball until the end

    ``None`` where it does not hold, or needs more than that.
    """
    if theory_of(scene, quantity, model) is None:
        return None
    rates = {FINITE: gas_numbers.finite_haff_rate, START_RATES: gas_numbers.haff_rate}
    if quantity == q.HAFF_RATE and model in rates:
        return rates[model](scene)
    if quantity == q.RATIO and model in (INFINITE, FINITE):
        return DISK_RATIOS[model](scene).pressure
    if quantity == q.SPIN_RATIO and facts.hold(scene, "cold"):
        return gas_numbers.late_spins(scene, collisions)
    return None


def source_of(quantity: Quantity, model: str) -> str:
    """Where the formula of a theory is from."""
    return THEORIES[f"{quantity.name}: {model}"][0].source


def disk_ratios(scene: Scene) -> dict[str, DiskRatio]:
    """PV/NT of hard disks by the name of the theory."""
    models = known_models(scene, q.RATIO)
    return {model: ratio(scene) for model, ratio in DISK_RATIOS.items() if model in models}


def speed_laws(scene: Scene) -> dict[str, SpeedLaw]:
    """The laws of the speeds after the relaxation, by their names."""
    traits, laws = facts.traits_of(scene), dict[str, SpeedLaw]()
    for model, needs, law, _ in SPEED_LAWS:
        if model not in laws and facts.missing(traits, needs) is None:
            laws[model] = law(scene)
    return laws


def gas_kinds(gas: Traits | Scene) -> tuple[q.GasKind, ...]:
    """What decides the main quantities of a gas. Traits alone do not show clusters."""
    traits = gas if isinstance(gas, Traits) else facts.traits_of(gas)
    critical = None
    if isinstance(gas, Scene):
        critical = value_of(gas, q.CRITICAL_RATIO, CRITICAL)
    further: dict[q.GasKind, bool] = {
        "mixture": not facts.hold(traits, "equal_balls"),
        "rough": facts.hold(traits, "rough"),
        "clusters": critical is not None and critical > 1,
        "uneven": facts.hold(traits, "uneven"),
    }
    return facts.gas_type(traits), *(kind for kind, holds in further.items() if holds)
