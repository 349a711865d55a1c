"""The unknowns as the kernels of the filter take them: one flat table of what each sets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rotordrop.elements.parameter import Rule
from rotordrop.rotor.parameters import DropModel
from rotordrop.rotor.unknowns import Target, Unknown
from rotordrop.track import _propagation as P

_KIND_OF_ARRAY = {
    "bearing": P.ON_BEARING,
    "spin": P.ON_SPIN,
    "magnet": P.ON_MAGNET,
    "unbalance": P.ON_UNBALANCE,
    "load": P.ON_LOAD,
    "modes": P.SCALE_MODES,
}
_KIND_OF_RULE = {Rule.SCALE: P.SCALE_BEARING, Rule.AT_TYPICAL_DEPTH: P.AT_TYPICAL_DEPTH}


def _kind(target: Target) -> int:
    return _KIND_OF_RULE.get(target.entry.rule, _KIND_OF_ARRAY[target.entry.array])


def _acts(targets: list[tuple[int, Target]], count: int, bearings: int) -> NDArray[np.bool_]:
    """Which of ``count`` parameters act on each bearing and, in the last column, on the rotor itself."""
    acts = np.zeros((count, bearings + 1), dtype=np.bool_)
    for k, target in targets:
        acts[k, target.row if target.entry.array == "bearing" else bearings] = True
    return acts


def _together(targets: list[tuple[int, Target]], count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """For each of ``count`` parameters the targets that write where it writes, and where its list begins."""
    # All unbalances add up in the same entries; a gap is also the radius of the rotor.
    places = [
        (t.entry.array,) if t.entry.array == "unbalance" else (t.entry.array, t.row, t.entry.column)
        for _, t in targets
    ]
    lists = []
    for k in range(count):
        own = {place for place, (j, _) in zip(places, targets, strict=True) if j == k}
        lists.append([i for i, place in enumerate(places) if place in own])
    starts = np.cumsum([0, *map(len, lists)])
    return np.array([i for chosen in lists for i in chosen], dtype=np.int64), starts.astype(np.int64)


def parameter_targets(model: DropModel, unknowns: tuple[Unknown, ...]) -> P.ParameterTargets:
    """Flat table of what the unknowns set in the kernel, in the order given."""
    targets = [(k, target) for k, unknown in enumerate(unknowns) for target in unknown.targets]
    # What changes an entry comes after what sets it.
    targets.sort(key=lambda item: item[1].entry.rule in _KIND_OF_RULE)
    planes = [model.basis.node_row(unbalance.node) for unbalance in model.machine.unbalances]
    shape = np.array(planes) if planes else np.zeros((0, model.layout.n_modes))
    drift = np.array([u.drift for u in unknowns])
    together, starts = _together(targets, len(unknowns))
    return P.ParameterTargets(
        target=np.array([(k, _kind(t), t.row, t.entry.column) for k, t in targets], dtype=np.int64).reshape(
            -1, 4
        ),
        acts=_acts(targets, len(unknowns), len(model.parameters.bearing)),
        together=together,
        starts=starts,
        factor=np.array([t.factor for _, t in targets]),
        logarithmic=np.array([int(u.logarithmic) for u in unknowns], dtype=np.int64),
        drift=drift,
        late_drift=drift * np.array([u.parameter.late_drift_factor for u in unknowns]),
        step=np.array([1e-5 if u.logarithmic else max(1e-3 * u.sigma, 1e-12) for u in unknowns]),
        plane_shape=np.ascontiguousarray(shape),
        lower=np.array([u.bounds[0] for u in unknowns]),
        upper=np.array([u.bounds[1] for u in unknowns]),
        mean=np.array([u.begin for u in unknowns]),
        eigenvalue=model.parameters.eigenvalue,
    )
