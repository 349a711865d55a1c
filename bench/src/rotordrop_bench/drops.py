"""The list of DropBench: which drops there are, from which seeds; fixed for a version."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import count, cycle
from typing import Any

from rotordrop_bench.departures import DEPARTURES, LARGE, SLIGHT
from rotordrop_bench.rotors import ROTORS

VERSION = "2026"
"""Changes whenever a drop of the list does; scores of different versions are not comparable."""


@dataclass(frozen=True, kw_only=True)
class BenchDrop:
    """One drop of the bench; its name says nothing of what is hidden."""

    name: str
    family: str
    """What is scored together."""
    rotor: str
    """Rotor, by its name in `ROTORS`."""
    speed: float
    """Speed at power-off [Hz]."""
    machine_seed: int
    drop_seed: int
    """Seeds of the hidden machine and of the drop."""
    departures: tuple[tuple[str, int], ...] = ()
    """Kinds and sizes of what the description of the machine does not have."""
    tail: bool = True
    """Whether the settled tail was recorded."""
    sampling_rate: float = 20e3
    """Samples per second [Hz]."""


SPEEDS: dict[str, tuple[float, ...]] = {
    "5 kg": (550.0, 320.0, 150.0),
    "13 kg": (500.0, 260.0, 120.0),
    "30 kg": (300.0, 180.0, 80.0),
    "60 kg": (120.0, 210.0, 60.0),
    "140 kg": (180.0, 110.0, 60.0),
    "500 kg": (115.0, 70.0, 40.0),
    "1.6 t": (80.0, 50.0, 30.0),
    "6 t": (50.0, 35.0, 20.0),
}
"""Speeds at which each rotor is dropped, in turn [Hz]."""

PAIRS: tuple[tuple[str, ...], ...] = (
    ("turned support axes", "cross-axis sensitivity"),
    ("sensor lag", "foundation mode"),
    ("cubic support", "long remanence"),
    ("brackets that follow the housing", "turned support axes"),
    ("friction", "unbalance beyond its grade"),
    ("contact law", "sensor planes elsewhere"),
)
TRIPLES: tuple[tuple[str, ...], ...] = (
    ("turned support axes", "cross-axis sensitivity", "sensor lag"),
    ("foundation mode", "hysteretic support", "cross-axis sensitivity"),
    ("cubic support", "turned support axes", "rotor stiffness"),
    ("brackets that follow the housing", "long remanence", "thermal gap"),
    ("sensor lag", "sensor planes elsewhere", "bearing centres"),
    ("foundation mode", "turned support axes", "sensor lag"),
)
RATES = (10e3, 50e3, 100e3)
SIZES = ((SLIGHT, "slight"), (LARGE, "large"))
FIRST = 21
"""Kinds of departures in the first family of them; the others but the last are in the second."""


class _List:
    """Numbers the drops of a list, and gives each a rotor and a speed in turn."""

    def __init__(self, first: int) -> None:
        self.numbers, self.rotors = count(first), cycle(ROTORS)
        self.speeds = {rotor: cycle(values) for rotor, values in SPEEDS.items()}

    def drop(
        self, family: str, seed: int, *kinds: tuple[str, int], rotor: str = "", **more: Any
    ) -> BenchDrop:
        number, rotor = next(self.numbers), rotor or next(self.rotors)
        return BenchDrop(
            name=f"drop_{number:03d}",
            family=family,
            rotor=rotor,
            speed=more.pop("speed", 0.0) or next(self.speeds[rotor]),
            machine_seed=seed,
            drop_seed=9000 + number,
            departures=kinds,
            **more,
        )

    def single(self, family: str, seed: int, kinds: list[str], size: int) -> Iterator[BenchDrop]:
        """Drops with one departure each."""
        for i, kind in enumerate(kinds):
            yield self.drop(family, seed + 100 * size + i, (kind, size))


def _listed() -> Iterator[BenchDrop]:
    kinds, drops = list(DEPARTURES), _List(1)
    for i, rotor in enumerate(ROTORS):
        yield drops.drop("right", 700 + i, rotor=rotor)
        yield drops.drop("right, without tail", 700 + i, rotor=rotor, tail=False)
    for size, word in SIZES:
        yield from drops.single(f"one departure, {word}", 800, kinds[:FIRST], size)
        next(drops.rotors)  # else each kind would meet one rotor in both sizes
    for seed, family, groups in ((1000, "two departures", PAIRS), (1100, "three departures", TRIPLES)):
        for i, group in enumerate(groups):
            yield drops.drop(family, seed + i, *((kind, SLIGHT) for kind in group))
    for i, rate in enumerate(RATES):
        yield drops.drop("other sampling rates", 1200 + i, sampling_rate=rate)
    drops = _List(101)
    for size, word in SIZES:
        yield from drops.single(f"later kinds, {word}", 1300, kinds[FIRST:-1], size)
    drops = _List(201)
    for i, (rotor, (size, word)) in enumerate(zip(ROTORS, cycle(SIZES), strict=False)):
        family = f"{kinds[-1]}, {word}"
        yield drops.drop(family, 1500 + i, (kinds[-1], size), rotor=rotor, speed=SPEEDS[rotor][1])


DROPS: tuple[BenchDrop, ...] = tuple(_listed())
"""All drops of the bench, in order."""
