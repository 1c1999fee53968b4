"""Averages, predictions and the exact twin in ``snooker bench error``."""

import numpy as np

from snooker_cli.validation.accuracy_study import against_truth
from snooker_cli.validation.methods import all_methods

METHODS = all_methods((1e-3, 1e-4))


SEVEN = {
    "name": "seven",
    "description": "seven balls in a light container, not quite elastic",
    "collisions": 40,
    "rings": {"number": 1, "restitution": 0.9, "container_mass": 20.0},
}


def test_methods_beside_the_exact_twin():
    (found,) = against_truth(SEVEN, METHODS)
    assert (found["collisions"], found["checkpoints"][-1]) == (40, 40)
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
