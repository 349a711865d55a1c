"""Let the gate judge spoiled and clean records, and count what it says.

Usage: python studies/gate/score.py faults OUT FOLDER FIRST [SUPPLIED [KIND ...]]
       python studies/gate/score.py clean OUT FOLDER FIRST LAST
       python studies/gate/score.py blocks OUT FOLDER FIRST LAST
       python studies/gate/score.py costs OUT FOLDER BLOCKS [MOST]
       python studies/gate/score.py ranges OUT FOLDER FIRST SUPPLIED FAULTS
       python studies/gate/score.py count OUT [OUT ...]

Every judgement is one line of the file OUT; what is there already is not made again, so a run that was
stopped goes on. FOLDER keeps the clean records (`records.py`); FIRST, a multiple of ten, is the first of the
twenty seeds that are spoiled. SUPPLIED is a folder with drops of the bundled example (`drop_060.csv`,
`drop_060_tail.csv` and so on); the bundled drop stands for them where there is none. Every kind of fault hits
three records: a supplied one, one of a rotor up to 60 kg and one of a heavier one.

`ranges` estimates the records whose fault was not caught in FAULTS, the OUT of the faults before, and asks
whether the ranges of the peak forces hold the truth, bearing by bearing. A supplied drop without a truth file
(`truth/`) has the values that are estimated of it without the fault in place of a truth.

`costs` estimates the records whose exchanged blocks were silent in BLOCKS, the OUT of the blocks before, with
and without them: first those after power-off, then those before it by size, MOST in all.

A fault counts as caught by a finding that the record as it was does not have: a refusal, a warning or a note.
A clean record counts as a false alarm by any warning or refusal. Clean records whose levitated orbit is wider
than 0.3 air gaps are left out: no machine runs so (zone limit B/C of ISO 14839-2 is 0.4).
"""

from __future__ import annotations

import json
import sys
import time
import zlib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from importlib import resources
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from faults import FAULTS, Given
from records import NAMES, kept, made, name_of, rotor_of

from rotordrop import example_machine, read_record
from rotordrop.arrays import Array
from rotordrop.errors import RecordError, RotordropError
from rotordrop.estimation import estimate_drop
from rotordrop.evidence.quality import check_record
from rotordrop.evidence.quality.channels import check_channels
from rotordrop.evidence.quality.recorder import check_blocks
from rotordrop.record.record import Record

LIGHT, HEAVY = (0, 1, 2, 3, 8), (4, 5, 6, 7, 9)
"""Places of the rotors up to 60 kg and of the heavier ones in `NAMES`."""

SUPPLIED = (
    ("drop_060.csv", "drop_060_tail.csv"),
    ("drop_100.csv", "drop_100_tail.csv"),
    ("drop_150.csv", "drop_150_tail.csv"),
    ("drop_210.txt", "drop_210_tail.csv"),
    ("repeat_150_1.csv", "drop_150_tail.csv"),
    ("repeat_150_2.csv", "drop_150_tail.csv"),
    ("repeat_150_3.csv", "drop_150_tail.csv"),
)
_LAST = 0.65
"""Supplied records are cut here [s], as the simulated ones end."""


@cache
def supplied(folder: str, number: int) -> tuple[str, Given]:
    """A supplied drop of the bundled example, by number, with its name."""
    machine = example_machine("lp400")
    drop, tail = SUPPLIED[number % len(SUPPLIED)]
    place = Path(folder)
    if not folder:
        place = Path(str(resources.files("rotordrop"))) / "examples" / "lp400"
        drop, tail = "drop_060.h5", "drop_060_tail.csv"
    record = read_record(place / drop, machine).window(-np.inf, _LAST)
    return drop, Given(record=record, tail=read_record(place / tail, machine), machine=machine)


def of_seed(folder: Path, seed: int) -> Given:
    """A simulated drop to be spoiled."""
    record, tail = kept(folder, seed, long=True)
    return Given(record=record, tail=tail, machine=rotor_of(seed))


