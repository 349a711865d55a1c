"""What a machine is: frozen descriptions, read from and written to a TOML file with units."""

from rotordrop.machine.examples import example_machine, example_names, example_path
from rotordrop.machine.loading import load_machine, loads_machine
from rotordrop.machine.machine import Machine

__all__ = ["Machine", "example_machine", "example_names", "example_path", "load_machine", "loads_machine"]
