"""Elementary functions from + − × ÷ √ alone, so that a drop has the same bits on every processor.

IEEE 754 prescribes these five operations to the last bit and leaves all else to the library: the C
library's ``pow`` or ``sin`` has one variant with fused multiply-add and one without, which differ in the
last bit. After the first contact that bit grows until two drops differ visibly. Each function here is
within one unit in the last place of the exact value on the range it names (a test compares with 60
digits). Nothing may be contracted or reassociated, which `rotordrop.physics._compile` sees to.

The polynomials of `elementary_tables` are summed in pairs, not by Horner's rule, because what counts is how
long the last term waits. Exponential and power start from a table: a polynomial for a 128th is short.
Where a result must keep more than a double holds, it is carried as an unevaluated sum ``high + low``.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from rotordrop.arrays import Array
from rotordrop.physics._compile import inner_kernel, kernel, lean_kernel
from rotordrop.physics.elementary_tables import ATAN, ATANH, COS, EXP, LOG2, LOGARITHMS, POWERS, SIN

_NEAREST = 6755399441055744.0
"""1.5 · 2^52: adding and subtracting it rounds to the nearest whole number."""

_LN2 = (0.6931471805592082, 7.371002565167799e-13)
"""ln 2 with its last bits zero, so that it times an exponent is exact, and the rest."""

_STEPS_OF_TWO = 128.0
_STEPS = 184.6649652337873
"""128 / ln 2: steps of the table of powers in a unit of a natural exponent."""
_STEP = (0.005415212347998022, 1.2655086083325438e-13)
"""ln 2 / 128 in 34 bits, which times a count of steps up to 2^18 are exact, and the rest."""
_LN2_FULL = 0.6931471805599453

_TWO_OVER_PI = 0.6366197723675814
_HALF_PI = (1.570796325802803, 9.920935739593517e-10, 5.721188709663575e-18, 1.6446256936324258e-26)
"""π/2 in parts of 27 bits, which times a count below 2^26 are exact, and the rest."""

_HALF_PI_SHORT = (1.5707963267341256, 6.077100506506192e-11)
"""π/2 in 33 bits, which times a count below 2^20 are exact, and the rest."""

_PI_HIGH, _PI_LOW = 3.141592653589793, 1.2246467991473532e-16
_ATAN_HALF = (0.4636476090008061, 2.2698777452961687e-17)
"""atan ½, high and low part."""

_FRACTION = np.int64(0xFFFFFFFFFFFFF)
_UNIT = np.int64(0x3FF0000000000000)
_BIAS = np.int64(1023)
_PLACES = np.int64(52)
_THIRD = np.int64(0x2A9F84FE36D22425)
_LEADING = np.int64(-0x8000000)
_IN_TABLE = np.int64(127)
_OF_TABLE = np.int64(7)
_BELOW_TABLE = np.int64(45)

EXP_OF, LN_OF, SIN_OF, COS_OF, CUBE_ROOT_OF = range(5)
"""Functions of all entries of an array."""


@inner_kernel
def two_sum(a: float, b: float) -> tuple[float, float]:
    """Sum and its rounding error [any unit], exactly. Source: Knuth, Seminumerical Algorithms, 4.2.2."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@inner_kernel
def two_product(a: float, b: float) -> tuple[float, float]:
    """Product below 1e299 and its rounding error [any unit], exactly.

    Source: Dekker, Numer. Math. 18 (1971) 224.
    """
    product = a * b
    t = 134217729.0 * a
    a_high = t - (t - a)
    a_low = a - a_high
    t = 134217729.0 * b
    b_high = t - (t - b)
    b_low = b - b_high
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, error


@inner_kernel
def _power_of_two(k: int) -> float:
    """2^k for −1022 ≤ k ≤ 1023, written as a bit pattern."""
    return np.int64((np.int64(k) + _BIAS) << _PLACES).view(np.float64)


@inner_kernel
def _scaled(value: float, k: int) -> float:
    """Value · 2^k for |k| ≤ 2044, in two steps so that neither factor leaves the range."""
    half = k >> 1
    return value * _power_of_two(half) * _power_of_two(k - half)


@inner_kernel
def _grown(r: float) -> float:
    """The exponential less 1 + r, for |r| ≤ ln 2 / 256."""
    r2 = r * r
    return r2 * ((EXP[0] + EXP[1] * r) + (EXP[2] + EXP[3] * r) * r2)


