"""A soft mount: what lies beside the spring and damper of a support. Ribbon, branches that relax, stop.

Spring and damper themselves are those of the support, `rotordrop.elements.support`.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any, ClassVar

from rotordrop.arrays import Array
from rotordrop.elements import values as V
from rotordrop.elements.description import Description, Misfit
from rotordrop.elements.parameter import Parameter, stated_only
from rotordrop.elements.values import default, follows, scaled
from rotordrop.known import Known
from rotordrop.physics import columns as L
from rotordrop.physics import mount as law
from rotordrop.physics.contact import contact_law
from rotordrop.units import format_quantity

FRICTION_SHARE = 1.573
"""Stiffness of a ribbon's friction over that of its spring [1] for a loss factor of 0.3 at 3.4 times the
travel of slip: by harmonic balance 0.2643 r / (1 + 0.2455 r)."""

SLIP_TRAVEL = (25e-6, 5e-6, 100e-6)
"""Travel at which a ribbon slips [m] and its range, where no slip force is given: chosen, not measured."""

ELEMENTS: Mapping[str, tuple[str, ...]] = {
    "spring": ("stiffness", "damping", "damping_ratio", "cubic"),
    "ribbon": ("stiffness",),
    "maxwell": ("stiffness",),
    "stop": (),
}
"""Kinds of elements, and what each says of the spring and damper of the support."""


def _branch_at(k: int) -> int:
    """First entry of a branch in the numbers of a mount."""
    return law.BRANCHES + k * law.BRANCH_ENTRIES


class Stop(Description):
    """A stop around the support: a second contact, circle in circle, without friction."""

    gap: V.PositiveLength
    """Travel of the support up to the stop [m]."""
    stiffness: V.Stiffness = default(5e8, "a steel ring in its housing", (1e8, 5e9))
    """Stiffness of the stop [N/m]."""
    damping: V.ContactDamping = default(0.1, "contact damping of steel at low speed", (0.0, 0.5))
    """Contact damping λ [s/m]."""


class Ribbon(Description):
    """A corrugated ribbon: it holds by a spring up to its slip force, and slips beyond."""

    friction_stiffness: V.Stiffness = follows(
        "a loss factor of 0.3 at 3.4 times the travel at which it slips"
    )
    """Stiffness of the spring that slips [N/m]."""
    slip_force: V.PositiveForce = follows("a travel of 25 µm")
    """Force at which it slips [N]."""
    sharpness: V.Positive = default(10.0, "close to Coulomb's friction, and smooth")
    """Exponent n of the transition to slip [1]."""


class Branch(Description):
    """A spring in series with a damper (Maxwell): stiff when fast, gone when slow."""

    stiffness: V.Stiffness
    """Stiffness of its spring [N/m]."""
    time: V.PositiveTime
    """Time in which its force relaxes [s]."""


class Mount(Description):
    """What lies in parallel to spring and damper of a support; nothing by default."""

    stop: Stop | None = None
    """A stop."""
    ribbon: Ribbon | None = None
    """A corrugated ribbon (tolerance ring)."""
    maxwell: tuple[Branch, ...] = ()
    """Branches that relax, such as of an O-ring, slowest first; three at most."""

    states_at: ClassVar[int] = L.MOUNT_STATES

    @property
    def present(self) -> bool:
        """Whether there is any element."""
        return self.stop is not None or len(self.further_states) > 0

    @property
    def further_states(self) -> Mapping[str, int]:
        """The stretch, x and y, of each spring that slips or relaxes."""
        springs = ["ribbon"] * (self.ribbon is not None)
        springs += [f"branch {k + 1}" for k in range(len(self.maxwell))]
        return {f"mount {{}} {spring} {axis}": L.POSITION for spring in springs for axis in "xy"}

    @property
    def stiffnesses(self) -> dict[str, float]:
        """Stiffness [N/m] of each of its elements."""
        found = {f"branch {k + 1}": one.stiffness.value for k, one in enumerate(self.maxwell)}
        found |= {} if self.ribbon is None else {"ribbon": self.ribbon.friction_stiffness.value}
        return found | ({} if self.stop is None else {"stop": self.stop.stiffness.value})

    def check(self) -> None:
        """Refuse branches that do not descend, or too many."""
        times = [branch.time.value for branch in self.maxwell]
        if len(times) > law.MOST_BRANCHES:
            raise Misfit(
                f"the mount has {len(times)} branches; {law.MOST_BRANCHES} cover two decades of "
                "frequency and are the most: join the two whose times are closest",
                ("maxwell",),
            )
        for k, (one, other) in enumerate(pairwise(times)):
            if other >= one:
                shown = " and ".join(format_quantity(time, "time") for time in (one, other))
                raise Misfit(
                    f"the relaxation times do not descend: {shown}; write the slowest branch first",
                    ("maxwell", k + 1, "time"),
                )

    def beside(self, stiffness: Known) -> Mount:
        """The mount with what its ribbon leaves out, beside a spring of a stiffness [N/m]."""
        if self.ribbon is None:
            return self
        given, values = self.ribbon.model_fields_set, dict[str, Any]()
        friction = self.ribbon.friction_stiffness
        if "friction_stiffness" not in given:
            if "slip_force" in given and stiffness.status == "default":
                raise Misfit(
                    "the ribbon has a 'slip_force' but no stiffness; give its 'friction_stiffness', or the "
                    "'stiffness' of the spring beside it",
                    ("ribbon", "slip_force"),
                )
            why = "a loss factor of 0.3 at 3.4 × the travel of slip"
            friction = scaled(stiffness, FRICTION_SHARE, why, "N/m")
            values["friction_stiffness"] = friction
        if "slip_force" not in given:
            force, low, high = (travel * friction.value for travel in SLIP_TRAVEL)
            why = f"{format_quantity(SLIP_TRAVEL[0], 'length')} of travel, chosen and not measured"
            values["slip_force"] = Known(
                value=force, status="default", range=(low, high), source=why, unit="N"
            )
        return self.completed_with({"ribbon": self.ribbon.completed_with(values)})

    def fill(self, row: Array) -> None:
        """Write the columns of the mount."""
        numbers = row[L.MOUNT : L.MOUNT_END]
        numbers[law.PRESENT], numbers[law.STATES] = self.present, len(self.further_states)
        if self.stop is not None:
            numbers[law.GAP] = float(self.stop.gap)
            numbers[law.STOP : law.STOP_END] = contact_law(
                float(self.stop.stiffness), 1.0, float(self.stop.damping)
            )
        if self.ribbon is not None:
            numbers[law.RIBBON] = float(self.ribbon.friction_stiffness)
            numbers[law.SLIP] = float(self.ribbon.slip_force)
            numbers[law.SHARPNESS] = float(self.ribbon.sharpness)
        for k, branch in enumerate(self.maxwell):
            at = _branch_at(k)
            numbers[at], numbers[at + 1] = float(branch.stiffness), float(branch.time)


def mounted(raw: dict[str, Any]) -> dict[str, Any]:
    """Sort a mount that is a list of elements in parallel: spring and damper are those of the support.

    Spring, ribbon and maxwell may state the ``stiffness`` of the plain spring beside them; one of them does.
    """
    elements = raw.get("mount")
    if elements is None or isinstance(elements, Mapping | Mount):
        return raw
    if not isinstance(elements, list | tuple):
        example = 'mount = [{ kind = "stop", gap = "0.25 mm" }]'
        raise Misfit(f"{elements!r} is no mount; write a list of its elements, {example}", ("mount",))
    mount: dict[str, Any] = {}
    given = raw.get("support", {})
    support = dict(given) if isinstance(given, Mapping) else {}
    for k, element in enumerate(elements):
        kind, rest = _element(element, ("mount", k))
        for key in [key for key in ELEMENTS[kind] if key in rest]:
            if key in support or not isinstance(given, Mapping):
                raise Misfit(
                    f"the support has a {key!r} already, and so does this {kind}; state their sum once",
                    ("mount", k, key),
                )
            support[key] = rest.pop(key)
        if kind in mount:
            raise Misfit(f"the mount has two elements {kind!r}; keep one", ("mount", k))
        mount[kind] = rest
    if unknown := mount.pop("spring", {}):
        raise Misfit(f"a spring has no {next(iter(unknown))!r}", ("mount",))
    if "maxwell" in mount:
        mount["maxwell"] = mount["maxwell"]["branches"]
    return raw | {"mount": mount} | ({"support": support} if support else {})


def _element(element: Any, place: tuple[str | int, ...]) -> tuple[str, dict[str, Any]]:
    """Kind of an element, and the rest of it."""
    kind = element.get("kind") if isinstance(element, Mapping) else None
    if not isinstance(kind, str) or kind not in ELEMENTS:
        shown = repr(element if kind is None else kind)
        raise Misfit(f"{shown} is no element of a mount; its kind is one of {', '.join(ELEMENTS)}", place)
    rest = {key: value for key, value in element.items() if key != "kind"}
    if kind == "maxwell" and not (set(rest) <= {"stiffness", "branches"} and rest.get("branches")):
        raise Misfit(
            "a maxwell element of a mount has branches, and may state the 'stiffness' of the spring; "
            'write branches = [{ stiffness = "4e6 N/m", time = "30 ms" }, ...]',
            place,
        )
    return kind, rest


STATED: tuple[Parameter, ...] = (
    stated_only(
        "mount.stop.gap",
        "travel up to the stop of the mount",
        "length",
        0.2,
        L.MOUNT + law.GAP,
        way_of="support",
        measured_by="a push of the bearing in its housing at {owner} until it stops",
    ),
    stated_only(
        "mount.stop.stiffness", "stiffness of the stop of the mount", "stiffness", 0.7, L.MOUNT + law.STOP
    ),
    stated_only(
        "mount.ribbon.friction_stiffness",
        "stiffness of the ribbon's friction",
        "stiffness",
        0.5,
        L.MOUNT + law.RIBBON,
    ),
    stated_only(
        "mount.ribbon.slip_force", "force at which the ribbon slips", "force", 0.7, L.MOUNT + law.SLIP
    ),
    *(
        row
        for k, at in enumerate(L.MOUNT + _branch_at(k) for k in range(law.MOST_BRANCHES))
        for path, of in ((f"mount.maxwell.{k}", f"of branch {k + 1} of the mount"),)
        for row in (
            stated_only(f"{path}.stiffness", f"stiffness {of}", "stiffness", 0.5, at),
            stated_only(f"{path}.time", f"relaxation time {of}", "time", 0.7, at + 1, shown_as="short_time"),
        )
    ),
)
"""Unknowns of a mount, of a bearing that has it."""
