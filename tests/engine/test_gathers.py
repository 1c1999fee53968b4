"""The compiled kernels have no gathers: some processors take longer for one than for its loads."""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import pytest
from scenes import gas

from snooker_cli.engine import all_pairs, cells, jit, simulate

if os.environ.get("NUMBA_DISABLE_JIT", "0") not in {"", "0"}:
    pytest.skip("nothing is compiled here", allow_module_level=True)

PROGRAM = """
import pickle, sys
from snooker_cli.engine import all_pairs, cells

for kernel, signatures in zip((all_pairs.advance, cells.advance), pickle.load(sys.stdin.buffer)):
    for signature in signatures:
        kernel.compiled.compile(signature)
    for assembly in kernel.compiled.inspect_asm().values():
        print(assembly)
"""


@pytest.mark.long
@pytest.mark.parametrize("processor", ["skylake-avx512", "haswell", "znver3", "znver4"])
def test_kernels_have_no_gathers(processor: str, tmp_path: Path) -> None:
    """A process of its own compiles both engines for the processor, and runs nothing.

    It has an empty cache, because kernels from the cache have no assembly.
    """
    types = []
    for engine, kernel in (("allpairs", all_pairs.advance), ("cells", cells.advance)):
        known = set(kernel.compiled.signatures)
        simulate(gas("circle", 60, 0.3, mixed=True), collisions=1, search=search)
        signatures = kernel.compiled.signatures
        types.append(
            [signature for signature in signatures if signature not in known] or signatures[:1]
        )
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
