"""Chunks packed by hand are what HDF5's own filters would read back."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from snooker_cli.store.hdf5 import packed

ROWS = 65536
GENERATOR = np.random.default_rng(1)
COLUMNS: dict[str, NDArray[Any]] = {
    "noise": GENERATOR.random(ROWS),
    "times": np.cumsum(GENERATOR.exponential(size=ROWS)),
    "one value": np.full(ROWS, 0.1),
    "zeros": np.zeros(ROWS),
    "steps": np.arange(1, ROWS + 1),
    "pairs": GENERATOR.integers(-1, 37, size=(ROWS, 1, 2), dtype=np.int32),
    "histogram": GENERATOR.integers(0, 9, size=(ROWS // 32, 32)),
    "half of it": np.where(np.arange(ROWS) % 2 == 0, GENERATOR.random(ROWS), 0.0),
}


def shuffled(values: NDArray[Any]) -> bytes:
    return values.view(np.uint8).reshape(-1, values.itemsize).T.tobytes()


@pytest.mark.parametrize("name", COLUMNS)
def test_zlib_reads_a_packed_chunk(name: str) -> None:
    values = COLUMNS[name]
    chunk = packed(values, len(values))
    assert zlib.decompress(chunk) == shuffled(values)
    # Stored blocks add 5 bytes for 65,535, so that nothing grows by more.
    assert len(chunk) <= values.nbytes * (1 + 1e-3)


@pytest.mark.parametrize("rows", [1, 2, 255, 4096, 65535])
def test_a_chunk_that_is_not_full_ends_in_zeros(rows: int) -> None:
    for values in COLUMNS.values():
        short = values[:rows]
        padded = np.zeros((ROWS, *values.shape[1:]), values.dtype)
        padded[: len(short)] = short
        assert zlib.decompress(packed(short, ROWS)) == shuffled(padded)


@pytest.mark.parametrize(("name", "most"), [("noise", 0.94), ("times", 0.75), ("zeros", 2 / 1032)])
def test_what_can_be_made_smaller_is(name: str, most: float) -> None:
    """Of 8 bytes of a random number below 1, the first is not noise; deflate takes 1/1032."""
    assert len(packed(COLUMNS[name], ROWS)) < most * COLUMNS[name].nbytes


def test_steps_take_next_to_nothing() -> None:
    assert len(packed(COLUMNS["steps"], ROWS)) < 0.1 * ROWS
