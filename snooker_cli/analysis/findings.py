"""The results of a run in sentences: the main quantities of its gas, compared with theory.

`Findings` serves ``fit``, ``compare``, reports and Python. A quantity has the same theory at all
points. Each point has its result, or the reason why it has none.
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
    FEWEST_TESTED,
    LEAST_PROBABILITY,
    MOST_ERRORS,
    TOO_FEW,
    cannot_be_tested,
    joint_probability,
    verdict,
)
from snooker_cli.analysis.quantities import QUANTITIES, Quantity, main_quantities
from snooker_cli.analysis.run_analysis import JsonRows
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

MOST_NAMED = 3  # points that a sentence names
LARGE_FACTOR = 2.0  # from this many times theory on, a factor says more than a percentage

UNIFORM = "its theory is about a gas with one temperature"
"""What a reader of PV/NT has to know where walls make the gas uneven."""

RATIOS = (quantities.SPECIES_RATIO.name, quantities.SPIN_RATIO.name)
CHECKS = (quantities.GIVEN, quantities.ENERGY_LEFT)
"""Quantities that a finding has only where they differ from theory."""

JsonRow = Mapping[str, Any]


# A row as words.


def has_theory(row: JsonRow) -> bool:
    """Whether a row of ``compare`` has a theory. The ideal gas law does not count."""
    return row["model"] != NO_THEORY and not row["model"].startswith(IDEAL)


def theory_name(row: JsonRow) -> str:
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
} | {known.source: f"the simulations of {known.source}" for known in PUBLISHED_RATIOS}


def errors_from_theory(row: JsonRow) -> float | None:
    """The difference from theory in errors; ``None`` if too few repeats have one."""
    return row["difference_in_errors"] if row["repeats"] >= FEWEST_TESTED else None


def distance(row: JsonRow) -> str:
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
        return f"{_with_known_error(factor, error)} times"
    share = factor - 1
    percent = _with_known_error(100 * abs(share), None if error is None else 100 * error)
    return f"{percent} % {'below' if share < 0 else 'above'}"


def _with_known_error(value: float, error: float | None) -> str:
    """A number with its error; to two digits if the error is not known."""
    return with_error(value, error) if error else ratio(value)


def result_text(row: JsonRow) -> str:
    """``α = 0.697 ± 0.021 1/s``."""
    quantity = QUANTITIES[row["quantity"]]
    value = with_error(row["measured"], row["error"], quantity.unit_text)
    return f"{quantity.symbol} = {value}"


def result_and_theory(row: JsonRow) -> str:
    """A result with its theory: ``PV/NT = 2.9 ± 0.1 agrees with … (1 % above, 0.3 errors)``."""
    if row["model"] == NO_THEORY:
        return f"{result_text(row)} (there is no theory of it here)"
    if not has_theory(row):
        return f"{result_text(row)} (an ideal gas has {short(row['predicted'])})"
    errors, theory = errors_from_theory(row), theory_name(row)
    if errors is None:
        why = TOO_FEW if row["repeats"] < FEWEST_TESTED else "without an error"
        return f"{result_text(row)}, {distance(row)} {theory} ({why})"
    number = f"{abs(errors):.1f} errors"
    if abs(errors) <= MOST_ERRORS:
        return f"{result_text(row)} agrees with {theory} ({_distance_part(row)}{number})"
    return f"{result_text(row)} is {distance(row)} {theory} ({number})"


def _distance_part(row: JsonRow) -> str:
    """How far a result that agrees is from theory: ``1 % above, ``; empty without a difference."""
    return "" if row["difference"] == 0 else f"{distance(row)}, "


# One theory for a quantity.


def chosen_theories(compared: Iterable[JsonRow]) -> dict[str, str]:
    """One theory for each main quantity: that of most points; of equally many the later one.

    The rows of a point go from simple theories to better ones. A quantity without a theory has the
    model of its rows.
    """
    theories = {}
    rows = [row for row in compared if QUANTITIES[row["quantity"]] in (*main_quantities(), *CHECKS)]
    for name in dict.fromkeys(row["quantity"] for row in rows):
        candidates = [row for row in rows if row["quantity"] == name]
        if name == quantities.TEMPERATURE.name:  # the ideal gas law gives T of any gas from P
            candidates = [row for row in candidates if not row["model"].startswith(IDEAL)]
        candidates = [row for row in candidates if has_theory(row)] or candidates
        counts = Counter(row["model"] for row in candidates)
        last = {row["model"]: place for place, row in enumerate(candidates)}
        if counts:
            theories[name] = max(counts, key=lambda model: (counts[model], last[model]))
    return theories


def main_quantity_rows(
    compared: Sequence[JsonRow], chosen: Mapping[str, str] | None = None
) -> JsonRows:
    """The rows of main quantities with their chosen theories, in the order of the sentences.

    chosen : the theory of each quantity; without it those of `chosen_theories`
    """
    chosen = chosen_theories(compared) if chosen is None else chosen
    return [
        dict(row)
        for quantity in main_quantities()
        for row in compared
        if row["quantity"] == quantity.name and row["model"] == chosen.get(quantity.name)
    ]


def main_result(compared: Sequence[JsonRow]) -> JsonRows:
    """The rows of the first main quantity that half of the points have, or else of most of them.

    A row with a theory goes before others. A trend is about these rows.
    """
    rows = main_quantity_rows(compared)
    rows = [row for row in rows if has_theory(row)] or rows
    counts = Counter(row["quantity"] for row in rows)
    half = len({_label(row) for row in compared}) / 2
    name = next((name for name, count in counts.items() if count >= half), None)
    name = name or max(counts, key=lambda name: counts[name], default=None)
    return [row for row in rows if row["quantity"] == name]


# Laws of decay.


def cools(fit: JsonRow) -> bool:
    """Whether a fit is that of the energy of a gas that loses energy."""
    return bool(fit["quantity"] == "kinetic_energy" and not fit["elastic"])


def few_repeats(fits: Sequence[JsonRow]) -> list[str]:
    """``FEW_REPEATS`` if few repeats do not refuse one of these laws, up to some time.

    A verdict that they cannot test a law says it already.
    """
    known = (row for row in fits if row["probability"] is not None)
    judged = (row for row in known if not cannot_be_tested(row))
    few = (row for row in judged if row["judged_repeats"] < ENOUGH_REPEATS)
    return [FEW_REPEATS] if any(row["holds_to"] > row["judged_from"] for row in few) else []


def _is_refused(law: JsonRow) -> bool:
    return bool(law["holds_to"] < law["judged_to"])


class Findings:
    """What holds at points: of each point by its label, and of all of them together.

    fits, compared : rows of ``fit`` and ``compare``; either may be empty
    states : what analyses know of each point besides its rows, see ``comparison.state_of``; rows
        alone, as those of a figure, have no points that are left out
    """

    def __init__(
        self, fits: Sequence[JsonRow], compared: Sequence[JsonRow], states: Sequence[JsonRow] = ()
    ) -> None:
        self.fits, self.compared = list(fits), list(compared)
        self.theories = chosen_theories(self.compared)
        labels = (_label(row) for row in (*states, *fits, *compared))
        self.labels = list(dict.fromkeys(labels))
        self.states = {_label(state): state for state in states}

    # One point.

    def at_point(self, label: str) -> str:
        """What holds at a point, without a full stop; empty if nothing is known."""
        rows, laws = self._rows(label), self._laws(label)
        ratios = [row for row in rows if row["quantity"] in RATIOS]
        others = [row for row in rows if row not in ratios]
        known = [
            text for row in ratios for text in (result_and_theory(row), *self._change(label, row))
        ]
        known += self._clusters(label)
        known += self._law_of_decay(laws, {row["quantity"] for row in rows})
        when = " after the relaxation" if "cooling" in self._kinds(label) else ""
        for row in others:
            if self._says_enough(row, rows):
                relaxed = when * (row["quantity"] == quantities.RATIO.name)
                known.append(result_and_theory(row).replace(" =", f"{relaxed} =", 1))
        known += self._uneven(rows, self._kinds(label))
        known += self._differing_checks(label)
        known += self._stationary(label)
        about = laws[:1] if laws else rows[-1:]
        return _sentence([*known, *_reservations(about)] if known else [])

    @property
    def lines(self) -> list[str]:
        """What holds at each point, after its label; of several points first of all together."""
        singly = [f"{label}: {text}" for label in self.labels if (text := self.at_point(label))]
        together = [f"{counted(len(self.labels), 'point')}: {self.overview}"] * bool(self.overview)
        return together * (len(self.labels) > 1) + singly

    def _rows(self, label: str) -> JsonRows:
        """The main rows of a point with the theory of all points, or else without a theory."""
        compared = [row for row in self.compared if _label(row) == label]
        rows = main_quantity_rows(compared, self.theories)
        known = {row["quantity"] for row in rows}
        others = [row for row in main_quantity_rows(compared) if row["quantity"] not in known]
        rows += [row for row in others if not has_theory(row)]
        return sorted(rows, key=lambda row: main_quantities().index(QUANTITIES[row["quantity"]]))

    def _laws(self, label: str) -> JsonRows:
        """Fits to the energy of a point, that of the law which holds longest first."""
        laws = [dict(row) for row in self.fits if cools(row) and _label(row) == label]
        return sorted(laws, key=lambda row: (-(row["holds_to"] or 0.0), row["model"] != "haff"))

    def _law_of_decay(self, laws: JsonRows, compared: set[str]) -> Iterator[str]:
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

    def _uneven(self, rows: JsonRows, kinds: Sequence[str]) -> Iterator[str]:
        """A remark on the theory of PV/NT in a gas that walls make uneven."""
        is_ratio = (row["quantity"] == quantities.RATIO.name and has_theory(row) for row in rows)
        if "uneven" in kinds and any(is_ratio):
            yield UNIFORM

    def _clusters(self, label: str = "") -> Iterator[str]:
        """Where theory expects clusters: at a point, or at all points."""
        name = quantities.CRITICAL_RATIO.name
        rows = [row for row in self.compared if row["quantity"] == name]
        rows = [row for row in rows if not label or _label(row) == label]
        beyond = [row for row in rows if row["measured"] > 1]
        if beyond:
            most = ratio(max(row["measured"] for row in beyond))
            where = f" {_at_points(beyond, rows)}" if rows[1:] else ""
            equals = f"{name} = {most}" if not beyond[1:] else f"{name} is up to {most}"
            yield f"theory expects vortices and then clusters{where} ({equals})"

    def _stationary(self, label: str) -> Iterator[str]:
        """Whether a gas that walls keep warm is stationary, where it was compared."""
        stationary = self.states.get(label, {}).get("stationary")
        if stationary is not None:
            yield _about_the_gas(stationary["sentence"])

    def _kinds(self, label: str) -> list[str]:
        """The kinds of gas of a point, which decide its main quantities; empty if not known."""
        return list(self.states.get(label, {}).get("kinds", ()))

    def _change(self, label: str, row: JsonRow) -> Iterator[str]:
        """A remark on a ratio of temperatures: whether it is steady, or was not tested."""
        change = self.states.get(label, {}).get("changes", {}).get(row["quantity"])
        if change:
            yield change["sentence"]

    def _says_enough(self, row: JsonRow, rows: JsonRows) -> bool:
        """Whether a sentence mentions a row; PV/NT of an ideal gas says little beside a theory."""
        return has_theory(row) or row["model"] == NO_THEORY or len(rows) == 1

    def _differing_checks(self, label: str) -> Iterator[str]:
        """Checks of a point that differ from theory."""
        for quantity in CHECKS:
            for row in self._rows_of(quantity):
                if _label(row) == label and _differs(row):
                    yield _differing(row)

    def _rows_of(self, quantity: Quantity) -> JsonRows:
        """The rows of a quantity with its chosen theory."""
        return [
            dict(row)
            for row in self.compared
            if row["quantity"] == quantity.name and row["model"] == self.theories.get(quantity.name)
        ]

    # All points together.

    @cached_property
    def overview(self) -> str:
        """What holds for all points together, without a full stop; empty if nothing is known."""
        ratios = [quantity for quantity in main_quantities() if quantity.name in RATIOS]
        others = [quantity for quantity in (*main_quantities(), *CHECKS) if quantity not in ratios]
        parts = [*self._quantities_together(ratios), *self._changes_together()]
        parts += [*self._clusters(), *self._laws_together(), *self._quantities_together(others)]
        kinds = [kind for label in self.labels for kind in self._kinds(label)]
        parts += self._uneven(self._rows_of(quantities.RATIO), kinds)
        parts += self._stationary_together()
        haff = [row for row in self.fits if cools(row) and row["model"] == "haff"]
        return _sentence([*parts, *_reservations([*haff, *main_quantity_rows(self.compared)])])

    @property
    def verdict(self) -> str:
        """The main result in plain words, without its numbers, as the end of a sentence.

        Empty if nothing is known.
        """
        warm = [state for state in self.states.values() if state["stationary"]]
        if warm and not any(state["stationary"]["found"] for state in warm):
            return "no stationary part was found"
        if [*self._clusters()]:
            return "theory expects clusters"
        for quantity in main_quantities():
            if rows := self._rows_of(quantity):
                return self._plainly(quantity, rows)
        return ""

    def _plainly(self, quantity: Quantity, rows: JsonRows) -> str:
        """Whether a quantity agrees with its theory; without a theory or a test its values."""
        known = [row for row in rows if errors_from_theory(row) is not None]
        if not known or not has_theory(rows[0]):
            return _range_of(quantity, rows) if rows[1:] else result_text(rows[0])
        differing = [row for row in known if _differs(row)]
        chosen = differing or known
        where = f" {_at_points(chosen, known, named=False)}" if self.labels[1:] else ""
        sides = {row["difference"] > 0 for row in differing}
        how = ("is above" if sides.pop() else "is below") if len(sides) == 1 else "differs from"
        how = how if differing else "agrees with"
        name = f"the {quantity.words}" if quantity.words[0].islower() else quantity.words
        return f"{name} {how} {theory_name(known[0])}{where}"

    def _quantities_together(self, chosen: Iterable[Quantity]) -> Iterator[str]:
        """What holds of those of these quantities that have rows."""
        for quantity in chosen:
            if rows := self._rows_of(quantity):
                yield from self._quantity_together(quantity, rows)

    def _laws_together(self) -> Iterator[str]:
        """At how many points Haff's law is refused."""
        haff = [row for row in self.fits if cools(row) and row["model"] == "haff"]
        judged = [row for row in haff if row["probability"] is not None]
        refused = [row for row in judged if _is_refused(row)]
        if judged:
            outcome = (
                f"refused {_at_points(refused, judged)}"
                if refused
                else f"not refused {_at_points([], judged)}"
            )
            yield f"Haff's law is {outcome}"
        if rest := [row for row in haff if row["probability"] is None]:
            yield f"Haff's law is not tested at {_labels(rest)} (too few repeats or collisions)"

    def _stationary_together(self) -> Iterator[str]:
        """Which gases that walls keep warm have a stationary part."""
        warm = [state for state in self.states.values() if state["stationary"]]
        lacking = [state for state in warm if not state["stationary"]["found"]]
        settled = [state for state in warm if state not in lacking]
        if warm:
            where = _at_points(settled, warm, named=False) if settled else "at no point"
            yield f"the gas is not refused as stationary {where}"
        if lacking:
            yield f"left out: {_labels(lacking)} ({_reason(lacking)})"

    def _quantity_together(self, quantity: Quantity, rows: JsonRows) -> Iterator[str]:
        """A quantity at all points: the worst disagreement with theory, and what is left out."""
        if not has_theory(rows[0]):
            names = {row["quantity"] for row in main_quantity_rows(self.compared)}
            if names == {quantity.name} or quantity is not quantities.RATIO:
                yield _range_of(quantity, rows)
            return
        known = [row for row in rows if errors_from_theory(row) is not None]
        if not known:
            if quantity in main_quantities():
                yield f"{quantity.symbol} has too few repeats at all points for a test of theory"
            return
        worst = max(known, key=lambda row: abs(row["difference_in_errors"]))
        theory, differing = theory_name(worst), [row for row in known if _differs(row)]
        number = f"{abs(worst['difference_in_errors']):.1f} errors"
        name = quantity.symbol if quantity in main_quantities() else f"the {quantity.name}"
        if differing:
            value = with_error(worst["measured"], worst["error"], quantity.unit_text)
            where = _at_points(differing, known, named=not differing[1:])
            where += f", most in errors at {_label(worst)}" if differing[1:] else ""
            far = f"{value} is {distance(worst)} it ({number})"
            yield f"{name} differs from {theory} {where}: {far}"
        if quantity in CHECKS:
            return
        if not differing:
            most = f"at most {number}, at {_label(worst)}: {distance(worst)}"
            if not known[1:]:
                most = f"{_distance_part(worst)}{number}"
            yield f"{name} agrees with {theory} {_at_points(known, known)} ({most})"
            yield from _jointly(known, theory)
        yield from self._left_out(quantity, known)

    def _left_out(self, quantity: Quantity, known: JsonRows) -> Iterator[str]:
        """The points that have no value of this quantity with its theory, and why."""
        with_value = {_label(row) for row in known}
        reasons: dict[str, list[JsonRow]] = {}
        for label, state in self.states.items():
            if label in with_value or not {*quantity.main_of} & {*state["kinds"]}:
                continue
            if state["stationary"] and not state["stationary"]["found"]:
                continue  # named before
            reasons.setdefault(self._absence(quantity, label, state), []).append(state)
        for why, states in reasons.items():
            yield f"{quantity.symbol} is left out at {_labels(states)} ({why})"

    def _absence(self, quantity: Quantity, label: str, state: JsonRow) -> str:
        """Why a point has no value of this quantity with its theory."""
        compared = [row for row in self.compared if _label(row) == label]
        models = {row["model"] for row in compared if row["quantity"] == quantity.name}
        if not state["repeats"]:
            return "no repeat is there"
        if models and self.theories[quantity.name] in models:
            return "too few repeats"
        return "no theory" if models else "not measured"

    def _changes_together(self) -> Iterator[str]:
        """At which points a ratio of temperatures is not steady."""
        names = dict.fromkeys(name for state in self.states.values() for name in state["changes"])
        for name in names:
            tested = [state for state in self.states.values() if name in state["changes"]]
            refused = [state for state in tested if state["changes"][name]["refused"]]
            if refused:
                where = _at_points(refused, tested)
                yield f"{name} is not steady {where}"


