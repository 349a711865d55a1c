"""Every unknown parameter of a drop, one row each; whatever lists parameters is a query of this table.

A row says what a parameter is called, what it is measured in, what is known of it before a record is read,
which entries of the kernel it sets, what the estimators do with it and where its value is published.
"""

from __future__ import annotations

from collections.abc import Iterator

from rotordrop.elements.beam import FORM
from rotordrop.elements.parameter import Entry, Load, Owner, Parameter, Role, Rule, Step
from rotordrop.physics import columns as L
from rotordrop.rotor.structure_table import STRUCTURE


def _bearing(*columns: int) -> tuple[Entry, ...]:
    """The first column takes the value, the others follow at their ratio."""
    first, *others = columns
    return (
        Entry(array="bearing", column=first),
        *(Entry(array="bearing", column=column, rule=Rule.RATIO) for column in others),
    )


TABLE: tuple[Parameter, ...] = (
    Parameter(
        path="air_gap",
        label="air gap",
        kind="length",
        measured_by="a lift check at {owner} (rotordrop clearance)",
        logarithmic=False,
        role=Role.SOUGHT,
        guess_sigma=0.08,
        given_sigma=0.08,
        scale="air gap",
        least_sigma=1e-12,
        lower=0.0,
        drift=0.032,
        entries=_bearing(L.AIR_GAP),
        step=Step.TAIL,
        field="air_gap_m",
        truth=("air_gap_m",),
        separated_by={"offset": "a lift test of the rotor in its magnets gives the diametral clearance"},
    ),
    Parameter(
        path="equivalent_stiffness",
        label="equivalent stiffness, bearing and support",
        kind="stiffness",
        role=Role.DERIVED,
        step=Step.FIRST_CONTACT,
        field="equivalent_stiffness_N_per_m",
        truth=("equivalent_stiffness",),
    ),
    Parameter(
        path="support.stiffness",
        label="support stiffness",
        kind="stiffness",
        measured_by="a hammer test of the touchdown-bearing housing at {owner}",
        role=Role.SOUGHT,
        guess_sigma=0.5,
        given_sigma=0.05,
        drift=0.02,
        entries=_bearing(L.SUPPORT_STIFFNESS_Y, L.SUPPORT_STIFFNESS_X),
        step=Step.IMPACTS,
        decisive=True,
        leading=True,
        field="support.stiffness_N_per_m",
        truth=("support_stiffness",),
        taken_over="needed",
        separated_by={
            "support.mass": (
                "a hammer test of the touchdown-bearing housing gives support frequency and stiffness"
            )
        },
    ),
    Parameter(
        path="support.anisotropy",
        label="horizontal over vertical support stiffness",
        kind="dimensionless",
        guess_sigma=0.03,
        given_sigma=0.03,
        entries=(Entry(array="bearing", column=L.SUPPORT_STIFFNESS_X, rule=Rule.SCALE),),
        field="support.anisotropy",
        truth=("support_anisotropy",),
    ),
    Parameter(
        path="support.mass",
        label="support mass",
        kind="mass",
        measured_by="a hammer test of the touchdown-bearing housing at {owner}",
        role=Role.SOUGHT,
        guess_sigma=0.4,
        given_sigma=0.05,
        drift=0.02,
        entries=_bearing(L.SUPPORT_MASS_Y, L.SUPPORT_MASS_X),
        step=Step.IMPACTS,
        decisive=True,
        leading=True,
        field="support.mass_kg",
        truth=("support_mass",),
        taken_over="needed",
    ),
    Parameter(
        path="support.damping",
        label="support damping",
        kind="damping",
        measured_by="a hammer test of the touchdown-bearing housing at {owner}",
        role=Role.SOUGHT,
        guess_sigma=0.7,
        given_sigma=0.3,
        drift=0.1,
        entries=_bearing(L.SUPPORT_DAMPING_Y, L.SUPPORT_DAMPING_X),
        step=Step.IMPACTS,
        leading=True,
        field="support.damping_N_s_per_m",
        truth=("support_damping",),
        taken_over="needed",
    ),
    Parameter(
        path="contact.stiffness",
        label="contact stiffness",
        kind="contact_stiffness",
        measured_by="a static push with a known force at {owner}",
        guess_sigma=0.3,
        given_sigma=0.3,
        drift=0.2,
        entries=_bearing(L.CONTACT_STIFFNESS),
        step=Step.IMPACTS,
        leading=True,
        field="contact.stiffness_N_per_m_n",
        truth=("contact_K",),
        taken_over="welcome",
        separated_by={"air_gap": "a static push with a known force gives the contact stiffness"},
    ),
    Parameter(
        path="contact.exponent",
        label="contact exponent",
        kind="dimensionless",
        measured_by="a static push with a known force at {owner}",
        guess_sigma=0.1,  # from 10/9 of a line to 3/2 of a point
        given_sigma=0.1,
        least_sigma=0.01,  # an interval that ends at a limit may have no width, and no drop says more
        lower=1.0,
        upper=2.0,
        entries=(
            Entry(array="bearing", column=L.CONTACT_EXPONENT),
            Entry(array="bearing", column=L.CONTACT_STIFFNESS, rule=Rule.AT_TYPICAL_DEPTH),
        ),
        field="contact.exponent",
        truth=("contact", "n"),
    ),
    Parameter(
        path="contact.damping",
        label="contact damping",
        kind="contact_damping",
        role=Role.CONSIDERED,
        guess_sigma=0.6,
        given_sigma=0.6,
        entries=_bearing(L.CONTACT_DAMPING),
        step=Step.IMPACTS,
        field="contact.damping_s_per_m",
        truth=("contact", "lam"),
        taken_over="welcome",
    ),
    Parameter(
        path="friction.static",
        label="static friction coefficient",
        kind="dimensionless",
        role=Role.DERIVED,
        step=Step.SWEEP,
        field="friction.static",
        truth=("friction_static",),
        taken_over="welcome",
    ),
    Parameter(
        path="friction.dynamic",
        label="dynamic friction coefficient",
        kind="dimensionless",
        measured_by="a speed sensor on the inner race of {owner}",
        role=Role.SOUGHT,
        guess_sigma=0.4,
        given_sigma=0.4,
        reach=3.0,
        drift=1.0,
        late_drift_factor=5.0,
        entries=_bearing(L.FRICTION_DYNAMIC, L.FRICTION_STATIC),
        step=Step.SWEEP,
        field="friction.dynamic",
        truth=("friction_dynamic",),
        taken_over="needed",
        separated_by={"race.inertia": "a speed sensor on the inner race gives its spin-up"},
    ),
    Parameter(
        path="friction.stribeck_speed",
        label="Stribeck speed of the friction",
        kind="velocity",
        guess_sigma=0.4,
        given_sigma=0.4,
        reach=5.0,
        drift=1.0,
        late_drift_factor=5.0,
        entries=_bearing(L.STRIBECK_SPEED),
        spin_up_only=True,
        field="friction.stribeck_speed_m_per_s",
        truth=("contact", "v_stribeck"),
    ),
    Parameter(
        path="race.inertia",
        label="race inertia",
        kind="inertia",
        measured_by="a speed sensor on the inner race of {owner}",
        role=Role.CONSIDERED,
        guess_sigma=0.12,
        given_sigma=0.12,
        reach=2.0,
        drift=0.1,
        late_drift_factor=5.0,
        entries=_bearing(L.RACE_INERTIA),
        step=Step.IMPACTS,
        spin_up_only=True,
        field="race.inertia_kg_m2",
        truth=("ring_Ip",),
        taken_over="welcome",
    ),
    Parameter(
        path="race.drag_coefficient",
        label="drag coefficient of the race",
        kind="dimensionless",
        guess_sigma=0.5,
        given_sigma=0.5,
        reach=6.0,
        drift=0.2,
        entries=_bearing(L.DRAG_COEFFICIENT),
        spin_up_only=True,
        field="race.drag_coefficient",
        truth=("bearing", "drag_mu"),
    ),
    Parameter(
        path="damping_time",
        label="damping time of the balls",
        kind="time",
        shown_as="short_time",
        guess_sigma=0.5,
        given_sigma=0.5,
        drift=0.2,
        entries=(Entry(array="bearing", column=L.BEARING_DAMPING, rule=Rule.RATIO),),
        step=Step.IMPACTS,
        field="damping_time_s",
        truth=("bearing", "Cb_over_Kb"),
        taken_over="welcome",
    ),
    Parameter(
        path="preload",
        label="preload",
        kind="force",
        measured_by="the preload of the bearing at {owner}, from its drawing",
        logarithmic=False,  # by the axial offset of the ball rows, which is what the ball forces depend on
        role=Role.CONSIDERED,
        guess_sigma=0.15,
        given_sigma=0.15,
        entries=_bearing(L.AXIAL_OFFSET),
        step=Step.IMPACTS,
        field="preload_N",
        truth=("preload_N",),
        taken_over="welcome",
    ),
    Parameter(
        path="gain",
        owner="sensor",
        label="gain",
        kind="dimensionless",
        logarithmic=False,
        guess_sigma=0.01,
        given_sigma=0.01,
        scale="one",
        least_sigma=1e-12,
    ),
    Parameter(
        path="offset",
        owner="sensor",
        label="offset",
        kind="length",
        logarithmic=False,
        guess_sigma=0.04,
        given_sigma=0.04,
        scale="smallest air gap",
        least_sigma=1e-12,
    ),
    *(
        Parameter(
            path=part,
            owner="unbalance",
            label=f"unbalance, {part} part",
            kind="unbalance",
            logarithmic=False,
            guess_sigma=1.0,
            scale="amount described",
            entries=(Entry(array="unbalance", column=column),),
        )
        for column, part in enumerate(("cosine", "sine"))
    ),
    *(
        Parameter(
            path=f"remanent_force.{axis}",
            owner="magnet",
            label=f"remanent force, {axis}",
            kind="force",
            logarithmic=False,
            guess_sigma=0.2,
            scale="weight a magnet carries",
            entries=(Entry(array="magnet", column=column),),
        )
        for column, axis in ((L.REMANENT_X, "x"), (L.REMANENT_Y, "y"))
    ),
    Parameter(
        path="remanence.time_constant",
        owner="drop",
        label="time constant of the remanent force",
        kind="time",
        shown_as="duration",
        guess_sigma=0.4,
        entries=(Entry(array="spin", column=L.REMANENCE_TIME_CONSTANT),),
    ),
    Parameter(
        path="speed.aero_time_constant",
        owner="drop",
        label="aerodynamic time constant",
        kind="time",
        shown_as="duration",
        guess_sigma=0.7,
        entries=(Entry(array="spin", column=L.AERO_TIME_CONSTANT),),
        truth=("tau_aero",),
    ),
)
"""The rows; those of a bearing in the order in which the estimators hold them."""

