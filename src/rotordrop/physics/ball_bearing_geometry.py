"""What describes a ball bearing: the numbers its physics needs."""

from __future__ import annotations

from typing import Literal, Protocol, SupportsFloat

Arrangement = Literal["X", "O", "tandem", "single"]


class BallBearingDescription(Protocol):
    """What the physics needs to know of a ball bearing: a bearing of a machine fits.

    Source: Neisi 2020, Fig. 1.
    """

    @property
    def ball_diameter(self) -> SupportsFloat:
        """Ball diameter [m]."""

    @property
    def ball_count(self) -> int:
        """Balls per row [1]."""

    @property
    def pitch_diameter(self) -> SupportsFloat:
        """Pitch diameter [m]."""

    @property
    def contact_angle(self) -> SupportsFloat:
        """Nominal contact angle [rad]."""

    @property
    def conformity_inner(self) -> SupportsFloat:
        """Groove radius of the inner race over ball diameter [1]."""

    @property
    def conformity_outer(self) -> SupportsFloat:
        """Groove radius of the outer race over ball diameter [1]."""

    @property
    def ring_youngs_modulus(self) -> SupportsFloat:
        """Young's modulus of the rings [Pa]."""

    @property
    def ring_poisson_ratio(self) -> SupportsFloat:
        """Poisson ratio of the rings [1]."""

    @property
    def ball_youngs_modulus(self) -> SupportsFloat:
        """Young's modulus of the balls [Pa]."""

    @property
    def ball_poisson_ratio(self) -> SupportsFloat:
        """Poisson ratio of the balls [1]."""

    @property
    def ball_density(self) -> SupportsFloat:
        """Density of the balls [kg/m³]."""

    @property
    def preload(self) -> SupportsFloat:
        """Axial preload of each row [N]."""

    @property
    def clearance(self) -> SupportsFloat | None:
        """Radial internal clearance P_d, across the diameter [m]; None where the contact angle is given."""

    @property
    def arrangement(self) -> Arrangement:
        """Arrangement of the rows."""

    @property
    def first_ball_angle(self) -> SupportsFloat:
        """Angle of the first ball from +y towards −x [rad]."""

    @property
    def second_row_offset(self) -> SupportsFloat:
        """Angle of the second row against the first, fraction of the ball pitch [1]."""
