"""Configurations: YAML -> a frozen, valid Config -> the points of its sweep and their digests.

Everything that a user can get wrong is raised as ConfigError, all problems at once.
"""

from typing import TYPE_CHECKING

from snooker_cli.config.models import BallList, Config, Rings, Start
from snooker_cli.config.points import (
    LIMITS,
    Point,
    PointConfig,
    digest,
    extends,
    points,
    to_json,
    unit_of,
    validated,
    with_values,
)
from snooker_cli.config.problems import ConfigError
from snooker_cli.lazy_names import lazy_names

if TYPE_CHECKING:
    from snooker_cli.config.reading import Loaded, load, parse

__all__ = ["LIMITS", "BallList", "Rings"]
__all__ += ["Config", "ConfigError", "Loaded", "Point", "PointConfig", "Start"]
__all__ += ["digest", "extends", "load", "parse", "points", "to_json", "unit_of", "validated"]
__all__ += ["with_values"]

# Most commands read a run, and no YAML.
__getattr__ = lazy_names(__name__, {"reading": "Loaded load parse"})
