"""Bearings by designation: catalogue values, and ball complements where the maker does not publish them."""

from rotordrop.machine.catalog.lookup import (
    BallComplement,
    CatalogueBearing,
    PreloadClass,
    ball_size,
    designations,
    find_bearing,
)

__all__ = ["BallComplement", "CatalogueBearing", "PreloadClass", "ball_size", "designations", "find_bearing"]
