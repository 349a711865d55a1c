"""The published document of an estimate, declared; it is written from these types and read back into them.

Times are from power-off, all numbers in SI units, the unit stands in the key.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    ModelWrapValidatorHandler,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from rotordrop.document import ABSENT, Document, Of, Pair, Schema, read_json
from rotordrop.errors import UsageError
from rotordrop.json_schema import DIALECT, closed
from rotordrop.known import Known
from rotordrop.severity.numbers import NUMBERS
from rotordrop.severity.statistics import Statistics
from rotordrop.sketch import sketch
from rotordrop.units import format_moment, format_quantity, si_unit

FORMAT = "rotordrop estimate 2"
MADE_BY = "rotordrop estimate --json"
IN_ROWS = {
    "peak force [N]": "peak_force_N",
    "peak stress [Pa]": "peak_stress_Pa",
    "mean force, 150 to 200 ms [N]": "mean_force_0p15_0p2_N",
    "air gap [m]": "air_gap_m",
}
"""Columns of a table of drops, each with its 90 % interval, and their fields."""


class Value(Document):
    """A number with what is known of it."""

    value: float
    """Value in the unit of the field name."""
    status: str = ABSENT
    """Verdict, or why there is no interval."""
    standard_error: float = ABSENT
    """Standard error in the same unit."""
    interval_90: Pair = ABSENT
    """Interval that holds the true value with 90 % probability."""
    allowance_90: float = ABSENT
    """Half width of the interval by what the model leaves out alone."""
    lower: float = ABSENT
    """Lower limit set by the record."""
    upper: float = ABSENT
    """Upper limit set by the record."""
    start: float = ABSENT
    """Where the search began."""
    bounds: Pair = ABSENT
    """Limits of the search."""
    unit: str = ABSENT
    time_s: float = ABSENT
    """When, from power-off."""
    time_interval_90_s: Pair = ABSENT
    """Interval that holds the time with 90 % probability."""

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 90 % interval, where there is one."""
        ends: list[float] | None = self.interval_90
        return None if ends is None else (ends[0], ends[1])


def peak_text(peak: Value | Known) -> str:
    """A force with its interval where there is one."""
    text = format_quantity(peak.value, "force")
    if peak.interval_90 is None:
        return text
    low, high = (format_quantity(value, "force") for value in peak.interval_90)
    return f"{text} (90 %: {low} to {high})"


class Impact(Document):
    """One contact at one bearing."""

    start_s: float
    end_s: float | None
    peak_time_s: float
    azimuth_rad: float
    peak_force_N: Value
    """Largest bearing force during it."""
    impulse_N_s: Value
    """Of the normal force in the contact."""
    dissipated_energy_J: Value
    after_flight: bool = False
    """Whether it begins an impact; the others follow a hop too short to be told from the displacement."""


def _impact(contact: Any, after_flight: bool) -> Impact:
    return Impact.of_result(contact, after_flight=after_flight)


def described() -> dict[str, str]:
    """Every number that a bearing may have, by its path in the document, with label and unit."""
    # the elements name their parameters; reading a document needs no elements
    from rotordrop.elements.table import published

    found = {field: f"{row.label} [{row.unit}]" for field, row in published().items()}
    return found | {one.field: f"{one.label} [{si_unit(one.kind) or '1'}]" for one in NUMBERS}


