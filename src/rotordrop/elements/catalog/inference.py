"""Balls of a bearing whose maker does not publish them, from its size and, where known, its ratings."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from itertools import accumulate

from rotordrop.elements.catalog.designation import Kind
from rotordrop.errors import UsageError
from rotordrop.known import NINETY

# Mean and standard deviation of the ball diameter over the height of the cross-section, 2 D_w / (D - d), and
# of the share of the pitch circle that balls fill, Z D_w / (π D_pw). Of the spindle bearings whose balls are
# published (GMN) or follow from rigidity and lift-off force (FAG).
_BALL_SHARE = {"18": (0.55, 0.040), "19": (0.587, 0.032), "10": (0.580, 0.033), "02": (0.588, 0.032)}
_FILL = {"18": (0.65, 0.05), "19": (0.750, 0.036), "10": (0.790, 0.050), "02": (0.797, 0.052)}
_SMALL_SHARE, _SMALL_FILL = (0.453, 0.036), (0.718, 0.055)
_SMALLEST_FILL = (20.0, 0.06)
"""Below this bore [mm] makers fill less evenly: standard deviation there."""

_GROOVE_FILLING = (188.0, 7.0)
"""Angle [°] over which the balls of a deep groove stand when it is filled through the offset rings."""

_RATING_SIGMA = (0.05, 0.07)
"""Standard deviation of the logarithm of a maker's ratings, static and dynamic, about the formulas."""

_RIGIDITY_SIGMA = 0.04
"""Standard deviation of the logarithm of a maker's axial rigidity about the formulas [1]."""

USUAL_GROOVE = 0.52
"""Groove radius over ball diameter [1] that the tables of load ratings hold for."""
_CONFORMITY: dict[Kind, tuple[float, float]] = {
    "angular contact": (0.53, 0.011),
    "deep groove": (USUAL_GROOVE, 0.011),
}
"""Mean and standard deviation of the conformity where no maker gives it [1]: 0.53 reproduces the rigidities
that FAG and GMN publish for spindle bearings; deep grooves are ground to 0.52, for which ISO 281 holds (with
0.53 their dynamic ratings come out 4 to 16 % low)."""
_MATERIAL_FACTOR = 1.3
_THIRTY_SECOND, _ONE_INCH = 0.79375, 25.4

# ISO 76:2006 table 1, f_0 of deep-groove and angular-contact bearings, D_w cos α / D_pw = 0, 0.01 … 0.30.
_STATIC = (
    *(14.7, 14.9, 15.1, 15.3, 15.5, 15.7, 15.9, 16.1, 16.3, 16.5, 16.4, 16.1, 15.9, 15.6, 15.4, 15.2),
    *(14.9, 14.7, 14.4, 14.2, 14.0, 13.7, 13.5, 13.2, 13.0, 12.8, 12.5, 12.3, 12.1, 11.8, 11.6),
)
# ISO 281:2007 table 2, f_c of single-row bearings, D_w cos α / D_pw = 0.01 … 0.30.
_DYNAMIC = (
    *(29.1, 35.8, 40.3, 43.8, 46.7, 49.1, 51.1, 52.8, 54.3, 55.5, 56.6, 57.5, 58.2, 58.8, 59.3, 59.6),
    *(59.8, 59.9, 60.0, 59.9, 59.8, 59.6, 59.3, 59.0, 58.6, 58.2, 57.7, 57.1, 56.6, 56.0),
)


@dataclass(frozen=True, kw_only=True)
class PairRigidity:
    """What a catalogue says of the axial rigidity of a pair."""

    value: float
    """Axial rigidity of an X or O pair without load [N/m]."""
    preload: float
    """Preload it is stated for [N]."""
    hybrid: bool | None = None
    """Whether the balls are of silicon nitride; None where the designation says it."""


