"""``snooker init``, ``validate`` and ``schema``: write and check configs."""

import os
import re
from pathlib import Path
from typing import Annotated

import typer

from snooker_cli.cli.options import ConfigPath, Overrides, flag, option
from snooker_cli.cli.output import print_line, print_table
from snooker_cli.config import EXAMPLES, SCHEMA_FILE
from snooker_cli.errors import UserError, check_name, notice
from snooker_cli.files import write_text
from snooker_cli.runs.plan import checked
from snooker_cli.runs.progress import reporting
from snooker_cli.runs.starting_state import load

SCHEMA = "snooker-schema.json"  # beside a config, whose first line names it for editors


def templates() -> dict[str, Path]:
    """The commented configs by name, the simplest first."""
    cold = ("report", "haff", "sweep", "exact", "dense", "brownian")
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


def init(
    template: Annotated[
        str | None, typer.Argument(metavar="TEMPLATE", help="A name [list the templates].")
    ] = None,
    out: Annotated[Path | None, option("FILE", "The config; - prints it [TEMPLATE.yaml].")] = None,
    list_all: Annotated[bool, flag("--list", "List templates and example configs.")] = False,
) -> None:
    """Write a commented config; without TEMPLATE, list all templates.

    A template explains every key. --list also lists the examples in configs/: the configs of the
    reproduction, and scenes that are hard to simulate. The file snooker-schema.json is written
    beside the config. With that, editors with a YAML language server complete keys and check
    values. The names of the written files are printed.
    """
    configs = templates() | examples()
    if template is None or list_all:
        if out is not None:
            raise UserError(f"--out {out}: give the TEMPLATE to write; `snooker init` lists them")
        shown = configs if list_all else templates()
        rows = [[name, purpose(path)] for name, path in shown.items()]
        print_table(["template", "what it is"], rows)
        return
    check_name(template, configs, "template", "snooker init --list")
    text = configs[template].read_text(encoding="utf-8")
    text = re.sub(r"\$schema=\S+", f"$schema={SCHEMA}", text, count=1)
    if out == Path("-"):
        print_line(text.rstrip("\n"))
        notice(f"tip: `snooker schema > {SCHEMA}` in this folder lets your editor check the file")
        return
    path = out or Path(f"{template}.yaml")
    if os.path.lexists(path):
        raise UserError(f"{path}: exists already", "give --out for another name")
    commands = rf"^(#   snooker \w+ ){template}\b"  # in comments; they name the file
    text = re.sub(commands, lambda match: match[1] + path.stem, text, flags=re.MULTILINE)
    schema_text = SCHEMA_FILE.read_text("utf-8")
    for written, content in ((path, text), (path.with_name(SCHEMA), schema_text)):
        write_text(written, content)
        print_line(str(written))
    notice(f"next: snooker run {path} --dry-run")


def validate(config: ConfigPath, override: Overrides = None) -> None:
    """Check CONFIG without running it.

    The check includes the starting scene of every point.
    """
    loaded = load(config, override or ())
    with reporting() as show:
        points, scene_classes = checked(loaded, show=show)
    balls = sorted({number for scenes in scene_classes for number in scenes.balls})
    fewest = f"{balls[0]} to " if balls[1:] else ""
    counts = f"points: {len(points):,}, repeats of each: {loaded.experiment.repeats}"
    print_line(f"{config}: valid; {counts}, balls: {fewest}{balls[-1]}")


def schema() -> None:
    """Print the JSON schema of configs, for editors."""
    print_line(SCHEMA_FILE.read_text("utf-8").rstrip())
