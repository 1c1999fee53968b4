"""What tests of the live page share: V8 with its scripts."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from live_scripts import LiveScripts


@pytest.fixture(scope="session")
def javascript() -> Iterator[LiveScripts]:
    with LiveScripts() as started:
        yield started
