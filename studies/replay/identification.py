"""Supports and air gap from synthetic records, everything else known.

    python studies/replay/identification.py [--first 1120] [--count 12]

Sensors with ordinary noise, hum, runout and 16 bits, but without zero and gain errors. One file for all
seeds in ``results``; it is written anew after every record.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from typing import Any

from common import (
    SUPPORT,
    WITHOUT_ZERO_AND_GAIN_ERRORS,
    informed,
    known_machine,
    radians,
    size_of,
    speed_of,
    value_of,
    with_right_sensors,
    write,
)

from rotordrop.arrays import Array
from rotordrop.evidence.evidence import Evidence, read_evidence
from rotordrop.evidence.evidence import known as present
from rotordrop.evidence.rest import identify_air_gap
from rotordrop.known import Known
from rotordrop.replay.first_impacts import FirstImpacts, first_impacts
from rotordrop.replay.support_and_friction import (
    LONGEST_WINDOW,
    SupportFit,
    fit_support,
    identified_values,
    refit_with_friction,
)
from rotordrop.rotor.parameters import build_drop_model
from rotordrop_bench import hidden_machine, synthesize_drop

UNTIL = 0.06


def supports_of(evidence: Evidence) -> tuple[SupportFit, dict[str, Known], FirstImpacts, Array]:
    """Supports as the replay finds them, but for the sweep of the friction, which is known here."""
    quick = build_drop_model(evidence.model.machine, "quick")
    coarse, fine = (first_impacts(evidence, model, until=UNTIL) for model in (quick, evidence.model))
    found = fit_support(coarse, fine, evidence.latest_first_contact)
    longest = evidence.latest_first_contact + LONGEST_WINDOW
    friction = identified_values(fine, found.search.best.x, found.covariance)[fine.paths[fine.friction]]
    problem, x, covariance = refit_with_friction(fine, found.search.best, friction, longest=longest)
    return found, identified_values(problem, x, covariance), problem, x


def one(seed: int, hertz: float) -> dict[str, Any]:
    """Errors of one record, whose machine and drop have this seed."""
    known = known_machine()
    hidden = hidden_machine(known, seed)
    drop = synthesize_drop(hidden, radians(hertz), seed, sensor_chain=WITHOUT_ZERO_AND_GAIN_ERRORS)
    began, used = time.perf_counter(), time.process_time()
    model = build_drop_model(with_right_sensors(informed(known, hidden)))
    evidence = read_evidence(model, drop.record, drop.tail)
    found, values, problem, x = supports_of(evidence)
    best = found.search.best
    rows = problem.rows(problem.trial(x))
    settled = replace(evidence.model, parameters=evidence.model.parameters._replace(bearing=rows))
    gap = identify_air_gap(present(evidence.rest), settled, present(evidence.sensing))
    bearings = {}
    for b, bearing in enumerate(hidden.machine.touchdown_bearings):
        entry: dict[str, Any] = {
            "air_gap_error_um": 1e6 * (float(gap.value[b]) - value_of(bearing, "air_gap"))
        }
        for path in SUPPORT:
            value, true = values[f"{bearing.name}.{path}"], value_of(bearing, path)
            low, high = value.interval_90 or (float("nan"),) * 2
            entry[path] = {
                "true": true,
                "error_percent": 100.0 * (value.value / true - 1.0),
                "interval_90_percent": [100.0 * (low / true - 1.0), 100.0 * (high / true - 1.0)],
                "covered": low <= true <= high,
                "status": value.status,
            }
        bearings[bearing.name] = entry
    return {
        "seed": seed,
        "speed_Hz": hertz,
        "bearings": bearings,
        "misfit": best.misfit,
        "window_after_later_contact_ms": 1e3 * (best.window - evidence.latest_first_contact),
        "ended_early": found.search.ended_early or found.coarse.ended_early,
        "wall_s": time.perf_counter() - began,
        "processor_s": time.process_time() - used,
    }


def summary(records: list[dict[str, Any]]) -> dict[str, Any]:
    """Sizes of the errors over all records and bearings."""
    bearings = [bearing for record in records for bearing in record["bearings"].values()]
    sizes: dict[str, Any] = {
        f"{path} [%]": size_of([bearing[path]["error_percent"] for bearing in bearings]) for path in SUPPORT
    }
    sizes["air_gap [um]"] = size_of([bearing["air_gap_error_um"] for bearing in bearings])
    covered = [bearing[path]["covered"] for bearing in bearings for path in SUPPORT]
    sizes["share of 90 % intervals that hold the truth"] = sum(covered) / len(covered)
    return sizes


def main() -> None:
    """Run the seeds named on the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1120)
    parser.add_argument("--count", type=int, default=12)
    options = parser.parse_args()
    records: list[dict[str, Any]] = []
    for place in range(options.count):
        record = one(options.first + place, speed_of(place))
        records.append(record)
        errors = [round(b[p]["error_percent"], 2) for b in record["bearings"].values() for p in SUPPORT]
        gaps = [round(b["air_gap_error_um"], 2) for b in record["bearings"].values()]
        print(
            record["seed"],
            record["speed_Hz"],
            errors,
            gaps,
            round(record["misfit"], 2),
            record["ended_early"],
            round(record["processor_s"], 1),
            flush=True,
        )
        write("identification.json", {"summary": summary(records), "records": records})


if __name__ == "__main__":
    main()
