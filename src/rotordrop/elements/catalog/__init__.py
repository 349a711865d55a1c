"""Bearings by designation: catalogue values, and ball complements where the maker does not publish them."""

from rotordrop.elements.catalog.designation import Designation, read_designation
from rotordrop.elements.catalog.inference import PairRigidity
from rotordrop.elements.catalog.lookup import (
    PRELOAD_FACTOR,
    BallComplement,
    CatalogueBearing,
    PreloadClass,
    ball_size,
    designations,
    find_bearing,
    search_bearings,
)

__all__ = [
    "PRELOAD_FACTOR",
    "BallComplement",
    "CatalogueBearing",
    "Designation",
    "PairRigidity",
    "PreloadClass",
    "ball_size",
    "designations",
    "find_bearing",
    "read_designation",
    "search_bearings",
]
