"""Averages, predictions and the exact twin in ``snooker bench error``."""

import math

import numpy as np
import pytest

from snooker_cli.validation.accuracy_study import (
    against_truth,
    averages,
    quantities,
)
from snooker_cli.validation.methods import ReferenceScene, all_methods, by_engine, rings

METHODS = all_methods((1e-3, 1e-4))


def seven(repeat=0):
    """Seven balls in a light container, not quite elastic."""
    return rings(repeat, number=1, restitution=0.9, container_mass=20.0)


SEVEN = ReferenceScene("seven", "seven balls", 40, seven)


def test_averages_are_compared_with_the_first_method():
    first, other = averages(SEVEN, (METHODS[0], METHODS[2]), 1.0, 5)["methods"]
    courses = [by_engine(seven(repeat), np.array([1.0])) for repeat in range(5)]
    values = [quantities(course, 1.0) for course in courses]
    assert [bias["quantity"] for bias in first["biases"]] == list(values[0])
    for bias in first["biases"]:
        column = np.array([value[bias["quantity"]] for value in values])
        assert bias["mean"] == pytest.approx(np.mean(column), rel=1e-14)
        assert bias["error"] == pytest.approx(np.std(column, ddof=1) / math.sqrt(5), rel=1e-12)
        assert bias["difference"] == 0.0
    assert (first["overlapping"], other["overlapping"]) == (0, 5)
    for a, b in zip(first["biases"], other["biases"], strict=True):
        assert b["difference"] == pytest.approx(b["mean"] - a["mean"], abs=1e-12)


def test_methods_beside_the_exact_twin():
    found = against_truth(SEVEN, METHODS)
    assert (found["certain"], found["collisions"], found["checkpoints"][-1]) == (40, 40, 40)
    engine, report, *steps = found["results"]
    for one in (engine, report):
        assert (one["first_different"], one["collisions"]) == (40, 40)
        assert one["place_errors"][0] < 1e-14
    for one in steps:
        assert np.all(engine["place_errors"] < one["place_errors"])
        assert one["first_different"] < 40
    # A tenth of the step makes a tenth of the error, before chaos.
    third = found["checkpoints"].index(5)
    assert steps[1]["place_errors"][third] < steps[0]["place_errors"][third]
