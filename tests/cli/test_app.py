"""The commands by name, their help, and what the shell offers on Tab."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer
from command_line import Snooker

from snooker_cli import __version__
from snooker_cli.cli.app import COMMANDS, loaded
from snooker_cli.figures import FIGURES

HEAVY = {"numba", "numpy", "scipy", "matplotlib", "h5py", "pydantic", "yaml", "jinja2", "typst"}
CONSOLE_SCRIPT = [Path(sys.executable).with_name("snooker")]
MODULE = [sys.executable, "-m", "snooker_cli"]


def printed(command: list[str | Path], environment: dict[str, str], folder: Path) -> str:
    """What a process prints with more environment variables."""
    variables = {**os.environ, "PYTHONIOENCODING": "utf-8", **environment}
    done = subprocess.run(
        command, cwd=folder, env=variables, capture_output=True, encoding="utf-8", check=True
    )
    assert done.stderr == ""
    return done.stdout


def test_help_lists_the_commands_without_loading_heavy_libraries() -> None:
    """Loading them takes a second, too long for `--help`."""
    script = (
        "import sys\n"
        "from snooker_cli.cli import main\n"
        "sys.argv = ['snooker', '--help']\n"
        "try:\n"
        "    main()\n"
        "finally:\n"
        "    print(*sys.modules, file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    for name, (_, sentence) in COMMANDS.items():
        assert re.search(rf"(?m)^  {name} +{re.escape(sentence)}$", done.stdout)
    modules = {name.partition(".")[0] for name in done.stderr.split()}
    assert "typer" in modules
    assert not modules & HEAVY


@pytest.mark.parametrize("name", COMMANDS)
def test_the_list_of_commands_has_the_first_sentence_of_each(name: str) -> None:
    assert loaded(name).help.splitlines()[0] == COMMANDS[name][1]


def test_python_m_prints_the_version(tmp_path: Path) -> None:
    assert printed([*MODULE, "--version"], {}, tmp_path) == f"snooker {__version__}\n"


@pytest.mark.parametrize(
    ("words", "offers"),
    [
        ("va", ["validate"]),
        ("verify --rep", ["--replay"]),
        ("init d", ["decay", "dense"]),
        ("show ", ["small"]),
        ("fit s", ["small"]),
        ("fit n", []),
        (
            "plot small energy energy",
            [name for name in FIGURES if name.startswith("energy") and name != "energy"],
        ),
        ("run small.yaml -o balls.ri", ["balls.rings=", "balls.ring_extent="]),
        ("validate small.yaml -o rec", ["record="]),
    ],
)
def test_bash_is_offered(
    words: str,
    offers: list[str],
    finished: Path,
    snooker: Snooker,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (finished.parent / "not-a-run").mkdir()
    monkeypatch.setenv("_SNOOKER_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "\n".join(["snooker", *words.split(" ")]))
    monkeypatch.setenv("COMP_CWORD", str(len(words.split(" "))))
    ended = snooker()
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.split() == offers


def test_zsh_and_fish_get_the_meaning_of_a_key(here: Path) -> None:
    line = {"_TYPER_COMPLETE_ARGS": "snooker run small.yaml -o balls.mas"}
    fish = {"_SNOOKER_COMPLETE": "complete_fish", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    (offer,) = printed(CONSOLE_SCRIPT, line | fish, here).splitlines()
    meaning = "Mass of every ball, kg."
    assert offer.split("\t") == ["balls.mass=", meaning]
    zsh = printed(CONSOLE_SCRIPT, line | {"_SNOOKER_COMPLETE": "complete_zsh"}, here)
    assert f'"balls.mass=":"{meaning}"' in zsh


NAMED = "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"
"""With this variable the shell is named as an argument; Typer otherwise finds it itself."""


@pytest.fixture
def naming_the_shell(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Typer reads the variable when it makes a parser, which happens once for all tests."""
    monkeypatch.setenv(NAMED, "1")
    typer.main.get_command.cache_clear()
    yield
    typer.main.get_command.cache_clear()


@pytest.mark.usefixtures("naming_the_shell")
@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_to_install_asks_snooker(
    snooker: Snooker, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, shell: str
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    script = snooker("--show-completion", shell).out
    assert f"_SNOOKER_COMPLETE=complete_{shell}" in script
    ended = snooker("--install-completion", shell)
    assert ended.code == 0
    (path,) = (path for path in tmp_path.rglob("*snooker*") if path.is_file())
    assert str(path) in ended.out
    assert path.read_text().strip() == script.strip()


def test_python_m_gives_the_script_of_the_command(tmp_path: Path) -> None:
    variables = {NAMED: "1", "HOME": str(tmp_path)}
    asked = ["--show-completion", "bash"]
    script = printed([*MODULE, *asked], variables, tmp_path)
    assert "_snooker_completion snooker" in script
    assert script == printed([*CONSOLE_SCRIPT, *asked], variables, tmp_path)