@dataclass(frozen=True, kw_only=True)
class BallComplement:
    """Balls of one row: published, or reconstructed with what that rests on."""

    ball_count: int
    """Balls per row."""
    ball_diameter: float
    pitch_diameter: float
    """D_w and D_pw [m]."""
    conformity: float
    """Groove radius over ball diameter of both races [1]."""
    basis: str
    """What the numbers rest on."""
    count_range: tuple[int, int] | None = None
    """90 % interval of the balls per row, where they are inferred."""
    diameter_range: tuple[float, float] | None = None
    conformity_range: tuple[float, float] | None = None
    """90 % intervals of D_w [m] and of the conformity [1], where they are inferred."""


def static_rating(
    ball_count: int, ball_diameter: float, pitch_diameter: float, contact_angle: float
) -> float:
    """Static radial load rating [N] of a row of balls [m, rad]. Source: ISO 76:2006, f_0 Z D_w² cos α."""
    factor = _interpolated(_STATIC, 0.0, ball_diameter * math.cos(contact_angle) / pitch_diameter)
    return factor * ball_count * (1e3 * ball_diameter) ** 2 * math.cos(contact_angle)


def dynamic_rating(
    ball_count: int, ball_diameter: float, pitch_diameter: float, contact_angle: float
) -> float:
    """Basic dynamic radial load rating [N] of a row of balls [m, rad].

    Source: ISO 281:2007, b_m f_c (cos α)^0.7 Z^(2/3) D_w^1.8, with 3.647 D_w^1.4 beyond 25.4 mm.
    """
    D_w, cosine = 1e3 * ball_diameter, math.cos(contact_angle)
    factor = _interpolated(_DYNAMIC, 0.01, ball_diameter * cosine / pitch_diameter)
    size = D_w**1.8 if D_w <= _ONE_INCH else 3.647 * D_w**1.4
    return float(_MATERIAL_FACTOR * factor * cosine**0.7 * ball_count ** (2.0 / 3.0) * size)


def pair_rigidity(
    row: tuple[int, float, float, float], conformity: float, preload: float, *, hybrid: bool = False
) -> float:
    """Axial rigidity [N/m] of a pair of rows (count, D_w, D_pw, contact angle) [1, m, m, rad].

    Every ball takes its share of the preload [N] at the angle that the axial approach gives it; the pair has
    twice the tangent stiffness of a row.
    Source: Harris, Rolling Bearing Analysis; contacts by Brewe and Hamrock 1977, within 1 % of Hertz.
    """
    count, D_w, D_pw, alpha = row
    A_0, gamma = (2.0 * conformity - 1.0) * D_w, D_w * math.cos(alpha) / D_pw
    contacts = [_point_stiffness(D_w, D_w / 2 * (1 - side * gamma), conformity, hybrid) for side in (1, -1)]
    K = math.fsum(one ** (-2.0 / 3.0) for one in contacts) ** -1.5
    radial, start = A_0 * math.cos(alpha), A_0 * math.sin(alpha)

    def force(approach: float) -> float:
        distance = math.hypot(radial, start + approach)
        return float(count * K * max(distance - A_0, 0.0) ** 1.5 * (start + approach) / distance)

    low, high = 0.0, A_0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if force(middle) < preload else (low, middle)
    step = 1e-3 * high
    return (force(high + step) - force(high - step)) / step


def _point_stiffness(D_w: float, rolling: float, conformity: float, hybrid: bool) -> float:
    """Stiffness [N/m^1.5] of a ball on its groove, whose radius in the plane of rolling is given [m]."""
    across = conformity * D_w / (2.0 * conformity - 1.0)
    ratio = across / rolling
    # fits of Brewe and Hamrock to the axes of the contact ellipse and to both elliptic integrals
    shape = 1.0339 * ratio**0.636
    first, second = 1.0003 + 0.5968 / ratio, 1.5277 + 0.6023 * math.log(ratio)
    modulus, poisson = (315e9, 0.26) if hybrid else (208e9, 0.3)
    reduced = 2.0 / ((1.0 - 0.3**2) / 208e9 + (1.0 - poisson**2) / modulus)
    radius = across * rolling / (across + rolling)
    return float(math.pi * shape * reduced * math.sqrt(radius * first / (4.5 * second**3)))


