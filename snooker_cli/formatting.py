"""Numbers, lists and tables as text, the same in tables, figures and the report."""

import math
import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from decimal import Decimal
from typing import Any

MOST_PLACES, SMALL, LARGE = 8, 1e-5, 1e7  # decimal places, sizes of a value without a power of ten
DIGITS_OF_DOUBLE = 15

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def short(value: float | None, digits: int = 3) -> str:
    """A number with this many digits, very large or small as 1.2 × 10⁻¹⁵; a dash for none."""
    if value is None or not math.isfinite(value):
        return "–"
    text = f"{value:.{digits}g}"
    mantissa, separator, exponent = text.partition("e")
    if separator:
        text = f"{mantissa} × 10{str(int(exponent)).translate(_RAISED)}"
    return text.replace("-", "−")


def exact(value: float) -> str:
    """The shortest decimal number that reads back as this double."""
    return repr(float(value)).removesuffix(".0").replace("-", "−")


def with_error(value: float | None, error: float | None, unit: str = "") -> str:
    """``1.234 ± 0.012 s⁻¹``: the error to two digits, the value to the same place.

    Very large and very small numbers share a power of ten: ``(2.056 ± 0.035) × 10⁹``.
    """
    unit = f" {unit}" if unit else ""
    if value is None or error is None or not math.isfinite(value + error) or error <= 0:
        return f"{short(value, 4)}{unit}"
    places = 1 - math.floor(math.log10(error))
    if 0 <= places <= MOST_PLACES and max(abs(value), error) >= SMALL and abs(value) < LARGE:
        text = f"{value:.{places}f} ± {error:.{places}f}"
    else:
        largest = max(abs(value), error)
        digits = places + math.floor(math.log10(largest))
        if digits > DIGITS_OF_DOUBLE:  # the error is below the rounding of the value
            return f"({short(value, 4)} ± {short(error, 2)}){unit}"
        power = int(f"{largest:.{digits}e}".partition("e")[2])  # 9.996 may be rounded to 10
        pair = (f"{Decimal(number).scaleb(-power):.{places + power}f}" for number in (value, error))
        text = f"({' ± '.join(pair)}) × 10{str(power).translate(_RAISED)}"
    return f"{text.replace('-', '−')}{unit}"


def printable(text: str, kept: str = "") -> str:
    """Text of a file or a user without control characters, and others that print nothing.

    They are written as ``\\x1b`` or ``\\u202e``: they could rule a terminal or turn a line round.

    kept : characters that stay
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in kept else ascii(c)[1:-1] for c in text)


_WORDS = str.maketrans(
    {
        **dict(zip("−–—‐‑━╸╺‘’“”⟨⟩×·÷⁄µ≈\u00a0", "--------''''<>x*//u~ ", strict=True)),
        "±": "+/-",
        "≥": ">=",
        "≤": "<=",
        "→": "->",
        "√": "sqrt ",
        "∞": "infinity",
        "…": "...",
        "°": " degrees",
    }
)
"""Plain words for characters that have no ASCII letters in them."""

_GREEK = "GREEK (SMALL|CAPITAL) LETTER (FINAL )?([A-Z]+)"
_SPECIAL = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻ⁿ]+|[^\x00-\x7f]")


def in_encoding(text: str, encoding: str) -> str:
    """Text with plain words for what an encoding lacks: ``alpha = 1.2 +/- 0.1 s^-1``.

    Spaces between columns, two or more, become fewer as words become longer.
    """

    def plain_word(found: re.Match[str]) -> str:
        word = found[0]
        try:
            word.encode(encoding)
        except UnicodeEncodeError:
            return _plain_word(word)
        return word

    lines = []
    for line in text.split("\n"):
        plain, longer = "", 0
        for part in re.split("( {2,})", line):
            word = _SPECIAL.sub(plain_word, part)
            if part[:2] == "  ":
                word = " " * max(2, len(part) - longer)
            longer += len(word) - len(part)
            plain += word
        lines.append(plain)
    return "\n".join(lines)


def _plain_word(word: str) -> str:
    """ASCII for a character or for several raised ones: by its word, its name, or its letters."""
    if greek := re.fullmatch(_GREEK, unicodedata.name(word[0], "")):
        return greek[3].lower() if greek[1] == "SMALL" else greek[3].title()
    raised = "^" if unicodedata.decomposition(word[0]).startswith("<super>") else ""
    letters = unicodedata.normalize("NFKD", word.translate(_WORDS)).translate(_WORDS)
    bare = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return raised + bare.encode("ascii", "backslashreplace").decode("ascii")


TYPED = 10  # characters of a number that a user may have typed; longer ones are computed


def value_text(value: object) -> str:
    """The value of a swept key, as tables, figures and file names show it.

    A computed number, such as 0.6928571428571428 of a range, has six digits.
    """
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) and len(repr(value)) > TYPED:
        return f"{value:.6g}"
    return str(value)


def point_label(parameters: Mapping[str, object]) -> str:
    """A point's swept keys and values, as in ``cor=0.8, balls.radius=1.0``."""
    nulls = {"container.mass": "∞", "wall_cor": "cor"}  # what they stand for
    values = ((key, nulls.get(key) if v is None else v) for key, v in parameters.items())
    return printable(", ".join(f"{key}={value_text(v)}" for key, v in values)) or "all"


