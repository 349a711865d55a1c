"""On which recorded drops the values of a machine file were calibrated."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, StrictBool

from rotordrop.elements.description import Description, Misfit, Text


class RecordedLift(Description):
    """The remanent force of one magnet in one recorded drop, over the weight that the magnet carries."""

    magnet: Text
    """Name of the magnet."""
    sideways: float
    """Its two parts [1]."""
    sideways_error: float = Field(gt=0.0)
    """Their standard errors, what was known before the record included [1]."""
    up: float
    """Its two parts [1]."""
    up_error: float = Field(gt=0.0)
    """Their standard errors, what was known before the record included [1]."""


class CalibrationDrop(Description):
    """One recorded drop that a machine was calibrated on."""

    name: Text
    """Name of the recording, as it is, with commas and blanks."""
    sha256: Text = ""
    """Hash of its file; empty where there was no file."""
    lift: tuple[RecordedLift, ...] = ()
    """What the drop showed of the remanent force of each magnet; no other drop need have it."""


class JointSpread(Description):
    """How the errors of calibrated values belong together."""

    paths: tuple[Text, ...] = Field(min_length=1)
    """Values by path, such as ``"NDE.support.stiffness"``; their own numbers in the file are the middle."""
    logarithmic: tuple[StrictBool, ...]
    """Whether the natural logarithm of each is normal, or the value [SI] itself."""
    covariance: tuple[float, ...]
    """Lower triangle of the covariance, row by row with its diagonal."""

    def check(self) -> None:
        """Refuse a covariance that is none, or none of these values."""
        n = len(self.paths)
        for name, expected in (("logarithmic", n), ("covariance", n * (n + 1) // 2)):
            if len(getattr(self, name)) != expected:
                raise Misfit(
                    f"{len(getattr(self, name))} entries; {n} paths need {expected} of them", (name,)
                )
        matrix = self.matrix
        largest = float(np.abs(matrix).max())
        if not np.isfinite(matrix).all() or np.linalg.eigvalsh(matrix).min() < -1e-9 * largest:
            raise Misfit("the covariance has a negative variance in some direction", ("covariance",))

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The covariance, shape (n, n), of the logarithms or the values [SI]."""
        n = len(self.paths)
        lower = np.zeros((n, n))
        lower[np.tril_indices(n)] = self.covariance
        return lower + np.tril(lower, -1).T


class CalibrationOrigin(Description):
    """Where the estimates of a calibrated machine come from; written by ``rotordrop calibrate``."""

    drops: tuple[CalibrationDrop, ...] = Field(min_length=1)
    """Recorded drops that the machine was fitted to."""
    consistent: StrictBool
    """Whether the model agreed with all of them."""
    joint: JointSpread | None = None
    """How the errors of the values belong together: their distribution for a study."""

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
