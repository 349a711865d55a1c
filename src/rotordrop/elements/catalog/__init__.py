"""Bearings by designation: catalogue values, and ball complements where the maker does not publish them."""
