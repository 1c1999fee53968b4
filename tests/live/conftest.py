"""What tests of the live page share: V8 with its scripts."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from javascript import JavaScript


@pytest.fixture(scope="session")
def javascript() -> Iterator[JavaScript]:
    with JavaScript() as started:
        yield started
