"""What the shell is offered on Tab, asked as bash, zsh and fish ask for it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from snooker_cli import results
from snooker_cli.cli import completion
from snooker_cli.config import load, schema
from snooker_cli.gallery import KINDS
from snooker_cli.results import files

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
    line = {"_TYPER_COMPLETE_ARGS": "snooker run small.yaml -o balls.list[0].pos"}
    fish = {"_SNOOKER_COMPLETE": "complete_fish", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    (offer,) = ask(here, line | fish).splitlines()
    meaning = "Position [x, y] of the ball’s centre at the start, m."
    assert offer.split("\t") == ["balls.list[0].position=", meaning]
    zsh = ask(here, line | {"_SNOOKER_COMPLETE": "complete_zsh"})
    assert f'"balls.list[0].position=":"{meaning}"' in zsh


def test_commands_and_options(here: Path, offered: Offered) -> None:
    assert offered("va") == ["validate"]
    assert offered("verify", "--rep") == ["--replay"]


def test_templates(here: Path, offered: Offered) -> None:
    assert offered("init", "d") == ["decay", "dense"]


def test_configs_are_yaml_files_here_and_one_folder_down(here: Path, offered: Offered) -> None:
    for name in ("configs/a.yaml", "configs/b.yml", "configs/notes.txt", ".hidden/c.yaml"):
        (here / name).parent.mkdir(exist_ok=True)
        (here / name).touch()
    assert offered("run", "") == ["configs/a.yaml", "configs/b.yml", "small.yaml"]
    assert offered("validate", "configs/a") == ["configs/a.yaml"]
    assert offered("run", f"{here}/configs/b") == [f"{here}/configs/b.yml"]


def test_runs_in_folders_and_packed(finished: Path, offered: Offered) -> None:
    (finished.parent / "not-a-run").mkdir()
    (finished.parent / "archived.h5").touch()
    assert offered("show", "") == ["archived", "small"]
    assert offered("fit", "s") == ["small"]


def test_figures_of_plot_that_are_not_given_yet(here: Path, offered: Offered) -> None:
    wanted = [name for name in KINDS if name.startswith("energy") and name != "energy"]
    assert wanted
    assert offered("plot", "small", "energy", "energy") == wanted


def test_keys_of_overrides(here: Path, offered: Offered) -> None:
    assert offered("run", "small.yaml", "-o", "balls.ri") == [
        "balls.rings=",
        "balls.ring_extent=",
    ]
    assert offered("validate", "small.yaml", "-o", "collapse.") == [
        "collapse.tc=",
        "collapse.elastic_below=",
    ]


def test_the_last_key_left_is_offered_with_what_it_can_be(here: Path, offered: Offered) -> None:
    assert offered("run", "small.yaml", "-o", "rec") == ["record=events", "record=summary"]
    assert offered("run", "small.yaml", "-o", "cor") == ["cor=", "cor=0.85"]
    assert offered("run", "not-there.yaml", "-o", "cor") == ["cor="]


def test_keys_of_the_item_of_a_list_that_is_typed(here: Path, offered: Offered) -> None:
    ball = "{position: [0.0, 0.0], velocity: [1.0, 0.0], radius: 0.5}"
    other = ball.replace("[0.0, 0.0]", "[2.0, 0.0]")
    (here / "two.yaml").write_text(
        f"container: {{radius: 5.0}}\nballs: {{list: [{ball}, {other}]}}\ncor: 1\ntime: 1\n"
    )
    assert load(here / "two.yaml").points()
    assert offered("run", "two.yaml", "-o", "balls.list[1].p") == [
        "balls.list[1].position=",
        "balls.list[1].position=[2.0,0.0]",
    ]


def test_every_key_that_can_be_swept_can_be_completed() -> None:
    found = {key.path for key in completion._keys("")}
    swept = schema()["properties"]["sweep"]["properties"]
    assert {key for key in swept if "." in key or key == "cor"} <= found
    assert {"title", "repeats", "seed", "record"} <= found
    assert not {path for path in found if path.startswith("sweep")}


def test_an_explanation_is_one_line() -> None:
    """Of which fish would take the second one for something to type."""
    for key in completion._keys(""):
        assert len(completion._plain(key.description).replace("\\[", "[")) <= completion.LINE


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_to_install_asks_snooker(
    snooker: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path, shell: str
) -> None:
    """The shell that is asked about is here given, where Typer looks at who started it."""
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")
    monkeypatch.setenv("HOME", str(tmp_path))
    script = snooker("--show-completion", shell).out
    assert f"_SNOOKER_COMPLETE=complete_{shell}" in script
    ended = snooker("--install-completion", shell)
    assert ended.code == 0
    (path,) = (path for path in tmp_path.rglob("*snooker*") if path.is_file())
    assert str(path) in ended.out
    assert path.read_text().strip() == script.strip()


def test_where_runs_are_is_what_results_say() -> None:
    assert (completion.RUNS, completion.MANIFEST) == (results.RUNS, results.MANIFEST)
    assert completion.PACKED == files.SUFFIX
