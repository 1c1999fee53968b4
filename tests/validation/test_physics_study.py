"""Gases beside known values: they agree, they can disagree, and values have sources."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from direct_simulation import RATIO, a2, moments, temperatures
from typer.testing import CliRunner

from snooker_cli.cli.app import app
from snooker_cli.validation import physics_study as measurements
from snooker_cli.validation import spinning_gases
from snooker_cli.validation.gas_samples import ALLOWED, GasSample, known_value
from snooker_cli.validation.study import PLANS

Record = dict[str, Any]


@pytest.fixture(scope="module")
def record(bench: Any) -> Record:
    return bench("physics")[1]


def a_row(measured: float = 1.029, error: float = 0.01, **changes: float) -> Record:
    gas = GasSample(100, 0.3, 50, 200, 12)
    return known_value("group", "quantity", gas, (measured, error), 1.0, "source", **changes)


@pytest.mark.parametrize(
    ("changes", "agrees"),
    [
        ({}, True),
        ({"measured": 1.031}, False),
        ({"measured": 0.969}, False),
        ({"measured": 1.04, "expected_error": 0.01}, True),
        ({"measured": 1.04, "known": 0.02}, True),
        ({"measured": 1.04, "systematic": 0.02}, True),
        ({"measured": 1.06, "systematic": 0.02}, False),
    ],
)
def test_what_is_left_is_judged(changes: dict[str, float], agrees: bool) -> None:
    assert (a_row(**changes)["agreement"] != "no") is agrees


def test_a_gas_with_losses_does_not_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    gas = {"balls": 100, "packing": 0.3, "settling": 50, "collisions": 200, "seeds": 6}
    lossy = {"gases": {"fluids": [gas | {"cor": 0.98}]}}
    monkeypatch.setitem(PLANS["physics"], "quick", lossy)
    ended = CliRunner().invoke(app, ["bench", "physics", "--quick"])
    assert ended.exit_code == 4
    assert "0 of 2 rows agree within 3 standard errors" in ended.stdout
    assert re.search(
        r"not: Z = PV/NT at packing 0\.3 and CoR 0\.98 \(\S+\) and collisions of a ball, 1/s at pa",
        ended.stdout,
    )


def test_every_quick_row_agrees(record: Record) -> None:
    """Those that theory knows exactly without what is open."""
    rows = record["rows"]
    assert {row["agreement"] for row in rows if not row["systematic"]} == {"yes"}
    assert {row["agreement"] for row in rows} <= {"yes", "only with open"}


def test_an_approximation_is_open(record: Record) -> None:
    """Enskog's conductivity has no error of its own that is known; it is 1/s in two dimensions."""
    (row,) = [row for row in record["rows"] if row["quantity"].startswith("conductivity")]
    assert row["quantity"] == "conductivity, 1/s"
    # The packing of the middle; the gas is a little denser at walls.
    assert row["systematic"] / row["expected"] == pytest.approx(row["setting"]["packing"], rel=0.05)


def test_rows_that_chance_puts_beyond_three_errors() -> None:
    """Two thirds of a hundredth of Student's t with eleven degrees of freedom, in two tails."""
    rows = [a_row(), a_row(), a_row(systematic=0.1)]
    draws = np.random.default_rng(1).standard_normal((200_000, 12))
    t = draws.mean(axis=1) / (draws.std(axis=1, ddof=1) / math.sqrt(12))
    share = np.mean(abs(t) > ALLOWED)
    error = math.sqrt(share / len(t))
    assert measurements.by_chance(rows) / 2 == pytest.approx(share, abs=4 * error)


def test_the_loss_at_fixed_energy_is_that_of_a_mean_cube() -> None:
    """N⟨|u|³⟩ of a component on a sphere, over Maxwell's, at the energy of the free velocities."""
    gas = GasSample(balls=5, packing=0.1, settling=1, collisions=1, seeds=1, shape="periodic")
    draws = np.random.default_rng(1).standard_normal((400_000, 2 * gas.free))
    cubes = np.abs(draws[:, 0] * math.sqrt(2 * gas.free) / np.linalg.norm(draws, axis=1)) ** 3
    found = gas.balls / gas.free * cubes / math.sqrt(8 / math.pi)
    error = found.std() / math.sqrt(len(found))
    assert measurements.finite_loss(gas) == pytest.approx(found.mean(), abs=4 * error)


def test_a2_of_direct_simulation() -> None:
    value, error = measurements.DIRECT_A2[0.95]
    found, own_error = a2(0.95, 20_000, 8)
    assert found == pytest.approx(value, abs=4 * math.hypot(error, own_error))


def test_rough_disks_of_direct_simulation() -> None:
    """The saved values are those of more particles."""
    direct, settings = spinning_gases.DIRECT_ROUGH[0.0], (0.9, 0.0)
    mean, error = moments(*settings, 10_000, 8)[:, RATIO].tolist()
    value, saved_error = direct["ratio"]
    assert abs(mean - value) < 4 * math.hypot(error, saved_error) < 0.01
    after = spinning_gases.cooled_after(*settings)
    both, errors = temperatures(*settings, after, 10_000, 8)
    saved, saved_errors = np.transpose([direct["T_tr"], direct["T_rot"]])
    assert np.all(np.abs(both - saved) < 4 * np.hypot(errors, saved_errors))
    assert np.all(errors < 0.01 * both)
