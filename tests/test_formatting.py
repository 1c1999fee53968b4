"""Numbers, errors and lists as text."""

from __future__ import annotations

import math

from snooker_cli.formatting import (
    duration,
    exact,
    in_encoding,
    least_to_most,
    listed,
    point_label,
    short,
    size,
    with_error,
)


def test_values_with_errors() -> None:
    for value, error, text in (
        (1.8404, 0.0123, "1.840 ± 0.012"),
        (-0.5, 0.01, "−0.500 ± 0.010"),
        (1234.5, math.nan, "1234"),
        (3.2e-16, 1e-17, "(3.20 ± 0.10) × 10⁻¹⁶"),
        (4.9e-6, 3.9e-7, "(4.90 ± 0.39) × 10⁻⁶"),
        (-4.9e-6, 3.9e-5, "−0.000005 ± 0.000039"),
        (1234.4, 30.0, "1234 ± 30"),
        (12345.0, 300.0, "(1.234 ± 0.030) × 10⁴"),
        (-2.056e9, 3.5e7, "(−2.056 ± 0.035) × 10⁹"),
        (9.99996e9, 1e7, "(1.0000 ± 0.0010) × 10¹⁰"),
        (3.0, 3.5e7, "(0.0 ± 3.5) × 10⁷"),
        (1e308, 1e307, "(1.00 ± 0.10) × 10³⁰⁸"),
        (1.0, 1e-300, "(1 ± 1 × 10⁻³⁰⁰)"),
        (math.nan, 1e-3, "–"),
    ):
        assert with_error(value, error) == text


def test_plain_words_for_what_an_encoding_lacks() -> None:
    text = "α  (s⁻¹)  10⁻¹⁴ × 3 ± 1 m²  v₀ ≥ ½  “⟨v⟩” … é Σ µs 中"
    for encoding, expected in {
        "utf-8": text,
        "latin-1": "alpha  (s^-1)  10^-14 × 3 ± 1 m²  v0 >= ½  '<v>' ... é Sigma µs \\u4e2d",
        "cp437": "α  (s^-1)  10^-14 x 3 ± 1 m²  v0 ≥ ½  '<v>' ... é Σ µs \\u4e2d",
        "ascii": "alpha  (s^-1)  10^-14 x 3 +/- 1 m^2  v0 >= 1/2  '<v>' ... e Sigma us \\u4e2d",
    }.items():
        assert in_encoding(text, encoding) == expected
        expected.encode(encoding)
    # Columns stay where they are while there is room.
    assert in_encoding("α      1\nbeta   2", "ascii") == "alpha  1\nbeta   2"


def test_words() -> None:
    assert short(-2.5e-15, 2) == "−2.5 × 10⁻¹⁵"
    assert exact(9.000000000000002) == "9.000000000000002"
    assert exact(9.0) == "9"
    assert listed(["a", "b", "c"]) == "a, b and c"


def test_a_range_is_the_least_and_the_most_or_one() -> None:
    assert least_to_most([3, 1, 2], str) == "1 to 3"
    assert least_to_most(iter((0.12341, 0.12342))) == "0.123"  # of one text
    assert least_to_most({2000, 12}, "{:,}".format) == "12 to 2,000"


def test_durations_and_sizes_have_two_digits() -> None:
    seconds = [0.001, 1.04, 17.2, 119.0, 130.0, 9e4, 2e6, 1e12]
    assert [duration(second) for second in seconds] == [
        "a second", "1 s", "17 s", "120 s", "2.2 minutes", "25 hours", "23 days", "32,000 years"
    ]  # fmt: skip
    sizes = [10, 999_999, 1.35e9, 2.7e12]
    assert [size(number) for number in sizes] == ["10 bytes", "1 MB", "1.4 GB", "2.7 TB"]


def test_the_label_of_a_point_writes_null_as_what_it_stands_for() -> None:
    assert point_label({"cor": 0.8, "container.mass": None}) == "cor=0.8, container.mass=∞"
    assert point_label({"wall_cor": None, "a": False}) == "wall_cor=cor, a=false"
    assert point_label({"balls.rings": None}) == "balls.rings=null"
    assert point_label({}) == "all"