# Points and gases as words.


def _sentence(parts: Sequence[str]) -> str:
    """Parts as one sentence without a full stop."""
    text = "; ".join(parts)
    return f"T{text[1:]}" if text.startswith("the") else text


def _about_the_gas(sentence: str) -> str:
    """A sentence on the stationary part of a gas, with the gas as its subject."""
    return f"the gas is {sentence}" if sentence.startswith("not ") else sentence


def _differs(row: JsonRow) -> bool:
    errors = errors_from_theory(row)
    return errors is not None and abs(errors) > MOST_ERRORS


def _differing(row: JsonRow) -> str:
    """``the energy from the walls is 5 % above what collisions take (4.0 errors)``."""
    number = f"{abs(row['difference_in_errors']):.1f} errors"
    return f"the {row['quantity']} is {distance(row)} {theory_name(row)} ({number})"


def _at_points(some: Sequence[JsonRow], every: Sequence[JsonRow], named: bool = True) -> str:
    """``at all 4 points``, ``at 2 of 4 points (cor=0.6 and cor=0.7)``, ``at any of 4 points``."""
    if not some:
        return f"at any of {len(every)} points" if every[1:] else f"at {_label(every[0])}"
    if len(some) == len(every):
        every_point = "both" if len(every) == 2 else f"all {len(every)}"
        return f"at {every_point} points" if every[1:] else f"at {_label(every[0])}"
    return f"at {len(some)} of {len(every)} points{f' ({_labels(some)})' * named}"