@inner_kernel
def _exponential(count: float, r: float) -> float:
    """2^(count/128) exp(r) [1] for a whole count and |r| ≤ ln 2 / 256.

    Source: Tang, ACM Trans. Math. Software 15 (1989) 144.
    """
    if not abs(count) < 130000.0:
        return _extreme_exponential(count, r)
    j = np.int64(count)
    entry = POWERS[j & _IN_TABLE]
    value = entry[0] + (entry[1] + entry[0] * (r + _grown(r)))
    bits = np.float64(value).view(np.int64) + ((j >> _OF_TABLE) << _PLACES)
    return np.int64(bits).view(np.float64)


@lean_kernel
def _extreme_exponential(count: float, r: float) -> float:
    if count != count:
        return count
    if abs(count) > 140000.0:
        return math.inf if count > 0.0 else 0.0
    j = np.int64(count)
    entry = POWERS[j & _IN_TABLE]
    return _scaled(entry[0] + (entry[1] + entry[0] * (r + _grown(r))), int(j >> _OF_TABLE))


@inner_kernel
def _steps_and_rest(x: float) -> tuple[float, float, float]:
    """Nearest whole number of steps ln 2 / 128 in x, and what is left [1] as high + low.

    Source: argument reduction of Cody and Waite, Software Manual for the Elementary Functions (1980), ch. 6.
    """
    count = (x * _STEPS + _NEAREST) - _NEAREST
    exact = x - count * _STEP[0]
    rest = count * _STEP[1]
    r = exact - rest
    return count, r, (exact - r) - rest


@lean_kernel
def exp(x: float) -> float:
    """Exponential [1]; inf above 709.78, 0 below −745.2. Source: `_exponential`."""
    count, r, _ = _steps_and_rest(x)
    return _exponential(count, r)


@lean_kernel
def ln(x: float) -> float:
    """Natural logarithm [1]; −inf of 0, NaN of a negative number.

    ``log m = 2 artanh s`` with ``s = (m − 1)/(m + 1)`` and m between √½ and √2, of which m − 1 is exact.
    Source: fdlibm, e_log.c.
    """
    k = 0
    if not 2.2250738585072014e-308 <= x < math.inf:
        if not 0.0 < x < math.inf:
            return x if x > 0.0 or x != x else (-math.inf if x == 0.0 else math.nan)
        x *= 18014398509481984.0
        k = -54
    bits = np.float64(x).view(np.int64)
    k += int((bits >> _PLACES) - _BIAS)
    m = np.int64((bits & _FRACTION) | _UNIT).view(np.float64)
    if m > 1.4142135623730951:
        m *= 0.5
        k += 1
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    z2 = z * z
    p = (ATANH[0] + ATANH[1] * z) + (ATANH[2] + ATANH[3] * z) * z2
    p += ((ATANH[4] + ATANH[5] * z) + (ATANH[6] + ATANH[7] * z) * z2) * (z2 * z2)
    half = 0.5 * f * f
    return k * _LN2[0] + (f - (half - (s * (half + 2.0 * z * p) + k * _LN2[1])))


@inner_kernel
def _ordinary_power(x: float, n: float) -> float:
    """Power x^n [1] of a normal number.

    What counts for ``exp(n log x)`` is the absolute error of the logarithm, 2^-59 at most. Its leading part
    has so few bits that 26 bits of n times it are exact; taking whole steps from that product is exact too.
    Source: Tang, ACM Trans. Math. Software 16 (1990) 378 and 15 (1989) 144.
    """
    bits = np.float64(x).view(np.int64)
    k = (bits >> _PLACES) - _BIAS
    entry = LOGARITHMS[(bits >> _BELOW_TABLE) & _IN_TABLE]
    s = (np.int64((bits & _FRACTION) | _UNIT).view(np.float64) - entry[0]) * entry[1]
    s2 = s * s
    p = (LOG2[0] + LOG2[1] * s) + ((LOG2[2] + LOG2[3] * s) + LOG2[4] * s2) * s2
    leading = k + entry[2]
    t = 134217729.0 * n
    n_high = t - (t - n)
    first = n_high * leading
    # The nearest step need not wait for the small terms; r may then pass half a step by a twentieth.
    count = ((first + n * s) * _STEPS_OF_TWO + _NEAREST) - _NEAREST
    rest = s + (entry[3] + s2 * p)
    r = ((first - count / _STEPS_OF_TWO) + ((n - n_high) * leading + n * rest)) * _LN2_FULL
    return _exponential(count, r)


