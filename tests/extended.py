"""A copy of the package with a few edits, as someone makes who adds a law or a shape.

Laws and shapes have no plug: a kernel's cache, the processes of a run, WebAssembly and the version
in a run's files all go by the sources of the package. So an example is the text that one adds to
them.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

import snooker_cli

Edits: TypeAlias = Mapping[str, Sequence[tuple[str, str]]]
"""For each file of the package: texts that it has once, and what stands in their place."""


class Extended:
    """The package with edits, in a folder of its own; its commands run in processes.

    Its kernels run as plain Python, except where a test compiles them: nothing else has the kernels
    of a copy, and to compile them takes longer than a few hundred collisions.
    """

    def __init__(self, edits: Edits, folder: Path) -> None:
        self.folder, package = folder, folder / "snooker_cli"
        self.compiles = False
        without = shutil.ignore_patterns("__pycache__")
        shutil.copytree(Path(snooker_cli.__file__).parent, package, ignore=without)
        for name, changes in edits.items():
            text = (package / name).read_text("utf-8")
            for old, new in changes:
                found = text.count(old)
                where = f"snooker_cli/{name} has this {found} times, not once; change the example"
                assert found == 1, f"{where}: {old!r}"
                text = text.replace(old, new)
            (package / name).write_text(text, encoding="utf-8")

    @contextmanager
    def compiling(self) -> Iterator[None]:
        """What runs within compiles its kernels."""
        self.compiles = True
        try:
            yield
        finally:
            self.compiles = False

    def ended(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Python with arguments, which has ended."""
        tests = Path(__file__).parent
        paths = os.pathsep.join(map(str, (self.folder, tests)))
        plain = "0" if self.compiles else "1"
        return subprocess.run(
            [sys.executable, *arguments],
            cwd=self.folder,
            env=os.environ | {"PYTHONPATH": paths, "NUMBA_DISABLE_JIT": plain},
            capture_output=True,
            encoding="utf-8",
            check=False,
        )

    def snooker(self, *arguments: str) -> str:
        """What a command prints that works."""
        done = self.ended("-m", "snooker_cli", *arguments)
        assert done.returncode == 0, f"snooker {' '.join(arguments)}: {done.stderr}"
        return done.stdout

    def refused(self, *arguments: str) -> str:
        """The sentence of a command that does not work, in one line."""
        done = self.ended("-m", "snooker_cli", *arguments)
        assert done.returncode != 0, f"snooker {' '.join(arguments)} works: {done.stdout}"
        assert not {"Traceback", "unexpected"} & {*done.stderr.split()}, done.stderr
        return " ".join(done.stderr.split())

    def value(self, script: str) -> Any:
        """The JSON that a script prints."""
        done = self.ended("-c", script)
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def run(self, name: str, config: str) -> None:
        """Simulate a config; the run has this name."""
        (self.folder / f"{name}.yaml").write_text(config, encoding="utf-8")
        self.snooker("run", f"{name}.yaml")


SAME_IN_V8 = """
import json
import snooker_cli
from javascript import JavaScript, scene_of
from snooker_cli.trace import event_hashes
with JavaScript({boundaries!r}) as page:
    repeat = snooker_cli.open("{run}")[0, 0]
    limits = json.dumps(dict(collisions=len(repeat.events)))
    here = page.answer("simulated(%s, %s)" % (scene_of(repeat.scene), limits))
print(json.dumps([here["hash"], repeat.hashes()[-1][1]]))
"""
"""A script that prints two hashes of a repeat's collisions: that of a film's page, and its own."""
