"""Damage machine files and see what the program says.

Usage: python studies/damaged/machines.py COUNT [FIRST]

Four files, damaged in eight ways: characters, lines, numbers, units, words, brackets. Each is read, summed
up where it is accepted. The number is the seed; the first is FIRST. One line per 250 files in
``results/machines.jsonl``; a block that is there is not made again.
"""

from __future__ import annotations

import json
import random
import re
import sys
import time
import traceback
from collections import Counter
from pathlib import Path

from rotordrop.errors import RotordropError
from rotordrop.machine import example_path, loads_machine
from rotordrop.machine.template import template_text
from rotordrop.rotor.machine_summary import summarise_machine

BLOCK = 250
RESULTS = Path(__file__).parent / "results" / "machines.jsonl"
SLOW_S = 5.0
_ODD = [
    "",
    "0",
    "-1",
    "1e400",
    "nan",
    "true",
    '"',
    "[",
    "{",
    "]",
    "}",
    "=",
    "\x00",
    "ü",
    "1e-300",
    "'''",
    "9" * 400,
]


def damaged(text: str, dice: random.Random) -> str:
    """Damage a machine file in one of eight ways."""
    lines = text.split("\n")
    said = [i for i, line in enumerate(lines) if "=" in line and not line.lstrip().startswith("#")]
    at = dice.choice(said)
    way = dice.randrange(8)
    if way == 0:
        k = dice.randrange(len(text))
        return text[:k] + chr(dice.randrange(1, 0x250)) + text[k + dice.randrange(2) :]
    if way == 1:
        del lines[at]
    elif way == 2:
        lines.insert(dice.choice(said), lines[at])
    elif way == 3:
        lines[at] = re.sub(r"[0-9.]+", lambda _: dice.choice(_ODD), lines[at], count=1)
    elif way == 4:
        factor = 10.0 ** dice.randrange(-12, 13) * dice.choice([1.0, -1.0])
        lines[at] = re.sub(r"\d+\.?\d*", lambda m: f"{float(m[0]) * factor:g}", lines[at], count=1)
    elif way == 5:
        lines[at] = re.sub(
            r" [A-Za-z/^*1-9]+\"", f' {dice.choice(["m", "kg", "Hz", "um^3", "N/m/s", "°"])}"', lines[at]
        )
    elif way == 6:
        key, sign, value = lines[at].partition("=")
        lines[at] = f"{key.strip()[: dice.randrange(1, 9)]} {sign} {value}"
    else:
        lines[at] = lines[at].partition("=")[0] + "= " + dice.choice(_ODD)
    return "\n".join(lines)


def outcome(text: str, folder: Path) -> str:
    """What becomes of a machine file."""
    begun = time.perf_counter()
    try:
        machine = loads_machine(text, folder)
        summarise_machine(machine)
        said = "accepted"
    except RotordropError as error:
        said = (
            "refused with a line" if re.search(r"(^|\D)\d+:\d+|line \d+", str(error)) else "refused, no line"
        )
        said += "" if len(str(error)) > 20 else ", hardly a word"
    except Exception:
        said = "traceback: " + traceback.format_exc().strip().splitlines()[-1][:120]
    return said if time.perf_counter() - begun < SLOW_S else f"slow: {said}"


def main() -> None:
    """Run what is missing and print the sums."""
    sources = [Path(example_path(name)) for name in ("lp400", "paper", "small")]
    texts = [(path.read_text(encoding="utf-8"), path.parent) for path in sources]
    texts.append((template_text(), Path()))
    RESULTS.parent.mkdir(exist_ok=True)
    lines = [json.loads(line) for line in RESULTS.read_text().splitlines()] if RESULTS.is_file() else []
    there = {line["block"] for line in lines}
    with RESULTS.open("a") as out:
        begin = int(sys.argv[2]) if len(sys.argv) > 2 else 0
        for first in range(begin, begin + int(sys.argv[1]), BLOCK):
            if first in there:
                continue
            counts: Counter[str] = Counter()
            kept: list[tuple[int, str]] = []
            for number in range(first, first + BLOCK):
                text, folder = texts[number % len(texts)]
                said = outcome(damaged(text, random.Random(number)), folder)
                counts[said] += 1
                if said.startswith(("traceback", "slow", "refused, no line")):
                    kept.append((number, said))
            line = {"block": first, "counts": counts, "told": kept}
            lines.append(line)
            out.write(json.dumps(line) + "\n")
            out.flush()
    total: Counter[str] = Counter()
    for line in lines:
        total.update(line["counts"])
    print(dict(total))


if __name__ == "__main__":
    main()
