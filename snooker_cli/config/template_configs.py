"""The commented configs that ``snooker init`` writes, and the example configs."""

import re
from pathlib import Path

_PACKAGE = Path(__file__).parents[1]
EXAMPLES = next(filter(Path.is_dir, (_PACKAGE / "configs", _PACKAGE.parent / "configs")), _PACKAGE)
"""The folder of the example configs: inside an installed package, at the top of a checkout."""

SCHEMA_FILE = EXAMPLES / "schema.json"  # draft 2020-12, written by ``tests/make_schema.py``

SCHEMA = "snooker-schema.json"  # beside a config, whose first line names it for editors


def templates() -> dict[str, Path]:
    """The commented configs by name, the simplest first."""
    cold = ("report", "haff", "sweep", "exact", "dense", "brownian", "rough")
    names = (*cold, "driven", "heat", "granular-heat")
    return {name: Path(__file__).with_name("templates") / f"{name}.yaml" for name in names}


def examples() -> dict[str, Path]:
    """The configs of configs/ by name, such as ``configs/hard/ring``, the hard ones last."""
    paths = [*sorted(EXAMPLES.glob("*.yaml")), *sorted(EXAMPLES.glob("hard/*.yaml"))]
    return {f"configs/{path.relative_to(EXAMPLES).with_suffix('')}": path for path in paths}


def purpose(config: Path) -> str:
    """What a template is for: its second line; the title of an example."""
    lines = config.read_text(encoding="utf-8").splitlines()
    if lines[2] == "#":
        return lines[1].removeprefix("# ")
    return next(line.removeprefix("title: ") for line in lines if line.startswith("title: "))


def template_text(config: Path) -> str:
    """The text of a template or an example, for a folder that has the file ``SCHEMA``."""
    text = config.read_text(encoding="utf-8")
    return re.sub(r"\$schema=\S+", f"$schema={SCHEMA}", text, count=1)


def renamed(text: str, template: str, name: str) -> str:
    """The text of a template whose commands, in comments, name another config."""
    commands = rf"^(#   snooker \w+ ){template}\b"
    return re.sub(commands, lambda match: match[1] + name, text, flags=re.MULTILINE)
