"""Results that are kept in memory: their owners, their order and their limit."""

import gc

import numpy as np

from snooker_cli.memory import Memory, size_of


class Owner:
    """An object with results."""


def test_results_of_deleted_objects_do_not_count() -> None:
    memory, owner = Memory(2000), Owner()
    kept = memory.keep("a", np.zeros(100), owner)
    for _ in range(9):
        memory.keep("a", np.zeros(100), Owner())
    gc.collect()
    assert memory.find("a", owner) is kept
    assert memory.size == 800


def test_the_limit_is_that_of_the_results_used_last() -> None:
    memory = Memory(2000)
    for key in ("a", "b"):
        memory.keep(key, np.zeros(100))
    assert memory.find("a") is not None
    memory.keep("c", np.zeros(100))
    assert [memory.find(key) is not None for key in "abc"] == [True, False, True]
    large = memory.get("large", lambda: np.zeros(1000))
    assert memory.get("large", lambda: np.ones(1)) is large
    assert memory.find("a") is None
    assert memory.size == size_of(large)
