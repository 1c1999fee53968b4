"""The Python interface: ``import snooker_cli as snooker``, then ``run``, ``open`` or ``simulate``.

Units are SI with k_B = 1. Everything that a user can get wrong raises a ``SnookerError``. What a
user should know beside files that are written is logged as a warning.
"""

from snooker_cli.api.analyses import SideBySide
from snooker_cli.api.configs import (
    check_config,
    laws_of_packages,
    schema_text,
    template,
    templates,
    warm_up,
    write_template,
)
from snooker_cli.api.live_pages import LivePage, live
from snooker_cli.api.output_files import made_folder
from snooker_cli.api.repeats import Repeat
from snooker_cli.api.results import Outcome, Plan, Records, SavedFigure, Verdicts
from snooker_cli.api.runs import (
    Run,
    figure_list,
    open,
    plugin_list,
    runs_and_figures,
    statuses,
    write_report,
)
from snooker_cli.api.scenes import new_scene, simulate
from snooker_cli.api.simulating import Request, plan, run
from snooker_cli.api.wording import ARGUMENTS
from snooker_cli.config import EXAMPLES
from snooker_cli.config.template_configs import SCHEMA
from snooker_cli.export import export_endings, has_only_states
from snooker_cli.runs.batch import CHECKPOINT_INTERVAL
from snooker_cli.runs.progress import showing_notices

__all__ = ["LivePage", "Outcome", "Plan", "Records", "Repeat", "Run", "SavedFigure"]
__all__ += ["SideBySide", "Verdicts"]
__all__ += ["check_config", "figure_list", "live", "new_scene", "open", "plan", "plugin_list"]
__all__ += ["run", "simulate"]
__all__ += ["statuses", "template", "templates", "warm_up", "write_report", "write_template"]
# For commands.
__all__ += ["ARGUMENTS", "CHECKPOINT_INTERVAL", "EXAMPLES", "SCHEMA", "Request"]
__all__ += [
    "export_endings",
    "has_only_states",
    "laws_of_packages",
    "made_folder",
    "runs_and_figures",
    "schema_text",
    "showing_notices",
]
