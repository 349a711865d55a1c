"""On which recorded drops the values of a machine file were calibrated."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, StrictBool

from rotordrop.elements.description import Description, Misfit, Text


class RecordedLift(Description):
    """The remanent force of one magnet in one recorded drop, over the weight that the magnet carries.

    Attributes
    ----------
    magnet : str
        Name of the magnet.
    sideways, up : float
        Its two parts [1].
    sideways_error, up_error : float
        Their standard errors, what was known before the record included [1].
    """

    magnet: Text
    sideways: float
    sideways_error: float = Field(gt=0.0)
    up: float
    up_error: float = Field(gt=0.0)


class CalibrationDrop(Description):
    """One recorded drop that a machine was calibrated on.

    Attributes
    ----------
    name : str
        Name of the recording, as it is, with commas and blanks.
    sha256 : str
        Hash of its file; empty where there was no file.
    lift : tuple of RecordedLift
        What the drop showed of the remanent force of each magnet; no other drop need have it.
    """

    name: Text
    sha256: Text = Field(default="", description="SHA-256 of the file of the recording")
    lift: tuple[RecordedLift, ...] = Field(
        default=(), description="Remanent force of each magnet in this drop, over the weight it carries"
    )


class JointSpread(Description):
    """How the errors of calibrated values belong together.

    Attributes
    ----------
    paths : tuple of str
        Values by path, such as ``"NDE.support.stiffness"``; their own numbers in the file are the middle.
    logarithmic : tuple of bool
        Whether the natural logarithm of each is normal, or the value [SI] itself.
    covariance : tuple of float
        Lower triangle of the covariance, row by row with its diagonal.
    """

    paths: tuple[Text, ...] = Field(min_length=1)
    logarithmic: tuple[StrictBool, ...]
    covariance: tuple[float, ...]

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
    """Where the estimates of a calibrated machine come from; written by ``rotordrop calibrate``.

    Attributes
    ----------
    drops : tuple of CalibrationDrop
        Recorded drops that the machine was fitted to.
    consistent : bool
        Whether the model agreed with all of them.
    joint : JointSpread, optional
        How the errors of the values belong together: their distribution for a study.
    """

    drops: tuple[CalibrationDrop, ...] = Field(min_length=1)
    consistent: StrictBool = Field(description="Whether the model agreed with all drops")
    joint: JointSpread | None = Field(
        default=None, description="How the errors of the calibrated values belong together"
    )

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
