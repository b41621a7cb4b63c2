# SPDX-License-Identifier: Apache-2.0
"""One visit of a contact in a sweep: the new impulse on the second body, from the one held and the present velocities.

The normal n points from the first body to the second, the tangent t is (n_y, -n_x). A pressed contact takes an implicit
step of spring and dashpot along n, and of the friction curve along t, at most mu times the normal impulse. A contact
that closes faster than `threshold` and holds no impulse is an impact: it rebounds with e, and the bodies move back to
the moment of touch. An impact may follow another only after WAIT visits; otherwise endless impacts would carry a load.

A contact that holds no impulse may close its gap in the step. One that bears closes it slowly. Without this limit it is
an integral controller, and the friction in crowds feeds waves.

There are no branches, so the loop over pairs is vectorised.
"""

from conveyor_sim.engine.compiler.compile import part
from conveyor_sim.engine.contact.friction import implicit_slip

WAIT = 3.0

NEAR = 1e-4
"""Gap across which a contact that holds an impulse still bears, m."""

CLOSING = 1.5e-5
"""Largest speed at which a contact that bears closes a gap, as a share of that at which it corrects an overlap."""

UNLIMITED = 1e9
"""Speed of contacts that bear nothing, m/s."""


@part
def visit(
    held_x: float,
    held_y: float,
    held_turn: float,
    wait: float,
    nx: float,
    ny: float,
    gap: float,
    separating: float,
    slip: float,
    mass: float,
    mass_inverse: float,
    turn: float,
    turn_inverse: float,
    open_rate: float,
    closed_rate: float,
    open_gain: float,
    closed_gain: float,
    compliance: float,
    rebound: float,
    friction: float,
    apart: float,
    fastest: float,
    threshold: float,
    slip_limit: float,
    h: float,
) -> tuple[float, float, float, float, float, float, float, float, float, float, float, float]:
    """Return changes of the impulse (x, y, turn), the row to store, shifts of position (x, y, in m/kg^-1), act, N h.

    separating, slip: m/s, of the second body relative to the first. act: 0 if the contact does nothing, 1 if pressed,
    2 for an impact.
    """
    normal = held_x * nx + held_y * ny
    normal = normal if normal > 0.0 else 0.0
    tangential = held_x * ny - held_y * nx
    held = abs(held_x) + abs(held_y)
    reached = 1.0 if gap + h * separating <= 0.0 else 0.0
    act = 1.0 if held > 0.0 else reached
    hit = act if held == 0.0 else 0.0
    hit = hit if separating < -threshold else 0.0
    hit = hit if wait == 0.0 else 0.0
    left = -gap - normal * compliance
    bears = normal if gap < NEAR else 0.0
    rate = open_rate if gap > 0.0 else closed_rate
    gain = open_gain if gap > 0.0 else closed_gain
    slowest = CLOSING * fastest if bears > 0.0 else UNLIMITED
    aim = left * rate
    aim = aim if aim < fastest else fastest
    aim = aim if aim > -slowest else -slowest
    impulse = normal + (aim - separating) * gain
    impulse = impulse if impulse > 0.0 else 0.0
    impulse = -rebound * separating if hit > 0.0 else impulse
    first = slip + tangential * mass + held_turn * (turn - mass)
    along = (first - implicit_slip(first, friction * impulse / slip_limit, slip_limit, None)) * turn_inverse
    # Exactly 0 without a normal impulse, so that a contact which has ended holds nothing.
    along = along if impulse > 0.0 else 0.0
    fx = (impulse * nx + along * ny) * act
    fy = (impulse * ny - along * nx) * act
    change_turn = along * act - held_turn
    change_x = fx - held_x
    change_y = fy - held_y
    keep = 1.0 - hit
    later = wait - 1.0
    later = later if later > 0.0 else 0.0
    later = WAIT if hit > 0.0 else later
    push = apart * left
    push = push if left > 0.0 else 0.0
    push = push * act
    ahead = gap if gap > 0.0 else 0.0
    speed = separating if hit > 0.0 else -1.0
    back = hit * ahead / speed
    return (
        change_x,
        change_y,
        change_turn,
        fx * keep,
        fy * keep,
        along * act * keep,
        later,
        push * nx + back * change_x,
        push * ny + back * change_y,
        act + hit,
        impulse * act,
        separating,
    )
