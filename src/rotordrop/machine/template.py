"""A commented machine file to start from."""

from __future__ import annotations

from importlib.resources import files


def template_text() -> str:
    """Give a complete, commented machine file that can be read as it stands."""
    return (files("rotordrop.machine") / "template.toml").read_text(encoding="utf-8")
