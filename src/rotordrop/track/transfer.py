"""Carry a smoothed trajectory from one basis of the rotor to another, to linearise the finer model there."""

from __future__ import annotations

import math

import numpy as np

from rotordrop.arrays import Array
from rotordrop.track.problem import DropProblem


def transferred(coarse: DropProblem, fine: DropProblem, means: Array) -> Array:
    """Trajectory (N, n) of a coarse problem in the coordinates of a fine one, by projecting the modes.

    Sensors that the coarse problem leaves out start at what is known of them beforehand.
    """
    one, two = coarse.model.layout, fine.model.layout
    result = np.zeros((len(means), len(fine.mean)))
    project = (fine.model.basis.shapes.T @ (fine.model.fe.mass @ coarse.model.basis.shapes)).T
    for part in ("modal_x", "modal_y"):
        source, target = getattr(one, part), getattr(two, part)
        result[:, target] = means[:, source] @ project
        result[:, two.velocity_of(target)] = means[:, one.velocity_of(source)] @ project
    for part in ("race", "support"):
        source, target = getattr(one, part), getattr(two, part)
        result[:, target] = means[:, source]
        result[:, two.velocity_of(target)] = means[:, one.velocity_of(source)]
    # spins and parameters do not depend on the basis
    own, wanted = coarse.n_dynamic + len(coarse.unknowns), fine.n_dynamic + len(fine.unknowns)
    result[:, two.race_spin] = means[:, one.race_spin]
    for place, states in one.further:
        if (place, states) in two.further:
            result[:, two.further_at(place)] = means[:, one.further_at(place)]
    if two.moves_axially and one.moves_axially:
        result[:, two.axial : two.axial + 2] = means[:, one.axial : one.axial + 2]
    result[:, two.rotor_speed : two.n_dynamic] = means[:, one.rotor_speed : one.n_dynamic]
    _carry_unknowns(coarse, fine, means, result)
    if two.sensor_own:
        result[:, two.sensors] = result[:, : two.n_dynamic] @ fine.sensor_rows.T
    result[:, wanted:] = fine.mean[wanted:]
    names = [sensor.name for sensor in coarse.model.machine.sensors]
    for c, sensor in enumerate(fine.model.machine.sensors):
        if sensor.name in names:
            kinds = np.arange(4)  # gain, offset, cosine and sine of the runout
            source = own + kinds * coarse.n_channels + names.index(sensor.name)
            result[:, wanted + kinds * fine.n_channels + c] = means[:, source]
    return result


def _carry_unknowns(coarse: DropProblem, fine: DropProblem, means: Array, result: Array) -> None:
    """Carry the unknowns by name; what the coarse problem does not have begins at what is known of it.

    So does what another prior holds now: where the old one held it is no place to begin.
    """
    source = {unknown.path: k for k, unknown in enumerate(coarse.unknowns)}
    for k, unknown in enumerate(fine.unknowns):
        at = source.get(unknown.path)
        if at is not None and not math.isclose(coarse.unknowns[at].sigma, unknown.sigma):
            at = None
        values = fine.start[fine.n_dynamic + k] if at is None else means[:, coarse.n_dynamic + at]
        result[:, fine.n_dynamic + k] = values
