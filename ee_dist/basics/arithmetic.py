"""The same last digit on every machine: numerical libraries choose their arithmetic by the processor that they find, and a sum of
products or a sine then differs in its last bit. A loop whose robots fall over turns that into another result.

What is set here counts only if it is set before NumPy is loaded.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping, MutableMapping
from pathlib import Path

CPU = Path("/proc/cpuinfo")
COMMON = ("avx2", "fma")
"""What processors of the last ten years have in common; a machine without it goes its own way."""
SETTINGS: Mapping[str, str] = {
    # The kernels of BLAS and LAPACK, in NumPy's library and in SciPy's.
    "OPENBLAS_CORETYPE": "Haswell",
    # Sums over several threads are other sums.
    "OPENBLAS_NUM_THREADS": "1",
    # Sines and exponentials of vectors of eight are not those of vectors of four.
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
}


def pin(environment: MutableMapping[str, str] = os.environ, cpu: Path = CPU, machine: str = platform.machine()) -> None:
    """Choose the arithmetic that all x86 machines with AVX2 have in common; what the user set stays as it is."""
    if machine not in ("x86_64", "AMD64") or not set(COMMON) <= _flags(cpu):
        return
    for name, value in SETTINGS.items():
        environment.setdefault(name, value)


def _flags(cpu: Path) -> set[str]:
    try:
        lines = cpu.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return set()
    return set(next((line.partition(":")[2] for line in lines if line.startswith("flags")), "").split())
