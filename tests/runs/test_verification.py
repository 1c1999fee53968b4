"""`verify` reads each file with a limit of memory."""

from __future__ import annotations

from pathlib import Path

import hostile
import pytest
from command_line import Snooker

from snooker_cli.runs import verification
from snooker_cli.runs.verification import limited_memory

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="memory is limited on Linux only"
)


def test_after_a_file_the_limit_is_the_old_one() -> None:
    with pytest.raises(MemoryError), limited_memory(10**8):
        bytes(10**9)
    assert len(bytes(10**9)) == 10**9


def test_a_file_without_memory_is_one_bad_file(
    finished: Path, snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other files are read."""
    path = finished / "point-0000" / "repeats-0000-0002.h5"
    hostile.provenance(machine="a" * 10**8)(path)
    monkeypatch.setattr(verification, "READING_MEMORY", 10**8)
    monkeypatch.setattr(verification, "MEMORY_PER_BYTE", 0)
    ended = snooker("verify", "small")
    assert (ended.code, ended.err) == (1, "")
    error, counts = ended.out.splitlines()
    assert error.startswith(f"{path.relative_to(finished.parents[1])}: needs more memory than")
    assert "3 complete repeats, 1 bad file" in counts