def infer_balls(
    *,
    kind: Kind,
    dimension_series: str,
    bore: float,
    outside_diameter: float,
    contact_angle: float = 0.0,
    small_balls: bool = False,
    static_load_rating: float | None = None,
    dynamic_load_rating: float | None = None,
    rigidity: PairRigidity | None = None,
) -> BallComplement:
    """Infer the balls of a row from boundary dimensions [m], load ratings [N] and the rigidity of a pair.

    Every standard ball and every count gets a weight: how usual such a ball is in the cross-section, how
    usual that filling of the pitch circle is, and how well load ratings and rigidity come out. The heaviest
    is the value; the interval holds 90 % of the weight. Deep grooves fill by the angle through which balls
    can be put between offset rings. A rigidity says of the grooves what size and ratings do not.
    """
    pitch, height = 0.5 * (bore + outside_diameter), 0.5 * (outside_diameter - bore)
    share = _SMALL_SHARE if small_balls else _BALL_SHARE[dimension_series]
    fill = _SMALL_FILL if small_balls else _FILL[dimension_series]
    if 1e3 * bore < _SMALLEST_FILL[0]:
        fill = (fill[0], max(fill[1], _SMALLEST_FILL[1]))
    ratings = (static_load_rating, dynamic_load_rating)
    told = rigidity is not None or (kind == "angular contact" and any(one is not None for one in ratings))
    grooves = _conformities(kind, told)
    weights: dict[tuple[float, int, float], float] = {}
    for diameter in _standard_balls(1e3 * height):
        for count in range(5, int(math.pi * pitch / diameter) + 1):
            error = _squared((diameter / height - share[0]) / share[1])
            error += _filling_error(kind, diameter / pitch, count, fill)
            row = (count, diameter, pitch, contact_angle)
            for conformity, unusual in grooves:
                carried = _ratings_error(
                    ratings, row, conformity if kind == "angular contact" else USUAL_GROOVE
                )
                stiff = _rigidity_error(rigidity, row, conformity)
                weights[diameter, count, conformity] = math.exp(-0.5 * (error + unusual + carried + stiff))
    diameter, count, conformity = max(weights, key=lambda key: weights[key])
    if weights[diameter, count, conformity] == 0.0:
        given = ", ".join(f"{one:g} N" for one in ratings if one is not None)
        raise UsageError(
            f"no balls in {1e3 * bore:g} × {1e3 * outside_diameter:g} mm have the load ratings {given}; "
            "expected those of the maker in N. Correct them or leave them out."
        )
    counts = _interval([(float(z), w) for (_, z, _), w in weights.items()])
    diameters = _interval([(d, w) for (d, _, _), w in weights.items()])
    rated = [
        name
        for name, rating in (("static", static_load_rating), ("dynamic", dynamic_load_rating))
        if rating is not None
    ]
    source = f" and its {' and '.join(rated)} load rating (ISO 76, ISO 281)" if rated else ""
    source += " and its axial rigidity" if rigidity else ""
    middle, sigma = _moments([(f, w) for (_, _, f), w in weights.items()]) if told else _CONFORMITY[kind]
    return BallComplement(
        ball_count=count,
        ball_diameter=diameter,
        pitch_diameter=pitch,
        count_range=(int(counts[0]), int(counts[1])),
        diameter_range=diameters,
        conformity=middle,
        conformity_range=(middle - NINETY * sigma, middle + NINETY * sigma),
        basis=(
            f"inferred from the boundary dimensions{source}: {counts[0]:.0f} to {counts[1]:.0f} balls of "
            f"{1e3 * diameters[0]:.4g} to {1e3 * diameters[1]:.4g} mm, 90 %"
        ),
    )


def _conformities(kind: Kind, told: bool) -> list[tuple[float, float]]:
    """Conformities that are tried, and how unusual each is; one where nothing tells them apart."""
    middle, sigma = _CONFORMITY[kind]
    if not told:
        return [(middle, 0.0)]
    return [(middle + 0.5 * k * sigma, _squared(0.5 * k)) for k in range(-5, 6)]


