"""What there is of compiled kernels; apart from their sources, whose changes compile all of them again."""

from __future__ import annotations

import os
from typing import Any

from rotordrop.physics import _compile, _numba


def compiled_code() -> dict[str, Any]:
    """Kernels that came with the package and those cached here, ready for JSON: where, how many, writable."""
    folder = _compile.cache_folder()
    shipped = (_compile._SHIPPED / folder.name).glob("*.object") if _numba._is_portable_here() else ()
    sizes = [file.stat().st_size for file in folder.glob("*.object")]
    nearest = next(parent for parent in (folder, *folder.parents) if parent.exists())
    return {
        "shipped": len(list(shipped)),
        "folder": str(folder),
        "writable": os.access(nearest, os.W_OK),
        "kernels": len(sizes),
        "bytes": sum(sizes),
    }
