"""Machines that ship with rotordrop."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from rotordrop.machine.loading import load_machine
from rotordrop.machine.machine import Machine
from rotordrop.require import require

_EXAMPLES = {
    "paper": "the reference machine, reconstructed from Neisi et al. 2020",
    "lp400": "the machine of the supplied records, as its owner knows it",
    "small": "an invented high-speed compressor rotor of 13 kg at 500 Hz, for studies",
}


def template_text() -> str:
    """Give a complete, commented machine file that can be read as it stands."""
    return (files("rotordrop.machine") / "template.toml").read_text(encoding="utf-8")


def example_names() -> tuple[str, ...]:
    """Names of the machines that ship with rotordrop."""
    return tuple(_EXAMPLES)


def example_path(name: str) -> Path:
    """Path of the machine file of an example."""
    require(name, "example machine", str, among=_EXAMPLES)
    return Path(str(files("rotordrop.machine.examples") / f"{name}.toml"))


def example_machine(name: str) -> Machine:
    """Load a machine that ships with rotordrop: "paper", "lp400" or "small"."""
    return load_machine(example_path(name))
