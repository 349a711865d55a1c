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
from rotordrop.machine import Machine
from rotordrop.physics import columns as L
from rotordrop.physics.contact import contact_law, stiffness_of_exponent
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.statics import bearing_load_shares
from rotordrop_bench import departing as D
from rotordrop_bench.violations import Violations

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
    factor = violations["rotor.unbalance"]
    if factor != 1.0:
        for index, unbalance in enumerate(machine.unbalances):
            values[f"unbalance.{index}.amount"] = factor * float(unbalance.amount)
    machine = machine.with_values(values) if values else machine
    machine = machine.with_magnets_on(violations["magnets.stays_on"])
    node = violations["seal.node"]
    if node is not None:
        gap = violations["seal.gap"] * max(float(bearing.air_gap) for bearing in machine.touchdown_bearings)
        stiffness = f"{violations['seal.stiffness']!r} N/m"
        place = Clearance(name="seal", node=node, gap=f"{gap!r} m", stiffness=stiffness)
        place = place.completed_with(place.completed(machine.rotor))
        machine = machine.completed_with({"clearances": (*machine.clearances, place)})
    softer = violations["rotor.youngs_modulus"]
    if softer == 1.0:
        return machine
    rotor = machine.rotor
    materials = {name: rotor.material_named(name) for name in {e.material for e in rotor.elements}}
    changed = {
        name: material.changed(youngs_modulus=f"{softer * float(material.youngs_modulus)!r} Pa")
        for name, material in materials.items()
    }
    return machine.completed_with({"rotor": rotor.changed(materials={**rotor.materials, **changed})})


def _of_bearing(bearing: TouchdownBearing, v: Violations, typical: float) -> Mapping[str, float]:
    contact, exponent = bearing.contact, v["contact.exponent"]
    values: dict[str, float] = {}
    if exponent is not None:
        law = contact_law(float(contact.stiffness), float(contact.exponent), float(contact.damping))
        values["contact.exponent"] = exponent
        stiffness = stiffness_of_exponent(law, typical, exponent)
        if stiffness != float(contact.stiffness):
            values["contact.stiffness"] = stiffness
    dynamic = v["friction.dynamic"]
    rubs = 1.0 if dynamic is None else dynamic / float(bearing.friction.dynamic)
    factors = {
        "race.mass": v["race.mass"],
        "race.inertia": v["race.mass"],
        "friction.dynamic": rubs,
        "friction.static": rubs,
        "support.stiffness_horizontal": v["support.stiffness_ratio"],
        "support.damping_horizontal": v["support.damping_ratio"],
    }
    changed = {path: factor for path, factor in factors.items() if factor != 1.0}
    return values | {path: float(attrgetter(path)(bearing)) * factor for path, factor in changed.items()}


def departures_of(machine: Machine, violations: Violations) -> Array:
    """Departures of all bearings of a true machine, shape (B, C) [SI]; (0, C) where nothing departs."""
    rows = np.array(
        [
            _departure(b, violations.of_bearing(b.name), float(load))
            for b, load in zip(machine.touchdown_bearings, bearing_load_shares(machine), strict=True)
        ]
    )
    if violations["unbalance_jump.node"] is None and np.all(rows == D.no_departure()):
        return rows[:0]
    return rows


COLUMNS: tuple[dict[str, int], ...] = (
    {"support.slip_force": D.SLIP_FORCE, "support.slip_travel": D.SLIP_TRAVEL},
    {"gap.drift": D.GAP_DRIFT, "gap.drift_time": D.GAP_DRIFT_TIME},
    {"gap.closing": D.GAP_CLOSING, "gap.heat": D.GAP_HEAT},
    {"friction.wear": D.WEAR, "friction.wear_heat": D.WEAR_HEAT},
    {"balls.seat_play": D.LOOSE_WAY},
    {"sleeve.eccentricity": D.SLEEVE_OFF},
    {"sleeve.ovality": D.SLEEVE_OVAL},
    {"sleeve.angle": D.SLEEVE_ANGLE},
    {"centre.x": D.CENTRE_X},
    {"centre.y": D.CENTRE_Y},
)
"""Columns of violations that stand in a row as they are, unless the first of them is zero."""


