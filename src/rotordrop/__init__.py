"""From a recorded rotor drop to touchdown-bearing force and stress.

The public names below are loaded when first used, so that ``import rotordrop`` stays light.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from rotordrop._version import __version__

if TYPE_CHECKING:
    from rotordrop.document import read_document as read_document
    from rotordrop.elements.catalog.lookup import find_bearing as find_bearing
    from rotordrop.errors import RotordropError as RotordropError
    from rotordrop.estimation import Replay as Replay
    from rotordrop.estimation import Tracked as Tracked
    from rotordrop.estimation import estimate_drop as estimate_drop
    from rotordrop.estimation import estimate_drops as estimate_drops
    from rotordrop.evidence.look import look as look
    from rotordrop.evidence.quality import check_record as check_record
    from rotordrop.known import Known as Known
    from rotordrop.machine import Machine as Machine
    from rotordrop.machine import example_machine as example_machine
    from rotordrop.machine import load_machine as load_machine
    from rotordrop.machine.saving import save_machine as save_machine
    from rotordrop.machine.schema import machine_schema as machine_schema
    from rotordrop.record.examples import example_record_path as example_record_path
    from rotordrop.record.record import Record as Record
    from rotordrop.record.record import read_record as read_record
    from rotordrop.rotor.parameters import DropModel as DropModel
    from rotordrop.rotor.parameters import build_drop_model as build_drop_model
    from rotordrop.simulate.case import DropCase as DropCase
    from rotordrop.simulate.case import LevitatedStart as LevitatedStart
    from rotordrop.simulate.case import PlacedStart as PlacedStart
    from rotordrop.simulate.case import UnbalanceJump as UnbalanceJump
    from rotordrop.simulate.drop import simulate_drop as simulate_drop
    from rotordrop.simulate.result import DropResult as DropResult
    from rotordrop.simulate.result import load_result as load_result
    from rotordrop.study.plan import load_study as load_study
    from rotordrop.study.run import run_study as run_study
    from rotordrop.study.run import sweep as sweep
    from rotordrop.track.force_estimate import ForceEstimate as ForceEstimate
    from rotordrop.track.force_estimate import estimate_force as estimate_force
    from rotordrop.twin.calibrated import calibrate_machine as calibrate_machine
    from rotordrop.twin.stream import StreamStep as StreamStep
    from rotordrop.twin.stream import track_stream as track_stream
    from rotordrop.units import format_quantity as format_quantity
    from rotordrop.units import parse_quantity as parse_quantity

_PUBLIC = {
    "DropCase": "rotordrop.simulate.case",
    "DropModel": "rotordrop.rotor.parameters",
    "DropResult": "rotordrop.simulate.result",
    "ForceEstimate": "rotordrop.track.force_estimate",
    "Known": "rotordrop.known",
    "LevitatedStart": "rotordrop.simulate.case",
    "Machine": "rotordrop.machine",
    "PlacedStart": "rotordrop.simulate.case",
    "Record": "rotordrop.record.record",
    "RotordropError": "rotordrop.errors",
    "Replay": "rotordrop.estimation",
    "Tracked": "rotordrop.estimation",
    "UnbalanceJump": "rotordrop.simulate.case",
    "build_drop_model": "rotordrop.rotor.parameters",
    "calibrate_machine": "rotordrop.twin.calibrated",
    "check_record": "rotordrop.evidence.quality",
    "estimate_drop": "rotordrop.estimation",
    "estimate_drops": "rotordrop.estimation",
    "estimate_force": "rotordrop.track.force_estimate",
    "find_bearing": "rotordrop.elements.catalog.lookup",
    "example_machine": "rotordrop.machine",
    "example_record_path": "rotordrop.record.examples",
    "format_quantity": "rotordrop.units",
    "load_machine": "rotordrop.machine",
    "load_result": "rotordrop.simulate.result",
    "load_study": "rotordrop.study.plan",
    "look": "rotordrop.evidence.look",
    "machine_schema": "rotordrop.machine.schema",
    "parse_quantity": "rotordrop.units",
    "read_document": "rotordrop.document",
    "read_record": "rotordrop.record.record",
    "run_study": "rotordrop.study.run",
    "save_machine": "rotordrop.machine.saving",
    "simulate_drop": "rotordrop.simulate.drop",
    "StreamStep": "rotordrop.twin.stream",
    "sweep": "rotordrop.study.run",
    "track_stream": "rotordrop.twin.stream",
}

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'rotordrop' has no attribute {name!r}")
    value = getattr(import_module(_PUBLIC[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
