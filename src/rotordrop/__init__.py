"""From a recorded rotor drop to touchdown-bearing force and stress.

The public names below are loaded when first used, so that ``import rotordrop`` stays light.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rotordrop._version import __version__

if TYPE_CHECKING:
    from rotordrop.document import read_document as read_document
    from rotordrop.elements.catalog.lookup import find_bearing as find_bearing
    from rotordrop.errors import RotordropError as RotordropError
    from rotordrop.estimate.changed import changes as changes
    from rotordrop.estimate.coast_down import waterfall as waterfall
    from rotordrop.estimate.published import read_drop as read_drop
    from rotordrop.estimation import Replay as Replay
    from rotordrop.estimation import Tracked as Tracked
    from rotordrop.estimation import estimate_drop as estimate_drop
    from rotordrop.estimation import estimate_drops as estimate_drops
    from rotordrop.evidence.look import look as look
    from rotordrop.evidence.quality import check_record as check_record
    from rotordrop.examples import example_record_path as example_record_path
    from rotordrop.known import Known as Known
    from rotordrop.ledger.book import read_log as read_log
    from rotordrop.machine import Machine as Machine
    from rotordrop.machine import example_machine as example_machine
    from rotordrop.machine import load_machine as load_machine
    from rotordrop.machine.saving import save_machine as save_machine
    from rotordrop.machine.schema import machine_schema as machine_schema
    from rotordrop.record.record import Record as Record
    from rotordrop.record.record import read_record as read_record
    from rotordrop.rotor.campbell import campbell_diagram as campbell_diagram
    from rotordrop.rotor.critical_speeds import critical_speed_map as critical_speed_map
    from rotordrop.rotor.parameters import DropModel as DropModel
    from rotordrop.rotor.parameters import build_drop_model as build_drop_model
    from rotordrop.severity.ranking import DropSeverity as DropSeverity
    from rotordrop.severity.ranking import rank_drops as rank_drops
    from rotordrop.simulate.case import CoastDownCase as CoastDownCase
    from rotordrop.simulate.case import DropCase as DropCase
    from rotordrop.simulate.case import LevitatedStart as LevitatedStart
    from rotordrop.simulate.case import PlacedStart as PlacedStart
    from rotordrop.simulate.case import UnbalanceJump as UnbalanceJump
    from rotordrop.simulate.coast_down import simulate_coast_down as simulate_coast_down
    from rotordrop.simulate.drop import simulate_drop as simulate_drop
    from rotordrop.simulate.result import DropResult as DropResult
    from rotordrop.simulate.result import load_result as load_result
    from rotordrop.study.plan import load_study as load_study
    from rotordrop.study.run import run_study as run_study
    from rotordrop.study.run import sweep as sweep
    from rotordrop.track.force_estimate import ForceEstimate as ForceEstimate
    from rotordrop.track.force_estimate import estimate_force as estimate_force
    from rotordrop.twin.calibrated import calibrate_machine as calibrate_machine
    from rotordrop.units import format_quantity as format_quantity
    from rotordrop.units import parse_quantity as parse_quantity

_PUBLIC = {
    name: f"rotordrop.{module}"
    for module, names in {
        "document": "read_document",
        "elements.catalog.lookup": "find_bearing",
        "errors": "RotordropError",
        "estimate.changed": "changes",
        "estimate.published": "read_drop",
        "estimate.coast_down": "waterfall",
        "estimation": "Replay Tracked estimate_drop estimate_drops",
        "evidence.look": "look",
        "evidence.quality": "check_record",
        "examples": "example_record_path",
        "known": "Known",
        "ledger.book": "read_log",
        "machine": "Machine example_machine load_machine",
        "machine.saving": "save_machine",
        "machine.schema": "machine_schema",
        "record.record": "Record read_record",
        "rotor.campbell": "campbell_diagram",
        "rotor.critical_speeds": "critical_speed_map",
        "rotor.parameters": "DropModel build_drop_model",
        "severity.ranking": "DropSeverity rank_drops",
        "simulate.case": "CoastDownCase DropCase LevitatedStart PlacedStart UnbalanceJump",
        "simulate.coast_down": "simulate_coast_down",
        "simulate.drop": "simulate_drop",
        "simulate.result": "DropResult load_result",
        "study.plan": "load_study",
        "study.run": "run_study sweep",
        "track.force_estimate": "ForceEstimate estimate_force",
        "twin.calibrated": "calibrate_machine",
        "units": "format_quantity parse_quantity",
    }.items()
    for name in names.split()
}

__all__ = ["__version__", *_PUBLIC]


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        words = f"module 'rotordrop' has no attribute {name!r}"
        raise AttributeError(words, name=name, obj=sys.modules[__name__])  # Python names the nearest one
    value = getattr(import_module(_PUBLIC[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
