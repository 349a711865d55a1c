"""Where the energy of a simulated drop goes: contact, friction, ball set, support, ring, bending."""

from __future__ import annotations

from dataclasses import dataclass

from rotordrop.arrays import Array
from rotordrop.physics import columns as L
from rotordrop.rotor.parameters import DropModel
from rotordrop.simulate import _rhs as R
from rotordrop.simulate.result import DropResult


@dataclass(frozen=True, kw_only=True)
class Losses:
    """Energy that a drop dissipated, by place [J]; shape (B,) where it belongs to a bearing."""

    sliding: Array
    """Heat of sliding between rotor and race."""
    contact: Array
    """Lost in the normal direction of the contacts."""
    ball_set: Array
    """Damping between race and support."""
    support: Array
    """Damping of support and foundation."""
    drag: Array
    """Friction inside the bearing that brakes the race."""
    spin_up: Array
    """Work of friction on the spin of the race: its kinetic energy and what drag took of it. No loss of its
    own: the drag is counted above, the rest is still in the race."""
    bending: float
    """Damping of the rotor's modes."""
    rubbing: float
    """Contacts of the rotor with its housing."""
    coils: float
    """Resistance of the coils of magnets in the loop."""

    @property
    def total(self) -> float:
        """Sum of all that is lost; the book of the time loop."""
        parts = (self.sliding, self.contact, self.ball_set, self.support, self.drag)
        return float(sum(part.sum() for part in parts)) + self.bending + self.rubbing + self.coils


def losses(model: DropModel, result: DropResult) -> Losses:
    """Split the energy that a drop dissipated, as the time loop booked it over its accepted steps.

    Source: the powers of the right-hand side (Neisi 2020, eqs. 1, 9 and 11), place by place.
    """
    lost, spin = result.lost[:-1], result.race_speed
    gained = 0.5 * model.parameters.bearing[:, L.RACE_INERTIA] * (spin[-1] ** 2 - spin[0] ** 2)
    return Losses(
        sliding=lost[:, R.SLIDING],
        contact=lost[:, R.IN_CONTACT],
        ball_set=lost[:, R.BALL_SET],
        support=lost[:, R.SUPPORT],
        drag=lost[:, R.DRAG],
        spin_up=gained + lost[:, R.DRAG],
        bending=float(result.lost[-1, R.BENDING]),
        rubbing=float(result.lost[-1, R.RUBBING]),
        coils=float(result.lost[-1, R.COILS]),
    )
