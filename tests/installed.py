"""A folder with installed packages, and commands of snooker that see them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

from hatchling.builders.wheel import WheelBuilder

EXAMPLES = {
    "neighbour-alignment": "snooker_neighbour_alignment.py",
    "free-times": "snooker_free_times.py",
    "lammps-dump": "snooker_lammps_dump.py",
    "yielding": "snooker_yielding.py",
}
"""The folders of the example packages and the only module of each."""

GAS = """\
container: {shape: periodic, width: 20}
balls: {count: 20, radius: 0.8, speed: 10}
cor: 1
collisions: 4000
repeats: 12
"""

YIELDING_GAS = """\
container: {shape: periodic, width: 20}
balls: {count: 30, radius: 0.5, speed: 5}
cor: 0.7
law: {name: yielding, yield_speed: 2}
collisions: 300
repeats: 3
"""

PACKAGES = Path(__file__).parent / "extending" / "packages"


class Installed:
    """Packages in a folder of their own, as pip puts them there, and runs beside it."""

    def __init__(self, folder: Path) -> None:
        self.site, self.here = folder / "site", folder / "here"
        self.site.mkdir()
        self.here.mkdir()

    def add(self, package: Path) -> None:
        """Install the wheel of a package."""
        builder = WheelBuilder(str(package))
        (wheel,) = builder.build(directory=str(self.site.parent), versions=["standard"])
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(self.site)

    def write(self, name: str, source: str, site: Path | None = None, **entries: str) -> None:
        """Install a module of a distribution: its source, and an object of it for each group."""
        site = site or self.site
        (site / f"{name}.py").write_text(source, encoding="utf-8")
        information = site / f"{name}-1.0.dist-info"
        information.mkdir()
        (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0")
        points = (f"[snooker.{group}]\nit = {name}:{thing}\n" for group, thing in entries.items())
        (information / "entry_points.txt").write_text("".join(points))

    def ended(self, *arguments: str, here: Path | None = None) -> subprocess.CompletedProcess[str]:
        """Python with arguments, which has ended."""
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=here or self.here,
            env=os.environ | {"PYTHONPATH": str(self.site), "COLUMNS": "100"},
            capture_output=True,
            encoding="utf-8",
            check=False,
        )

    def snooker(self, *arguments: str, here: Path | None = None) -> str:
        """What a command prints that works."""
        done = self.ended("-m", "snooker_cli", *arguments, here=here)
        assert done.returncode == 0, f"snooker {' '.join(arguments)}: {done.stderr}"
        return done.stdout

    def plugins(self, here: Path | None = None) -> list[dict[str, Any]]:
        """What packages add, and what they could not add."""
        rows = json.loads(self.snooker("plugins", "--json", here=here))
        return [row for row in rows if row["entry"]]

    def rows(self, run: str) -> dict[tuple[str, str], dict[str, Any]]:
        """The rows of ``compare`` by quantity and model."""
        rows = json.loads(self.snooker("compare", run, "--json"))
        return {(row["quantity"], row["model"]): row for row in rows}


def with_examples(folder: Path) -> Installed:
    """All examples, and a run of an elastic gas."""
    installed = Installed(folder)
    for name in EXAMPLES:
        installed.add(PACKAGES / name)
    (installed.here / "gas.yaml").write_text(GAS)
    installed.snooker("run", "gas.yaml")
    return installed


def with_yielding(folder: Path, *options: str) -> Installed:
    """The package with the law of balls that yield, and a run of a gas with it."""
    installed = Installed(folder)
    installed.add(PACKAGES / "yielding")
    (installed.here / "gas.yaml").write_text(YIELDING_GAS)
    installed.snooker("run", "gas.yaml", *options)
    return installed