def spoiled_records(folder: Path, first: int, given: str) -> Iterator[tuple[str, str, Given]]:
    """Every kind of fault with the three records it hits, by name."""
    for number, kind in enumerate(FAULTS):
        turn = len(NAMES) * (number // len(LIGHT) % 2)
        name, one = supplied(given, number)
        yield kind, name, one
        for places in (LIGHT, HEAVY):
            seed = first + turn + places[number % len(places)]
            yield kind, str(seed), of_seed(folder, seed)


def judged(given: Given) -> dict[str, Any]:
    """Findings, the worst first, and the processor time it took [s]."""
    begun = time.process_time()
    try:
        found = check_record(given.record, given.machine, given.tail)
        said = [[str(one.kind), one.severity, one.channel or "", one.message] for one in found]
    except RecordError as error:
        said = [[f"refused: {str(error)[:120]}", "stop", "", ""]]
    return {"findings": said, "seconds": round(time.process_time() - begun, 2)}


def spoilt(kind: str, name: str, given: Given) -> Given:
    """What a fault makes of a record; place, channel and sign come from both names."""
    return FAULTS[kind].make(given, np.random.default_rng(zlib.crc32(f"{kind} {name}".encode())))


def _wide(given: Given) -> bool:
    """Whether the rotor circles wider before the drop than machines are run."""
    gap = min(float(bearing.air_gap) for bearing in given.machine.touchdown_bearings)
    floating = given.record.signals[given.record.time < -5e-3]
    return float(np.max(np.ptp(floating, axis=0))) > 2.0 * 0.3 * gap


def lines_of(path: Path) -> list[dict[str, Any]]:
    """What was judged so far."""
    return [json.loads(line) for line in path.read_text().splitlines()] if path.is_file() else []


def run_faults(path: Path, folder: Path, first: int, given: str, kinds: tuple[str, ...]) -> None:
    """Judge every kind of fault on its three records, and these records as they were."""
    done = {(line["fault"], line["record"]) for line in lines_of(path)}
    with path.open("a") as out:
        for kind, name, one in spoiled_records(folder, first, given):
            if kinds and not any(word in kind for word in kinds):
                continue
            for fault, what in (("", one), (kind, None)):
                if (fault, name) not in done:
                    done.add((fault, name))
                    line = {"fault": fault, "record": name, **judged(what or spoilt(kind, name, one))}
                    out.write(json.dumps(line, ensure_ascii=False) + "\n")
                    out.flush()


def run_clean(path: Path, folder: Path, seeds: range) -> None:
    """Judge clean records."""
    done = {line["seed"] for line in lines_of(path)}
    with path.open("a") as out:
        for seed in seeds:
            record, tail = kept(folder, seed)
            given = Given(record=record, tail=tail, machine=rotor_of(seed))
            if seed not in done and not _wide(given):
                line = {"seed": seed, "rotor": name_of(seed), "rate": record.sampling_rate, **judged(given)}
                out.write(json.dumps(line, ensure_ascii=False) + "\n")
                out.flush()


def run_blocks(path: Path, folder: Path, seeds: range) -> None:
    """Exchange or zero blocks anywhere in clean records, and ask the checks of channels and blocks."""
    done = {(line["block"], line["seed"]) for line in lines_of(path)}
    with path.open("a") as out:
        for seed, kind in product(seeds, BLOCKS):
            if (kind, seed) in done:
                continue
            record, torn, _ = torn_record(folder, kind, seed)
            said = [
                {(one.kind, one.channel) for one in check_channels(read) + check_blocks(read)}
                for read in (record, torn)
            ]
            size = float(np.max(np.abs(torn.signals - record.signals)))
            line = {"block": kind, "seed": seed, "size": size, "seen": bool(said[1] - said[0])}
            out.write(json.dumps(line) + "\n")


def torn_record(folder: Path, kind: str, seed: int) -> tuple[Record, Record, Record]:
    """A clean record, the same with exchanged or zeroed blocks, and its tail."""
    random = np.random.default_rng(zlib.crc32(f"{kind} {seed}".encode()))
    record, tail = kept(folder, seed)
    return record, replace(record, signals=BLOCKS[kind](record.signals.copy(), random)), tail


def run_costs(path: Path, folder: Path, blocks: Path, most: int) -> None:
    """Estimate records with and without the blocks that no check sees."""
    done = {(line["silent"], line["seed"]) for line in lines_of(path)}
    silent = []
    for line in lines_of(blocks):
        if not line["seen"] and line["size"] > 0.0:
            record, torn, tail = torn_record(folder, line["block"], line["seed"])
            changed = record.time[np.any(record.signals != torn.signals, axis=1)]
            silent.append((changed[-1] < 0.0, -line["size"], line, changed, (record, torn, tail)))
    silent.sort(key=lambda one: one[:2])
    with path.open("a") as out:
        for _, _, line, changed, (record, torn, tail) in silent[:most]:
            if (line["block"], line["seed"]) in done:
                continue
            machine = rotor_of(line["seed"])
            long = line["seed"] % 5 == 0
            told = {
                "silent": line["block"],
                "seed": line["seed"],
                "size": line["size"],
                "from": float(changed[0]),
                "to": float(changed[-1]),
                "true": list(made(line["seed"], long=long).truth["peak_force_N"].values()),
                "whole": peaks_of(Given(record=record, tail=tail, machine=machine)),
                "torn": peaks_of(Given(record=torn, tail=tail, machine=machine)),
            }
            out.write(json.dumps(told) + "\n")
            out.flush()


def count_costs(lines: list[dict[str, Any]]) -> None:
    """Print how far blocks that no check sees move the peaks, and which ranges hold the truth."""
    outside = held = held_whole = peaks = 0
    for line in lines:
        shifts = []
        for (whole, *_), (_, low, high), true, (_, least, most) in zip(
            line["whole"]["peaks"],
            line["torn"]["peaks"],
            line["true"],
            line["whole"]["peaks"],
            strict=False,
        ):
            peaks += 1
            outside += not low <= whole <= high
            held += low <= true <= high
            held_whole += least <= true <= most
            shifts.append(f"{low:.0f} {whole:.0f} {high:.0f} true {true:.0f}")
        verdicts = " → ".join(line[which]["verdict"][:60] for which in ("whole", "torn"))
        print(
            f"{line['silent']:34} {line['seed']} {1e6 * line['size']:5.1f} µm {1e3 * line['from']:7.1f} to "
            f"{1e3 * line['to']:7.1f} ms {verdicts} {shifts}"
        )
    print(f"{len(lines)} records, {peaks} peaks: outside the range with the block {outside}")
    print(f"truth held {wilson(held, peaks)}; without the block {wilson(held_whole, peaks)}")


def new_findings(lines: list[dict[str, Any]]) -> dict[tuple[str, str], list[list[str]]]:
    """Findings of every spoiled record that it does not have without the fault, by fault and record."""
    was = {one["record"]: {tuple(f[:3]) for f in one["findings"]} for one in lines if not one["fault"]}
    return {
        (line["fault"], line["record"]): [
            f for f in line["findings"] if tuple(f[:3]) not in was[line["record"]]
        ]
        for line in lines
        if line["fault"]
    }


def run_ranges(path: Path, folder: Path, first: int, given: str, faults: Path) -> None:
    """Estimate what the gate let pass, and ask whether the ranges of the peak forces hold the truth."""
    done = {(line["fault"], line["record"]) for line in lines_of(path)}
    missed = {case for case, found in new_findings(lines_of(faults)).items() if not found} - done
    with path.open("a") as out:
        for kind, name, one in spoiled_records(folder, first, given):
            if (kind, name) in missed:
                line = {"fault": kind, "record": name, **peaks_of(spoilt(kind, name, one))}
                line["true"] = true_peaks(name, given) or [peak[0] for peak in peaks_of(one)["peaks"]]
                out.write(json.dumps(line, ensure_ascii=False) + "\n")
                out.flush()


def peaks_of(given: Given) -> dict[str, Any]:
    """Peak force of every bearing with the ends of its range [N], and what the estimate says of itself."""
    begun = time.process_time()
    try:
        estimate = estimate_drop(given.machine, given.record, given.tail)
    except RotordropError as error:
        return {"peaks": [], "verdict": f"refused: {error}", "seconds": round(time.process_time() - begun, 1)}
    known = [bearing.peak_force.known for bearing in estimate.bearings]
    return {
        "peaks": [[one.value, *(one.interval_90 or (one.value, one.value))] for one in known],
        "verdict": estimate.verdict.name,
        "seconds": round(time.process_time() - begun, 1),
    }


def true_peaks(name: str, given: str) -> list[float]:
    """Peak forces of a record [N] in the order of the bearings; none where no truth is known."""
    if name.isdecimal():
        return list(made(int(name), long=True).truth["peak_force_N"].values())
    path = Path(given) / "truth" / f"{Path(name).stem}.json"
    return list(json.loads(path.read_text())["peak_force_N"].values()) if path.is_file() else []


def count_ranges(lines: list[dict[str, Any]]) -> None:
    """Print which ranges hold the truth: of all bearings of a record, or some."""
    covered = refused = 0
    for line in lines:
        held = [
            low <= true <= high for (_, low, high), true in zip(line["peaks"], line["true"], strict=False)
        ]
        covered += bool(held) and all(held)
        refused += not held
        off = [
            f"{peak[0] / true - 1.0:+.1%}" for peak, true in zip(line["peaks"], line["true"], strict=False)
        ]
        print(f"{line['fault']:34} {line['record']:18} {line['verdict'][:60]:12} {held} {off}")
    print(f"all ranges hold the truth {wilson(covered, len(lines))}; refused by the estimate {refused}")
    _print_seconds(lines)


def _exchanged(most: int, *, every: bool) -> Callable[[Array, np.random.Generator], Array]:
    """Exchange two neighbouring blocks of 8 to `most` samples in all channels or one."""

    def change(signals: Array, random: np.random.Generator) -> Array:
        count = 2 ** int(random.integers(3, 1 + int(np.log2(most))))
        begin = int(random.integers(1, len(signals) - 2 * count))
        columns = slice(None) if every else [int(random.integers(signals.shape[1]))]
        block = signals[begin : begin + 2 * count, columns].copy()
        signals[begin : begin + 2 * count, columns] = np.roll(block, count, axis=0)
        return signals

    return change


def _zeroed(signals: Array, random: np.random.Generator) -> Array:
    """Zero a block of 8 to 64 samples in one channel."""
    count = 2 ** int(random.integers(3, 7))
    begin = int(random.integers(1, len(signals) - count))
    signals[begin : begin + count, int(random.integers(signals.shape[1]))] = 0.0
    return signals


BLOCKS = {
    "rows of 16 bits exchanged": _exchanged(256, every=True),
    "rows of 64 bits exchanged": _exchanged(64, every=True),
    "samples of one channel exchanged": _exchanged(256, every=False),
    "samples of one channel zero": _zeroed,
}
"""Blocks that formats without a checksum lose or exchange, by name."""


def count_blocks(lines: list[dict[str, Any]]) -> None:
    """Print what passed, and the largest error in it."""
    for kind in BLOCKS:
        mine = [line for line in lines if line["block"] == kind]
        silent = [1e6 * line["size"] for line in mine if not line["seen"] and line["size"] > 0.0]
        above = sum(size > 5.0 for size in silent)
        print(f"{kind:34} silent {wilson(len(silent), len(mine))}, {above} above 5 µm, {sorted(silent)[-3:]}")


def wilson(hits: int, count: int) -> str:
    """Share with its 95 % interval after Wilson."""
    if not count:
        return "-"
    z, p = 1.96, hits / count
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z * np.sqrt(p * (1 - p) / count + z * z / (4 * count**2)) / (1 + z * z / count)
    return f"{hits}/{count} = {p:.1%} ({max(middle - half, 0.0):.1%} to {min(middle + half, 1.0):.1%})"


def _print_seconds(lines: list[dict[str, Any]]) -> None:
    spent = [line["seconds"] for line in lines]
    print(f"processor time: median {np.median(spent):.2f} s, most {max(spent):.1f} s")


def count_clean(lines: list[dict[str, Any]]) -> None:
    """Print the false alarms by rotor."""
    said = [line for line in lines if any(one[1] != "note" for one in line["findings"])]
    kinds = Counter(one[0] for line in said for one in line["findings"] if one[1] != "note")
    print(f"false alarms {wilson(len(said), len(lines))} {dict(kinds)}")
    print(f"seeds with a false alarm: {[line['seed'] for line in said]}")
    for name in NAMES:
        mine = [line for line in lines if line["rotor"] == name]
        print(f"  {name:24} {sum(line in said for line in mine)}/{len(mine)}")
    _print_seconds(lines)


def count_faults(lines: list[dict[str, Any]]) -> None:
    """Print what was caught, and what under its right name."""
    found_of = new_findings(lines)
    spoiled = [line for line in lines if line["fault"]]
    total = Counter[str]()
    for fault, one in FAULTS.items():
        mine = [line["record"] for line in spoiled if line["fault"] == fault]
        new = [found_of[fault, record] for record in mine]
        caught = [found for found in new if found]
        right = [found for found in caught if found[0][0] in one.names]
        notes = sum(found[0][1] == "note" for found in caught)
        other = dict(Counter(found[0][0] for found in caught if found not in right))
        total.update(made=len(mine), caught=len(caught), right=len(right), notes=notes)
        missed = [record for record, found in zip(mine, new, strict=True) if not found]
        if mine:
            named = f"right {len(right)}, notes {notes} {other or ''} {missed or ''}"
            print(f"{fault:38} caught {len(caught)}/{len(mine)}, {named}")
    print(f"caught {wilson(total['caught'], total['made'])}, {total['notes']} of them by a note alone")
    right_of = [wilson(total["right"], total[of]) for of in ("made", "caught")]
    print(f"right name {right_of[0]} of all; {right_of[1]} of caught")
    _print_seconds(spoiled)


if __name__ == "__main__":
    what, *rest = sys.argv[1:]
    if what == "count":
        every = [line for name in rest for line in lines_of(Path(name))]
        counts = {
            "rotor": count_clean,
            "findings": count_faults,
            "block": count_blocks,
            "silent": count_costs,
            "peaks": count_ranges,
        }
        for line in every:
            line["key"] = next(key for key in counts if key in line)
        for key, counted in counts.items():
            if lines := [line for line in every if line["key"] == key]:
                counted(lines)
    elif what == "faults":
        out, folder, first, given, *kinds = [*rest, ""] if len(rest) < 4 else rest
        run_faults(Path(out), Path(folder), int(first), given, tuple(kinds))
    elif what == "costs":
        out, folder, blocks, *most = rest
        run_costs(Path(out), Path(folder), Path(blocks), int(most[0]) if most else 10**6)
    elif what == "ranges":
        out, folder, first, given, faults = rest
        run_ranges(Path(out), Path(folder), int(first), given, Path(faults))
    else:
        run = run_clean if what == "clean" else run_blocks
        run(Path(rest[0]), Path(rest[1]), range(int(rest[2]), int(rest[3])))
