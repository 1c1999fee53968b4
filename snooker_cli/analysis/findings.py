"""What holds at the points of a run, as sentences: the main quantities of its gas beside theory.

`Findings` serves ``fit``, ``compare``, reports and Python. Each quantity is compared with one
theory at all points. All points count, and those that are left out have a reason.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from snooker_cli.analysis import quantities
from snooker_cli.analysis.fitting import LAWS
from snooker_cli.analysis.goodness import (
    ENOUGH_REPEATS,
    FEW_REPEATS,
    LEAST_PROBABILITY,
    cannot_be_tested,
    joint_probability,
    verdict,
)
from snooker_cli.analysis.quantities import QUANTITIES, Quantity
from snooker_cli.analysis.run_analysis import Records
from snooker_cli.analysis.theories import (
    ABOVE_DRIFT,
    ABOVE_ROTATION,
    BALANCE,
    BY_COUNT,
    NO_THEORY,
    START_RATES,
    WALLS,
)
from snooker_cli.formatting import chance, counted, listed, point_label, ratio, short, with_error
from snooker_cli.theory import IDEAL, PUBLISHED_RATIOS
from snooker_cli.two_temperatures import EQUAL_RATES, MEAN_FIELD

MOST_ERRORS = 3.0
"""Standard errors up to which a result agrees with theory."""

MOST_NAMED = 3  # points that a sentence names
LARGE_FACTOR = 2.0  # of theory, from which on a factor says more than a percentage

MAIN = tuple(one for one in QUANTITIES.values() if one.main_of)
RATIOS = (quantities.SPECIES_RATIO.name, quantities.SPIN_RATIO.name)
CHECKS = (quantities.GIVEN, quantities.ENERGY_LEFT)
"""Quantities that a finding has only where they differ from theory."""

Row = Mapping[str, Any]


# A row as words.


def is_theory(row: Row) -> bool:
    """Whether a row of ``compare`` has a theory of this quantity; an ideal gas has no balls."""
    return row["model"] != NO_THEORY and not row["model"].startswith(IDEAL)


def theory_name(row: Row) -> str:
    """The name of a model as a theory: ``Enskog``, ``theory for hard disks, finite N``."""
    return _THEORIES.get(row["model"], f"theory for {row['model']}")


_THEORIES = {
    START_RATES: "Enskog",
    MEAN_FIELD: "mean-field theory",
    BY_COUNT: "what the counted collisions of a uniform gas would leave",
    ABOVE_ROTATION: "what the counted collisions would leave above the energy of rotation L²/2I",
    ABOVE_DRIFT: "what the counted collisions would leave above the energy of the drift p²/2M",
    "taken by collisions": "what collisions take",
    WALLS: "the temperature of the wall",
    BALANCE: "the balance of energy",
    EQUAL_RATES: "the theory of equal cooling rates",
} | {one.source: f"the simulations of {one.source}" for one in PUBLISHED_RATIOS}


def errors_of(row: Row) -> float | None:
    """The difference from theory in errors; ``None`` if too few repeats have one."""
    return row["difference_in_errors"] if row["repeats"] > 2 else None


def distance(row: Row) -> str:
    """How far a result is from its prediction: ``4.0 ± 1.9 % below``, ``43 ± 21 times``.

    The error is that of the difference, which is taken in each repeat.
    """
    measured, predicted = row["measured"], row["predicted"]
    if predicted == 0 or measured / predicted < 0:
        unit = QUANTITIES[row["quantity"]].unit_text
        return f"{short(row['difference'], 2)} {unit}".rstrip() + " from"
    factor, error = measured / predicted, row.get("difference_error")
    error = None if error is None else error / abs(predicted)
    if factor >= LARGE_FACTOR or factor <= 1 / LARGE_FACTOR:
        return f"{_number(factor, error)} times"
    share = factor - 1
    percent = _number(100 * abs(share), None if error is None else 100 * error)
    return f"{percent} % {'below' if share < 0 else 'above'}"


def _number(value: float, error: float | None) -> str:
    """A number with its error if that is known, else to two digits."""
    return with_error(value, error) if error else ratio(value)


def value_of(row: Row) -> str:
    """``α = 0.697 ± 0.021 1/s``."""
    one = QUANTITIES[row["quantity"]]
    return f"{one.symbol} = {with_error(row['measured'], row['error'], one.unit_text)}"


def beside(row: Row) -> str:
    """A result beside its theory: ``PV/NT = 2.9 ± 0.1 agrees with … (1 % above, 0.3 errors)``."""
    if row["model"] == NO_THEORY:
        return f"{value_of(row)} (there is no theory of it here)"
    if not is_theory(row):
        return f"{value_of(row)} (an ideal gas has {short(row['predicted'])})"
    errors, theory = errors_of(row), theory_name(row)
    if errors is None:
        why = "too few repeats for a test" if row["repeats"] < 3 else "without an error"
        return f"{value_of(row)}, {distance(row)} {theory} ({why})"
    number = f"{abs(errors):.1f} errors"
    if abs(errors) <= MOST_ERRORS:
        return f"{value_of(row)} agrees with {theory} ({_from(row)}{number})"
    return f"{value_of(row)} is {distance(row)} {theory} ({number})"


def _from(row: Row) -> str:
    """``1 % above, `` of a result that agrees."""
    return "" if row["difference"] == 0 else f"{distance(row)}, "


# One theory for a quantity.


def one_theory(compared: Iterable[Row]) -> dict[str, str]:
    """The theory of each main quantity: that of most points, of several the last row's.

    Rows of a point go from simple theories to better ones. A quantity without a theory has the
    name that its rows have instead.
    """
    found = {}
    rows = [row for row in compared if QUANTITIES[row["quantity"]] in (*MAIN, *CHECKS)]
    for name in dict.fromkeys(row["quantity"] for row in rows):
        own = [row for row in rows if row["quantity"] == name]
        if name == quantities.TEMPERATURE.name:  # the ideal gas law gives T of any gas from P
            own = [row for row in own if not row["model"].startswith(IDEAL)]
        own = [row for row in own if is_theory(row)] or own
        counts = Counter(row["model"] for row in own)
        last = {row["model"]: place for place, row in enumerate(own)}
        if counts:
            found[name] = max(counts, key=lambda model: (counts[model], last[model]))
    return found


def main_rows(compared: Sequence[Row], chosen: Mapping[str, str] | None = None) -> Records:
    """The rows of main quantities with one theory each, in the order in which sentences have them.

    chosen : the theory of each quantity [`one_theory` of the rows]
    """
    chosen = one_theory(compared) if chosen is None else chosen
    return [
        dict(row)
        for one in MAIN
        for row in compared
        if row["quantity"] == one.name and row["model"] == chosen.get(one.name)
    ]


def main_result(compared: Sequence[Row]) -> Records:
    """The rows of the first main quantity that half of the points have, or else of most of them.

    One beside a theory goes before others. A trend is about it.
    """
    rows = main_rows(compared)
    rows = [row for row in rows if is_theory(row)] or rows
    counts = Counter(row["quantity"] for row in rows)
    half = len({_place(row) for row in compared}) / 2
    name = next((one for one in counts if counts[one] >= half), None)
    name = name or max(counts, key=lambda one: counts[one], default=None)
    return [row for row in rows if row["quantity"] == name]


# Laws of decay.


def cools(fit: Row) -> bool:
    """Whether a fit is that of the energy of a gas that loses energy."""
    return bool(fit["quantity"] == "kinetic_energy" and not fit["elastic"])


def few_repeats(fits: Sequence[Row]) -> list[str]:
    """``FEW_REPEATS`` if few repeats do not refuse one of these laws, up to some time.

    A verdict that they cannot test a law says it already.
    """
    known = (row for row in fits if row["probability"] is not None)
    judged = (row for row in known if not cannot_be_tested(row))
    few = (row for row in judged if row["judged_repeats"] < ENOUGH_REPEATS)
    return [FEW_REPEATS] if any(row["holds_to"] > row["judged_from"] for row in few) else []


def _is_refused(law: Row) -> bool:
    return bool(law["holds_to"] < law["judged_to"])


class Findings:
    """What holds at points: of each point by its label, and of all together.

    fits, compared : rows of ``fit`` and ``compare``; either may be empty
    states : what analyses know of each point besides its rows, see ``comparison.state_of``; rows
        alone, as those of a figure, have no points that are left out
    """

    def __init__(
        self, fits: Sequence[Row], compared: Sequence[Row], states: Sequence[Row] = ()
    ) -> None:
        self.fits, self.compared = list(fits), list(compared)
        self.theories = one_theory(self.compared)
        labels = (point_label(row["parameters"]) for row in (*states, *fits, *compared))
        self.labels = list(dict.fromkeys(labels))
        self.states = {point_label(one["parameters"]): one for one in states}

    # One point.

    def at(self, label: str) -> str:
        """What holds at a point, without a full stop; empty if nothing is known."""
        rows, laws = self._rows(label), self._laws(label)
        ratios = [row for row in rows if row["quantity"] in RATIOS]
        others = [row for row in rows if row not in ratios]
        known = [text for row in ratios for text in (beside(row), *self._change(label, row))]
        known += self._law_of_decay(laws, {row["quantity"] for row in rows})
        when = " after the relaxation" if "cooling" in self._kinds(label) else ""
        for row in others:
            if self._is_new(row, rows):
                relaxed = when * (row["quantity"] == quantities.RATIO.name)
                known.append(beside(row).replace(" =", f"{relaxed} =", 1))
        known += self._differing_checks(label)
        known += self._stationary(label)
        about = laws[:1] if laws else rows[-1:]
        return _sentence([*known, *_reservations(about)] if known else [])

    @property
    def lines(self) -> list[str]:
        """What holds at each point, after its label; of several points first of all together."""
        each = [f"{label}: {text}" for label in self.labels if (text := self.at(label))]
        together = [f"{counted(len(self.labels), 'point')}: {self.overview}"] * bool(self.overview)
        return together * (len(self.labels) > 1) + each

    def _rows(self, label: str) -> Records:
        """The main rows of a point with the theory of all points, or else without a theory."""
        own = [row for row in self.compared if point_label(row["parameters"]) == label]
        rows = main_rows(own, self.theories)
        there = {row["quantity"] for row in rows}
        others = [row for row in main_rows(own) if row["quantity"] not in there]
        rows += [row for row in others if not is_theory(row)]
        return sorted(rows, key=lambda row: MAIN.index(QUANTITIES[row["quantity"]]))

    def _laws(self, label: str) -> Records:
        """Fits to the energy of a point, that of the law which holds longest first."""
        laws = [
            dict(row) for row in self.fits if cools(row) and point_label(row["parameters"]) == label
        ]
        return sorted(laws, key=lambda row: (-(row["holds_to"] or 0.0), row["model"] != "haff"))

    def _law_of_decay(self, laws: Records, compared: set[str]) -> Iterator[str]:
        """The law that holds longest with its constant; α follows beside its theory."""
        if not laws:
            return
        law = laws[0]
        if law["value"] is None:
            yield "The energy has no fit"
            return
        yield verdict(law)
        if law["model"] != "haff" or quantities.HAFF_RATE.name not in compared:
            yield f"{LAWS[law['model']].symbol} = {with_error(law['value'], law['error'], '1/s')}"

    def _stationary(self, label: str) -> Iterator[str]:
        """Whether a gas that walls keep warm is stationary, where it was compared."""
        stationary = self.states.get(label, {}).get("stationary")
        if stationary is not None:
            yield _about_the_gas(stationary["sentence"])

    def _kinds(self, label: str) -> list[str]:
        """What decides the main quantities of a point; empty if it is not known."""
        return list(self.states.get(label, {}).get("kinds", ()))

    def _change(self, label: str, row: Row) -> Iterator[str]:
        """A remark on a ratio of temperatures that still changes, or was not tested."""
        change = self.states.get(label, {}).get("changes", {}).get(row["quantity"])
        if change:
            yield change["sentence"]

    def _is_new(self, row: Row, rows: Records) -> bool:
        """PV/NT beside an ideal gas says little where another main quantity has a theory."""
        return is_theory(row) or row["model"] == NO_THEORY or len(rows) == 1

    def _differing_checks(self, label: str) -> Iterator[str]:
        """Checks of a point that differ from theory."""
        for one in CHECKS:
            for row in self._of(one):
                if point_label(row["parameters"]) == label and _differs(row):
                    yield _differing(row)

    def _of(self, one: Quantity) -> Records:
        """The rows of a quantity with its theory."""
        return [
            dict(row)
            for row in self.compared
            if row["quantity"] == one.name and row["model"] == self.theories.get(one.name)
        ]

    # All points together.

    @cached_property
    def overview(self) -> str:
        """What holds for all points together, without a full stop; empty if nothing is known."""
        ratios = [one for one in MAIN if one.name in RATIOS]
        others = [one for one in (*MAIN, *CHECKS) if one not in ratios]
        parts = [*self._each_together(ratios), *self._changes_together()]
        parts += [*self._laws_together(), *self._each_together(others)]
        parts += self._stationary_together()
        haff = [row for row in self.fits if cools(row) and row["model"] == "haff"]
        return _sentence([*parts, *_reservations([*haff, *main_rows(self.compared)])])

    def _each_together(self, chosen: Iterable[Quantity]) -> Iterator[str]:
        """What holds of these quantities, of those that have rows."""
        for one in chosen:
            if rows := self._of(one):
                yield from self._together(one, rows)

    def _laws_together(self) -> Iterator[str]:
        """At how many points Haff's law is refused."""
        haff = [row for row in self.fits if cools(row) and row["model"] == "haff"]
        judged = [row for row in haff if row["probability"] is not None]
        refused = [row for row in judged if _is_refused(row)]
        if judged:
            found = (
                f"refused {_at(refused, judged)}" if refused else f"not refused {_at([], judged)}"
            )
            yield f"Haff's law is {found}"
        if rest := [row for row in haff if row["probability"] is None]:
            places = _places(rest)
            yield f"Haff's law is not tested at {places} (too few repeats or collisions)"

    def _stationary_together(self) -> Iterator[str]:
        """Which gases that walls keep warm have a stationary part."""
        warm = [one for one in self.states.values() if one["stationary"]]
        lacking = [one for one in warm if not one["stationary"]["found"]]
        settled = [one for one in warm if one not in lacking]
        if warm:
            found = _at(settled, warm, named=False) if settled else "at no point"
            yield f"the gas is not refused as stationary {found}"
        if lacking:
            yield f"left out: {_places(lacking)} ({_reason(lacking)})"

    def _together(self, one: Quantity, rows: Records) -> Iterator[str]:
        """A quantity at all points: the worst disagreement with theory, and what is left out."""
        if not is_theory(rows[0]):
            alone = {row["quantity"] for row in main_rows(self.compared)} == {one.name}
            if alone or one is not quantities.RATIO:
                yield _range_of(one, rows)
            return
        known = [row for row in rows if errors_of(row) is not None]
        if not known:
            if one in MAIN:
                yield f"{one.symbol} has too few repeats at all points for a test of theory"
            return
        worst = max(known, key=lambda row: abs(row["difference_in_errors"]))
        theory, differing = theory_name(worst), [row for row in known if _differs(row)]
        number = f"{abs(worst['difference_in_errors']):.1f} errors"
        name = one.symbol if one in MAIN else f"the {one.name}"
        if differing:
            value = with_error(worst["measured"], worst["error"], one.unit_text)
            at = _at(differing, known, named=not differing[1:])
            at += f", most in errors at {_place(worst)}" if differing[1:] else ""
            far = f"{value} is {distance(worst)} it ({number})"
            yield f"{name} differs from {theory} {at}: {far}"
        if one in CHECKS:
            return
        if not differing:
            most = f"at most {number}, at {_place(worst)}: {distance(worst)}"
            if not known[1:]:
                most = f"{_from(worst)}{number}"
            yield f"{name} agrees with {theory} {_at(known, known)} ({most})"
            yield from _jointly(known, theory)
        yield from self._left_out(one, known)

    def _left_out(self, one: Quantity, known: Records) -> Iterator[str]:
        """The points without a value of this quantity beside its theory, and why."""
        there = {point_label(row["parameters"]) for row in known}
        reasons: dict[str, list[Row]] = {}
        for label, state in self.states.items():
            if label in there or not {*one.main_of} & {*state["kinds"]}:
                continue
            if state["stationary"] and not state["stationary"]["found"]:
                continue  # named before
            reasons.setdefault(self._lack(one, label, state), []).append(state)
        for why, states in reasons.items():
            yield f"{one.symbol} is left out at {_places(states)} ({why})"

    def _lack(self, one: Quantity, label: str, state: Row) -> str:
        """Why a point has no such value."""
        own = [row for row in self.compared if point_label(row["parameters"]) == label]
        if not state["repeats"]:
            return "no repeat is there"
        if any(
            row["quantity"] == one.name and row["model"] == self.theories[one.name] for row in own
        ):
            return "too few repeats"
        return "no theory" if any(row["quantity"] == one.name for row in own) else "not measured"

    def _changes_together(self) -> Iterator[str]:
        """At which points a ratio of temperatures still changes."""
        names = dict.fromkeys(name for one in self.states.values() for name in one["changes"])
        for name in names:
            tested = [one for one in self.states.values() if name in one["changes"]]
            refused = [one for one in tested if one["changes"][name]["refused"]]
            if refused:
                yield f"{name} still changes {_at(refused, tested)}, and its mean is not steady"


