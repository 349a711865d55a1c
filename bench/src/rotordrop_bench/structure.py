"""What violations make of a machine: other values, and structures that no estimator's model has."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from operator import attrgetter
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.elements.bearing_numbers import numbers_of
from rotordrop.elements.clearance import Clearance
from rotordrop.elements.touchdown_bearing import TouchdownBearing
from rotordrop.errors import UsageError
from rotordrop.known import Known
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.physics.contact import contact_law, stiffness_of_exponent
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop_bench import departure as D
from rotordrop_bench.departing import departures_in
from rotordrop_bench.violations import BearingViolations, Violations

PULL_LASTS, PULL_POINTS = 6.0, 61
"""Time constants after which a pull is gone, and points of its course: straight between two of them it is
within 0.2 % of the largest; chosen, not measured."""
TYPICAL_LOADS = 5.0
"""Force over the mean load of a bearing at which a contact with another exponent is as deep as before [1]."""
LARGEST_LOADS = 60.0
"""Load over the static load of a bearing up to which its table goes, with room besides [1]; chosen."""
SMEARED = 4
"""Places per ball at which the ring of balls is summed up [1]; chosen."""


def violated(machine: Machine, violations: Violations) -> Machine:
    """The machine with those violations that are other values of what it has already."""
    values: dict[str, float] = {}
    weight = machine.rotor.mass * float(machine.gravity)
    typical = TYPICAL_LOADS * weight / len(machine.touchdown_bearings)
    for bearing in machine.touchdown_bearings:
        mine = _of_bearing(bearing, violations.of_bearing(bearing.name), typical)
        values |= {f"{bearing.name}.{path}": value for path, value in mine.items()}
    factor = float(violations.rotor.unbalance)
    if factor != 1.0:
        for index, unbalance in enumerate(machine.unbalances):
            values[f"unbalance.{index}.amount"] = factor * float(unbalance.amount)
    machine = machine.with_values(values) if values else machine
    machine = machine.with_magnets_on(violations.magnets.stays_on)
    seal = violations.seal
    if seal is not None:
        gap = float(seal.gap) * max(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
        stiffness = f"{float(seal.stiffness)!r} N/m"
        place = Clearance(name="seal", node=seal.node, gap=f"{gap!r} m", stiffness=stiffness)
        place = place.completed_with(place.completed(machine.rotor))
        machine = machine.completed_with({"clearances": (*machine.clearances, place)})
    softer = float(violations.rotor.youngs_modulus)
    if softer == 1.0:
        return machine
    rotor = machine.rotor
    materials = {name: rotor.material_named(name) for name in {e.material for e in rotor.elements}}
    changed = {
        name: material.changed(youngs_modulus=f"{softer * float(material.youngs_modulus)!r} Pa")
        for name, material in materials.items()
    }
    return machine.completed_with({"rotor": rotor.changed(materials={**rotor.materials, **changed})})


def _of_bearing(bearing: TouchdownBearing, v: BearingViolations, typical: float) -> Mapping[str, float]:
    contact = bearing.contact
    stiffness = float(contact.stiffness) * float(v.contact.stiffness)
    values: dict[str, float] = {}
    if v.contact.exponent is not None:
        law = contact_law(stiffness, float(contact.exponent), float(contact.damping))
        exponent = float(v.contact.exponent)
        stiffness = stiffness_of_exponent(law, typical, exponent)
        values["contact.exponent"] = exponent
    rubs = 1.0 if v.friction.dynamic is None else float(v.friction.dynamic) / float(bearing.friction.dynamic)
    factors = {
        "contact.damping": float(v.contact.damping),
        "race.mass": float(v.race.mass),
        "race.inertia": float(v.race.inertia) * float(v.race.mass),
        "friction.stribeck_speed": float(v.friction.stribeck_speed),
        "friction.dynamic": rubs,
        "friction.static": rubs * float(v.friction.static),
        "support.stiffness_horizontal": float(v.support.stiffness_ratio),
        "support.damping": float(v.support.damping),
        "support.damping_horizontal": float(v.support.damping) * float(v.support.damping_ratio),
    }
    changed = {path: factor for path, factor in factors.items() if factor != 1.0}
    values |= {path: float(attrgetter(path)(bearing)) * factor for path, factor in changed.items()}
    if stiffness != float(contact.stiffness):
        values["contact.stiffness"] = stiffness
    if v.balls.first_ball_angle is not None:
        values["bearing.first_ball_angle"] = float(v.balls.first_ball_angle)
    return values


def departures_of(machine: Machine, violations: Violations) -> Array:
    """Departures of all bearings of a true machine, shape (B, C) [SI]; (0, C) where nothing departs."""
    rows = np.array(
        [
            _departure(b, violations.of_bearing(b.name), float(load))
            for b, load in zip(machine.touchdown_bearings, bearing_load_shares(machine), strict=True)
        ]
    )
    if violations.unbalance_jump is None and np.all(rows == D.no_departure()):
        return rows[:0]
    return rows


def _departure(bearing: TouchdownBearing, v: BearingViolations, load: float) -> Array:
    row = D.no_departure()
    support, foundation, balls = v.support, v.foundation, bearing.bearing
    for part in (support, v.gap, v.friction, v.balls, v.sleeve, v.centre):
        part.fill(row)
    angle = float(support.axes_angle)
    if angle != 0.0:
        row[[D.AXIS_COSINE, D.AXIS_SINE]] = math.cos(angle), math.sin(angle)
    deflection = float(support.hardening_force) / float(bearing.support.stiffness)
    row[D.HARDENING] = float(support.hardening) / deflection**2
    row[D.RADIAL] = float(support.hardening_radial and row[D.HARDENING] > 0.0)
    if row[D.LOOSE_WAY] > 0.0:
        row[D.TABLE_WAY_STEP :] = _seat_table(bearing, row[D.LOOSE_WAY], load)
    if foundation.mass is not None and foundation.frequency is not None:
        across = foundation.frequency_horizontal or foundation.frequency
        row[D.FOUNDATION_MODE : D.FOUNDATION_MODE + D.MODE_WIDTH] = _mode(
            1.0 / float(foundation.mass), float(across), float(foundation.frequency), foundation.damping_ratio
        )
    if v.race.tilt_stiffness is not None and v.race.tilt_frequency is not None:
        frequency = float(v.race.tilt_frequency)
        w = 2.0 * math.pi * frequency
        row[D.TILT_MODE : D.TILT_MODE + D.MODE_WIDTH] = _mode(
            w * w / float(v.race.tilt_stiffness), frequency, frequency, v.race.tilt_damping_ratio
        )
    if v.balls.turn:
        radial = float(balls.ball_diameter) * math.cos(float(balls.contact_angle))
        # turn of the cage per turn of the inner race
        row[D.CAGE_RATIO] = 0.5 * (1.0 - radial / float(balls.pitch_diameter))
    law = [(float(p.depth), float(p.force)) for p in v.contact.law]
    row[D.LAW_PIECES] = max(len(law) - 1, 0)
    for i, ((d1, f1), (d2, f2)) in enumerate(pairwise(law)):  # a power of the depth each
        exponent = math.log(f2 / f1) / math.log(d2 / d1)
        at = D.LAW + i * D.LAW_WIDTH
        row[at : at + D.LAW_UNTIL] = contact_law(f1 / d1**exponent, exponent, float(bearing.contact.damping))
        row[at + D.LAW_UNTIL] = d2
    return row


def _seat_table(bearing: TouchdownBearing, play: float, load: float) -> Array:
    """Step of the way [m], then force and largest load of a ball [N] behind a play [m]; (1 + 2 P,).

    ``load`` is the static load of the bearing [N]. A pair of rows is a smooth ring of balls, whose loads
    follow from where the grooves go.
    """
    numbers = numbers_of(bearing)
    c = numbers.constants
    if not (c.preloaded and len(c.axial_signs) == 2):
        raise UsageError(
            f"{bearing.name}: seat_play of balls needs a preloaded pair of rows, which this bearing is not; "
            "leave it out of its violations"
        )
    free = c.groove_distance * (1.0 - math.cos(c.contact_angle))
    step = (4.0 * numbers.deflection(LARGEST_LOADS * load)[0] + free) / (D.TABLE_POINTS - 1)
    places = SMEARED * len(c.ball_angles)
    cosine = np.cos(2.0 * math.pi * (np.arange(places) + 0.5) / places)
    found = []
    for i in range(D.TABLE_POINTS):
        radial = c.radial_offset + max(step * i - play, 0.0) * cosine
        apart = np.hypot(radial, c.axial_offset)
        pressed = c.ball_stiffness * np.maximum(apart - c.groove_distance, 0.0) ** 1.5
        found.append((2.0 * float((1.0 / SMEARED * pressed / apart) @ (radial * cosine)), max(pressed)))
    return np.concatenate([[step], *np.array(found).T])


def loosened(model: DropModel) -> DropModel:
    """The model whose races, where they are loose in their seats, lie in them by their weight."""
    bearing = model.parameters.bearing.copy()
    for row, own in zip(bearing, departures_in(model), strict=False):
        if own[D.LOOSE_WAY] > 0.0:
            row[L.RACE_WEIGHT] = row[L.RACE_MASS] * float(model.machine.gravity)
    return replace(model, parameters=model.parameters._replace(bearing=bearing))


def pushed(model: DropModel, violations: Violations) -> DropModel:
    """The model with what pushes its rotor beside level gravity and the drawn unbalance."""
    p, machine = model.parameters, model.machine
    rows: list[tuple[Array, Array, Array]] = []  # entries, course, shape over the modes
    side, tilt, bow = violations.side_force, float(violations.stand.tilt), float(violations.rotor.bow)

    def steady(x: float, y: float, shape: Array) -> None:
        entries = np.zeros(L.N_LOAD_COLUMNS)
        entries[[L.LOAD_X, L.LOAD_Y]] = x, y
        rows.append((entries, np.zeros((0, 3)), shape))

    if side is not None and float(side.force) > 0.0:
        force, angle = float(side.force), float(side.direction)
        steady(force * math.cos(angle), force * math.sin(angle), model.basis.node_row(side.node))
    if tilt != 0.0:  # gravity alone acts along -y
        steady(-math.sin(tilt), math.cos(tilt) - 1.0, p.gravity)
    pull = float(violations.magnets.pull)
    if pull > 0.0:
        share = pull * machine.rotor.mass * float(machine.gravity) / len(machine.ambs)
        times = np.append(np.linspace(0.0, PULL_LASTS, PULL_POINTS), PULL_LASTS + 1.0)
        left = np.append(np.exp(-times[:-1]), 0.0)
        course = np.column_stack([float(violations.magnets.pull_time) * times, share * left, 0.0 * left])
        rows += [(np.zeros(L.N_LOAD_COLUMNS), course, shape) for shape in p.magnet_shape]
    if rows:
        points = np.zeros((0, 3))
        for entries, course, _ in rows:
            entries[[L.LOAD_FIRST, L.LOAD_END]] = len(points), len(points) + len(course)
            points = np.vstack([points, course])
        flags = p.flags.copy()
        flags[L.LOADS_ACT] = 1
        p = p._replace(
            load=np.array([entries for entries, _, _ in rows]),
            load_shape=np.array([shape for _, _, shape in rows]),
            load_points=points,
            flags=flags,
        )
    if bow != 0.0:
        # the force that would straighten it turns with the rotor
        place = np.asarray(model.fe.node_positions)
        along = (place - place[0]) / (place[-1] - place[0])
        bent = np.zeros(model.fe.mass.shape[0])
        bent[0::2] = 4.0 * bow * along * (1.0 - along)
        bent[1::2] = 4.0 * bow * (1.0 - 2.0 * along) / (place[-1] - place[0])
        straightening = p.eigenvalue * (model.basis.shapes.T @ (model.fe.mass @ bent))
        speed = 2.0 * math.pi * float(violations.rotor.bow_speed)
        p = p._replace(unbalance_cos=p.unbalance_cos + straightening / speed**2)
    return model if p is model.parameters else replace(model, parameters=p)


def _mode(compliance: float, across: float, upright: float, damping_ratio: Known) -> list[float]:
    """Entries of a mode from 1/M [1/kg], its frequencies along x and y [Hz] and its damping ratio [1]."""
    wx, wy = 2.0 * math.pi * across, 2.0 * math.pi * upright
    twice = 2.0 * float(damping_ratio)
    return [compliance, wx * wx, wy * wy, twice * wx, twice * wy]


def support_matrices(bearing: TouchdownBearing, v: BearingViolations) -> dict[str, Any]:
    """True stiffness and damping of a support in x and y [N/m], [N s/m]: K_xx, K_xy, K_yy and so on."""
    angle = float(v.support.axes_angle)
    c, s = (math.cos(angle), math.sin(angle)) if angle != 0.0 else (1.0, 0.0)
    support, found = bearing.support, {}
    for letter, first, second in (
        ("K", float(support.stiffness_horizontal), float(support.stiffness)),
        ("C", float(support.damping_horizontal), float(support.damping)),
    ):
        found[f"{letter}_xx"] = c * c * first + s * s * second
        found[f"{letter}_xy"] = c * s * (first - second)
        found[f"{letter}_yy"] = s * s * first + c * c * second
    return found
