"""Random numbers of a study: which share of the probability every varied value of a drop has.

Every drop has numbers of its own (Philox, key = seed, counter = drop), so that none depends on shards,
threads or the order of work.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from rotordrop.arrays import Array
from rotordrop.elements.table import fitted_row
from rotordrop.errors import UsageError
from rotordrop.machine import Machine
from rotordrop.machine.machine import value_of_path
from rotordrop.physics.elementary import exp_each, ln_each
from rotordrop.physics.linear_algebra import product, symmetric_eigen
from rotordrop.study.distributions import Distribution, normal_score

Design = Literal["random", "latin hypercube", "sobol", "grid", "sensitivity"]
DESIGNS: tuple[str, ...] = get_args(Design)


def independent(seed: int, first: int, last: int, width: int) -> Array:
    """Shares of drops ``first`` to ``last - 1``, shape (n, width), each drop on its own."""
    bits = np.random.Philox(key=seed, counter=0)
    generator, begin = np.random.Generator(bits), bits.state
    shares = np.empty((last - first, width))
    # each drop has a block of the counter that no other reaches; a new generator each took six times as long
    for row, drop in enumerate(range(first, last)):
        begin["state"]["counter"][2] = drop
        bits.state = begin
        generator.random(out=shares[row])
    return shares


def sobol(seed: int, first: int, last: int, width: int) -> Array:
    """Points of a scrambled Sobol sequence, shape (n, width)."""
    from scipy.stats import qmc

    if first == last:
        return np.empty((0, width))
    sequence = qmc.Sobol(width, scramble=True, rng=_generator(seed))
    if first:
        sequence.fast_forward(first)
        return np.asarray(sequence.random(last - first))
    # the first point by itself: a first draw that is no power of two is warned of, and pieces are meant here
    return np.asarray(np.concatenate([sequence.random(1), sequence.random(last - 1)]))


@lru_cache(maxsize=4)
def hypercube(seed: int, drops: int, width: int) -> Array:
    """All points of a Latin hypercube, shape (drops, width)."""
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(width, rng=_generator(seed)).random(drops))


def _generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.Philox(np.random.SeedSequence(seed)))


def grid(seed: int, first: int, last: int, spreads: Mapping[str, Distribution]) -> Array:
    """Cells in the order of the product, again and again until all drops are placed, shape (n, V)."""
    names = list(spreads)
    grids = [name for name in names if spreads[name].shape == "grid"]
    sizes = [len(spreads[name].numbers) for name in grids]
    share = independent(seed, first, last, len(names))
    cells = np.unravel_index(np.arange(first, last) % math.prod(sizes), sizes)
    for name, size, places in zip(grids, sizes, cells, strict=True):
        share[:, names.index(name)] = (places + 0.5) / size
    return share


def sensitivity(seed: int, first: int, last: int, width: int) -> Array:
    """Blocks of ``width + 2`` drops that tell the values apart, shape (n, width).

    The first drop of a block is a point A, the second a point B, and each further one is A with one value
    taken from B. Source: Saltelli and others, Computer Physics Communications 181, 2010.
    """
    size = width + 2
    low, high = first // size, -(-last // size)
    points = sobol(seed, low, high, 2 * width)
    share = np.empty((last - first, width))
    for row, drop in enumerate(range(first, last)):
        block, place = divmod(drop, size)
        a, b = points[block - low, :width], points[block - low, width:]
        share[row] = b if place == 1 else a
        if place > 1:
            share[row, place - 2] = b[place - 2]
    return share


@dataclass(frozen=True, kw_only=True)
class Joint:
    """Joint distribution of calibrated values: normal in the values or in their logarithms."""

    paths: tuple[str, ...]
    """Values by path."""
    logarithmic: NDArray[np.bool_]
    """Whether the logarithm is normal, shape (n,)."""
    middle: Array
    """Mean of each, of the logarithm where that is normal [SI], shape (n,)."""
    root: Array
    """Root of the covariance, shape (n, n)."""

    def values(self, share: Array) -> Array:
        """Values [SI], shape (n, V), at independent shares of the probability, shape (n, V)."""
        drawn: Array = self.middle + product(normal_score(share), self.root.T)
        drawn[:, self.logarithmic] = exp_each(drawn[:, self.logarithmic])
        for k, path in enumerate(self.paths):
            if (row := fitted_row(path)) is not None:
                drawn[:, k] = [row.within(value) for value in drawn[:, k].tolist()]
        return drawn

    def marginal(self, k: int) -> Distribution:
        """Distribution of one value alone."""
        sigma = float(np.sqrt(np.sum(self.root[k] ** 2)))
        if self.logarithmic[k]:
            return Distribution(shape="log_normal", numbers=(float(np.exp(self.middle[k])), sigma))
        return Distribution(shape="normal", numbers=(float(self.middle[k]), sigma))


def joint_of(machine: Machine) -> Joint:
    """The joint distribution that a calibrated machine file holds; refuses a file that holds none."""
    origin = machine.calibration
    if origin is None or origin.joint is None:
        raise UsageError(
            f"{machine.name!r} holds no joint distribution of its values; expected a machine file that "
            "'rotordrop calibrate' wrote. Calibrate it on recorded drops, or vary its values one by one"
        )
    spread = origin.joint
    logs = np.array(spread.logarithmic)
    middle = np.array([value_of_path(machine, path) for path in spread.paths])
    middle[logs] = ln_each(middle[logs])
    size, turn = symmetric_eigen(spread.matrix)
    # rows of the symmetric root: the same numbers whatever sign an eigenvector has
    root = product(turn * np.sqrt(np.maximum(size, 0.0)), turn.T)
    return Joint(paths=spread.paths, logarithmic=logs, middle=middle, root=root)
