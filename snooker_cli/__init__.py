"""Experiment runner for inelastic hard disks in a container; ``api`` has all that users import."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from snooker_cli.api import (
        Box,
        Circle,
        ConfigError,
        DamagedError,
        FigureError,
        PeriodicBox,
        Repeat,
        Run,
        RunError,
        Scene,
        SceneError,
        SnookerError,
        StoreError,
        Trace,
        UserError,
        new_scene,
        open,
        run,
        simulate,
    )

__version__ = "0.1.0"

__all__ = [
    "Box",
    "Circle",
    "ConfigError",
    "DamagedError",
    "FigureError",
    "PeriodicBox",
    "Repeat",
    "Run",
    "RunError",
    "Scene",
    "SceneError",
    "SnookerError",
    "StoreError",
    "Trace",
    "UserError",
    "new_scene",
    "open",
    "run",
    "simulate",
]


def __getattr__(name: str) -> Any:
    """A name of ``api``, which is loaded then: ``import snooker_cli`` alone takes no time."""
    if name in __all__:
        return getattr(import_module("snooker_cli.api"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
