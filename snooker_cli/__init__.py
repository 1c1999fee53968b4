"""Experiments with inelastic hard disks. ``import snooker_cli as snooker`` has these names."""

TYPE_CHECKING = False  # type checkers take it as true; typing takes 10 ms to load
if TYPE_CHECKING:
    from snooker_cli.api import (
        LivePage,
        Outcome,
        Plan,
        Records,
        Repeat,
        Run,
        SavedFigure,
        SideBySide,
        Verdicts,
        check_config,
        figure_list,
        live,
        new_scene,
        open,
        plan,
        plugin_list,
        run,
        simulate,
        statuses,
        template,
        templates,
        warm_up,
        write_report,
        write_template,
    )
    from snooker_cli.config import ConfigError
    from snooker_cli.containers import Box, Channel, Circle, PeriodicBox
    from snooker_cli.errors import (
        FigureError,
        RunError,
        SceneError,
        SnookerError,
        StoreError,
        UserError,
    )
    from snooker_cli.scene import Scene
    from snooker_cli.trace import Trace

__version__ = "0.1.0"

__all__ = ["LivePage", "Outcome", "Plan", "Records", "Repeat", "Run", "SavedFigure"]
__all__ += ["SideBySide", "Verdicts"]
__all__ += ["check_config", "figure_list", "live", "new_scene", "open", "plan", "plugin_list"]
__all__ += ["run", "simulate"]
__all__ += ["statuses", "template", "templates", "warm_up", "write_report", "write_template"]
__all__ += ["Box", "Channel", "Circle", "PeriodicBox", "Scene", "Trace"]
__all__ += ["ConfigError", "FigureError", "RunError", "SceneError", "SnookerError"]
__all__ += ["StoreError", "UserError"]

_HOMES = ("errors", "containers", "scene", "trace", "config", "api")


def __getattr__(name: str) -> object:
    """A name of ``__all__``, whose module is loaded now: ``import snooker_cli`` takes no time."""
    if name in __all__:
        from importlib import import_module  # here, so that `snooker` begins sooner

        for home in _HOMES:
            if hasattr(module := import_module(f"{__name__}.{home}"), name):
                return getattr(module, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