def _departure(bearing: TouchdownBearing, v: Violations, load: float) -> Array:
    row, balls, angle = D.no_departure(), bearing.bearing, v["support.axes_angle"]
    for group in COLUMNS:
        if v[next(iter(group))] != 0.0:
            for path, column in group.items():
                row[column] = v[path]
    if angle != 0.0:
        row[[D.AXIS_COSINE, D.AXIS_SINE]] = math.cos(angle), math.sin(angle)
    deflection = v["support.hardening_force"] / float(bearing.support.stiffness)
    row[D.HARDENING] = v["support.hardening"] / deflection**2
    if row[D.LOOSE_WAY] > 0.0:
        row[D.TABLE_WAY_STEP :] = _seat_table(bearing, row[D.LOOSE_WAY], load)
    if (mass := v["foundation.mass"]) is not None:
        upright = v["foundation.frequency"]
        across = v["foundation.frequency_horizontal"] or upright
        row[D.FOUNDATION_MODE : D.FOUNDATION_MODE + D.MODE_WIDTH] = _mode(
            1.0 / mass, across, upright, v["foundation.damping_ratio"]
        )
    if (frequency := v["race.tilt_frequency"]) is not None:
        w = 2.0 * math.pi * frequency
        row[D.TILT_MODE : D.TILT_MODE + D.MODE_WIDTH] = _mode(
            w * w / v["race.tilt_stiffness"], frequency, frequency, v["race.tilt_damping_ratio"]
        )
    if v["balls.turn"]:
        radial = float(balls.ball_diameter) * math.cos(float(balls.contact_angle))
        # turn of the cage per turn of the inner race
        row[D.CAGE_RATIO] = 0.5 * (1.0 - radial / float(balls.pitch_diameter))
    law = [(point["depth"], point["force"]) for point in v["contact.law"]]
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


def pushed(model: DropModel, violations: Violations) -> DropModel:
    """The model with what pushes its rotor beside level gravity and the drawn unbalance."""
    p, machine = model.parameters, model.machine
    side, tilt, bow = (violations[path] for path in ("side_force.force", "stand.tilt", "rotor.bow"))
    none = np.zeros((0, 3))
    rows: list[tuple[float, float, Array, Array]] = []  # steady force [N], course, shape over the modes
    if side:
        rows.append((side, 0.0, none, model.basis.node_row(violations["side_force.node"])))
    if tilt != 0.0:  # gravity alone acts along -y
        rows.append((-math.sin(tilt), math.cos(tilt) - 1.0, none, p.gravity))
    pull = violations["magnets.pull"]
    if pull > 0.0:
        share = pull * machine.rotor.mass * float(machine.gravity) / len(machine.ambs)
        times = np.append(np.linspace(0.0, PULL_LASTS, PULL_POINTS), PULL_LASTS + 1.0)
        left = np.append(np.exp(-times[:-1]), 0.0)
        course = np.column_stack([violations["magnets.pull_time"] * times, share * left, 0.0 * left])
        rows += [(0.0, 0.0, course, shape) for shape in p.magnet_shape]
    if rows:
        load, shapes, points = np.zeros((len(rows), L.N_LOAD_COLUMNS)), [shape for *_, shape in rows], none
        for entries, (x, y, course, _) in zip(load, rows, strict=True):
            entries[[L.LOAD_X, L.LOAD_Y]] = x, y
            entries[[L.LOAD_FIRST, L.LOAD_END]] = len(points), len(points) + len(course)
            points = np.vstack([points, course])
        flags = p.flags.copy()
        flags[L.LOADS_ACT] = 1
        p = p._replace(load=load, load_shape=np.array(shapes), load_points=points, flags=flags)
    if bow != 0.0:
        # the force that would straighten it turns with the rotor
        place = np.asarray(model.fe.node_positions)
        along = (place - place[0]) / (place[-1] - place[0])
        bent = np.zeros(model.fe.mass.shape[0])
        bent[0::2] = 4.0 * bow * along * (1.0 - along)
        bent[1::2] = 4.0 * bow * (1.0 - 2.0 * along) / (place[-1] - place[0])
        straightening = p.eigenvalue * (model.basis.shapes.T @ (model.fe.mass @ bent))
        speed = 2.0 * math.pi * violations["rotor.bow_speed"]
        p = p._replace(unbalance_cos=p.unbalance_cos + straightening / speed**2)
    return model if p is model.parameters else replace(model, parameters=p)


def _mode(compliance: float, across: float, upright: float, damping_ratio: float) -> list[float]:
    """Entries of a mode from 1/M [1/kg], its frequencies along x and y [Hz] and its damping ratio [1]."""
    wx, wy = 2.0 * math.pi * across, 2.0 * math.pi * upright
    twice = 2.0 * damping_ratio
    return [compliance, wx * wx, wy * wy, twice * wx, twice * wy]


def support_matrices(bearing: TouchdownBearing, v: Violations) -> dict[str, Any]:
    """True stiffness and damping of a support in x and y [N/m], [N s/m]: K_xx, K_xy, K_yy and so on."""
    angle = v["support.axes_angle"]
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
