"""A ball among the cells is one line of the processor's cache, part of it read in two ways."""

import numpy as np
from scenes import gas

from snooker_cli.engine import cell_memory as cm
from snooker_cli.engine.kernel_state import CLOCK, EVENTS, FORMER, HISTORY_ROWS, X
from snooker_cli.engine.simulation import AmongNeighbours


def test_each_ball_is_a_line_of_the_cache() -> None:
    balls, _ = cm.ball_memory(7)
    assert balls.shape == (cm.CELL_BALL_ROWS, 7)
    assert balls.strides == (8, cm.LINE)
    assert balls.ctypes.data % cm.LINE == 0
    links = AmongNeighbours([gas("box", 7, 0.2)], 1, None).search.cells.links
    assert links.strides == (4, cm.LINE // 2)


def test_the_history_is_the_last_eight_bytes() -> None:
    """It is not in the way of a number of the same ball, nor of another ball."""
    balls, history = cm.ball_memory(3)
    balls[X : cm.CROSSING_TIME + 1] = np.arange(1.0, 8.0)[:, np.newaxis]
    before = balls[: cm.CROSSING_TIME + 1].copy()
    history[EVENTS, 1], history[FORMER, 1] = 5, -1
    assert np.array_equal(balls[: cm.CROSSING_TIME + 1], before)
    assert balls[:, 1].tobytes()[56:] == np.array([5, -1], np.int32).tobytes()
    assert balls[:, [0, 2]].T[:, 7].tobytes() == bytes(16)
    balls[CLOCK] = 0.0
    assert (history[EVENTS, 1], history[FORMER, 1]) == (5, -1)


def test_a_restored_copy_has_the_same_history_in_this_memory() -> None:
    run = AmongNeighbours([gas("box", 7, 0.2)], 100, None)
    run.chunk()
    again = AmongNeighbours([gas("box", 7, 0.2)], 100, None)
    again.restore(run.saved())
    for one in (run, again):
        assert np.shares_memory(one.states.history, one.states.balls)
    mine, its = again.states.history, run.states.history
    assert np.array_equal(mine[:, :HISTORY_ROWS], its[:, :HISTORY_ROWS])
    events = run.states.history[0, EVENTS].sum()
    assert events == run.state.collisions * 2 - run.state.counts[0]
