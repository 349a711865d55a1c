"""Elementary functions from + − × ÷ √ alone, so that a drop has the same bits on every processor.

IEEE 754 prescribes these five operations to the last bit and leaves all else to the library: the C
library's ``pow`` or ``sin`` has one variant with fused multiply-add and one without, which differ in the
last bit. After the first contact that bit grows until two drops differ visibly. Each function here is
within one unit in the last place of the exact value on the range it names (a test compares with 60
digits). Nothing may be contracted or reassociated, which `rotordrop.physics._compile` sees to.

The polynomials have the least largest relative error on their interval; ``tools/minimax.py`` computes
them. They are summed in pairs, not by Horner's rule, because what counts is how long the last term waits.
Where a result must keep more than a double holds, it is carried as an unevaluated sum ``high + low``.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotordrop.physics._compile import inner_kernel, kernel, lean_kernel

Array = NDArray[np.float64]

_EXP = (
    0.5,
    0.1666666666666667,
    0.041666666666666616,
    0.00833333333332611,
    0.0013888888888918187,
    0.0001984126987492317,
    2.480158724539699e-05,
    2.7557255257429236e-06,
    2.7557349764679505e-07,
    2.5105280484407848e-08,
    2.0889388025337233e-09,
)
_ATANH = (
    0.3333333333333333,
    0.20000000000000442,
    0.14285714285399045,
    0.11111111196463369,
    0.09090897756980333,
    0.07693123204870787,
    0.06634298532292894,
    0.06544217817121768,
)
_SIN = (
    -0.16666666666666666,
    0.008333333333333331,
    -0.00019841269841265003,
    2.7557319219294575e-06,
    -2.5052106217872983e-08,
    1.6058529427806369e-10,
    -7.5865738041884e-13,
)
_COS = (
    0.041666666666666664,
    -0.001388888888888738,
    2.4801587298741908e-05,
    -2.755731726020999e-07,
    2.087614400047863e-09,
    -1.138247671587663e-11,
)
_ATAN = (
    -0.3333333333333333,
    0.19999999999999982,
    -0.14285714285704634,
    0.11111111109128637,
    -0.09090908883819364,
    0.07692295241795181,
    -0.06666209496070775,
    0.058719046534877535,
    -0.05117227854764703,
    0.0360180182727522,
)

_NEAREST = 6755399441055744.0
"""1.5 · 2^52: adding and subtracting it rounds to the nearest whole number."""

_LOG2_E = 1.4426950408889634
_LN2 = (0.6931471805592082, 7.371002565167799e-13)
"""ln 2 with its last bits zero, so that it times an exponent is exact, and the rest."""

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
def _exp_parts(x: float, low: float) -> tuple[int, float, float, float]:
    """k, r, t and l with exp(x + low) = 2^k (1 + r + t) (1 + l).

    Source: argument reduction of Cody and Waite, Software Manual for the Elementary Functions (1980), ch. 6.
    """
    count = (x * _LOG2_E + _NEAREST) - _NEAREST
    exact = x - count * _LN2[0]
    rest = count * _LN2[1]
    r = exact - rest
    low += (exact - r) - rest
    r2 = r * r
    r4 = r2 * r2
    p = (_EXP[0] + _EXP[1] * r) + (_EXP[2] + _EXP[3] * r) * r2
    p += ((_EXP[4] + _EXP[5] * r) + (_EXP[6] + _EXP[7] * r) * r2) * r4
    p += ((_EXP[8] + _EXP[9] * r) + _EXP[10] * r2) * (r4 * r4)
    return int(count), r, r2 * p, low


@inner_kernel
def _exp_of_sum(x: float, low: float) -> float:
    if not -708.0 < x < 709.0:
        return _extreme_exp(x, low)
    k, r, t, low = _exp_parts(x, low)
    first = 1.0 + r
    value = first + ((((1.0 - first) + r) + t) + low * (first + t))
    bits = np.float64(value).view(np.int64) + (np.int64(k) << _PLACES)
    return np.int64(bits).view(np.float64)


@lean_kernel
def _extreme_exp(x: float, low: float) -> float:
    if x != x:
        return x
    if x > 709.8:
        return math.inf
    if x < -745.2:
        return 0.0
    k, r, t, low = _exp_parts(x, low)
    return _scaled(1.0 + (r + (t + low)), k)


@lean_kernel
def exp(x: float) -> float:
    """Exponential [1]; inf above 709.78, 0 below −745.2. Source: `_exp_parts`."""
    return _exp_of_sum(x, 0.0)


@inner_kernel
def _log_parts(x: float) -> tuple[float, float]:
    """Natural logarithm of a positive finite number as high + low, to about 2^-58 of it.

    ``log m = 2 atanh s`` with ``s = (m − 1)/(m + 1)`` and m between √½ and √2.
    Source: Tang, ACM Trans. Math. Software 16 (1990) 378, without his table.
    """
    k = 0
    if x < 2.2250738585072014e-308:
        x *= 18014398509481984.0
        k = -54
    bits = np.float64(x).view(np.int64)
    k += int((bits >> _PLACES) - _BIAS)
    m = np.int64((bits & _FRACTION) | _UNIT).view(np.float64)
    if m > 1.4142135623730951:
        m *= 0.5
        k += 1
    f = m - 1.0
    sum_ = m + 1.0
    sum_low = m - (sum_ - 1.0)
    inverse = 1.0 / sum_
    s = f * inverse
    product, product_low = two_product(s, sum_)
    s_low = (((f - product) - product_low) - s * sum_low) * inverse
    z = s * s
    z2 = z * z
    p = (_ATANH[0] + _ATANH[1] * z) + (_ATANH[2] + _ATANH[3] * z) * z2
    p += ((_ATANH[4] + _ATANH[5] * z) + (_ATANH[6] + _ATANH[7] * z) * z2) * (z2 * z2)
    of_k = k * _LN2[0]
    high = of_k + 2.0 * s
    error = 2.0 * s - (high - of_k)
    low = error + (2.0 * (s_low + s * z * p) + k * _LN2[1])
    total = high + low
    return total, (high - total) + low


@lean_kernel
def ln(x: float) -> float:
    """Natural logarithm [1]; −inf of 0, NaN of a negative number. Source: `_log_parts`."""
    if not 0.0 < x < math.inf:
        return x if x > 0.0 or x != x else (-math.inf if x == 0.0 else math.nan)
    return _log_parts(x)[0]


@lean_kernel
def power(x: float, n: float) -> float:
    """Power x^n [1] of a number that is not negative; x √x for n = 3/2, and exact where n is 1 or 2.

    The logarithm keeps 2^-58 of itself, so one unit in the last place holds for n from −16 to 16.
    Source: ``exp(n log x)`` in double-double arithmetic.
    """
    if n == 1.5:
        return x * math.sqrt(x)
    if n == 1.0:
        return x
    if n == 2.0:
        return x * x
    if n == 0.0:
        return 1.0
    if not 0.0 < x < math.inf:
        if x == 0.0 or x == math.inf:
            return 0.0 if (x == 0.0) == (n > 0.0) else math.inf
        return math.nan
    high, low = _log_parts(x)
    y, error = two_product(n, high)
    return _exp_of_sum(y, error + n * low)


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
    k, r, t, low = _exp_parts(2.0 * size, 0.0)
    scale = _power_of_two(k)
    head = r + t
    tail = ((r - head) + t) + low * (1.0 + head)
    e, e_low = two_sum(scale - 1.0, scale * head)
    e_low += scale * tail
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
    p = (_SIN[0] + _SIN[1] * z) + (_SIN[2] + _SIN[3] * z) * z2
    p += ((_SIN[4] + _SIN[5] * z) + _SIN[6] * z2) * z4
    q = (_COS[0] + _COS[1] * z) + (_COS[2] + _COS[3] * z) * z2
    q += (_COS[4] + _COS[5] * z) * z4
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
def sin(x: float) -> float:
    """Sine [1] of an angle up to 1e8 rad. Source: `sine_cosine`."""
    return sine_cosine(x)[0]


@lean_kernel
def cos(x: float) -> float:
    """Cosine [1] of an angle up to 1e8 rad. Source: `sine_cosine`."""
    return sine_cosine(x)[1]


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
    p = (_ATAN[0] + _ATAN[1] * z) + (_ATAN[2] + _ATAN[3] * z) * z2
    p += ((_ATAN[4] + _ATAN[5] * z) + (_ATAN[6] + _ATAN[7] * z) * z2) * z4
    p += (_ATAN[8] + _ATAN[9] * z) * (z4 * z4)
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


def exp_each(x: float | Array) -> Any:
    """Exponential [1] of every entry. Source: `exp`."""
    return _each(_exp_each, x)


def ln_each(x: float | Array) -> Any:
    """Natural logarithm [1] of every entry. Source: `ln`."""
    return _each(_ln_each, x)


def sin_each(x: float | Array) -> Any:
    """Sine [1] of every angle [rad]. Source: `sine_cosine`."""
    return _each(_sin_each, x)


def cos_each(x: float | Array) -> Any:
    """Cosine [1] of every angle [rad]. Source: `sine_cosine`."""
    return _each(_cos_each, x)


def cube_root_each(x: float | Array) -> Any:
    """Cube root [1] of every entry. Source: `cube_root`."""
    return _each(_cube_root_each, x)


def _each(loop: Callable[[Array], Array], x: float | Array) -> Any:
    values = np.asarray(x, dtype=np.float64)
    return loop(values.ravel()).reshape(values.shape)[()]


@kernel
def _exp_each(x: Array) -> Array:
    out = np.empty_like(x)
    for i in range(x.shape[0]):
        out[i] = exp(x[i])
    return out


@kernel
def _ln_each(x: Array) -> Array:
    out = np.empty_like(x)
    for i in range(x.shape[0]):
        out[i] = ln(x[i])
    return out


@kernel
def _sin_each(x: Array) -> Array:
    out = np.empty_like(x)
    for i in range(x.shape[0]):
        out[i] = sine_cosine(x[i])[0]
    return out


@kernel
def _cos_each(x: Array) -> Array:
    out = np.empty_like(x)
    for i in range(x.shape[0]):
        out[i] = sine_cosine(x[i])[1]
    return out


@kernel
def _cube_root_each(x: Array) -> Array:
    out = np.empty_like(x)
    for i in range(x.shape[0]):
        out[i] = cube_root(x[i])
    return out
