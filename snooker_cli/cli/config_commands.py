"""``snooker init``, ``validate``, ``warm-up`` and ``schema``: write, check and prepare configs."""

from pathlib import Path
from typing import Annotated

import typer

import snooker_cli as snooker
from snooker_cli import options
from snooker_cli.api.configs import installed_laws, schema_text
from snooker_cli.cli.output import print_line, print_table
from snooker_cli.cli.parameters import ConfigPath, takes
from snooker_cli.config.template_configs import SCHEMA
from snooker_cli.errors import UserError, notice


@takes(options.CONFIG_OUT, options.LIST_TEMPLATES)
def init(
    template: Annotated[
        str | None, typer.Argument(metavar="TEMPLATE", help="A name [list the templates].")
    ] = None,
    *,
    out: Path | None,
    list_all: bool,
) -> None:
    """Write a commented config; without TEMPLATE, list all templates.

    A template explains every key. --list also lists the examples in configs/: the configs of the
    reproduction, and scenes that are hard to simulate. The file snooker-schema.json is written
    beside the config. With that, editors with a YAML language server complete keys and check
    values. The names of the written files are printed.
    """
    if template is None or list_all:
        if out is not None:
            raise UserError(f"--out {out}: give the TEMPLATE to write; `snooker init` lists them")
        purposes = snooker.templates(examples=list_all)
        print_table(["template", "what it is"], [*map(list, purposes.items())])
        if laws := installed_laws():
            print_line("")
            print_table(["law", "from"], [[name, source] for name, source in laws.items()])
        return
    if out == Path("-"):
        print_line(snooker.template(template).rstrip("\n"))
        schema = f"snooker schema > {SCHEMA}"
        notice(f"tip: `{schema}` in this folder lets your editor check the file")
        return
    written = snooker.write_template(template, out)
    for path in written:
        print_line(str(path))
    notice(f"next: snooker run {written[0]} --dry-run")


@takes(options.OVERRIDES)
def validate(config: ConfigPath, *, overrides: list[str] | None) -> None:
    """Check CONFIG without running it.

    The check includes the starting scene of every point. Typical lengths and times of the gas are
    printed, each by the theory that holds for it.
    """
    print_line(str(snooker.check_config(config, overrides)))


def warm_up(
    configs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="CONFIG", readable=False, help="Experiments [all templates]."),
    ] = None,
) -> None:
    """Compile what CONFIG and its analyses need, for later.

    These are the kernels of `run`, of `fit` and `compare`, of figures, and of films and the live
    page. They are stored in ~/.cache/snooker or NUMBA_CACHE_DIR, so that later commands need not
    wait. Use this for class rooms, images of containers, and clusters. It uses all processors.
    """
    snooker.warm_up(*(configs or ()))


def schema() -> None:
    """Print the JSON schema of configs, for editors."""
    print_line(schema_text().rstrip())