def _label(row: JsonRow) -> str:
    return point_label(row["parameters"])


def _labels(rows: Sequence[JsonRow]) -> str:
    """The labels of points; of many points the first ones, and how many more there are."""
    labels = list(dict.fromkeys(map(_label, rows)))
    if len(labels) > MOST_NAMED:
        labels = [*labels[:MOST_NAMED], f"{len(labels) - MOST_NAMED} more"]
    return "; ".join(labels) if any(", " in label for label in labels) else listed(labels)


def _reason(states: Sequence[JsonRow]) -> str:
    """Why points have no stationary part; a short reason if they have different ones."""
    sentences = dict.fromkeys(state["stationary"]["sentence"] for state in states)
    return next(iter(sentences)) if len(sentences) == 1 else "not stationary, or too few repeats"


def _range_of(quantity: Quantity, rows: JsonRows) -> str:
    """The least and the largest value, of a quantity without a theory of it."""
    ends = [pick(rows, key=lambda row: row["measured"]) for pick in (min, max)]
    values = [with_error(row["measured"], row["error"], quantity.unit_text) for row in ends]
    ideal = " (an ideal gas has 1)" if quantity is quantities.RATIO else ""
    if _label(ends[0]) == _label(ends[1]):
        return f"{quantity.symbol} = {values[0]} at {_label(ends[0])}{ideal}"
    least, largest = (f"{value} at {_label(row)}" for value, row in zip(values, ends, strict=True))
    return f"{quantity.symbol} is from {least} to {largest}{ideal}"


def _jointly(known: JsonRows, theory: str) -> Iterator[str]:
    """Whether all points together agree with theory, by χ² of enough repeats at each."""
    enough = all(row["repeats"] >= ENOUGH_REPEATS for row in known)
    if len(known) > 1 and enough:
        p = joint_probability(np.array([row["difference_in_errors"] for row in known]))
        outcome = f"differ from {theory}" if p < LEAST_PROBABILITY else "do not refuse it"
        yield f"the {len(known)} points together {outcome} (χ², {chance(p)})"


def _reservations(rows: Sequence[JsonRow]) -> Iterator[str]:
    """How many repeats of the rows ended early or are missing; each point counts once."""
    points = {_label(row): row for row in rows}.values()
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
