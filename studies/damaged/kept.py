"""What the program keeps for itself: studies, logs, jobs of the page. Damaged, and what is made of that.

Usage: python studies/damaged/kept.py 500 [SEED]

Kinds of files, how one is made and what reads it are those of ``tests/unit/cli/test_written_files.py``: of
them the ones with a digest. One file at a time is damaged at random; told is how often that was named, had no
effect, changed something without a word, or ended in a traceback.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from tests.unit.cli.test_written_files import WRITTEN

from rotordrop.errors import RotordropError

RESULTS = Path(__file__).parent / "results" / "kept.json"
KINDS = ("bit", "zeros", "cut", "lost", "swapped", "there twice", "empty")


def damaged(whole: bytes, what: str, random: np.random.Generator) -> bytes:
    """A file with one fault."""
    at, size = int(random.integers(0, len(whole))), int(random.integers(1, 65))
    if what == "bit":
        raw = bytearray(whole)
        raw[at] ^= 1 << int(random.integers(0, 8))
        return bytes(raw)
    before, part, after = whole[:at], whole[at : at + size], whole[at + size :]
    return {
        "zeros": before + bytes(len(part)) + after,
        "cut": before,
        "lost": before + after,
        "swapped": before + after[:size] + part + after[size:],
        "there twice": before + part + part + after,
        "empty": b"",
    }[what]


def main() -> None:
    """Damage so many files and print the table."""
    random = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 26)
    counted: Counter[tuple[str, str]] = Counter()
    kinds = [name for name, entry in WRITTEN.items() if entry.sealed]
    with tempfile.TemporaryDirectory() as folder:
        made: dict[str, Path] = {}
        expected: dict[str, str] = {}
        for kind in kinds:
            place = Path(folder) / kind
            place.mkdir()
            made[kind] = WRITTEN[kind].make(place)
        for number in range(int(sys.argv[1])):
            kind = kinds[number % len(kinds)]
            file, read = made[kind], WRITTEN[kind].read
            if kind not in expected:
                expected[kind] = repr(read(file))
            whole = file.read_bytes()
            changed = damaged(whole, str(random.choice(KINDS)), random)
            file.write_bytes(changed)
            try:
                outcome = "unchanged" if repr(read(file)) == expected[kind] else "silent"
            except RotordropError:
                outcome = "named"
            except Exception as error:
                outcome = f"traceback ({type(error).__name__})"
            counted[kind, "same bytes" if changed == whole else outcome] += 1
            file.write_bytes(whole)
    table = {kind: {what: n for (one, what), n in counted.items() if one == kind} for kind in kinds}
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(table, indent=1) + "\n")
    for kind, row in table.items():
        print(f"{kind}: {', '.join(f'{what} {n}' for what, n in sorted(row.items()))}")
    print("all:", dict(Counter(what for (_, what), n in counted.items() for _ in range(n))))


if __name__ == "__main__":
    main()
