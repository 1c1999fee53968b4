"""What a point's repeats measured beside what theory predicts, difference in standard errors."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from snooker_cli import theory
from snooker_cli.decay import curve, fit_curve
from snooker_cli.observables import reduced_speed_counts, series, time_mean
from snooker_cli.trace import SPEED_BIN, SPEED_BINS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace


ROUNDING = 1e-12
"""Relative spread below which repeats differ by nothing but rounding."""


@dataclass(frozen=True)
class Measured:
    """What one repeat measured, means being over its time.

    pressure : impulse on the wall over the perimeter 2 pi R and the time, Pa m
    temperature, root_temperature : mean of T and of its root, J and J^(1/2)
    mean_speed : m/s; kurtosis : <v^4>/<v^2>^2, over the second half, when speeds have mixed
    pair_rate, wall_rate : collisions of one ball per second
    decay_constant, pressure_decay_constant, haff_rate : fitted, 1/s
    energy_left : kinetic energy at the end over that at the start
    """

    pressure: float
    temperature: float
    root_temperature: float
    mean_speed: float
    kurtosis: float
    pair_rate: float
    wall_rate: float
    pair_events: int
    wall_events: int
    start_temperature: float
    decay_constant: float
    pressure_decay_constant: float
    haff_rate: float
    energy_left: float


@dataclass(frozen=True)
class Comparison:
    """A measured quantity beside a prediction, both means over the repeats.

    error : standard error of the measured mean
    difference_error : of the mean of measured less predicted, repeat by repeat, since many
        predictions follow the repeat's own temperature
    """

    quantity: str
    unit: str
    model: str
    measured: float
    error: float
    predicted: float
    difference: float
    difference_error: float
    repeats: int

    @property
    def in_errors(self) -> float:
        """The difference in standard errors; nan if there is no error."""
        if not self.difference_error > 0:
            return math.nan
        if self.difference_error < ROUNDING * max(abs(self.measured), abs(self.predicted)):
            return math.nan  # the repeats agree to rounding: that is no measure of their spread
        return self.difference / self.difference_error


def measure(trace: Trace) -> Measured:
    """What one repeat measured."""
    found, scene, end = series(trace), trace.start, trace.stop.time
    temperature = found.kinetic_energy / scene.number
    half = found.time >= end / 2
    per_ball = 1 / (scene.number * end) if end > 0 else math.nan
    total = found.kinetic_energy + found.container_energy
    return Measured(
        pressure=float(found.wall_impulse[-1]) / (2 * math.pi * scene.container_radius * end)
        if end > 0
        else math.nan,
        temperature=time_mean(found.time, temperature, end),
        root_temperature=time_mean(found.time, np.sqrt(temperature), end),
        mean_speed=time_mean(found.time, found.mean_speed, end),
        kurtosis=time_mean(found.time[half], found.energy_moment[half], end)
        if half.any()
        else math.nan,
        pair_rate=2 * trace.pair_events * per_ball,
        wall_rate=trace.wall_events * per_ball,
        pair_events=trace.pair_events,
        wall_events=trace.wall_events,
        start_temperature=float(temperature[0]),
        decay_constant=fit_curve(curve(trace, "kinetic_energy"), "exponential").value,
        pressure_decay_constant=fit_curve(curve(trace, "pressure"), "exponential").value,
        haff_rate=fit_curve(curve(trace, "kinetic_energy"), "haff").value,
        energy_left=float(total[-1] / total[0]),
    )


def compare(traces: Iterable[Trace]) -> list[Comparison]:
    """A point's repeats beside every theory that its scene has."""
    measured, counts = [], np.zeros(SPEED_BINS, dtype=np.int64)
    scene: Scene | None = None
    for trace in traces:
        if trace.collisions == 0:
            continue
        scene = trace.start
        measured.append(measure(trace))
        counts += reduced_speed_counts(trace)
    if scene is None:
        return []
    table = _Table(measured)
    _ideal_gas(table, scene)
    if len(set(scene.radii.tolist())) == 1 and len(set(scene.masses.tolist())) == 1:
        _hard_disks(table, scene)
        _cooling(table, scene)
    _speeds(table, scene, counts)
    return table.rows


def record(row: Comparison, parameters: dict[str, Any]) -> dict[str, Any]:
    """A comparison as JSON; what is not a number is null."""
    values = {"parameters": parameters, **vars(row), "difference_in_errors": row.in_errors}
    return {
        key: None if isinstance(value, float) and not math.isfinite(value) else value
        for key, value in values.items()
    }


