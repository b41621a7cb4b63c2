"""Two machines that fail, and the conveyor between them: what theory says of such a line.

The model of continuous flow (Zimmern 1956; Wijngaard 1979; Gershwin and Schick 1980; reviewed by Dallery and Gershwin
1992): bottles are a fluid, both machines work at the same rate when they are up, the first one is never starved, the
last one never blocked. Times between failures and to repair are exponential. A machine fails only while it works
(operation-dependent failures).
"""

from __future__ import annotations

import math
from typing import NamedTuple


class Machine(NamedTuple):
    """How often it fails, and how long repairs take."""

    between_failures: float
    """s of running time, mean."""
    to_repair: float
    """s, mean."""

    @property
    def alone(self) -> float:
        """Efficiency of the machine by itself."""
        return self.between_failures / (self.between_failures + self.to_repair)


def efficiency(first: Machine, second: Machine, rate: float, buffer: float) -> float:
    """Throughput over `rate` (1/s, of both machines) with room for `buffer` bottles between them.

    Derived from the balance of flows in the steady state. l1, l2 are the rates of failure, r1, r2 of repair, l and r
    their sums, u the rate of bottles. While both work or none does, the level x stands. So nothing but "first up,
    second down" moves it up, and "first down, second up" down, and both have the same density g(x). The balances of
    "both up" and "both down" give those densities, g r/l and g l/r. The balance of "first up, second down",

        u g' = (-(r2 + l1) + l2 r/l + r1 l/r) g = (l2 r1 - l1 r2) (1/l + 1/r) g,

    has an exponential for its solution. At x = 0 the second machine starves while the first one is down, and can't
    fail: the balances there are l2 p(both up) = u g(0) and r1 p(starved) = l p(both up). At the full buffer it is the
    other way round.
    """
    l1, l2 = 1.0 / first.between_failures, 1.0 / second.between_failures
    r1, r2 = 1.0 / first.to_repair, 1.0 / second.to_repair
    fails, repairs = l1 + l2, r1 + r2
    growth = (l2 * r1 - l1 * r2) * (1.0 / fails + 1.0 / repairs) / rate
    full = math.exp(growth * buffer)
    inside = math.expm1(growth * buffer) / growth if growth else buffer
    empty_up, full_up = rate / l2, rate * full / l1
    starved, blocked = empty_up * fails / r1, full_up * fails / r2
    second_works = inside * (1.0 + repairs / fails) + empty_up + full_up
    return second_works / (inside * (2.0 + repairs / fails + fails / repairs) + empty_up + full_up + starved + blocked)


def conveyor_efficiency(first: Machine, second: Machine, rate: float, holds: float, transport: float) -> float:
    """The same where the buffer is a conveyor that holds so many bottles, and takes `transport` s from end to end.

    rate x transport bottles are on their way whenever the line flows. They buffer nothing: the room that counts is what
    is left. (Seen in a clock of the first machine that is late by `transport`, bottles arrive as they leave, and it is
    blocked by what the second one took `transport` earlier. In that time the second one takes rate x transport bottles
    at most, so the value is a lower bound; it is short of the truth only by what happens where both machines fail
    within one such time.)
    """
    return efficiency(first, second, rate, holds - rate * transport)
