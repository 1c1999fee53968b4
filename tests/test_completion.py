"""What the shell is offered on Tab, asked as bash, zsh and fish ask for it."""

from __future__ import annotations

import os
import pty
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import typer

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


@contextmanager
def typing(folder: Path, script: str) -> Iterator[Callable[[str], str]]:
    """What becomes of a line in a real bash that is typed there and then completed by a Tab."""
    tell = """bind -x '"\\C-g": echo "<<$READLINE_LINE>>"'"""
    (folder / "rc").write_text(f"{script}\n{tell}\nPS1=ready\n")
    bash, terminal = pty.openpty()
    path = os.pathsep.join([str(SNOOKER.parent), os.environ["PATH"]])
    process = subprocess.Popen(
        ["bash", "--rcfile", "rc", "-i"],
        cwd=folder,
        env={**os.environ, "PATH": path, "TERM": "dumb", "COLUMNS": "200"},
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
        start_new_session=True,
    )
    os.close(terminal)

    def until(pattern: bytes) -> str:
        said = b""
        while not (found := re.search(pattern, said)):
            said += os.read(bash, 1000)
        return found[1].decode()

    def completed(line: str) -> str:
        os.write(bash, f"{line}\t\a\x15".encode())
        return until(rb"<<(.*)>>")

    try:
        until(rb"(ready)")
        yield completed
    finally:
        process.kill()
        process.wait()
        os.close(bash)


@pytest.fixture
def shell_is_told(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have the shell named on the command line, where Typer looks at who started it.

    Typer asks for that as it makes a parser, which is else made once for all tests.
    """
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")
    typer.main.get_command.cache_clear()
    yield
    typer.main.get_command.cache_clear()


@pytest.mark.usefixtures("shell_is_told")
@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash here")
def test_bash_completes_what_is_behind_an_equals_sign(
    here: Path, snooker: Callable[..., Any]
) -> None:
    """Where it takes `cor=0.5` for three words, and would replace the last one only."""
    with typing(here, snooker("--show-completion", "bash").out) as completed:
        for typed, whole in (
            ("run small.yaml -o cor", "run small.yaml -o cor="),
            ("run --executor dask=tcp://h:1 sm", "run --executor dask=tcp://h:1 small.yaml "),
            ("run small.yaml -o seed=2 -o cor=", "run small.yaml -o seed=2 -o cor=0.85 "),
            ("run small.yaml --engine=ce", "run small.yaml --engine=cells "),
        ):
            assert completed(f"snooker {typed}") == f"snooker {whole}"


def test_words_that_bash_has_split(here: Path, offered: Offered) -> None:
    """Only what it will put behind the last `=` or `:` is offered."""
    run = ["run", "small.yaml", "-o"]
    assert offered(*run, "cor", "=") == ["0.85"]
    assert offered(*run, "seed", "=", "2", "-o", "record", "=", "s") == ["summary"]
    assert offered("run", "small.yaml", "--override", "=", "cor", "=", "0") == ["0.85"]
    assert offered("run", "--executor", "dask", "=") == ["tcp://", "tls://"]
    assert offered("run", "--executor", "dask", "=", "tcp", ":") == ["//"]
    assert offered("run", "--executor", "t") == ["threads"]


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
    results.pack(results.open_run("small"), finished.parent / "small.h5")
    assert offered("fit", "s") == ["small", "small.h5"]
    assert not results.open_run("small").packed
    assert results.open_run("small.h5").packed


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
    assert (completion.RUNS, completion.MANIFEST) == (results.RUNS, results.MANIFEST)
    assert completion.PACKED == files.SUFFIX
