"""In continuous integration no test is skipped that a machine could run."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parent

SKIPPED = """
import pytest

def test_needs_a_program():
    pytest.skip("there is no Chromium here")

@pytest.mark.skipif(True, reason="it has other locks")
def test_needs_a_system():
    pass

@pytest.mark.xfail(strict=True)
def test_is_wrong():
    assert False
"""
MODULE = "import pytest\npytest.importorskip('no_such_library')\n"


@pytest.mark.parametrize(
    ("ci", "text", "closing", "code"),
    [
        ("", SKIPPED, "2 skipped, 1 xfailed", 0),
        ("true", SKIPPED, "1 failed, 1 skipped, 1 xfailed", 1),
        ("", MODULE, "1 skipped", 5),  # nothing was tested
        ("true", MODULE, "1 error", 2),
    ],
)
def test_a_skip_is_a_failure_in_ci(
    ci: str, text: str, closing: str, code: int, tmp_path: Path
) -> None:
    """Of a test, or of a file that lacks a library; unless the machine cannot run it."""
    (tmp_path / "test_skipped.py").write_text(text)
    paths = os.pathsep.join(str(TESTS / name) for name in ("", "engine", "validation"))
    options = ("-q", "-p", "conftest", "-p", "no:cacheprovider")
    ended = subprocess.run(
        [sys.executable, "-m", "pytest", *options, tmp_path],
        env=os.environ | {"CI": ci, "PYTHONPATH": paths},
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.stdout.splitlines()[-1].startswith(closing), ended.stdout + ended.stderr
    assert ended.returncode == code