_BY_PATH = {(row.owner, row.path): row for row in (*TABLE, *STRUCTURE, *FORM)}


def parameter(path: str, owner: Owner = "bearing") -> Parameter:
    """Row of a path below its owner."""
    return _BY_PATH[owner, path]


def rows(owner: Owner | None = None) -> Iterator[Parameter]:
    """Rows of one kind of owner, or all."""
    return (row for row in TABLE if owner in (None, row.owner))


def row_of(path: str) -> Parameter:
    """Row of a path in the machine, such as ``"NDE.support.stiffness"`` or ``"sensors.X1.gain"``."""
    owner, _, rest = path.partition(".")
    if owner == "sensors":
        return _BY_PATH["sensor", rest.rpartition(".")[2]]
    if owner == "rotor":
        return _BY_PATH["rotor", rest]
    return _BY_PATH.get(("bearing", path)) or _BY_PATH["bearing", rest]


def fitted_row(path: str) -> Parameter | None:
    """Row of a path of the machine file; none for what is fitted by its ratio to another value there."""
    owner, _, rest = path.partition(".")
    return None if owner in ("sensors", "rotor") else _BY_PATH.get(("bearing", rest))


def published() -> dict[str, Parameter]:
    """Rows of bearings by their field in the JSON document."""
    return {row.field: row for row in rows("bearing") if row.field}


LOADS: tuple[Load, ...] = (
    Load(field="peak_force_N", label="peak bearing force", kind="force", truth="peak_force_N"),
    Load(
        field="peak_stress_Pa",
        label="peak Hertz stress",
        kind="pressure",
        truth="max_stress_MPa",
        truth_unit=1e6,
    ),
    Load(
        field="mean_force_0p15_0p2_N",
        label="mean force, 150 to 200 ms",
        kind="force",
        truth="mean_force_0p15_0p2_N",
    ),
    Load(
        field="mean_stress_Pa",
        label="mean Hertz stress",
        kind="pressure",
        truth="mean_stress_MPa",
        truth_unit=1e6,
    ),
)
"""What a drop did to a bearing, in the order in which it is shown."""


def separating_measurement(first: Parameter, second: Parameter) -> str:
    """What would tell two parameters apart that a record confounds."""
    for one, other in ((first, second), (second, first)):
        if other.path in one.separated_by:
            return one.separated_by[other.path]
    return "more drops at other speeds, or a measurement of one of the two"
