"""Printed digits and their tolerance, and the arithmetic of the source report's own numbers."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snooker_cli.reproduction.source_values import (
    LORD,
    SOURCE_VALUES,
    STATEMENTS,
    OurValue,
    SourceValue,
)

PRINTED = {printed.digits for printed in SOURCE_VALUES.values()}


def number(printed: str, *, mean: bool = False) -> SourceValue:
    """An invented printed number."""
    return SourceValue("invented", "here", "invented", "energy decay", printed, "1/s", mean=mean)


@given(st.floats(-1, 1), st.floats(0, 10))
def test_agreement_is_the_last_digit_and_two_standard_errors(part: float, error: float) -> None:
    printed = number("4.2 ± 0.3")
    reach = printed.half_digit + 2 * math.hypot(printed.standard_error, error)
    assert OurValue(4.2 + 0.999 * part * reach, error).agrees(printed)
    assert not OurValue(4.2 + 1.001 * reach, error).agrees(printed)
    assert OurValue(4.2 + 0.999 * part * printed.half_digit).rounds_to(printed)
    assert not OurValue(4.2 + 1.001 * printed.half_digit).rounds_to(printed)


def test_interval_of_a_mean_of_five_from_its_range() -> None:
    """Simulates Lord's factor: 95 % of means are within it times the range of five values."""
    draws = np.random.default_rng(1947).standard_normal((200_000, 5))
    ratios = np.abs(draws.mean(axis=1)) / np.ptp(draws, axis=1)
    # Binomial: the share within has a standard deviation of 0.0005.
    assert np.mean(ratios < LORD) == pytest.approx(0.95, abs=0.002)
    mean = number("0.117 ± 0.01", mean=True)
    assert 2 * mean.standard_error == pytest.approx(LORD * 2 * 0.01)


def test_checks_by_printed_numbers_alone_are_right() -> None:
    """Two values within 5 % of each other, λ = 1/(√2 n σ), and errors in proportion to ⟨v⟩."""
    compared = 0
    for one in STATEMENTS.values():
        form = r"(.+) against (.+): (.+) % apart(?: \((.+) % with the (.+) of III A\))?"
        if found := re.fullmatch(form, one["check"]):
            first, second, apart = map(float, found.groups()[:3])
            assert {found[1], found[2]} <= PRINTED
            assert 100 * abs(first / second - 1) == pytest.approx(apart, abs=0.05)
            assert one["holds"] == (apart <= 5)
            if found[4]:
                further = 100 * abs(float(found[5]) / second - 1)
                assert further == pytest.approx(float(found[4]), abs=0.05)
                assert found[5] in PRINTED
            compared += 1
    assert compared == 4
    density, section = (SOURCE_VALUES[name].value for name in ("density", "cross_section"))
    path = f"{1 / (math.sqrt(2) * density * section):.2f} m"
    assert path in STATEMENTS["mean_free_path"]["check"]
    for name, digits in (("tau", 2), ("theory", 3)):
        for cor in ("0.8", "0.9"):
            printed, speed = SOURCE_VALUES[f"{name}_{cor}"], SOURCE_VALUES[f"speed_{cor}"]
            assert speed.error is not None
            error = printed.value * speed.error / speed.value
            assert f"± {error:.{digits}f}" in STATEMENTS[f"errors_of_{name}"]["check"]


def test_numbers_that_are_printed_again_are_the_same() -> None:
    again = [number for number in SOURCE_VALUES.values() if number.repeats]
    assert len(again) == 3
    for number in again:
        first = SOURCE_VALUES[number.repeats]
        assert (number.cor, number.unit, number.error) == (first.cor, first.unit, first.error)
        # The abstract has 0.035 where III B has 0.036.
        assert abs(number.value - first.value) <= 2 * number.half_digit * (1 + 1e-9)


def test_a_printed_number_is_known_to_half_of_its_last_digit() -> None:
    assert SOURCE_VALUES["mean_free_path"].digits == "15.010"
    assert SOURCE_VALUES["mean_free_path"].half_digit == pytest.approx(0.0005)
