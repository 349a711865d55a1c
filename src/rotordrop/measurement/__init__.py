"""One recorded drop: reading it, trusting it, and finding what happens when."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotordrop.measurement.axes import planar as planar
    from rotordrop.measurement.axes import sensor_planes as sensor_planes
    from rotordrop.measurement.contacts import EarlyForces as EarlyForces
    from rotordrop.measurement.contacts import FirstForce as FirstForce
    from rotordrop.measurement.contacts import early_forces as early_forces
    from rotordrop.measurement.contacts import first_forces as first_forces
    from rotordrop.measurement.events import DropInstant as DropInstant
    from rotordrop.measurement.events import find_drop_instant as find_drop_instant
    from rotordrop.measurement.examples import example_record_names as example_record_names
    from rotordrop.measurement.examples import example_record_path as example_record_path
    from rotordrop.measurement.levitated import LevitatedModel as LevitatedModel
    from rotordrop.measurement.levitated import fit_levitated as fit_levitated
    from rotordrop.measurement.preprocess import local_polynomial as local_polynomial
    from rotordrop.measurement.profile import Profile as Profile
    from rotordrop.measurement.profile import load_profile as load_profile
    from rotordrop.measurement.profile import save_profile as save_profile
    from rotordrop.measurement.quality import Finding as Finding
    from rotordrop.measurement.quality import check_record as check_record
    from rotordrop.measurement.quality import refuse_unusable as refuse_unusable
    from rotordrop.measurement.record import Record as Record
    from rotordrop.measurement.record import read_record as read_record
    from rotordrop.measurement.record import save_record as save_record
    from rotordrop.measurement.settled import SettledTail as SettledTail
    from rotordrop.measurement.settled import settled_tail as settled_tail
    from rotordrop.measurement.speed import SpeedAtDrop as SpeedAtDrop
    from rotordrop.measurement.speed import smooth_speed as smooth_speed
    from rotordrop.measurement.speed import speed_at_drop as speed_at_drop
    from rotordrop.measurement.writers import recording_of as recording_of
    from rotordrop.measurement.writers import write_delimited as write_delimited
    from rotordrop.measurement.writers import write_hdf5 as write_hdf5

_PUBLIC = {
    "axes": ("planar", "sensor_planes"),
    "contacts": ("EarlyForces", "FirstForce", "early_forces", "first_forces"),
    "events": ("DropInstant", "find_drop_instant"),
    "examples": ("example_record_names", "example_record_path"),
    "levitated": ("LevitatedModel", "fit_levitated"),
    "preprocess": ("local_polynomial",),
    "profile": ("Profile", "load_profile", "save_profile"),
    "quality": ("Finding", "check_record", "refuse_unusable"),
    "record": ("Record", "read_record", "save_record"),
    "settled": ("SettledTail", "settled_tail"),
    "speed": ("SpeedAtDrop", "smooth_speed", "speed_at_drop"),
    "writers": ("recording_of", "write_delimited", "write_hdf5"),
}
_HOME = {name: module for module, names in _PUBLIC.items() for name in names}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'rotordrop.measurement' has no attribute {name!r}")
    return getattr(import_module(f"rotordrop.measurement.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(_HOME)
