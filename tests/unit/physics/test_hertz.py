"""Laws of the Hertz contact: limits, scaling, energy, and equivalence of the two ways to a number."""

import math

import numpy as np
import pytest

from rotordrop.physics import hertz

STEEL = (208e9, 0.3)
SILICON_NITRIDE = (315e9, 0.26)
ETA = hertz.compliance(*STEEL, *SILICON_NITRIDE)
KAPPAS = np.array([1.0 + 1e-9, 1.001, 1.5, 4.0, 12.0, 80.0])


def test_the_ellipse_of_any_curvature_difference():
    """F = 3/4 (κ − 1) to first order, where the textbook form has lost all its digits."""
    assert hertz.curvature_difference_of_ellipticity(1.0 + 1e-9) == pytest.approx(0.75e-9, rel=1e-6)
    F_rho = hertz.curvature_difference_of_ellipticity(KAPPAS)
    np.testing.assert_allclose(hertz.ellipticity(F_rho), KAPPAS, rtol=1e-11)
    np.testing.assert_allclose(hertz.contact_parameters(0.0), (1.0, 1.0, 1.0), rtol=1e-15)


@pytest.mark.parametrize("factor", [0.1, 8.0, 1000.0])
def test_powers_of_the_load(factor):
    contact = hertz.race_contact(0.009525, 0.085, 0.53, 0.4, ETA, inner=True)
    a, b = contact.semi_axes(50.0)
    a_2, b_2 = contact.semi_axes(50.0 * factor)
    assert (a_2 / a, b_2 / b) == pytest.approx((factor ** (1 / 3),) * 2, rel=1e-13)
    assert contact.approach(50.0 * factor) == pytest.approx(
        contact.approach(50.0) * factor ** (2 / 3), rel=1e-13
    )
    assert contact.maximum_pressure(50.0 * factor) == pytest.approx(
        contact.maximum_pressure(50.0) * factor ** (1 / 3), rel=1e-13
    )
    assert contact.stiffness * contact.approach(50.0) ** 1.5 == pytest.approx(50.0, rel=1e-13)


def test_lines_and_straight_grooves_are_limits_of_the_ellipse():
    inner = hertz.race_curvatures(0.01, 1e9, 0.53, 0.0, inner=True)
    outer = hertz.race_curvatures(0.01, 1e9, 0.53, 0.0, inner=False)
    straight = ((4.0 - 1.0 / 0.53) / 0.01, (1.0 / 0.53) / (4.0 - 1.0 / 0.53))
    assert inner == pytest.approx(straight, rel=1e-9)
    assert outer == pytest.approx(straight, rel=1e-9)
    line = hertz.LineContact(radius=0.05, length=1.0, compliance=1e-11)
    assert line.maximum_pressure(1e5) * line.half_width(1e5) * math.pi / 2.0 == pytest.approx(1e5, rel=1e-12)
    assert line.maximum_pressure(4e5) == pytest.approx(2.0 * line.maximum_pressure(1e5), rel=1e-12)
    open_, close = (hertz.cylinder_in_bore(0.03, 0.03 + gap, 0.036, 1e-11) for gap in (300e-6, 100e-6))
    assert open_.radius == pytest.approx(0.03 * 0.0303 / 300e-6)
    assert close.maximum_pressure(1e3) < open_.maximum_pressure(1e3)
    assert close.half_width(1e3) > open_.half_width(1e3)


def test_contacts_in_series_add_their_approaches():
    K = hertz.contacts_in_series(2e10, 5e10)
    Q = 123.0
    approach = (Q / 2e10) ** (2 / 3) + (Q / 5e10) ** (2 / 3)
    assert K * approach**1.5 == pytest.approx(Q, rel=1e-13)
