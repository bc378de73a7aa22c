"""exp, exp2, log, log2, tanh, sin and cos from sums, products and one division: the same bits alone, in plain Python and in vectors.

The functions of the mathematical library have no vectors of the same bits, and others on each system. Laws write ``math.exp``; the engine
takes these in its place. ``sin``, ``cos`` and ``power`` are called by name, by laws of which many run side by side. The argument is reduced
first, for exp to |r| <= ln 2 / 2, for log to a mantissa between sqrt(1/2) and sqrt(2), for sin and cos to |r| <= pi / 4:

    exp(x) = 2^n (1 + r + r^2 q(r)),  n = round(x / ln 2),  r = x - n ln 2
    log(x) = e ln 2 + f - (f^2/2 - s (f^2/2 + s^2 p(s^2))),  x = 2^e (1 + f),  s = f / (2 + f)
    tanh(x) = x + x^3 t(x^2) below 0.55, else 1 - 2 / (exp(2 x) + 1)
    sin(r) = r + r^3 s(r^2),  cos(r) = 1 - r^2/2 + r^4 c(r^2),  r = x - n pi / 2,  n = round(2 x / pi)

q, p, t, s and c are polynomials through the Chebyshev points of their intervals, computed with 50 digits. The results lie within 2 units in
the last place; beyond the range of doubles they are 0 or infinite, a logarithm of a negative number is NaN. Source: J.-M. Muller,
Elementary Functions (3rd ed.), chapters 3 and 11. Left out: numbers below 2.3e-308, which count as zero, and angles beyond 1.6 million, of
which each factor of two costs a place.
"""

from __future__ import annotations

import math

TO_WHOLE = 6755399441055744.0
"""1.5 * 2^52: a sum with it has no places behind the point."""
LOG2_E = 1.4426950408889634
LN2, LN2_HIGH, LN2_LOW = 0.6931471805599453, 0.6931471806019545, -4.2009150726810846e-11
"""ln 2, and as a sum whose first term has 32 bits: its products with the exponents of doubles are exact."""
QUARTERS = 0.6366197723675814
QUARTER_HIGH, QUARTER_MIDDLE, QUARTER_LOW = 1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21
"""2 / pi, and pi / 2 as a sum whose first two terms have 33 bits: their products with a million are exact."""
SMALLEST, ROOT_HALF = 2.2250738585072014e-308, 0.7071067811865476
EXP_OVERFLOWS, EXP_VANISHES = 709.782712893384, -708.0
EXP2_OVERFLOWS, EXP2_VANISHES = 1024.0, -1021.0
"""Exponents from which a power is infinite, the logarithm of the largest double, and below which it counts as zero."""
TANH_FROM_EXP = 0.55
"""Size from which tanh is taken from exp: nearer to zero 1 - 2 / (exp(2 x) + 1) loses digits."""


def two(power: float) -> float:
    """Return 2^power for a whole power from -1022 to 1023; NaN for NaN. One instruction or two in machine code."""
    return math.ldexp(1.0, int(power)) if power == power else power


def parts(number: float) -> tuple[float, float]:
    """Return m and e of number = m 2^e with m from 1/2 to 1. A few instructions on bits in machine code."""
    return math.frexp(number)


def exp(x: float) -> float:
    """Return e^x."""
    if x > EXP_OVERFLOWS:
        return math.inf
    if x < EXP_VANISHES:
        return 0.0
    whole = (x * LOG2_E + TO_WHOLE) - TO_WHOLE
    return raised((x - whole * LN2_HIGH) - whole * LN2_LOW, whole)


def exp2(x: float) -> float:
    """Return 2^x."""
    if x >= EXP2_OVERFLOWS:
        return math.inf
    if x < EXP2_VANISHES:
        return 0.0
    whole = (x + TO_WHOLE) - TO_WHOLE
    return raised((x - whole) * LN2, whole)


def raised(r: float, whole: float) -> float:
    """Return 2^whole e^r, |r| <= 0.35; the sum is written for few steps one after the other."""
    r2 = r * r
    r4 = r2 * r2
    low = (0.5000000000000001 + 0.16666666666666669 * r) + r2 * (0.04166666666662348 + 0.008333333333330011 * r)
    middle = (0.0013888888917538296 + 0.00019841269863303223 * r) + r2 * (2.4801520792572694e-05 + 2.75572680728901e-06 * r)
    high = 2.762032742826824e-07 + 2.5100569275813683e-08 * r
    return two(whole - 1.0) * (2.0 * (1.0 + (r + r2 * (low + r4 * (middle + r4 * high)))))


