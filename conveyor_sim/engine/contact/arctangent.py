# SPDX-License-Identifier: Apache-2.0
"""Arctangent without branches: LLVM vectorises it, unlike the C library's."""

import math

from conveyor_sim.engine.compiler.compile import part

_TAN_PI_8 = math.sqrt(2.0) - 1.0
_TAN_3_PI_8 = math.sqrt(2.0) + 1.0

# Q of atan(y) = y + y^3 Q(y^2), |y| <= tan(pi/8): interpolated in 60 digits at 11 Chebyshev nodes in y^2. Its relative
# error of 5e-18 is far below the rounding.
_Q0, _Q1, _Q2, _Q3 = -0.3333333333333333, 0.1999999999999552, -0.14285714284666542, 0.11111111015256361
_Q4, _Q5, _Q6, _Q7 = -0.09090904578123903, 0.07692183190826087, -0.06664511447381948, 0.0585814891280221
_Q8, _Q9, _Q10 = -0.0508544973794026, 0.03923165829558719, -0.019176887119062257


@part
def arctangent(x: float) -> float:
    """Return atan(x) in rad for x >= 0, to two units in the last place."""
    steep = x > _TAN_3_PI_8
    middle = x > _TAN_PI_8
    # atan x = pi/4 + atan((x - 1)/(x + 1)) = pi/2 - atan(1/x)
    upper = -1.0 if steep else (x - 1.0 if middle else x)
    lower = x if steep else (x + 1.0 if middle else 1.0)
    offset = 0.5 * math.pi if steep else (0.25 * math.pi if middle else 0.0)
    y = upper / lower
    z = y * y
    series = _Q10
    series = series * z + _Q9
    series = series * z + _Q8
    series = series * z + _Q7
    series = series * z + _Q6
    series = series * z + _Q5
    series = series * z + _Q4
    series = series * z + _Q3
    series = series * z + _Q2
    series = series * z + _Q1
    series = series * z + _Q0
    return offset + (y + y * z * series)
