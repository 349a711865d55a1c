"""One recorded drop: reading it, and its channels in SI units on one clock."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rotordrop.record.axes import sensor_planes as sensor_planes
    from rotordrop.record.examples import example_record_names as example_record_names
    from rotordrop.record.examples import example_record_path as example_record_path
    from rotordrop.record.profile import Profile as Profile
    from rotordrop.record.profile import load_profile as load_profile
    from rotordrop.record.profile import save_profile as save_profile
    from rotordrop.record.record import Record as Record
    from rotordrop.record.record import read_record as read_record
    from rotordrop.record.record import save_record as save_record
    from rotordrop.record.recording import recording_of as recording_of
    from rotordrop.record.speed import SpeedAtDrop as SpeedAtDrop
    from rotordrop.record.speed import smooth_speed as smooth_speed
    from rotordrop.record.speed import speed_at_drop as speed_at_drop
    from rotordrop.record.writers import write_delimited as write_delimited
    from rotordrop.record.writers import write_hdf5 as write_hdf5

_PUBLIC = {
    "axes": ("sensor_planes",),
    "examples": ("example_record_names", "example_record_path"),
    "profile": ("Profile", "load_profile", "save_profile"),
    "recording": ("recording_of",),
    "record": ("Record", "read_record", "save_record"),
    "speed": ("SpeedAtDrop", "smooth_speed", "speed_at_drop"),
    "writers": ("write_delimited", "write_hdf5"),
}
_HOME = {name: module for module, names in _PUBLIC.items() for name in names}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'rotordrop.record' has no attribute {name!r}")
    return getattr(import_module(f"rotordrop.record.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(_HOME)
