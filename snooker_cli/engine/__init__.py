"""The simulator: arrays and floats in, a trace out. It knows no config, files or plots."""

from typing import TYPE_CHECKING

from snooker_cli.engine.conversion import CheckpointError, stands_still
from snooker_cli.engine.replay import (
    States,
    batch_series,
    is_short,
    nearest_times,
    replay,
    replayed,
    series,
    state_at,
    stored_times,
)
from snooker_cli.lazy_names import lazy_names

if TYPE_CHECKING:
    from snooker_cli.engine.simulation import share_done, simulate, simulate_batch, specialisation

__all__ = [
    "ENGINE_VERSION",
    "CheckpointError",
    "States",
    "batch_series",
    "is_short",
    "nearest_times",
    "replay",
    "replayed",
    "series",
    "share_done",
    "simulate",
    "simulate_batch",
    "specialisation",
    "stands_still",
    "state_at",
    "stored_times",
]

# Most commands replay events, and do not simulate.
__getattr__ = lazy_names(
    __name__, {"simulation": "share_done simulate simulate_batch specialisation"}
)

ENGINE_VERSION = 11
"""Goes up when the same config may give other bits; results of two versions are never mixed."""
