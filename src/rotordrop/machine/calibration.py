"""On which recorded drops the values of a machine file were calibrated."""

from __future__ import annotations

from pydantic import Field, StrictBool

from rotordrop.machine.description import Description, Misfit, Text


class CalibrationDrop(Description):
    """One recorded drop that a machine was calibrated on.

    Attributes
    ----------
    name : str
        Name of the recording, as it is, with commas and blanks.
    sha256 : str
        Hash of its file; empty where there was no file.
    """

    name: Text
    sha256: Text = Field(default="", description="SHA-256 of the file of the recording")


class CalibrationOrigin(Description):
    """Where the estimates of a calibrated machine come from; written by ``rotordrop calibrate``.

    Attributes
    ----------
    drops : tuple of CalibrationDrop
        Recorded drops that the machine was fitted to.
    consistent : bool
        Whether the model agreed with all of them.
    """

    drops: tuple[CalibrationDrop, ...] = Field(min_length=1)
    consistent: StrictBool = Field(description="Whether the model agreed with all drops")

    def check(self) -> None:
        """Refuse a drop that is named twice."""
        seen: set[str] = set()
        for index, drop in enumerate(self.drops):
            if drop.name in seen:
                raise Misfit(
                    f"the drop {drop.name!r} stands twice in the calibration; names must differ",
                    ("drops", index, "name"),
                )
            seen.add(drop.name)
