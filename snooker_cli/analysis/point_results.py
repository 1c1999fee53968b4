"""The fits, comparisons and table of a point, as JSON: what `run_analysis` keeps."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from snooker_cli import facts
from snooker_cli.analysis.comparison import comparisons_of, state_of
from snooker_cli.analysis.decay import Decay, decays_of, fit_records
from snooker_cli.analysis.measurement import WINDOWS, Measurement
from snooker_cli.analysis.stationarity import stationary_part_of
from snooker_cli.formatting import plain
from snooker_cli.runs.status import ending
from snooker_cli.trace import StopReason


def all_results(measurement: Measurement) -> dict[str, Any]:
    """All results of the repeats of a point."""
    constants = decays_of(measurement)
    compared, notes = comparisons_of(measurement, constants)
    return {
        "fits": fit_records(constants),
        "comparisons": {
            "rows": [row.as_json() for row in compared],
            "notes": [note._asdict() for note in notes],
        },
        "table": _columns(measurement, constants),
        "state": state_of(measurement),
    }


def _columns(measurement: Measurement, constants: Sequence[Decay]) -> dict[str, list[Any]]:
    """The columns of ``Run.table`` of ``api`` that follow from the repeats."""
    fitted = {decay.law: decay.fits for decay in constants if decay.quantity == "kinetic_energy"}
    whole, scene = measurement.whole, measurement.scene
    lasts = whole.length > 0  # or else the mean over its time is what it starts with
    energy = np.where(lasts, whole.kinetic_energy, measurement.start_energy)
    speed = np.where(lasts | (measurement.start_energy > 0), whole.mean_speed, 0.0)
    pressure = np.where(lasts, whole.pressure(scene), 0.0)
    with np.errstate(invalid="ignore"):  # nothing may move at all
        ratio = measurement.last_energy / measurement.first_energy
    begins = np.full_like(whole.length, math.nan)
    is_warm = facts.hold(scene, "warm_walls")

    if is_warm and (first := stationary_part_of(measurement).first_window) is not None:
        begins[measurement.complete] = first / WINDOWS * measurement.time[measurement.complete]
    columns = {
        "ending": [ending(StopReason(name)) for name in measurement.endings],
        "complete": measurement.complete,
        "collisions": measurement.collisions,
        "wall_collisions": measurement.events[:, 0],
        "pair_collisions": measurement.events[:, 1],
        "time": measurement.time,
        "temperature": energy / scene.number,
        "pressure": pressure,
        "mean_speed": speed,
        "energy_ratio": ratio,
        "k": [fit.value for fit in fitted["exponential"]],
        "alpha": [fit.value for fit in fitted["haff"]],
        "wall_energy": whole.wall_energy,
        "lost_energy": whole.lost_energy,
        "stationary_from": begins,
    }
    if facts.hold(scene, "rough"):
        columns["rotational_temperature"] = 2 * whole.spin_energy / scene.number
    return dict(plain(columns))
