"""The child process: sets its own limits, reads one file, writes what it holds to its standard output."""

from __future__ import annotations

import json
import os
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from rotordrop.errors import RecordError
from rotordrop.record.unpacking import Content

_MOST_ITEMS = 2000


def main(order: dict[str, Any]) -> None:
    """Read the file of an order and write its content, or why not, to standard output."""
    answer = os.dup(1)
    os.dup2(2, 1)  # what a library prints must not land among the samples
    _limit(order["cpu_s"], order["memory"])
    path = Path(order["path"])
    try:
        reader = import_module(f"rotordrop.record.unpacking.{order['kind']}")
        content = reader.unpacked(path)
        if len(content.items) > _MOST_ITEMS:
            raise RecordError(
                f"{path} holds {len(content.items)} series, a recording at most {_MOST_ITEMS}; export the "
                "channels that are needed"
            )
        head, arrays = _packed(content)
    except RecordError as error:
        head, arrays = {"refused": str(error)}, []
    except ModuleNotFoundError as error:
        head, arrays = {"missing": error.name}, []
    except MemoryError:
        limit = order["memory"] / 1e6
        head, arrays = {"refused": f"{path} needs more than {limit:.0f} MB to be read; it is damaged"}, []
    with os.fdopen(answer, "wb") as stream:
        stream.write(json.dumps(head).encode() + b"\n")
        for array in arrays:
            stream.write(array.data)
        stream.flush()
    os._exit(0)  # libraries that met a damaged file may crash while they clean up


def _limit(cpu_s: float, memory: int) -> None:
    if os.name != "posix":
        return
    import resource

    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CPU, (round(cpu_s), round(cpu_s) + 1))
    with suppress(ValueError, OSError):
        resource.setrlimit(
            resource.RLIMIT_DATA if sys.platform == "linux" else resource.RLIMIT_AS, (memory, memory)
        )
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _packed(content: Content) -> tuple[dict[str, Any], list[np.ndarray[Any, Any]]]:
    arrays = [np.ascontiguousarray(item.values) for item in content.items]
    entries = [
        {
            "name": item.name,
            "attributes": dict(item.attributes),
            "dtype": array.dtype.str,
            "shape": array.shape,
        }
        for item, array in zip(content.items, arrays, strict=True)
    ]
    return {"attributes": dict(content.attributes), "items": entries}, [array.reshape(-1) for array in arrays]