@lean_kernel
def _special_power(x: float, n: float) -> float:
    if n == 0.0:
        return 1.0
    if n == 1.0:
        return x
    if n == 2.0:
        return x * x
    if x == 0.0 or x == math.inf:
        return 0.0 if (x == 0.0) == (n > 0.0) else math.inf
    if not x > 0.0:
        return math.nan
    # below the smallest normal number
    return _ordinary_power(x * 18014398509481984.0, n) * _ordinary_power(18014398509481984.0, -n)


@lean_kernel
def power(x: float, n: float) -> float:
    """Power x^n [1] of a number that is not negative; x √x for n = 3/2, and exact where n is 1 or 2.

    One unit in the last place holds for n from −16 to 16. Source: `_ordinary_power`.
    """
    if n == 1.5:
        return x * math.sqrt(x)
    if not 2.2250738585072014e-308 <= x < math.inf or n == 1.0 or n == 2.0 or n == 0.0:
        return _special_power(x, n)
    return _ordinary_power(x, n)


@lean_kernel
def cube_root(x: float) -> float:
    """Cube root [1] of any number.

    A third of the exponent starts two steps of Halley's; the third one divides by a square that is exact.
    Source: W. Kahan's arrangement of the cube root.
    """
    size = abs(x)
    if not 2.2250738585072014e-308 <= size < math.inf:
        return x if size != size or size == math.inf else power(size, 1.0 / 3.0) * math.copysign(1.0, x)
    t = np.int64(np.float64(size).view(np.int64) // np.int64(3) + _THIRD).view(np.float64)
    for _ in range(2):
        cube = t * t * t
        t = t * ((cube + 2.0 * size) / (2.0 * cube + size))
    t = np.int64(np.float64(t).view(np.int64) & _LEADING).view(np.float64)
    r = size / (t * t)
    root = t + t * ((r - t) / (2.0 * t + r))
    return root if x > 0.0 else -root


@lean_kernel
def tanh(x: float) -> float:
    """Hyperbolic tangent [1]: E/(E + 2) with E = exp(2|x|) − 1, both as high + low. Source: definition."""
    size = abs(x)
    if size < 1e-9:
        return x
    if size > 22.0:
        return 1.0 if x > 0.0 else -1.0
    if size != size:
        return x
    count, r, low = _steps_and_rest(2.0 * size)
    j = np.int64(count)
    entry = POWERS[j & _IN_TABLE]
    scale = _power_of_two(int(j >> _OF_TABLE))
    # one less than the power is exact while it is below 2^53, and small where the rest is large beside it
    above = scale * entry[0] - 1.0
    t = _grown(r)
    head = r + t
    e, e_low = two_sum(above, head)
    e, e_low = two_sum(e, e_low + (((r - head) + t + low) + (above * head + scale * entry[1] * (1.0 + head))))
    d, d_low = two_sum(e, 2.0)
    inverse = 1.0 / d
    quotient = e * inverse
    product, product_low = two_product(quotient, d)
    rest = ((e - product) - product_low) + (e_low - quotient * (d_low + e_low))
    value = quotient + rest * inverse
    return value if x > 0.0 else -value


@lean_kernel
def _reduced_angle(x: float, count: float) -> tuple[float, float]:
    """X − count π/2 as high + low, whatever cancels, for a count below 2^26."""
    first, error = two_sum(x - count * _HALF_PI[0], -count * _HALF_PI[1])
    second, error_2 = two_sum(first, -count * _HALF_PI[2])
    rest = count * _HALF_PI[3]
    r = second - rest
    return r, ((second - r) - rest) + (error + error_2)


@lean_kernel
def sine_cosine(x: float) -> tuple[float, float]:
    """Sine and cosine [1] of an angle up to 1e8 rad; beyond, its own last bit is more than 1e-8 rad.

    Source: Cody and Waite, ch. 8; polynomials on ±π/4.
    """
    count = (x * _TWO_OVER_PI + _NEAREST) - _NEAREST
    exact = x - count * _HALF_PI_SHORT[0]
    rest = count * _HALF_PI_SHORT[1]
    r = exact - rest
    low = (exact - r) - rest
    # two parts of pi/2 do while the count leaves the first product exact and little cancels
    if not (abs(r) >= 1e-3 and abs(count) <= 1e6):
        if not abs(x) < math.inf:
            return math.nan, math.nan
        r, low = _reduced_angle(x, count)
    z = r * r
    z2 = z * z
    z4 = z2 * z2
    p = (SIN[0] + SIN[1] * z) + (SIN[2] + SIN[3] * z) * z2
    p += ((SIN[4] + SIN[5] * z) + SIN[6] * z2) * z4
    q = (COS[0] + COS[1] * z) + (COS[2] + COS[3] * z) * z2
    q += (COS[4] + COS[5] * z) * z4
    half = 0.5 * z
    s = r + (r * z * p + low * (1.0 - half))
    head = 1.0 - half
    c = head + (((1.0 - head) - half) + (z2 * q - r * low))
    quadrant = int(count) & 3
    if quadrant == 0:
        return s, c
    if quadrant == 1:
        return c, -s
    if quadrant == 2:
        return -s, -c
    return -c, s


@lean_kernel
def atan2(y: float, x: float) -> float:
    """Angle of the point (x, y) from +x towards +y [rad], between −π and π; 0 of the origin.

    The angle is taken from one of the directions 0, atan ½ and π/4 of the first octant, whose distance is a
    quotient of two sums that are known exactly. Source: own arrangement of Cody and Waite, ch. 11.
    """
    along, across = abs(x), abs(y)
    if along == 0.0 and across == 0.0:
        return 0.0
    steep = across > along
    if steep:
        along, across = across, along
    base = base_low = 0.0
    share = 0.0
    if across > 0.75 * along:
        share, base, base_low = 1.0, 0.25 * _PI_HIGH, 0.25 * _PI_LOW
    elif across > 0.25 * along:
        share, base, base_low = 0.5, _ATAN_HALF[0], _ATAN_HALF[1]
    above, above_low = two_sum(across, -share * along)
    below, below_low = two_sum(along, share * across)
    inverse = 1.0 / below
    t = above * inverse
    product, product_low = two_product(t, below)
    t_low = (((above - product) - product_low) + above_low - t * below_low) * inverse
    z = t * t
    z2 = z * z
    z4 = z2 * z2
    p = (ATAN[0] + ATAN[1] * z) + (ATAN[2] + ATAN[3] * z) * z2
    p += ((ATAN[4] + ATAN[5] * z) + (ATAN[6] + ATAN[7] * z) * z2) * z4
    p += (ATAN[8] + ATAN[9] * z) * (z4 * z4)
    angle, low = two_sum(base, t)
    low += base_low + (t_low * (1.0 - z) + t * z * p)
    if steep:
        angle, error = two_sum(0.5 * _PI_HIGH, -angle)
        low = error + (0.5 * _PI_LOW - low)
    if x < 0.0:
        angle, error = two_sum(_PI_HIGH, -angle)
        low = error + (_PI_LOW - low)
    return angle + low if y >= 0.0 else -(angle + low)


@lean_kernel
def atan(x: float) -> float:
    """Angle [rad] whose tangent is x. Source: `atan2`."""
    return atan2(x, 1.0)


@lean_kernel
def asin(x: float) -> float:
    """Angle [rad] between −π/2 and π/2 whose sine is x. Source: `atan2`."""
    return atan2(x, math.sqrt((1.0 - x) * (1.0 + x)))


@lean_kernel
def acos(x: float) -> float:
    """Angle [rad] between 0 and π whose cosine is x. Source: `atan2`."""
    return atan2(math.sqrt((1.0 - x) * (1.0 + x)), x)


def magnitude(x: Array, y: Array) -> Array:
    """Length of vectors from their components, in their unit such as [N]. Source: Pythagoras."""
    return np.asarray(np.sqrt(x * x + y * y))


def _each(function: int, x: float | Array) -> Any:
    values = np.asarray(x, dtype=np.float64)
    return _values_of(function, values.ravel()).reshape(values.shape)[()]


exp_each = partial(_each, EXP_OF)
"""Exponential [1] of every entry. Source: `exp`."""
ln_each = partial(_each, LN_OF)
"""Natural logarithm [1] of every entry. Source: `ln`."""
sin_each = partial(_each, SIN_OF)
"""Sine [1] of every angle [rad]. Source: `sine_cosine`."""
cos_each = partial(_each, COS_OF)
"""Cosine [1] of every angle [rad]. Source: `sine_cosine`."""
cube_root_each = partial(_each, CUBE_ROOT_OF)
"""Cube root [1] of every entry. Source: `cube_root`."""


@kernel
def _values_of(function: int, x: Array) -> Array:
    """Values of one of the functions ``*_OF``: one kernel, for most programs need them all."""
    out = np.empty_like(x)
    for i in range(x.shape[0]):
        if function == EXP_OF:
            out[i] = exp(x[i])
        elif function == LN_OF:
            out[i] = ln(x[i])
        elif function == CUBE_ROOT_OF:
            out[i] = cube_root(x[i])
        else:
            sine, cosine = sine_cosine(x[i])
            out[i] = sine if function == SIN_OF else cosine
    return out
