"""The compiled kernels have no gathers: some processors take longer for one than for its loads."""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import pytest
from scenes import EVERYONE, NEIGHBOURS, gas

from snooker_cli.engine import jit, simulate
from snooker_cli.engine.event_loop import advance

if os.environ.get("NUMBA_DISABLE_JIT", "0") not in {"", "0"}:
    pytest.skip("nothing is compiled here", allow_module_level=True)

PROGRAM = """
import pickle, sys
from snooker_cli.engine.event_loop import advance

for signature in pickle.load(sys.stdin.buffer):
    advance.compiled.compile(signature)
for assembly in advance.compiled.inspect_asm().values():
    print(assembly)
"""


@pytest.mark.long
@pytest.mark.parametrize("processor", ["skylake-avx512", "haswell", "znver3", "znver4"])
def test_kernels_have_no_gathers(processor: str, tmp_path: Path) -> None:
    """A process of its own compiles both searches for the processor, and runs nothing.

    It has an empty cache, because kernels from the cache have no assembly.
    """
    for search in (EVERYONE, NEIGHBOURS):
        simulate(gas("circle", 60, 0.3, mixed=True), collisions=1, search=search)
    types = advance.compiled.signatures
    settings = {
        "NUMBA_CPU_NAME": processor,
        "NUMBA_CPU_FEATURES": jit.NO_GATHERS.lstrip(","),
        "NUMBA_CACHE_DIR": str(tmp_path),
    }
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        input=pickle.dumps(types),
        env=os.environ | settings,
        cwd=Path(__file__).parents[2],
        capture_output=True,
        check=True,
    )
    assembly = done.stdout.decode()
    assert assembly.count("vmulpd") > 20, "no loops in vector form"
    assert not re.findall(r"\bvp?gather\w+", assembly)