class _Table:
    """Collects comparisons from columns over the repeats."""

    def __init__(self, measured: list[Measured]) -> None:
        self.rows: list[Comparison] = []
        self._measured = measured

    def column(self, name: str) -> NDArray[np.float64]:
        """A measured quantity over the repeats."""
        return np.array([getattr(one, name) for one in self._measured], dtype=np.float64)

    def add(self, quantity: str, unit: str, values: Any, model: str, predicted: Any) -> None:
        """A row; ``predicted`` is a number or a column over the repeats."""
        values = np.asarray(values, dtype=np.float64)
        predicted = np.broadcast_to(np.asarray(predicted, dtype=np.float64), values.shape)
        good = np.isfinite(values) & np.isfinite(predicted)
        values, predicted = values[good], predicted[good]
        if not len(values):
            return
        self.rows.append(
            Comparison(
                quantity=quantity,
                unit=unit,
                model=model,
                measured=float(values.mean()),
                error=_standard_error(values),
                predicted=float(predicted.mean()),
                difference=float((values - predicted).mean()),
                difference_error=_standard_error(values - predicted),
                repeats=len(values),
            )
        )


def _standard_error(values: NDArray[np.float64]) -> float:
    return float(values.std(ddof=1)) / math.sqrt(len(values)) if len(values) > 1 else math.nan


def _ideal_gas(table: _Table, scene: Scene) -> None:
    """The ideal gas law, which knows neither radii nor dissipation."""
    number, area = scene.number, math.pi * scene.container_radius**2
    pressure, temperature = table.column("pressure"), table.column("temperature")
    ideal = theory.ideal_gas_pressure(number, 1.0, area) * temperature
    table.add("pressure", "Pa m", pressure, "ideal gas law", ideal)
    table.add("temperature", "J", temperature, "ideal gas law, PV/N", pressure * area / number)
    table.add("PV/NT", "1", pressure / ideal, "ideal gas law", 1.0)


def _hard_disks(table: _Table, scene: Scene) -> None:
    """Equations of state and collision rates of equal hard disks in a circle."""
    number, radius, mass = scene.number, float(scene.radii[0]), float(scene.masses[0])
    outer = scene.container_radius
    temperature, root = table.column("temperature"), table.column("root_temperature")
    at_one = {
        "accessible area": theory.accessible_wall_pressure(number, 1.0, radius, outer),
        "van der Waals": theory.van_der_waals_pressure(number, 1.0, math.pi * outer**2, radius),
        "hard disks, Padé": theory.bulk_pressure(number, 1.0, radius, outer),
    }
    density = theory.number_density(number, outer)
    packing = theory.packing_fraction(number, radius, outer)
    try:
        at_one["hard disks with a wall"] = theory.circle_state(number, 1.0, radius, outer).pressure
    except ValueError:
        return  # too dense for a fluid: no theory here speaks of it
    ideal = theory.ideal_gas_pressure(number, 1.0, math.pi * outer**2)
    for model, pressure in at_one.items():
        table.add("pressure", "Pa m", table.column("pressure"), model, pressure * temperature)
    measured_ratio = table.column("pressure") / (ideal * temperature)
    for model in ("hard disks, Padé", "hard disks with a wall"):
        table.add("PV/NT", "1", measured_ratio, model, at_one[model] / ideal)
    contact = float(theory.contact_value(packing))
    for model, chi in (("Boltzmann", 1.0), ("Enskog", contact)):
        rate = theory.ball_ball_rate(density, radius, 1.0, chi, mass)
        table.add("ball-ball rate of a ball", "1/s", table.column("pair_rate"), model, rate * root)
    walled = at_one["hard disks with a wall"]
    rate = theory.wall_rate_from_pressure(number, walled, 1.0, outer, mass)
    speed = theory.maxwell_mean_speed(1.0, mass)
    wall = table.column("wall_rate")
    ideal_rate = theory.wall_rate(speed, outer - radius)
    table.add("wall rate of a ball", "1/s", wall, "ideal gas", ideal_rate * root)
    table.add("wall rate of a ball", "1/s", wall, "hard disks with a wall", rate * root)
    rates = table.column("pair_rate")
    path = np.divide(
        table.column("mean_speed"), rates, out=np.full(len(rates), np.nan), where=rates > 0
    )
    for model, length in (
        ("Boltzmann", theory.boltzmann_mean_free_path(density, radius)),
        ("Enskog", theory.enskog_mean_free_path(density, radius, contact)),
        ("report, 1/(√2 n 2πr)", theory.report_mean_free_path(density, radius)),
    ):
        table.add("mean free path", "m", path, model, length)


