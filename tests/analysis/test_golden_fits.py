"""Fitted decay constants of a small run, against values in ``golden/fits.json``.

``python tests/test_golden_fits.py > tests/golden/fits.json`` writes them anew.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from scenes import report_scene

from snooker_cli.analysis.decay import Decay, decays, reported_constant
from snooker_cli.engine import simulate
from snooker_cli.trace import Trace

GOLDEN = Path(__file__).parents[1].joinpath("golden") / "fits.json"

TOLERANCE = 1e-9
"""Relative. Sums, exp and log that other processors round differently change a fit by a few 1e-15;
the search ends at steps of 1e-12, which another path to the minimum may leave it off by. A change
of the model, the points or the estimate of an error is larger."""


def repeats(*, summary: bool) -> list[Trace]:
    """Three repeats of the source report's cooling gas."""
    scenes = [report_scene(repeat, cor=0.85, container_mass=1e7) for repeat in range(3)]
    return [simulate(scene, collisions=500, summary=summary) for scene in scenes]


def numbers(decay: Decay) -> dict[str, Any]:
    """What a decay constant's fits found, of single repeats and of all."""
    over = decay.over_repeats
    return {
        "points": [fit.points for fit in decay.fits],
        "value": [fit.value for fit in decay.fits],
        "error": [fit.error for fit in decay.fits],
        "amplitude": [fit.amplitude for fit in decay.fits],
        "r_squared": [fit.r_squared for fit in decay.fits],
        "rms_residual": [fit.rms_residual for fit in decay.fits],
        "mean": over.mean,
        "standard_error": over.standard_error,
        "bootstrap_error": over.bootstrap_error,
        "bootstrap_interval": [over.bootstrap_low, over.bootstrap_high],
        "max_min_half_range": over.max_min_half_range,
    }


def table() -> dict[str, dict[str, Any]]:
    """What ``golden/fits.json`` holds, as fitted now."""
    found: dict[str, dict[str, Any]] = {}
    for kind in ("events", "summary"):
        traces = repeats(summary=kind == "summary")
        for decay in decays(traces):
            found[f"{kind}, {decay.quantity}, {decay.law}"] = numbers(decay)
        constants = [reported_constant(trace) for trace in traces]
        found[f"{kind}, the report's constant"] = {"value": constants}
    return found


def test_fits():
    golden, found = json.loads(GOLDEN.read_text(encoding="utf-8")), table()
    assert found.keys() == golden.keys()
    for name, constants in found.items():
        assert constants.keys() == golden[name].keys()
        for quantity, values in constants.items():
            expected = pytest.approx(golden[name][quantity], rel=TOLERANCE, abs=0)
            assert values == expected, f"{name}, {quantity}"


if __name__ == "__main__":
    print(json.dumps(table(), indent=1))