class Bearing(Document):
    """What happened at one touchdown bearing.

    Its ``numbers`` are known by their paths (``"support.mass_kg"``) and stand in the document one within the
    other.
    """

    origin: Annotated[str, Of("peak_force.origin.value")]
    """Who found force and stress of this bearing."""
    numbers: dict[str, Value]
    stress_statistics_Pa: Annotated[Statistics, Of("statistics")]
    impacts: Annotated[list[Impact], Of(lambda drop: [*map(_impact, drop.impacts, drop.after_flight)])]
    impacts_interval_90: Annotated[Pair, Of("count_interval_90")] = ABSENT
    """Interval that holds the number of impacts with 90 % probability."""
    contact_from_interval_90_s: Annotated[Pair, Of("contact_from_interval_90")] = ABSENT
    """The same of when the last of them began, the rotor in contact from there on."""
    largest_displacement_m: Annotated[Value, Of("largest")] = ABSENT
    """Largest distance of the rotor from the centre in the estimated part."""
    not_stated: Annotated[dict[str, str], Of("missing")] = ABSENT
    """Numbers that are not stated, and why."""

    def stated(self, field: str) -> Value | None:
        """A number by its path; None where there is none, or it is not stated: without its force, none is."""
        lost = {field, "peak_force_N"} & (self.not_stated or {}).keys()
        return None if lost else self.numbers.get(field)

    @model_validator(mode="wrap")
    @classmethod
    def _from_json(cls, content: Any, handler: ModelWrapValidatorHandler[Bearing]) -> Bearing:
        if isinstance(content, Mapping) and "numbers" not in content:
            own = {key: value for key, value in content.items() if key in cls.model_fields}
            numbers: dict[str, Any] = {}
            for key, part in content.items():
                if key in own:
                    continue
                if isinstance(part, Mapping) and "value" not in part:
                    numbers |= {f"{key}.{leaf}": value for leaf, value in part.items()}
                else:
                    numbers[key] = part
            content = own | {"numbers": numbers}
        # whoever states a number has the elements loaded; whoever reads one takes the word of the digest
        elif isinstance(content, Mapping) and (unknown := content["numbers"].keys() - described().keys()):
            raise ValueError(f"{min(unknown)} is no number of a bearing")
        found = handler(content)
        if missing := {"peak_force_N", "peak_stress_Pa"} - found.numbers.keys():
            raise ValueError(f"{min(missing)} is missing")
        return found

    @model_serializer(mode="wrap")
    def _to_json(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        made = handler(self)
        numbers = made.pop("numbers")
        severity = {path: value for path, value in numbers.items() if path.startswith("severity.")}
        rest = {path: value for path, value in numbers.items() if path not in severity}
        return {"origin": made.pop("origin"), **nested(rest), **made, **nested(severity)}

    @classmethod
    def __get_pydantic_json_schema__(cls, core: Any, handler: Any) -> dict[str, Any]:
        """The numbers one within the other, each with its label and unit."""
        schema: dict[str, Any] = handler.resolve_ref_schema(handler(core))
        entry = schema["properties"].pop("numbers")["additionalProperties"]
        tree = nested({path: {**entry, "description": text} for path, text in described().items()})
        for name, branch in tree.items():
            schema["properties"][name] = branch if "$ref" in branch else closed(branch)
        needed = [name for name in schema["required"] if name != "numbers"]
        schema["required"] = [*needed, "peak_force_N", "peak_stress_Pa"]
        return schema


def nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Numbers by path one within the other: ``support.mass_kg`` becomes ``support: {mass_kg: …}``."""
    tree: dict[str, Any] = {}
    for path, value in values.items():
        group, _, leaf = path.rpartition(".")
        (tree.setdefault(group, {}) if group else tree)[leaf] = value
    return tree


class Check(Document):
    """One check of consistency."""

    name: str
    passed: bool
    message: Annotated[str, Of("said")]
    note: Annotated[str, Of("noted")]
    widening: Annotated[float, Of(lambda check: None if check.widening == 1.0 else check.widening)] = ABSENT
    """Factor on all intervals that what is noted asks for [1]."""


class Consistency(Document):
    """What model and record say of each other."""

    consistent: bool
    sentence: str
    nis: float | None
    process_noise_factor: Annotated[float | None, Of("noise_factor")]
    checks: list[Check]


class Structure(Document):
    """Something the machine has beyond the base model."""

    name: str
    log_likelihood_rise: float | None
    """Of the readings, by it; null where the model without it needed larger process noise. Of another model,
    the logarithm of its odds."""
    sentence: str
    probability: float | None = None
    """Of another model that the record does not tell from the stated one; null of what the stated one has."""


class Advice(Document):
    """What to measure of the machine."""

    measurement: str
    paths: list[str]
    half_widths_N: dict[str, float]
    """Half the 90 % interval of the peak force by bearing."""
    narrowed_N: dict[str, float]
    """The same once the measurement is known."""
    sentence: str

    def left(self, bearing: str) -> float:
        """What would be left of the interval at a bearing [1]."""
        return self.narrowed_N[bearing] / self.half_widths_N[bearing]


class CrossCheck(Document):
    """One number found in two ways."""

    name: str
    estimate: Annotated[float, Of("estimate.value")]
    cross_check: Annotated[float, Of("check")]
    known_relative_accuracy: Annotated[float, Of("accuracy")]
    agrees: bool
    replaced: bool
    """Whether the cross-check stands in place of the estimate."""


class LaterMotion(Document):
    """How far the rotor went after the estimated part [m, s]."""

    bearing: str
    first: float
    first_time: float
    later: float
    later_time: float
    resolved: float
    larger: bool
    """Whether the rotor went further out after the estimated part."""


def later_warning(later: Iterable[LaterMotion], until: float) -> str:
    """What a motion after the estimated part [s] means for the stated peaks; empty where it is no larger."""
    beyond = ", ".join(
        f"{one.bearing} went {1e6 * (one.later - one.first):.1f} µm further out "
        f"at {format_moment(one.later_time)}"
        for one in later
        if one.larger
    )
    if not beyond:
        return ""
    return f"The peaks are of the first {1e3 * until:.0f} ms; {beyond}, where the largest force may be"


class Parameter(Document):
    """One unknown."""

    path: str
    scope: str
    prior: Value | None
    estimate: Value


class Joint(Document):
    """How the errors of what belongs to the machine hang together."""

    paths: list[str]
    mean: list[float]
    """In the measures of the estimate, mostly logarithms."""
    covariance: list[float]
    """Lower triangle, row by row, of the errors of the mean."""
    prior_mean: list[float]
    prior_standard_deviation: list[float]


class Sensor(Document):
    """What was found of one sensor."""

    gain_error: Value
    offset_m: Value
    noise_m: float


class Unbalance(Document):
    """Unbalance of one plane."""

    node: int
    """Node of the plane, counted from 1."""
    amount_kg_m: Value
    phase_rad: Value | None
    """Heavy spot when the mark of the shaft passes, from +y, positive with the spin; null where the record
    has no mark or tells no direction."""
    sentence: str


class Expansion(Document):
    """Start by modal expansion (the paper's), by bearing."""

    displacement_m: dict[str, list[float]]
    velocity_m_per_s: dict[str, list[float]]


class InitialState(Expansion):
    """Start of a replay, by bearing."""

    remanent_force_N: list[list[float]]
    remanence_time_constant_s: float
    modal_expansion: Expansion = ABSENT


class FirstContact(Document):
    """The first contact of one bearing in the record (Neisi 2020, eq. 17)."""

    start_s: float
    end_s: float
    duration_s: float
    timing_error_s: float
    impact_speed_m_per_s: float
    indentation_m: float
    mass_kg: float
    half_period_stiffness_N_per_m: Annotated[float, Of("equivalent_stiffness")]
    half_period_stiffness_error_N_per_m: Annotated[float, Of("standard_error")]
    gravity_corrected_stiffness_N_per_m: Annotated[float, Of("corrected_stiffness")]


class Window(Document):
    """Root mean square distance of replay and record in a window [m, s], by bearing."""

    name: str
    start: float
    end: float
    rms: dict[str, float]


class BearingAgreement(Document):
    """How far the replay follows the record at one bearing."""

    measured_contacts_s: list[Pair]
    simulated_contacts_s: list[Pair]
    measured_bounce_m: float | None
    simulated_bounce_m: float | None
    horizon_s: float


class Agreement(Document):
    """How far the replay follows the record."""

    windows: list[Window]
    bearings: dict[str, BearingAgreement]
    orbit_disagreement_m: float


class Drop(Document):
    """The estimate of one drop."""

    format: str
    verdict: Annotated[str, Of("verdict.value")]
    """What model and record say of each other, in a sentence."""
    consistent: bool
    """Whether single numbers hold within their intervals."""
    rotordrop_version: str
    fingerprint: str
    """Hash of a probe drop as this computer computes it."""
    machine: Annotated[str, Of("machine.name")]
    record: Annotated[str, Of(lambda made: made.name if made.record.path is None else made.record.path.name)]
    record_sha256: Annotated[str, Of("record.sha256")]
    recorded: Annotated[str, Of("record.event_date")]
    """When the recorder says the drop was; empty where it does not."""
    simulated_record: bool
    """Whether the record is known to be simulated."""
    method: Literal["tracked", "replay"]
    quick: bool
    drop_instant_s: Annotated[float, Of("drop_instant.value")]
    """Power-off in record time."""
    drop_instant_interval_90_s: Annotated[Pair, Of("drop_instant.interval_90")]
    speed_Hz: Annotated[float, Of(lambda made: made.speed / (2.0 * math.pi))]
    """Rotor speed at power-off."""
    estimated_until_s: Annotated[float, Of("until")]
    """End of the part that the numbers are of."""
    warnings: list[str]
    notes: list[str]
    consistency: Annotated[Consistency, Of(lambda made: made)]
    bearings: dict[str, Bearing]
    structure: list[Structure]
    advice: list[Advice]
    cross_check: list[CrossCheck]
    later_motion: Annotated[list[LaterMotion], Of("later")]
    parameters: list[Parameter]
    joint: Joint | None
    """How the errors of what belongs to the machine hang together."""
    sensors: Annotated[dict[str, Sensor], Of(lambda made: {one.sensor: one for one in made.sensors})]
    unbalance: list[Unbalance]
    initial_state: InitialState = ABSENT
    first_contact: dict[str, FirstContact] = ABSENT
    agreement: Annotated[Agreement, Of("agreement")] = ABSENT
    document_sha256: str = ABSENT
    """Digest of the other values."""

    def __repr__(self) -> str:
        """Record, machine and the peak force of every bearing."""
        peaks = (f"{name} {peak_text(one.numbers['peak_force_N'])}" for name, one in self.bearings.items())
        return f"<Drop {self.record} of {self.machine}: {'; '.join(peaks)}. {self.verdict}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        peaks = {  # a line from zero for each
            name: (
                [hit.peak_time_s for hit in one.impacts for _ in range(3)],
                [force for hit in one.impacts for force in (0.0, hit.peak_force_N.value, 0.0)],
            )
            for name, one in self.bearings.items()
        }
        return sketch(repr(self), "time from power-off [s]", "peak force of contacts [kN]", peaks, 1e-3)

    def rows(self) -> list[dict[str, Any]]:
        """One row per bearing: peaks, mean force and air gap with their intervals [SI], NaN where unknown."""
        found = []
        for bearing, of in self.bearings.items():
            row = {"drop": self.record, "bearing": bearing, "consistent": self.consistent}
            row["speed [Hz]"] = self.speed_Hz
            for name, field in IN_ROWS.items():
                known = of.numbers.get(field)
                low, high = (known.interval if known else None) or (math.nan, math.nan)
                row |= {name: known.value if known else math.nan, f"{name} 5 %": low, f"{name} 95 %": high}
            found.append(row)
        return found

    def largest(self, field: str) -> tuple[str, Value]:
        """Bearing and value of the largest peak, by the upper end of its interval where one has one."""
        found = {name: one.numbers[field] for name, one in self.bearings.items()}
        known = {name: one.interval[1] for name, one in found.items() if one.interval is not None}
        where = max(found, key=lambda name: known.get(name, -math.inf) if known else found[name].value)
        return where, found[where]

    @property
    def later_warning(self) -> str:
        """That the largest force may lie after the part that was estimated; empty where nothing says so."""
        return later_warning(self.later_motion, self.estimated_until_s)

    @property
    def went_on(self) -> frozenset[str]:
        """Bearings where the rotor went further out after the part that was estimated."""
        return frozenset(one.bearing for one in self.later_motion if one.larger)


class Drops(Document):
    """The estimates of several drops of one machine."""

    format: str
    rotordrop_version: str
    fingerprint: str
    machine: str
    drops: dict[str, Drop]
    document_sha256: str = ABSENT
    """Digest of the other values."""


def drops_of(content: Mapping[str, Any], place: str) -> dict[str, Drop]:
    """The estimates that an object holds, by name; one of a single drop has the name of its place.

    Raises
    ------
    UsageError
        If it is no document of an estimate, or one of another version.
    """
    if (found := content.get("format")) != FORMAT:
        if {"no_fall", "not_seen"} <= content.keys():
            raise UsageError(
                f"{place} is the JSON of 'rotordrop look', which holds no forces; expected an estimate. Give "
                f"a file that '{MADE_BY}' wrote."
            )
        stands = "there is no format" if found is None else f"the format is {found!r}"
        raise UsageError(
            f"{place}: {stands}; expected {FORMAT!r}. Give a file that '{MADE_BY}' of this "
            "version wrote, or estimate the drop anew."
        )
    if "drops" in content:
        return Drops.of(content, place, MADE_BY).drops
    return {Path(place).stem: Drop.of(content, place, MADE_BY)}


def read_drops(path: Path) -> dict[str, Drop]:
    """The estimates that a file holds, by name."""
    return drops_of(read_json(path, MADE_BY), str(path))


def read_drop(path: Path) -> Drop:
    """The estimate of the one drop that a file holds; a file of several is refused."""
    drops = read_drops(path)
    if len(drops) > 1:
        raise UsageError(
            f"{path} holds the drops {', '.join(drops)}; expected one. Write that drop to a file of its own."
        )
    return next(iter(drops.values()))


def estimate_schema() -> dict[str, Any]:
    """JSON Schema of the document that ``rotordrop estimate --json`` writes; times are from power-off."""
    made = Drops.model_json_schema(schema_generator=Schema)
    definitions = made.pop("$defs")
    return {
        "$schema": DIALECT,
        "title": "rotordrop estimate",
        "description": "Force and stress of touchdown bearings from one or several recorded drops.",
        "oneOf": [{"$ref": "#/$defs/Drop"}, made],
        "$defs": definitions,
    }
