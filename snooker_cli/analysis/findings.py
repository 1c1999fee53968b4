"""Rows of fits and comparisons -> the sentence that says what holds for a point or a run."""

from typing import Any

from snooker_cli.analysis.fitting import LAWS
from snooker_cli.analysis.run_analysis import Records
from snooker_cli.formatting import point_label, probability, ratio, short, with_error

_SYMBOLS = {"Haff's α": ("α", "1/s"), "PV/NT": ("PV/NT", "")}
"""The comparisons that a finding may have: symbol and unit. Of each point the last one counts."""


def finding(fits: Records, compared: Records) -> str:
    """What holds for a point: a sentence without a full stop, empty if nothing is known.

    fits, compared : the point's rows of ``fit.json`` and ``compare.json``; either may be empty

    A gas that cools has the law that its energy follows longest, and Haff's α beside theory.
    Another gas has PV/NT beside theory.
    """
    laws, beside = [one for one in fits if _cools(one)], _compared(compared)
    if not laws:
        return _beside(beside[-1]) if beside else ""
    law = max(laws, key=lambda one: (one["holds_to"] or 0.0, one["model"] == "haff"))
    if law["value"] is None:
        return "The energy has no fit"
    constant = f"{LAWS[law['model']].symbol} = {with_error(law['value'], law['error'], '1/s')}"
    if law["model"] == "haff" and beside and beside[-1]["quantity"] == "Haff's α":
        constant = _beside(beside[-1])
    return f"{_holds(law)}; {constant}"


def overview(fits: Records, compared: Records) -> str:
    """What holds for the points of a run, in a sentence like that of ``finding``."""
    haff = [one for one in fits if _cools(one) and one["model"] == "haff"]
    held = [one["holds_to"] == one["judged_to"] for one in haff if one["probability"] is not None]
    parts = [f"Haff's law holds to the end at {sum(held)} of {len(held)} points that cool"]
    groups: dict[str, list[float]] = {}
    for one in _compared(compared):
        name = f"{one['quantity']} differs from {_theory(one)} by"
        groups.setdefault(name, []).append(100 * one["difference"] / one["predicted"])
    for name, shares in groups.items():
        ends = dict.fromkeys(short(share, 2) for share in (min(shares), max(shares)))
        parts.append(f"{name} {' to '.join(ends)} %")
    return "; ".join(parts[not held :])


def _cools(fit: dict[str, Any]) -> bool:
    """Whether a fit is that of the energy of a gas that loses energy."""
    return fit["quantity"] == "kinetic_energy" and not fit["elastic"]


def _compared(rows: Records) -> Records:
    """The comparison of each point: Haff's α where it is, else PV/NT with the best theory."""
    known = {point_label(one["parameters"]): one for one in rows if one["quantity"] in _SYMBOLS}
    return list(known.values())


def _holds(law: dict[str, Any]) -> str:
    """Until when a law holds, and the probability of a deviation as large in the judged time."""
    label, p, end = LAWS[law["model"]].label, law["probability"], law["holds_to"]
    name = label if label[0].isupper() else f"The {label} law"
    if p is None:
        return f"{name} is not tested (too few repeats or collisions)"
    chance = f"p {'' if p < 0.001 else '= '}{probability(p)}"
    if end == law["judged_from"]:
        return f"{name} does not hold ({chance})"
    rest = "" if end == law["judged_to"] else f", not to {short(law['judged_to'])} s"
    return f"{name} holds to {short(end)} s{rest} ({chance})"


def _beside(row: dict[str, Any]) -> str:
    """``α = 0.697 ± 0.021 1/s, 4 % below Enskog, 2.1 errors``."""
    symbol, unit = _SYMBOLS[row["quantity"]]
    errors, excess = row["difference_in_errors"], 100 * row["difference"] / row["predicted"]
    value = with_error(row["measured"], row["error"], unit)
    side = "below" if excess < 0 else "above"
    known = errors is not None and row["repeats"] > 2  # an error of two repeats says little
    distance = f", {abs(errors):.1f} errors" if known else ""
    return f"{symbol} = {value}, {ratio(abs(excess))} % {side} {_theory(row)}{distance}"


def _theory(row: dict[str, Any]) -> str:
    """The name of a model as a theory: ``Enskog``, ``theory for hard disks with a wall``."""
    known = {"Enskog rates at the start": "Enskog", "ideal gas law": "the ideal gas law"}
    return known.get(row["model"], f"theory for {row['model']}")
