"""Configs: templates of them, and the check of one."""

import json
import os
from collections.abc import Iterable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, TypeAlias

from snooker_cli import laws, options
from snooker_cli.api.results import WIDTH, CommandResult
from snooker_cli.config import Config, Loaded, Point, template_configs
from snooker_cli.config.models import describe_laws
from snooker_cli.config.template_configs import SCHEMA, SCHEMA_FILE
from snooker_cli.engine import webassembly
from snooker_cli.engine.page_kernels import boundaries_of
from snooker_cli.errors import UserError, check_name
from snooker_cli.files import write_text
from snooker_cli.formatting import plain
from snooker_cli.runs import starting_state
from snooker_cli.runs.plan import SceneClass, alike, points_and_classes, scenes_of
from snooker_cli.runs.progress import counting, reporting
from snooker_cli.runs.warm_up import compiled_steps

if TYPE_CHECKING:
    from snooker_cli.analysis.typical_scales import TypicalScales

ConfigSource: TypeAlias = str | PathLike[str] | Mapping[str, Any]
"""A YAML file, or the same keys as a dict."""

Overrides: TypeAlias = Mapping[str, Any] | Iterable[str] | None
"""Values of keys, or texts such as ``cor=0.8`` as the option ``-o`` has them."""


def load(config: ConfigSource, overrides: Overrides = None) -> Loaded:
    """The experiment of a config, with the document that it comes from. Raises ``ConfigError``."""
    if isinstance(overrides, Mapping):
        overrides = [_override(key, value) for key, value in overrides.items()]
    return starting_state.load(config, overrides or ())


def _override(key: str, value: Any) -> str:
    """An override as ``-o`` has it."""
    if isinstance(value, str):
        return f"{key}={value}"
    values = plain(value)
    return f"{key}={','.join(map(json.dumps, values if isinstance(values, list) else [values]))}"


def with_scenes(
    config: ConfigSource, overrides: Overrides
) -> tuple[Config, tuple[Point, ...], list[SceneClass]]:
    """The experiment of a config, its points, and the classes of their starting scenes.

    Raises ``ConfigError``, also for a scene that cannot exist.
    """
    loaded = load(config, overrides)
    with reporting() as show:
        return loaded.config, *points_and_classes(loaded, show)


def check_config(config: ConfigSource, overrides: Overrides = None) -> CommandResult:
    """Check a config, with the starting scene of every point; what ``validate`` prints.

    config, overrides : as of ``run``

    ``points``, ``repeats`` of each, ``balls``, the least and the largest number of them, and
    typical ``scales``: of each its ``values`` at the points, and the ``models`` that they are from.
    Raises ``ConfigError``.
    """
    valid_config, points, scene_classes = with_scenes(config, overrides)
    balls = sorted({number for scenes in scene_classes for number in scenes.balls})
    number, repeats = len(points), valid_config.repeats
    fewest = f"{balls[0]} to " if balls[1:] else ""
    name = "{…}" if isinstance(config, Mapping) else config
    line = f"{name}: valid; points: {number:,}, repeats of each: {repeats}, balls: "
    content = {"points": number, "repeats": repeats, "balls": [balls[0], balls[-1]]}
    scales = typical_scales(points)
    lines = [f"{line}{fewest}{balls[-1]}", *scale_lines(scales)]
    return CommandResult({**content, "scales": scales.as_json()}, lines)


def typical_scales(points: Sequence[Point]) -> "TypicalScales":
    """Typical lengths and times at the points, whose scenes were checked."""
    from snooker_cli.analysis.typical_scales import TypicalScales  # takes time to load

    return TypicalScales(scenes_of(points))


def scale_lines(scales: "TypicalScales") -> list[str]:
    """Their table below an empty line; nothing if no theory holds."""
    lines, notes = scales.texts()
    lines += [part for note in notes for part in wrap(note, WIDTH, subsequent_indent="  ")]
    return [""] * bool(lines) + lines


def warm_up(*configs: ConfigSource) -> None:
    """Compile what runs of these configs and their analyses and films need.

    configs : as of ``run`` [all templates]

    Later, nothing has to wait for the compiler. A script needs ``if __name__ == "__main__":``,
    because processes compile, which import it again. Raises ``ConfigError``, ``UserError`` if
    compiled code cannot be stored, and ``RunError`` if processes cannot work.
    """
    names: Sequence[ConfigSource] = configs or tuple(template_configs.templates().values())
    points = [point for config in names for point in with_scenes(config, None)[1]]
    scenes = [same[0].config for same in alike(points).values()]
    steps = compiled_steps(scenes)
    for _ in counting(steps, "compiling, steps:", next(steps)):
        pass
    webassembly.modules(boundaries_of({scene.container.shape for scene in scenes}))


def templates(*, examples: bool = False) -> dict[str, str]:
    """The names of commented configs, and what each is for.

    examples : also those of configs/: of the reproduction, and scenes that are hard to simulate
    """
    return {name: template_configs.purpose(path) for name, path in _paths(examples).items()}


def _paths(with_examples: bool = True) -> dict[str, Path]:
    return template_configs.templates() | (template_configs.examples() if with_examples else {})


def template(name: str) -> str:
    """The text of a template or an example, for ``yaml.safe_load``. Raises ``UserError``."""
    check_name(name, _paths(), "template", options.TEMPLATE_NAMES)
    return template_configs.template_text(_paths()[name])


def write_template(name: str, out: str | PathLike[str] | None = None) -> list[Path]:
    """Write a template or an example, and the schema for editors beside it; both files.

    out : the config [the name and .yaml]

    Raises ``UserError`` if there is such a file, or no such template.
    """
    text, path = template(name), Path(out or f"{name}.yaml")
    if os.path.lexists(path):
        raise UserError(f"{path}: exists already", f"give {options.OUT} for another name")
    write_text(path, template_configs.renamed(text, name, path.stem))
    schema = path.with_name(SCHEMA)
    write_text(schema, schema_text())
    return [path, schema]


def installed_laws() -> dict[str, str]:
    """The laws of installed packages, and the distribution and version of each."""
    return {name: " ".join(laws.origin_of(name).split()[:2]) for name in laws.installed_laws()}


def schema_text() -> str:
    """The JSON schema of configs, for editors."""
    text = SCHEMA_FILE.read_text("utf-8")
    if not laws.installed_laws():
        return text
    schema = json.loads(text)
    for key in ("law", "wall_law"):
        describe_laws(schema["properties"][key])
    return json.dumps(schema, indent=2) + "\n"
