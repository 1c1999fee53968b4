"""The tutorial's commands print what it shows; ``python tests/test_tutorial.py`` renews that."""

from __future__ import annotations

import re
import runpy
import shlex
import shutil
import subprocess
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from snooker_cli.cli.options import templates
from snooker_cli.config import digest, parse

DOCS = Path(__file__).parents[2] / "docs"
TUTORIAL = DOCS / "tutorial.md"
CONSOLE = re.compile(r"```console\n\$ (.*)\n((?:.*\n)*?)```")
VARIES = re.compile(
    r" in [\d.]+ s \([\d,]+ events/s\)( after \d+ s of compiling)?"
    r"|\d{4}-\d\d-\d\d \d\d:\d\d"
    r"|[\d.]+ [kMG]?B\b"
)
"""Times, moments, and sizes of files, which hold the names of versions and machines."""

Command = Callable[[str], str]


def block(text: str, language: str) -> str:
    """The only block in a language."""
    (found,) = re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)
    return str(found)


def words(output: str) -> list[list[str]]:
    """What is printed but what varies, and how wide columns are."""
    return [line.split() for line in VARIES.sub("", output).splitlines()]


def carried_out(line: str, snooker: Command) -> str:
    """What a command prints: snooker's by ``snooker``, perhaps through grep, or a script's."""
    command, _, others = line.partition(" | ")
    if command.startswith("python "):
        with redirect_stdout(StringIO()) as out:
            runpy.run_path(command.removeprefix("python "))
        return out.getvalue()
    printed = snooker(command.removeprefix("snooker "))
    if not others:
        return printed
    done = subprocess.run(
        shlex.split(others), input=printed, capture_output=True, encoding="utf-8", check=True
    )
    return done.stdout


def test_the_tutorial_does_what_it_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, snooker: Callable[..., Any]
) -> None:
    def call(arguments: str) -> str:
        ended = snooker(*shlex.split(arguments))
        assert ended.code == 0, ended.err
        return str(ended.out)

    monkeypatch.chdir(tmp_path)
    text = TUTORIAL.read_text(encoding="utf-8")
    (tmp_path / "haff.py").write_text(block(text, "python"), encoding="utf-8")
    shown = CONSOLE.findall(text)
    assert len(shown) >= 12
    for command, output in shown:
        assert words(carried_out(command, call)) == words(output), command
    assert (tmp_path / "film.html").exists()


def test_the_config_shown_is_the_templates() -> None:
    text = TUTORIAL.read_text(encoding="utf-8")
    shown = parse(block(text, "yaml")).experiment
    template = parse(templates()["decay"].read_text(encoding="utf-8")).experiment
    assert shown == template
    assert digest(shown) == digest(template)


def test_links_lead_somewhere() -> None:
    for path in DOCS.glob("*.md"):
        links = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", path.read_text(encoding="utf-8"))
        for link in links:
            assert link.startswith("https://") or (DOCS / link).exists(), f"{path.name}: {link}"


def update() -> None:
    """Put into the tutorial what its commands print now, and its figure."""
    import os
    import sys
    import tempfile

    snooker = Path(sys.executable).with_name("snooker")

    def call(arguments: str) -> str:
        done = subprocess.run(
            [snooker, *shlex.split(arguments)], stdout=subprocess.PIPE, text=True, check=True
        )
        return re.sub(r" after \d+ s of compiling", "", done.stdout)

    text = TUTORIAL.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as made:
        os.chdir(made)
        Path("haff.py").write_text(block(text, "python"), encoding="utf-8")
        text = CONSOLE.sub(
            lambda found: f"```console\n$ {found[1]}\n{carried_out(found[1], call)}```", text
        )
        shutil.copy("runs/decay/figures/energy-fit.png", DOCS / "cooling.png")
    TUTORIAL.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    update()
