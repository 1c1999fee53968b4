"""The commands by name, their help, and what the shell offers on Tab."""

from __future__ import annotations

import re
import subprocess
import sys

import pytest
from command_line import Snooker

from snooker_cli.cli.app import COMMANDS, HIDDEN, loaded

HEAVY = {"numba", "numpy", "scipy", "matplotlib", "h5py", "pydantic", "yaml", "jinja2", "typst"}


def test_help_lists_the_commands_without_loading_heavy_libraries() -> None:
    """Loading them takes a second, too long for `--help`."""
    script = (
        "import atexit, sys\n"
        "from snooker_cli.cli import main\n"
        "atexit.register(lambda: print(*sys.modules, file=sys.stderr))\n"
        "main()\n"
    )
    command = [sys.executable, "-c", script, "--help"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    for name, (_, sentence) in COMMANDS.items():
        listed = re.search(rf"(?m)^  {name} +{re.escape(sentence)}$", done.stdout)
        assert bool(listed) == (name not in HIDDEN)
        assert loaded(name).help.splitlines()[0] == sentence
    modules = {name.partition(".")[0] for name in done.stderr.split()}
    assert "typer" in modules
    assert not modules & HEAVY


@pytest.mark.parametrize(
    ("words", "offers"), [("va", ["validate"]), ("verify --rep", ["--replay"])]
)
def test_bash_is_offered(
    words: str, offers: list[str], snooker: Snooker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_SNOOKER_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "\n".join(["snooker", *words.split(" ")]))
    monkeypatch.setenv("COMP_CWORD", str(len(words.split(" "))))
    ended = snooker()
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.split() == offers