def _ratings_error(
    ratings: tuple[float | None, float | None], row: tuple[int, float, float, float], conformity: float
) -> float:
    """Squared misfit of the load ratings, in standard deviations; wider grooves carry less."""
    error = 0.0
    factors = groove_factors(row, conformity)
    rules = (static_rating, dynamic_rating)
    for rating, rule, factor, sigma in zip(ratings, rules, factors, _RATING_SIGMA, strict=True):
        if rating is not None:
            error += _squared(math.log(rating / (factor * rule(*row))) / sigma)
    return error


def groove_factors(row: tuple[int, float, float, float], conformity: float) -> tuple[float, float]:
    """Static and dynamic rating of a groove over those of the usual one, which the tables of ISO hold for.

    Static: load at a given pressure, by Brewe and Hamrock 1977 proportional to k (E R)². Dynamic: the groove
    term of f_c, ISO 281 and Lundberg and Palmgren 1947.
    """
    _, D_w, D_pw, alpha = row
    rolling = 0.5 * D_w * (1.0 - D_w * math.cos(alpha) / D_pw)

    def carried(f: float) -> float:
        across = f * D_w / (2.0 * f - 1.0)
        ratio = across / rolling
        radius = across * rolling / (across + rolling)
        return float(ratio**0.636 * _squared((1.0003 + 0.5968 / ratio) * radius))

    def lasting(f: float) -> float:
        return float((2.0 * f / (2.0 * f - 1.0)) ** 0.41)

    usual = USUAL_GROOVE
    return carried(conformity) / carried(usual), lasting(conformity) / lasting(usual)


def _rigidity_error(
    rigidity: PairRigidity | None, row: tuple[int, float, float, float], conformity: float
) -> float:
    if rigidity is None:
        return 0.0
    found = pair_rigidity(row, conformity, rigidity.preload, hybrid=bool(rigidity.hybrid))
    return _squared(math.log(rigidity.value / found) / _RIGIDITY_SIGMA)


def _moments(weighted: list[tuple[float, float]]) -> tuple[float, float]:
    """Mean and standard deviation."""
    total = sum(weight for _, weight in weighted)
    mean = sum(value * weight for value, weight in weighted) / total
    return mean, math.sqrt(sum(_squared(value - mean) * weight for value, weight in weighted) / total)


def _filling_error(kind: Kind, ratio: float, count: int, fill: tuple[float, float]) -> float:
    if kind == "angular contact":
        return _squared((count * ratio / math.pi - fill[0]) / fill[1])
    angle = math.degrees(2.0 * (count - 1) * math.asin(ratio))
    return _squared((angle - _GROOVE_FILLING[0]) / _GROOVE_FILLING[1])


def _standard_balls(height: float) -> list[float]:
    """Ball diameters [m] that fit a cross-section [mm]: steps of 1/64 inch to 4 mm, 1/32 to 1 inch, 1/16."""
    sixty_fourths = range(1, int(2.0 * height / _THIRTY_SECOND) + 1)
    made = [k for k in sixty_fourths if k <= 10 or (k <= 64 and k % 2 == 0) or k % 4 == 0]
    sizes = [0.5 * _THIRTY_SECOND * k for k in made]
    return [1e-3 * size for size in sizes if 0.3 * height < size < 0.75 * height] or [0.55e-3 * height]


def _interval(weighted: list[tuple[float, float]]) -> tuple[float, float]:
    """Values between which 90 % of the weight lies, ends included."""
    ordered = sorted(weighted)
    sums = list(accumulate(weight for _, weight in ordered))
    at = [min(bisect_left(sums, share * sums[-1]), len(sums) - 1) for share in (0.05, 0.95)]
    return ordered[at[0]][0], ordered[at[1]][0]


def _interpolated(table: tuple[float, ...], start: float, ratio: float) -> float:
    place = min(max(100.0 * (ratio - start), 0.0), len(table) - 1.0)
    low = min(int(place), len(table) - 2)
    return table[low] + (place - low) * (table[low + 1] - table[low])


def _squared(number: float) -> float:
    return number * number