def listed(words: Sequence[str], last: str = "and") -> str:
    """``a, b and c``."""
    return f" {last} ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def counted(number: int, noun: str) -> str:
    """``1 repeat``, ``1,200 repeats``, ``2 batches``."""
    plural = "es" if noun.endswith("ch") else "s"
    return f"{number:,} {noun}{'' if number == 1 else plural}"


def size(number: float) -> str:
    """A number of bytes to two digits: ``520 kB``."""
    for unit, scale in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if number >= 0.95 * scale:
            return f"{rough(number / scale)} {unit}"
    return f"{number:.0f} bytes"


def rough(value: float) -> str:
    """A number of 1 or more to two digits: ``1.2``, ``17``, ``2,700``."""
    short = float(f"{value:.2g}")
    return f"{short:,.0f}" if short >= 10 else f"{short:g}"


def ratio(value: float | None) -> str:
    """A ratio to two digits, without a power of ten below a million; a dash for none."""
    return short(value, 2) if value is None or not 10 <= value < 1e6 else rough(value)


def probability(value: float | None) -> str:
    """A probability to two digits, ``<0.001`` below that; a dash for none."""
    return "<0.001" if value is not None and value < 0.001 else short(value, 2)


def percent(share: float) -> str:
    """A share in percent with two digits, or all before the point: ``1.3 %``, ``150 %``."""
    value = 100 * share
    return f"{value:.0f} %" if abs(value) >= 10 else f"{short(value, 2)} %"


def chance(value: float) -> str:
    """A probability in a sentence: ``p = 0.03``, ``p <0.001``."""
    return f"p {'' if value < 0.001 else '= '}{probability(value)}"


def plain(value: Any) -> Any:
    """A value as JSON has it: lists for arrays and tuples, ``None`` for what is not finite."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def duration(seconds: float) -> str:
    """A time in s to two digits: ``2.2 minutes``."""
    if seconds < 1.0:
        return "a second"
    units = {"years": 3.156e7, "days": 86400.0, "hours": 3600.0, "minutes": 60.0}
    for unit, length in units.items():
        if seconds >= 2 * length:
            return f"{rough(seconds / length)} {unit}"
    return f"{rough(seconds)} s"


def text_table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows under headings, columns as wide as their widest value.

    A heading that begins with ``>``, which is not shown, aligns its column on the right.
    """
    table = [[heading.removeprefix(">") for heading in headings], *rows]
    columns = zip(headings, zip(*table, strict=True), strict=True)
    forms = [f"{'>' if to[:1] == '>' else '<'}{max(map(len, cells))}" for to, cells in columns]
    lines = ([f"{cell:{form}}" for cell, form in zip(row, forms, strict=True)] for row in table)
    return ["  ".join(cells).rstrip() for cells in lines]


def least_to_most(values: Iterable[float], text: Callable[[Any], str] = short) -> str:
    """``2 to 5``: the texts of the least and the greatest value, or the one that both have."""
    known = [*values]
    return " to ".join(dict.fromkeys((text(min(known)), text(max(known)))))


def spans(numbers: Iterable[int]) -> str:
    """Rising whole numbers as a sentence has them: ``0 to 4 and 7``."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return listed([f"{run[0]} to {run[-1]}" if run[1:] else str(run[0]) for run in runs])


def range_held(row: Mapping[str, Any]) -> str:
    """``1.5/6.1``: until when the law of a row of fits holds, of the judged time (s)."""
    holds, end = short(row["holds_to"]), short(row["judged_to"])
    return "–" if holds == "–" else f"{holds}/{end}"
