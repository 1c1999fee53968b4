"""Rows of fits and comparisons -> the sentence that says what holds for a point or a run."""

from typing import Any

from snooker_cli.analysis.fitting import LAWS
from snooker_cli.analysis.run_analysis import Records
from snooker_cli.formatting import point_label, ratio, short, with_error

LEAST_REPEATS = 3  # for the test of a law, and for a difference in errors that says something
SMALLEST = 0.001  # a smaller probability is not written out

_SYMBOLS = {"Haff's α": "α", "PV/NT": "PV/NT"}
"""The comparisons that a finding may have."""


def finding(fits: Records, compared: Records) -> str:
    """What holds for a point: a sentence without a full stop, empty if nothing is known.

    fits, compared : the point's rows of ``fit.json`` and ``compare.json``; either may be empty

    A gas that cools has the law that its energy follows longest, and Haff's α beside theory.
    Another gas has PV/NT beside theory.
    """
    laws = {one["model"]: one for one in _energy(fits)}
    name = max(laws, key=lambda law: (laws[law]["holds_to"] or 0.0, law == "haff"), default="")
    beside = next(iter(_compared(compared).values()), None)
    if not laws:
        return _beside(beside) if beside else ""
    law = laws[name]
    if law["value"] is None:
        return "The energy has no fit"
    if name == "haff" and beside and beside["quantity"] == "Haff's α":
        return f"{_holds(law)}; {_beside(beside)}"
    constant = with_error(law["value"], law["error"], "1/s")
    return f"{_holds(law)}; {LAWS[name].symbol} = {constant}"


def overview(fits: Records, compared: Records) -> str:
    """What holds for the points of a run, in a sentence like that of ``finding``."""
    parts, haff = [], [one for one in _energy(fits) if one["model"] == "haff"]
    if judged := [one for one in haff if one["probability"] is not None]:
        held = sum(one["holds_to"] == one["judged_to"] for one in judged)
        parts.append(f"Haff's law holds to the end at {held} of {len(judged)} points that cool")
    groups: dict[str, Records] = {}
    for one in _compared(compared).values():
        groups.setdefault(f"{one['quantity']} | {_theory(one)}", []).append(one)
    for name, rows in groups.items():
        quantity, theory = name.split(" | ")
        rows.sort(key=_excess)
        least, _, side = _apart(rows[0]).rpartition(" % ")
        most = _apart(rows[-1])
        ends = [least if most.endswith(side) else _apart(rows[0]), most][len(rows) == 1 :]
        parts.append(f"{quantity} is {' to '.join(ends)} {theory}")
    return "; ".join(parts)


def _energy(fits: Records) -> Records:
    """The rows of the energy where it decays."""
    return [one for one in fits if one["quantity"] == "kinetic_energy" and not one["elastic"]]


def _compared(rows: Records) -> dict[str, dict[str, Any]]:
    """By point: Haff's α if it is there, or PV/NT with the best theory; these are the last rows."""
    return {point_label(one["parameters"]): one for one in rows if one["quantity"] in _SYMBOLS}


def _holds(law: dict[str, Any]) -> str:
    """Until when a law holds, and the probability of a deviation as large in the judged time."""
    label, p, end = LAWS[law["model"]].label, law["probability"], law["holds_to"]
    name = label if label[0].isupper() else f"The {label} law"
    if p is None:
        few = law["judged_repeats"] < LEAST_REPEATS
        why = f"fewer than {LEAST_REPEATS} repeats" if few else "too few collisions"
        return f"{name} is not tested ({why})"
    chance = f"p < {SMALLEST:g}" if p < SMALLEST else f"p = {p:.2g}"
    if end == law["judged_from"]:
        return f"{name} does not hold ({chance})"
    rest = "" if end == law["judged_to"] else f", not to {short(law['judged_to'])} s"
    return f"{name} holds to {short(end)} s{rest} ({chance})"


def _beside(row: dict[str, Any]) -> str:
    """``α = 0.697 ± 0.021 1/s, 4 % below Enskog, 2.1 errors``."""
    unit = "" if row["unit"] == "1" else row["unit"]
    value = with_error(row["measured"], row["error"], unit)
    errors = row["difference_in_errors"]
    known = errors is not None and row["repeats"] >= LEAST_REPEATS
    distance = f", {abs(errors):.1f} errors" if known else ""
    return f"{_SYMBOLS[row['quantity']]} = {value}, {_apart(row)} {_theory(row)}{distance}"


def _excess(row: dict[str, Any]) -> float:
    """The measured value less the predicted one, over the predicted one."""
    return float(row["difference"] / row["predicted"])


def _apart(row: dict[str, Any]) -> str:
    """``4 % below``."""
    return f"{ratio(100 * abs(_excess(row)))} % {'below' if _excess(row) < 0 else 'above'}"


def _theory(row: dict[str, Any]) -> str:
    """The name of the theory, as a noun."""
    names = {"Enskog rates at the start": "Enskog", "ideal gas law": "the ideal gas law"}
    return str(names.get(row["model"], row["model"]))