def _cooling(table: _Table, scene: Scene) -> None:
    """Decay constants and the energy that is left, where energy is lost at all."""
    inelastic, wall_inelastic = scene.restitution, scene.wall_restitution
    if inelastic == 1.0 and wall_inelastic == 1.0:
        return
    number, radius, mass = scene.number, float(scene.radii[0]), float(scene.masses[0])
    outer = scene.container_radius
    density = theory.number_density(number, outer)
    path = theory.report_mean_free_path(density, radius)
    if inelastic > 0:
        reported = np.array(
            [
                theory.report_decay_constant(inelastic, path, speed)
                for speed in table.column("mean_speed")
            ]
        )
        measured = table.column("decay_constant")
        table.add("decay constant of energy", "1/s", measured, "report, −2 ln e/τ", reported)
        pressure = table.column("pressure_decay_constant")
        table.add("decay constant of pressure", "1/s", pressure, "report, −ln e/τ", reported / 2)
    root = np.sqrt(table.column("start_temperature"))
    contact = float(theory.contact_value(theory.packing_fraction(number, radius, outer)))
    pairs = theory.ball_ball_rate(density, radius, 1.0, contact, mass)
    try:
        walled = theory.circle_state(number, 1.0, radius, outer).pressure
    except ValueError:
        return  # too dense for a fluid: no rates are known
    walls = theory.wall_rate_from_pressure(number, walled, 1.0, outer, mass)
    alpha = theory.haff_rate(theory.cooling_rate(inelastic, pairs, wall_inelastic, walls))
    table.add(
        "Haff's α", "1/s", table.column("haff_rate"), "Enskog rates at the start", alpha * root
    )
    left = theory.energy_ratio_by_events(
        number, inelastic, table.column("pair_events"), wall_inelastic, table.column("wall_events")
    )
    table.add("energy left at the end", "1", table.column("energy_left"), "by event count", left)


def _speeds(table: _Table, scene: Scene, counts: NDArray[np.int64]) -> None:
    """Mean speed, kurtosis and the distribution of speeds."""
    number, elastic = scene.number, scene.restitution == scene.wall_restitution == 1.0
    equal = len(set(scene.masses.tolist())) == 1
    if number < 2:
        return
    fixed = theory.fixed_energy_kurtosis(number)
    if equal:
        mass, root = float(scene.masses[0]), table.column("root_temperature")
        speed = table.column("mean_speed")
        maxwell = theory.maxwell_mean_speed(1.0, mass)
        at_fixed = theory.fixed_energy_mean_speed(number, 1.0, mass)
        table.add("mean speed", "m/s", speed, "Maxwell-Boltzmann", maxwell * root)
        table.add("mean speed", "m/s", speed, "fixed energy", at_fixed * root)
    models = [("Maxwell-Boltzmann", 2.0), ("fixed energy", fixed)]
    if not elastic and scene.restitution > 0:
        sonine = theory.sonine_coefficient(scene.restitution)
        models.append(("homogeneous cooling, a2", 2 * (1 + sonine)))
    for model, value in models:
        table.add("kurtosis of speeds", "1", table.column("kurtosis"), model, value)
    if elastic and counts.sum() > 0:
        edges = np.arange(SPEED_BINS, dtype=np.float64) * np.float64(SPEED_BIN)
        for model, cumulative in (
            # The reduced speed v √(m/2T) is the speed of a ball with m = 1 at T = 1/2.
            ("Maxwell-Boltzmann", theory.maxwell_speed_cdf(edges, 0.5)),
            ("fixed energy", theory.fixed_energy_speed_cdf(edges, number, 0.5)),
        ):
            table.rows.append(_chi_square(model, counts, np.append(cumulative, 1.0)))


def _chi_square(model: str, counts: NDArray[np.int64], cumulative: Any) -> Comparison:
    """Pearson's chi-square per degree of freedom of a speed histogram; one if the law holds."""
    expected = np.diff(cumulative) * counts.sum()
    # Bins in the tail are taken together until a handful of balls is expected in each.
    while len(expected) > 2 and expected[-1] < 8:
        expected = np.append(expected[:-2], expected[-2:].sum())
        counts = np.append(counts[:-2], counts[-2:].sum())
    freedom = len(expected) - 1
    value = float(np.sum((counts - expected) ** 2 / expected)) / freedom
    error = math.sqrt(2 / freedom)
    return Comparison(
        quantity="χ² of the speed distribution, per degree of freedom",
        unit="1",
        model=model,
        measured=value,
        error=math.nan,
        predicted=1.0,
        difference=value - 1,
        difference_error=error,
        repeats=int(counts.sum()),
    )