# Points and gases as words.


def _sentence(parts: Sequence[str]) -> str:
    """Parts as one sentence without a full stop."""
    text = "; ".join(parts)
    return f"T{text[1:]}" if text.startswith("the ") else text


def _about_the_gas(sentence: str) -> str:
    """A sentence on its stationary part with a subject."""
    return f"the gas is {sentence}" if sentence.startswith("not ") else sentence


def _differs(row: Row) -> bool:
    errors = errors_of(row)
    return errors is not None and abs(errors) > MOST_ERRORS


def _differing(row: Row) -> str:
    """``the energy from the walls is 5 % above what collisions take (4.0 errors)``."""
    number = f"{abs(row['difference_in_errors']):.1f} errors"
    return f"the {row['quantity']} is {distance(row)} {theory_name(row)} ({number})"


def _at(some: Sequence[Row], every: Sequence[Row], named: bool = True) -> str:
    """``at all 4 points``, ``at 2 of 4 points (cor=0.6 and cor=0.7)``, ``at any of 4 points``."""
    if not some:
        return f"at any of {len(every)} points" if every[1:] else f"at {_place(every[0])}"
    if len(some) == len(every):
        every_point = "both" if len(every) == 2 else f"all {len(every)}"
        return f"at {every_point} points" if every[1:] else f"at {_place(every[0])}"
    return f"at {len(some)} of {len(every)} points{f' ({_places(some)})' * named}"


