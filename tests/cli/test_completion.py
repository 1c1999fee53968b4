"""What the shell is offered on Tab, asked as bash, zsh and fish ask for it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from snooker_cli import runs
from snooker_cli.cli import options
from snooker_cli.figures import FIGURES

SNOOKER = Path(sys.executable).with_name("snooker")

Offered = Callable[..., list[str]]
"""The fixture of that name: words after ``snooker``, what bash is offered for the last one."""


def bash(*words: str) -> dict[str, str]:
    """The environment in which bash asks what the last word can be."""
    line = "\n".join(["snooker", *words])
    return {
        "_SNOOKER_COMPLETE": "complete_bash",
        "COMP_WORDS": line,
        "COMP_CWORD": str(len(words)),
    }


@pytest.fixture
def offered(snooker: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> Offered:
    def offers(*words: str) -> list[str]:
        for name, value in bash(*words).items():
            monkeypatch.setenv(name, value)
        ended = snooker()
        assert (ended.code, ended.err) == (0, "")
        return str(ended.out).split()

    return offers


def ask(folder: Path, environment: dict[str, str]) -> str:
    """What the console script prints in an environment."""
    done = subprocess.run(
        [SNOOKER],
        cwd=folder,
        env={**os.environ, "PYTHONIOENCODING": "utf-8", **environment},
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    assert done.stderr == ""
    return done.stdout


def test_the_console_script_answers_bash(here: Path) -> None:
    environment = bash("run", "small.yaml", "-o", "balls.ri")
    assert ask(here, environment).split() == ["balls.rings=", "balls.ring_extent="]


def test_the_console_script_tells_zsh_and_fish_what_a_key_means(here: Path) -> None:
    line = {"_TYPER_COMPLETE_ARGS": "snooker run small.yaml -o balls.mas"}
    fish = {"_SNOOKER_COMPLETE": "complete_fish", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    (offer,) = ask(here, line | fish).splitlines()
    meaning = "Mass of every ball, kg."
    assert offer.split("\t") == ["balls.mass=", meaning]
    zsh = ask(here, line | {"_SNOOKER_COMPLETE": "complete_zsh"})
    assert f'"balls.mass=":"{meaning}"' in zsh


@pytest.fixture
def shell_is_told(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have the shell named on the command line, where Typer looks at who started it.

    Typer asks for that as it makes a parser, which is else made once for all tests.
    """
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")
    typer.main.get_command.cache_clear()
    yield
    typer.main.get_command.cache_clear()


def test_commands_and_options(here: Path, offered: Offered) -> None:
    assert offered("va") == ["validate"]
    assert offered("verify", "--rep") == ["--replay"]


def test_templates(here: Path, offered: Offered) -> None:
    assert offered("init", "d") == ["decay", "dense"]


def test_runs(finished: Path, offered: Offered) -> None:
    (finished.parent / "not-a-run").mkdir()
    assert offered("show", "") == ["small"]
    assert offered("fit", "s") == ["small"]
    assert offered("fit", "n") == []


def test_figures_of_plot_that_are_not_given_yet(here: Path, offered: Offered) -> None:
    wanted = [name for name in FIGURES if name.startswith("energy") and name != "energy"]
    assert wanted
    assert offered("plot", "small", "energy", "energy") == wanted


def test_keys_of_overrides(here: Path, offered: Offered) -> None:
    assert offered("run", "small.yaml", "-o", "balls.ri") == [
        "balls.rings=",
        "balls.ring_extent=",
    ]
    assert offered("validate", "small.yaml", "-o", "rec") == ["record="]


@pytest.mark.usefixtures("shell_is_told")
@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_to_install_asks_snooker(
    snooker: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, shell: str
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    script = snooker("--show-completion", shell).out
    assert f"_SNOOKER_COMPLETE=complete_{shell}" in script
    ended = snooker("--install-completion", shell)
    assert ended.code == 0
    (path,) = (path for path in tmp_path.rglob("*snooker*") if path.is_file())
    assert str(path) in ended.out
    assert path.read_text().strip() == script.strip()


def test_a_script_asked_for_by_python_m_is_that_of_the_command(tmp_path: Path) -> None:
    environment = {"_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1", "HOME": str(tmp_path)}
    scripts = [
        subprocess.run(
            [*command, "--show-completion", "bash"],
            env={**os.environ, **environment},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for command in ([SNOOKER], [sys.executable, "-m", "snooker_cli"])
    ]
    assert scripts[0] == scripts[1]
    assert "_snooker_completion snooker" in scripts[0]


def test_where_runs_are_is_what_results_say() -> None:
    assert (options.RUNS, options.MANIFEST) == (runs.RUNS, runs.MANIFEST)
