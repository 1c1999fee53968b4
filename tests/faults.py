"""Deliberate faults, each of which some tests must find: ``python tests/faults.py [NAME …]``.

Each entry of ``tests/data/faults.yaml`` changes one place of the sources in a copy of the project
and names the tests that must fail then: files, without their long tests, or single tests. The
command ends with 1 if a fault is not found.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from subprocess import PIPE
from typing import Any

import yaml

ROOT = Path(__file__).parents[1]
FAULTS = ROOT / "tests" / "data" / "faults.yaml"
PASSED, FAILED = 0, 1  # exit codes of pytest


def copy_project(copy: Path) -> None:
    """Copy the files that git knows."""
    names = subprocess.check_output(["git", "ls-files"], cwd=ROOT, text=True).splitlines()
    for name in names:
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, copy / name)


def is_found(fault: dict[str, Any], copy: Path) -> bool:
    """Whether the fault's tests fail while the fault is in the copy."""
    source = copy / fault["file"]
    text = source.read_text()
    if text.count(fault["old"]) != 1:
        raise SystemExit(f"{fault['name']}: the old text must occur once in {fault['file']}")
    source.write_text(text.replace(fault["old"], fault["new"]))
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    command += [*fault["tests"].split(), *([] if "::" in fault["tests"] else ["-m", "not long"])]
    environment = os.environ | {"PYTHONPATH": str(copy)}
    if "engine" in fault["file"]:  # its kernels are compiled for this fault only
        environment["NUMBA_CACHE_DIR"] = str(copy.with_name("cache"))
    try:
        done = subprocess.run(
            command, cwd=copy, env=environment, stdout=PIPE, text=True, timeout=900, check=False
        )
        if done.returncode > FAILED:  # below zero, the fault has crashed the tests
            raise SystemExit(f"{fault['name']}: the tests could not run\n{done.stdout}")
        return done.returncode != PASSED
    except subprocess.TimeoutExpired:
        return True
    finally:
        source.write_text(text)


def main(names: list[str]) -> int:
    """Try the faults with these names, or all; 1 if the tests miss one."""
    faults = yaml.safe_load(FAULTS.read_text())
    missed = 0
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "copy"
        copy_project(copy)
        for fault in faults:
            if not names or fault["name"] in names:
                found = is_found(fault, copy)
                missed += not found
                print("found " if found else "MISSED", fault["name"], flush=True)
    print(f"{missed} missed")
    return int(missed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
