"""Sentences on laws of decay: p, and beside it how far the law is from the energy."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import stats

from snooker_cli.analysis.goodness import (
    ENOUGH_REPEATS,
    FAR,
    largest_speed_difference,
    verdict,
)


def law(**changes: Any) -> dict[str, Any]:
    """A row of ``fit.json``, of a law that three repeats do not refuse."""
    row = {"model": "haff", "probability": 0.045, "judged_repeats": 3, "judged_from": 0.1}
    row |= {"judged_to": 3.0, "holds_to": 3.0, "end_over_fit": 1.2, "end_over_fit_error": 0.1}
    return row | changes


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, "Haff's law is not refused up to 3 s by 3 repeats (p = 0.045; {})"),
        ({"holds_to": 1.0}, "Haff's law is refused after 1 of 3 s (p = 0.045; {})"),
        ({"holds_to": 0.1, "model": "exponential"}, "The exponential law does not hold (p = {})"),
    ],
)
def test_a_verdict_has_a_size_beside_p(changes: dict[str, Any], words: str) -> None:
    size = "the energy at the end is 1.20 ± 0.10 times the law's"
    if "model" in changes:
        size = f"0.045; {size}"
    assert verdict(law(**changes)) == words.format(size)


def test_few_repeats_cannot_test_a_law_that_is_far_from_the_energy() -> None:
    """A gas that clusters: its energy is 43 times the law, and three repeats do not refuse it."""
    far = law(end_over_fit=43.0, end_over_fit_error=21.0)
    assert verdict(far) == (
        "3 repeats cannot test Haff's law (p = 0.045): "
        "the energy at the end is 43 ± 21 times the law's"
    )
    for factor in (1.01 * FAR, 0.99 / FAR):
        assert "cannot test" in verdict(law(end_over_fit=factor))
    for factor in (0.99 * FAR, 1.01 / FAR):
        assert "is not refused" in verdict(law(end_over_fit=factor))
    enough = {**far, "judged_repeats": ENOUGH_REPEATS}
    assert verdict(enough).startswith("Haff's law is not refused up to 3 s by 20 repeats")
    assert "43 ± 21 times" in verdict(enough)


def test_a_verdict_without_a_test_or_a_size_says_so() -> None:
    untested = law(probability=None, holds_to=None, end_over_fit=None)
    assert verdict(untested) == "Haff's law is not tested (too few repeats or collisions)"
    assert verdict(law(end_over_fit=None)).endswith("by 3 repeats (p = 0.045)")


# The law of speeds.


def largest_differences(edges: np.ndarray, number: int, states: int, rows: int) -> np.ndarray:
    """D of samples of states whose balls share one energy at random."""
    rng = np.random.default_rng(5)
    shares = rng.dirichlet(np.ones(number), (rows, states)) * number
    law = 1 - (1 - np.minimum(edges**2 / number, 1.0)) ** (number - 1)
    below = (np.sqrt(shares)[..., np.newaxis] < edges).mean(axis=(1, 2))
    return np.asarray(np.abs(below - law).max(axis=1))


@pytest.mark.parametrize(("number", "states"), [(5, 80), (37, 10), (200, 4)])
def test_differences_of_speeds_are_those_of_states_at_fixed_energy(
    number: int, states: int
) -> None:
    """Beside direct samples; independent speeds would have larger ones."""
    edges = np.arange(1, 26) * 0.125
    found = largest_differences(edges, number, states, 2000)
    for share in (0.5, 0.9, 0.98):
        distance = float(np.quantile(found, share))
        law = largest_speed_difference(distance, edges, number, number * states)
        error = math.sqrt(share * (1 - share) / 2000)
        assert law.probability == pytest.approx(1 - share, abs=4 * error + 0.02)
        assert law.mean == pytest.approx(found.mean(), rel=0.05)
        scaled = distance * math.sqrt(number * states)
        assert law.probability < stats.kstwobign.sf(scaled)


def test_a_speed_difference_far_outside_has_a_small_probability() -> None:
    edges = np.arange(1, 26) * 0.125
    laws = [largest_speed_difference(d, edges, 37, 10_000) for d in (0.02, 0.05, 0.5)]
    assert laws[0].probability < 0.01
    assert 0 < laws[1].probability < 1e-10
    assert laws[2].probability < 1e-100
    assert math.isnan(largest_speed_difference(0.1, edges, 1, 100).probability)
