"""Numbers in words: a value with its uncertainty, the same way everywhere in the report."""

from __future__ import annotations

import math


def digits(value: float, places: int = 4) -> str:
    """A number to some significant digits, without an exponent where it can be read without."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{places}g}"
    return text.replace("-", "−") if "e" not in text else _power(value, places)


def with_error(value: float, error: float) -> str:
    """``1.84 ± 0.14``: the uncertainty to two digits, the value to the same place."""
    if not (math.isfinite(error) and error > 0):
        return digits(value)
    places = 1 - math.floor(math.log10(error))
    if not 0 <= places <= 9:
        return f"{digits(value)} ± {digits(error, 2)}"
    return f"{value:.{places}f} ± {error:.{places}f}".replace("-", "−")


def _power(value: float, places: int) -> str:
    """``1.2·10⁻¹⁵``."""
    mantissa, exponent = f"{value:.{places - 1}e}".split("e")
    raised = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa}·10{raised}".replace("-", "−")
