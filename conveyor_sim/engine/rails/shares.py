# SPDX-License-Identifier: Apache-2.0
"""Shared push of the pieces of one rail surface that touch a bottle together.

Two pieces with normals at an angle of cosine c would push twice near a shallow joint, with up to double the force. The
surface as a whole pushes with k times the shortest displacement d that clears all its overlaps, n_a . d >= delta_a.
That is d = sum lambda_a n_a with G lambda = delta, lambda >= 0 and G the cosines between normals. Collinear pieces then
push as one, pieces at a right angle as two walls, and the force is continuous in between. Obtuse pairs (c < 0, a wedge)
push separately, because clearing both would need an unbounded force.
"""

from conveyor_sim.engine.arrays.rails import RailContacts
from conveyor_sim.engine.compiler.compile import part

SWEEPS = 64

IN_LINE = 1e-10
"""Squared sine between normals below which two pieces count as one. Division by less would amplify rounding errors."""


@part
def share_overlaps(contacts: RailContacts, count: int) -> None:
    """Set `share` = lambda / delta of the first `count` contacts of one bottle, each surface by itself."""
    for a in range(count):
        contacts.share[a] = 1.0
    for a in range(count):
        first = True
        members = 1
        other = a
        for b in range(count):
            if b != a and contacts.surface[b] == contacts.surface[a]:
                first = first and b > a
                other = b
                members += 1
        if members == 2 and first:
            _share_two(contacts, a, other)
        elif members > 2 and first:
            _share_many(contacts, a, count)


@part
def _share_two(contacts: RailContacts, a: int, b: int) -> None:
    """Solve for two pieces, in closed form."""
    cosine = contacts.nx[a] * contacts.nx[b] + contacts.ny[a] * contacts.ny[b]
    if cosine <= 0.0:
        return
    over_a, over_b = contacts.overlap[a], contacts.overlap[b]
    if over_b <= cosine * over_a:
        contacts.share[b] = 0.0
        return
    if over_a <= cosine * over_b:
        contacts.share[a] = 0.0
        return
    # 1 - cosine^2, without its cancellation if the pieces are nearly in line.
    sine = contacts.nx[a] * contacts.ny[b] - contacts.ny[a] * contacts.nx[b]
    rest = sine * sine
    if rest < IN_LINE:
        contacts.share[a if over_a < over_b else b] = 0.0
    else:
        contacts.share[a] = (over_a - cosine * over_b) / (rest * over_a)
        contacts.share[b] = (over_b - cosine * over_a) / (rest * over_b)


@part
def _share_many(contacts: RailContacts, first: int, count: int) -> None:
    """Solve for three or more pieces, which is rare, by projected Gauss-Seidel."""
    surface = contacts.surface[first]
    for a in range(first, count):
        contacts.solution[a] = 0.0
    for _ in range(SWEEPS):
        for a in range(first, count):
            if contacts.surface[a] == surface:
                rest = contacts.overlap[a]
                for b in range(first, count):
                    if b != a and contacts.surface[b] == surface:
                        cosine = contacts.nx[a] * contacts.nx[b] + contacts.ny[a] * contacts.ny[b]
                        if cosine > 0.0:
                            rest -= cosine * contacts.solution[b]
                contacts.solution[a] = rest if rest > 0.0 else 0.0
    for a in range(first, count):
        if contacts.surface[a] == surface:
            contacts.share[a] = contacts.solution[a] / contacts.overlap[a]
