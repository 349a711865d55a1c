"""What describes a ball bearing: the numbers its physics needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol, SupportsFloat

Arrangement = Literal["X", "O", "tandem", "single"]


class BallBearingDescription(Protocol):
    """What the physics needs to know of a ball bearing: the machine's bearing and `BallBearingGeometry` fit.

    Source: Neisi 2020, Fig. 1.
    """

    @property
    def ball_diameter(self) -> SupportsFloat:
        """Ball diameter [m]."""
        ...

    @property
    def ball_count(self) -> int:
        """Balls per row [1]."""
        ...

    @property
    def pitch_diameter(self) -> SupportsFloat:
        """Pitch diameter [m]."""
        ...

    @property
    def contact_angle(self) -> SupportsFloat:
        """Nominal contact angle [rad]."""
        ...

    @property
    def conformity_inner(self) -> SupportsFloat:
        """Groove radius of the inner race over ball diameter [1]."""
        ...

    @property
    def conformity_outer(self) -> SupportsFloat:
        """Groove radius of the outer race over ball diameter [1]."""
        ...

    @property
    def ring_youngs_modulus(self) -> SupportsFloat:
        """Young's modulus of the rings [Pa]."""
        ...

    @property
    def ring_poisson_ratio(self) -> SupportsFloat:
        """Poisson ratio of the rings [1]."""
        ...

    @property
    def ball_youngs_modulus(self) -> SupportsFloat:
        """Young's modulus of the balls [Pa]."""
        ...

    @property
    def ball_poisson_ratio(self) -> SupportsFloat:
        """Poisson ratio of the balls [1]."""
        ...

    @property
    def ball_density(self) -> SupportsFloat:
        """Density of the balls [kg/m³]."""
        ...

    @property
    def preload(self) -> SupportsFloat:
        """Axial preload of each row [N]."""
        ...

    @property
    def clearance(self) -> SupportsFloat | None:
        """Radial internal clearance P_d, across the diameter [m]; None where the contact angle is given."""
        ...

    @property
    def arrangement(self) -> Arrangement:
        """Arrangement of the rows."""
        ...

    @property
    def first_ball_angle(self) -> SupportsFloat:
        """Angle of the first ball from +y towards −x [rad]."""
        ...

    @property
    def second_row_offset(self) -> SupportsFloat:
        """Angle of the second row against the first, fraction of the ball pitch [1]."""
        ...


@dataclass(frozen=True, kw_only=True)
class BallBearingGeometry:
    """A ball bearing by plain numbers [SI]; the default materials are steel rings and silicon nitride balls.

    Notes
    -----
    Source: Neisi 2020, Fig. 1.
    """

    ball_diameter: float
    ball_count: int
    """Balls per row [1]."""
    pitch_diameter: float
    """D_w and D_pw [m]."""
    contact_angle: float
    """Nominal contact angle α₀ [rad]."""
    conformity_inner: float
    conformity_outer: float
    """Groove radius over ball diameter [1]."""
    ring_youngs_modulus: float = 208e9
    ring_poisson_ratio: float = 0.3
    ball_youngs_modulus: float = 315e9
    """Young's moduli [Pa]."""
    ball_poisson_ratio: float = 0.26
    """Poisson ratios [1]."""
    ball_density: float = 3200.0
    """Density of the balls [kg/m³]."""
    preload: float = 0.0
    """Axial preload of each row [N]."""
    clearance: float | None = None
    """Radial internal clearance P_d, across the diameter [m]. Rows of deep grooves (α₀ = 0) get their free
    contact angle from it; in an X or O pair with a contact angle it is the play of the mounted pair."""
    arrangement: Arrangement = "X"
    """"X" (face to face), "O" (back to back), "tandem" or "single"."""
    first_ball_angle: float = 0.0
    """Angle of the first ball from +y towards −x [rad]."""
    second_row_offset: float = 0.0
    """Angle of the second row against the first, as a fraction of the ball pitch [1]."""
