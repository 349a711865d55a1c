"""Rotors as other programs write them: files of ROSS, shaft tables of spreadsheets and print-outs."""

from __future__ import annotations

from pathlib import Path

from rotordrop.elements.rotor import Rotor
from rotordrop.errors import MachineFileError
from rotordrop.machine.ross_files import ImportedRotor, read_ross
from rotordrop.machine.shaft_table import SECTION_LINE, read_shaft_table

TABLES = (".csv", ".txt", ".tsv", ".xlsx", ".xlsm")


def read_rotor(path: str | Path) -> ImportedRotor:
    """Read a rotor from a file of ROSS (.toml, .json) or a shaft table (.csv, .txt, .xlsx).

    Raises
    ------
    MachineFileError
        If the file holds no rotor; names what is missing.
    """
    path = Path(path)
    if not path.is_file():
        raise MachineFileError("there is no such file", file=path)
    if path.suffix.lower() in (".toml", ".json"):
        return read_ross(path)
    if path.suffix.lower() not in TABLES:
        raise MachineFileError(
            f"{path.suffix or 'no suffix'!r} is no format of a rotor; give a file of ROSS (.toml, .json) or "
            f"a shaft table ({', '.join(TABLES)})",
            file=path,
        )
    table = read_shaft_table(path)
    for section in table["sections"]:
        section.pop(SECTION_LINE, None)
    notes = tuple(table.pop("notes", ()))
    try:
        rotor = Rotor.model_validate(table)
    except ValueError as error:
        raise MachineFileError(f"the table describes no rotor: {error}", file=path) from error
    return ImportedRotor(rotor=rotor, springs=(), source=f"shaft table {path.name}", notes=notes)