def log(x: float) -> float:
    """Return the natural logarithm."""
    if not x >= SMALLEST:
        return -math.inf if x >= 0.0 else math.nan
    if x == math.inf:
        return x
    m, e = parts(x)
    if m < ROOT_HALF:
        m = m + m
        e = e - 1.0
    f = m - 1.0
    half = 0.5 * f * f
    return e * LN2_HIGH + (f - (half - (bent(f, half) + e * LN2_LOW)))


def log2(x: float) -> float:
    """Return the logarithm to the base 2."""
    if not x >= SMALLEST:
        return -math.inf if x >= 0.0 else math.nan
    if x == math.inf:
        return x
    m, e = parts(x)
    if m < ROOT_HALF:
        m = m + m
        e = e - 1.0
    f = m - 1.0
    half = 0.5 * f * f
    return e + (f - (half - bent(f, half))) * LOG2_E


def bent(f: float, half: float) -> float:
    """Return log(1 + f) - f + f^2/2 for f from -0.3 to 0.42; ``half`` is f^2/2."""
    s = f / (2.0 + f)
    z = s * s
    z2 = z * z
    low = (0.6666666666666666 + 0.4000000000000089 * z) + z2 * (0.28571428570795937 + 0.22222222393451754 * z)
    high = (0.18181795454619543 + 0.15386249783145445 * z) + z2 * (0.13268503447787144 + 0.1308944373631696 * z)
    return s * (half + z * (low + z2 * z2 * high))


def tanh(x: float) -> float:
    """Return the hyperbolic tangent."""
    size = abs(x)
    if size >= TANH_FROM_EXP:
        return math.copysign(1.0 - 2.0 / (exp(2.0 * size) + 1.0), x)
    z = x * x
    z2 = z * z
    z4 = z2 * z2
    low = (-0.3333333333333333 + 0.13333333333332703 * z) + z2 * (-0.053968253967420166 + 0.021869488493035 * z)
    middle = (-0.008863234383252563 + 0.003592110186863712 * z) + z2 * (-0.0014556602980704406 + 0.000588928506703218 * z)
    high = (-0.00023461235716657866 + 8.507647930447597e-05 * z) + z2 * -2.057731760812866e-05
    return x + x * z * (low + z4 * (middle + z4 * high))


def power(base: float, exponent: float) -> float:
    """Return a base that is not negative to an exponent above zero, within as many units in the last place as the exponent of e has."""
    return exp(exponent * log(base))


def sin(x: float) -> float:
    """Return the sine of an angle [rad]."""
    return turned(x, 0.0)


def cos(x: float) -> float:
    """Return the cosine of an angle [rad]."""
    return turned(x, 1.0)


def turned(x: float, ahead: float) -> float:
    """Return the sine of an angle [rad] so many quarters of a turn ``ahead``."""
    whole = (x * QUARTERS + TO_WHOLE) - TO_WHOLE
    r = ((x - whole * QUARTER_HIGH) - whole * QUARTER_MIDDLE) - whole * QUARTER_LOW
    if abs(r) > 1.0:  # of an angle so large that its digits do not hold a turn
        r = 0.0
    z = r * r
    z2 = z * z
    low = (-0.16666666666666666 + 0.008333333333330946 * z) + z2 * (-0.0001984126983675497 + 2.755731610068303e-06 * z)
    sine = r + r * z * (low + z2 * z2 * (-2.5051131455427946e-08 + 1.591810123027412e-10 * z))
    low = (0.041666666666666664 - 0.0013888888888887395 * z) + z2 * (2.4801587298763433e-05 - 2.7557317270560326e-07 * z)
    cosine = 1.0 - (0.5 * z - z2 * (low + z2 * z2 * (2.0876146024689747e-09 - 1.1382614868556325e-11 * z)))
    quarter = whole + ahead
    quarter = quarter - 4.0 * ((0.25 * quarter + TO_WHOLE) - TO_WHOLE)
    value = cosine if abs(quarter) == 1.0 else sine
    return -value if quarter < 0.0 or quarter > 1.0 else value


def within(value: float, low: float, high: float) -> float:
    """Return a value kept between two bounds."""
    if value > high:
        return high
    if value < low:
        return low
    return value


def hermite(share: float, span: float, first: float, first_rate: float, last: float, last_rate: float) -> float:
    """Return the value at a share of a span [s] on the cubic with the values and rates [1/s] at its ends."""
    rest = 1.0 - share
    return (
        (1.0 + 2.0 * share) * rest * rest * first
        + share * rest * rest * span * first_rate
        + share * share * (3.0 - 2.0 * share) * last
        - share * share * rest * span * last_rate
    )
