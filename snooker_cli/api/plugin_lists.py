"""What the tables have to which installed packages can add."""

from typing import Any

from snooker_cli import __version__, plugins
from snooker_cli.analysis.quantities import QUANTITIES
from snooker_cli.analysis.theories import THEORIES
from snooker_cli.export import FORMATS
from snooker_cli.figures.registry import FIGURES
from snooker_cli.laws import EVERY_LAW

TABLES = (EVERY_LAW, QUANTITIES, THEORIES, FIGURES, FORMATS)
DISTRIBUTION = "snooker-cli"


def listed_plugins() -> list[dict[str, Any]]:
    """What ``snooker.plugin_list`` returns."""
    own = [
        _row(table.group, name, DISTRIBUTION, __version__) for table in TABLES for name in table.own
    ]
    found = [plugin for table in TABLES for plugin in table.plugins]
    return own + [
        _row(p.group, p.name, p.origin.distribution, p.origin.version, p.entry, p.problem)
        for p in (*found, *plugins.without_table(*TABLES))
    ]


def _row(
    group: str, name: str, distribution: str, version: str, entry: str = "", problem: str = ""
) -> dict[str, Any]:
    of = {"group": group, "name": name, "distribution": distribution, "version": version}
    return of | {"entry": entry, "problem": problem}