def _place(row: Row) -> str:
    return point_label(row["parameters"])


def _places(rows: Sequence[Row]) -> str:
    """The labels of points, of many the first ones and their number."""
    labels = list(dict.fromkeys(map(_place, rows)))
    if len(labels) > MOST_NAMED:
        labels = [*labels[:MOST_NAMED], f"{len(labels) - MOST_NAMED} more"]
    return "; ".join(labels) if any(", " in label for label in labels) else listed(labels)


def _reason(states: Sequence[Row]) -> str:
    """Why points have no stationary part, as short as it is the same for all."""
    sentences = dict.fromkeys(one["stationary"]["sentence"] for one in states)
    return next(iter(sentences)) if len(sentences) == 1 else "not stationary, or too few repeats"


def _range_of(one: Quantity, rows: Records) -> str:
    """The least and the largest value, of a quantity without a theory of it."""
    ends = [pick(rows, key=lambda row: row["measured"]) for pick in (min, max)]
    values = [with_error(row["measured"], row["error"], one.unit_text) for row in ends]
    ideal = " (an ideal gas has 1)" if one is quantities.RATIO else ""
    if _place(ends[0]) == _place(ends[1]):
        return f"{one.symbol} = {values[0]} at {_place(ends[0])}{ideal}"
    least, largest = (f"{value} at {_place(row)}" for value, row in zip(values, ends, strict=True))
    return f"{one.symbol} is from {least} to {largest}{ideal}"


