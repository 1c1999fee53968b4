"""Experiments with inelastic hard disks. ``import snooker_cli as snooker`` has these names."""

from snooker_cli.lazy_names import lazy_names

TYPE_CHECKING = False  # type checkers take it as true; typing takes 10 ms to load
if TYPE_CHECKING:
    from snooker_cli.api.configs import check_config, template, templates, warm_up, write_template
    from snooker_cli.api.live_pages import LivePage, live
    from snooker_cli.api.repeats import Repeat
    from snooker_cli.api.results import Outcome, Plan, Records, SavedFigure, Verdicts
    from snooker_cli.api.runs import Run, figure_list, open, plugin_list, statuses, write_report
    from snooker_cli.api.scenes import new_scene, simulate
    from snooker_cli.api.side_by_side_analyses import SideBySide
    from snooker_cli.api.simulating import plan, run
    from snooker_cli.config.problems import ConfigError
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

_NAMES = {
    "api.side_by_side_analyses": "SideBySide",
    "api.configs": "check_config template templates warm_up write_template",
    "api.live_pages": "LivePage live",
    "api.repeats": "Repeat",
    "api.results": "Outcome Plan Records SavedFigure Verdicts",
    "api.runs": "Run figure_list open plugin_list statuses write_report",
    "api.scenes": "new_scene simulate",
    "api.simulating": "plan run",
    "config.problems": "ConfigError",
    "containers": "Box Channel Circle PeriodicBox",
    "errors": "FigureError RunError SceneError SnookerError StoreError UserError",
    "scene": "Scene",
    "trace": "Trace",
}
"""The names by their modules."""

__getattr__ = lazy_names(__name__, _NAMES)  # so that ``import snooker_cli`` takes no time


def __dir__() -> list[str]:
    return __all__
