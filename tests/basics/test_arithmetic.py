"""Numerical libraries compute alike whatever the processor: the arithmetic is chosen before they are loaded."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from ee_dist.basics.arithmetic import COMMON, CPU, SETTINGS, pin

SEEN = """
import os
import ee_dist
import numpy, scipy.linalg
from numpy._core._multiarray_umath import __cpu_features__ as features
print([name for name in ("X86_V3", "X86_V4", "AVX512_ICL") if features.get(name)], os.environ["OPENBLAS_NUM_THREADS"])
"""


def written(folder: Path, flags: str) -> Path:
    file = folder / "cpuinfo"
    file.write_text(f"processor\t: 0\nflags\t\t: fpu {flags}\n\nprocessor\t: 1\nflags\t\t: fpu\n")
    return file


def test_processors_with_avx2_get_what_all_of_them_have(tmp_path: Path) -> None:
    found: dict[str, str] = {"OPENBLAS_NUM_THREADS": "4"}
    pin(found, written(tmp_path, "avx2 fma avx512f"), "x86_64")
    assert found == {**SETTINGS, "OPENBLAS_NUM_THREADS": "4"}, "what the user set stays"


@pytest.mark.parametrize(("flags", "machine"), [("avx", "x86_64"), ("avx2 fma", "aarch64")])
def test_other_processors_are_left_alone(tmp_path: Path, flags: str, machine: str) -> None:
    found: dict[str, str] = {}
    pin(found, written(tmp_path, flags), machine)
    pin(found, tmp_path / "nowhere", "x86_64")
    assert found == {}


@pytest.mark.skipif(
    not CPU.exists() or not set(COMMON) <= set(CPU.read_text().split()), reason="a processor without AVX2, or no Linux"
)
def test_the_libraries_obey() -> None:
    """What OpenBLAS says itself of the kernels that it took, once for NumPy and once for SciPy."""
    clean = {k: v for k, v in os.environ.items() if k not in SETTINGS} | {"OPENBLAS_VERBOSE": "2"}
    done = subprocess.run([sys.executable, "-c", SEEN], env=clean, capture_output=True, text=True, check=True)
    assert (done.stdout + done.stderr).count("Core: Haswell") == 2
    assert "['X86_V3'] 1" in done.stdout
