"""Where, when and with what something was measured, the same way in every measurement."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from snooker_cli import __version__
from snooker_cli.engine import ENGINE_VERSION

PROCESSORS = Path("/proc/cpuinfo")


def origin(what: str, began: datetime, *libraries: str) -> dict[str, Any]:
    """The head of a measurement's record.

    what : what was measured
    began : when
    libraries : whose versions matter, beside Python's
    """
    return {
        "measurement": what,
        "snooker": __version__,
        "engine_version": ENGINE_VERSION,
        "date": began.isoformat(timespec="seconds"),
        "machine": {
            "platform": platform.platform(),
            "processor": processor(),
            "processors": os.cpu_count(),
        },
        "versions": {"python": platform.python_version()}
        | {name: version(name) for name in libraries},
    }


def machine(measurement: Mapping[str, Any]) -> str:
    """What a measurement holds for, in words: processor and system."""
    said = measurement["machine"]
    return f"{said['processor']}, {said['platform']}"


def processor() -> str:
    """The processor's name, or at least its kind."""
    if PROCESSORS.exists():
        for line in PROCESSORS.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