def _jointly(known: Records, theory: str) -> Iterator[str]:
    """Whether all points together agree with theory, by χ² of enough repeats at each."""
    enough = all(row["repeats"] >= ENOUGH_REPEATS for row in known)
    if len(known) > 1 and enough:
        p = joint_probability(np.array([row["difference_in_errors"] for row in known]))
        found = f"differ from {theory}" if p < LEAST_PROBABILITY else "do not refuse it"
        yield f"the {len(known)} points together {found} (χ², {chance(p)})"


def _reservations(rows: Sequence[Row]) -> Iterator[str]:
    """How many repeats behind rows ended early or are missing, each point counted once."""
    points = {point_label(row["parameters"]): row for row in rows}.values()
    total, early, requested = 0, 0, 0
    for row in points:
        repeats = row["simulated"] if "simulated" in row else row["repeats"] + row["failed"]
        total, early = total + repeats, early + repeats - row["complete"]
        requested += row["requested"]
    if early:
        of_all = f"all {total}" if early == total else f"{early} of {total}"
        sentence = "the repeat ended early" if total == 1 else f"{of_all} repeats ended early"
        judged = [row.get("judged_repeats") for row in points] == [total - early]
        yield f"{sentence}, and the law is judged on the others" if judged else sentence
    if total < requested:
        yield f"only {total} of {requested} repeats are there"
