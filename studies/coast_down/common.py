"""What the scripts of this folder share: the machine with its drag, and where results go."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from rotordrop.machine import Machine, load_machine

RESULTS = Path(__file__).parent / "results"


def arguments(text: str | None) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=text)
    parser.add_argument("machine", type=Path)
    parser.add_argument("--record", type=Path, help="recorded coast-down whose speed gives the drag")
    return parser


def machine_with_drag(path: Path, record: Path | None) -> Machine:
    machine = load_machine(path)
    if record is None:
        return machine
    from rotordrop.estimate.recorded_coast_down import recorded_coast_down, with_recorded_drag
    from rotordrop.record.record import read_record

    return with_recorded_drag(machine, recorded_coast_down(machine, read_record(record, machine)))


def keep(name: str, content: dict[str, Any]) -> None:
    RESULTS.mkdir(exist_ok=True)
    text = json.dumps(content, indent=1, ensure_ascii=False)
    (RESULTS / f"{name}.json").write_text(text + "\n", encoding="utf-8")
    print(text)
