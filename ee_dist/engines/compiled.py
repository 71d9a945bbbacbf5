"""Functions over the arrays of a batch, compiled by Numba.

A step of a batch of robots has little arithmetic and much of it is single operations on a few hundred numbers, which
NumPy spends mostly on calls. A compiled function reads like the formula and is called once a step.

The arithmetic is that of IEEE 754 in the order written: nothing is reassociated and no multiplication is fused with an
addition, so a result does not depend on the machine's vector units.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile at the first call with each kind of arrays; keep the machine code in a file for the next process.

    Without a folder that it may write (beside the module, or the user's own), every process compiles for itself.
    """
    options: dict[str, Any] = {"error_model": "numpy", "fastmath": False}
    try:
        return cast(Function, numba.njit(cache=True, **options)(function))
    except RuntimeError:
        return cast(Function, numba.njit(**options)(function))
