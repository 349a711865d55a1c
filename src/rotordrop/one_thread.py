"""One thread for linear algebra while an estimate, a gate or a study computes, whoever calls it.

Matrices are small here: threads inside linear algebra cost more than they give, above all on busy cores.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

ENVIRONMENT = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""For a process of our own. Each thread of each library takes 41 MB, which count against the limit of a
child, and long sums differ in the last digit with their number."""

_LOCK = threading.Lock()
_INSIDE: list[Any] = []
"""One entry for each that is inside; the first holds what there was before."""


@contextmanager
def one_thread() -> Iterator[None]:
    """Hold linear algebra to one thread; also a decorator, for functions that threads may call at once.

    Most libraries know one number for the whole process, some one for each thread that calls: whoever
    enters sets it, and who leaves last restores what there was before the first.
    """
    import scipy.linalg  # noqa: F401 - brings a library of its own, which can be held only once it is loaded
    from threadpoolctl import OpenBLASController, threadpool_limits

    with _LOCK:
        OpenBLASController.clear_controlling_thread(force=True)  # else only the thread that set it last may
        _INSIDE.append(threadpool_limits(1, user_api="blas"))
    try:
        yield
    finally:
        with _LOCK:
            if len(_INSIDE) == 1:
                OpenBLASController.clear_controlling_thread(force=True)
                _INSIDE[0].restore_original_limits()
                OpenBLASController.clear_controlling_thread()
            _INSIDE.pop()
