"""A ball among the cells is one line of the processor's cache, part of it read in two ways."""

import numpy as np
from scenes import gas

from snooker_cli.engine import cell_memory as cm
from snooker_cli.engine.kernel_state import CLOCK, X
from snooker_cli.engine.simulation import InCells


def test_each_ball_is_a_line_of_the_cache() -> None:
    balls = cm.ball_memory(7)
    assert balls.shape == (cm.CELL_BALL_ROWS, 7)
    assert balls.strides == (8, cm.LINE)
    assert balls.ctypes.data % cm.LINE == 0
    links = InCells([gas("box", 7, 0.2)], 1, None).cells.links
    assert links.strides == (4, cm.LINE // 2)


def test_tags_are_the_last_eight_bytes() -> None:
    """They are not in the way of a number of the same ball, nor of another ball."""
    balls = cm.ball_memory(3)
    balls[X : cm.CROSSING_TIME + 1] = np.arange(1.0, 8.0)[:, np.newaxis]
    before = balls[: cm.CROSSING_TIME + 1].copy()
    tags = cm.tags_of(balls)
    tags[cm.EVENTS, 1], tags[cm.FORMER, 1] = 5, -1
    assert np.array_equal(balls[: cm.CROSSING_TIME + 1], before)
    assert balls[:, 1].tobytes()[56:] == np.array([5, -1], np.int32).tobytes()
    assert balls[:, [0, 2]].T[:, 7].tobytes() == bytes(16)
    balls[CLOCK] = 0.0
    assert (tags[cm.EVENTS, 1], tags[cm.FORMER, 1]) == (5, -1)


def test_an_engine_and_its_restored_copy_share_this_memory() -> None:
    """Writing the tags of a ball is writing the state that a checkpoint saves."""
    run = InCells([gas("box", 7, 0.2)], 100, None)
    run.chunk()
    again = InCells([gas("box", 7, 0.2)], 100, None)
    again.restore(run.saved())
    for engine in (run, again):
        assert np.shares_memory(engine.cells.tags, engine.states.balls)
        assert np.array_equal(engine.cells.tags, cm.tags_of(engine.states.balls[0]))
    assert np.array_equal(again.cells.tags[cm.EVENTS], run.cells.tags[cm.EVENTS])
    assert run.cells.tags[cm.EVENTS].sum() == run.state.collisions * 2 - run.state.counts[0]
