"""A machine of twelve numbers: schema and machine file come from the commands, in a process of their own."""

from __future__ import annotations

import json
from functools import lru_cache
from threading import BoundedSemaphore
from typing import Any

from rotordrop.errors import UsageError
from rotordrop.web.commands import said_by_command
from rotordrop.web.workspace import LONGEST_OPTION, labelled

PATIENCE_S = 60.0
"""How long the commands may take [s]; chosen, not measured."""
MEMORY = 2 * 2**30
"""Memory of one of them [byte]; chosen, not measured."""
_AT_ONCE = BoundedSemaphore(2)


@lru_cache(maxsize=1)
def schema_of_numbers() -> str:
    """The JSON Schema of the twelve numbers."""
    return _said_by(["init", "--schema", "numbers"])


def machine_of_numbers(given: dict[str, Any]) -> str:
    """The text of a machine file of twelve numbers: texts with units by name, as the schema says."""
    schema = json.loads(schema_of_numbers())
    for name, value in given.items():
        if name not in schema["properties"]:
            raise UsageError(
                f"there is no number {labelled(name)!r}; there are {', '.join(schema['properties'])}"
            )
        if not isinstance(value, str) or len(value) > LONGEST_OPTION or "\0" in value:
            raise UsageError(f"{name} is {labelled(str(value))!r}; expected a short text with a unit")
    said = {name: value.strip() for name, value in given.items() if value.strip()}
    missing = [name for name in schema["required"] if name not in said]
    if missing:
        raise UsageError(f"of the twelve numbers {', '.join(missing)} are missing")
    options = [f"--{name.replace('_', '-')}={value}" for name, value in said.items()]
    return _said_by(["init", "--simple", *options, "-"])


def _said_by(arguments: list[str]) -> str:
    if not _AT_ONCE.acquire(timeout=PATIENCE_S):
        raise UsageError("others make machines at this moment; try again in a minute")
    try:
        return said_by_command(arguments, memory=MEMORY, seconds=int(PATIENCE_S))
    except UsageError:
        raise
    except ValueError:  # signs that no command takes
        raise UsageError("these numbers cannot be read; give texts with units") from None
    finally:
        _AT_ONCE.release()
