# SPDX-License-Identifier: Apache-2.0
"""Growth of the cost of a bottle-step: with bottles, belts, rails, and the share of bottles in contact."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import pairwise

from bench import ours
from bench.markdown import table as markdown
from bench.measure import RATE, Contestant, Effort, in_turns, say
from bench.packed import DT, FRICTION, MASS, NO_OUTPUTS, RADIUS, SPEED, STIFFNESS, TICK, WALL_STIFFNESS
from bench.packed import table as dense_table
from bench.rows import Row, Rows, Spread
from conveyor_sim.scene import Scene, parse_scene

BOTTLES, BELTS, RAILS, TOUCHING = "bottles", "belts", "rails", "share touching"
SIZES = (10, 30, 100, 300, 1_000, 3_000, 10_000, 30_000, 100_000)
QUICK_SIZES = (10, 100, 1_000)
SETTLE, SETTLE_SHORT = 1.2, 0.3
"""s; the short one from 30 000 bottles on."""
PARTS = (1, 10, 100, 1_000)
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
FILES = 1_000
"""Files of two bottles, side by side."""
FILE_PITCH = 0.14
"""m, so that files don't touch each other."""
RIDE = 20.0
"""m of belt for those that nothing stops: 100 s."""
OURS = "paper's effects, 1 thread"


def files(belts: int, rails: int, touching: float) -> Scene:
    """FILES files of two bottles, carried along y by so many belts; the first of a share of the files stand at a stop.

    The stop is so many rails end to end, 1 cm apart, between two files each. However finely belts and stop are divided,
    the same bottles touch the same things. What is not stopped rides on, undisturbed.
    """
    stopped = round(touching * FILES)
    gap = 2.0 * RADIUS
    # The second of a file presses on the first; where nothing is stopped, it keeps a distance.
    ranks = [(0, stopped, 0.0), (0, stopped, -gap), (stopped, FILES, 0.0), (stopped, FILES, -1.2 * gap)]
    fields = {
        "name": "files",
        "duration": 1e4,
        "tick": TICK,
        "accuracy": {"per_tick": round(TICK / DT)},
        "bottle_types": {"soft": {"radius": RADIUS, "mass": MASS, "material": "bottle"}},
        "contacts": [
            {"between": ["bottle", other], "stiffness": k, "friction": 0.1,
             "damping": {"law": "paper", "coefficient": 0.1}}
            for other, k in (("bottle", STIFFNESS), ("rail", WALL_STIFFNESS))
        ],
        "base": [{"between": ["bottle", "belt"], "friction": FRICTION}],
        "belts": {
            f"belt_{i}": {"kind": "straight", "start": [last * FILE_PITCH, -1.0], "angle": "90 deg", "length": RIDE,
                          "width": (last - first) * FILE_PITCH, "speed": SPEED, "material": "belt"}
            for i, (first, last) in enumerate(_divided(FILES, belts))
        },
        "rails": {
            f"rail_{i}": {"kind": "segment", "from": [first * FILE_PITCH + 0.005, RADIUS],
                          "to": [last * FILE_PITCH - 0.005, RADIUS], "material": "rail"}
            for i, (first, last) in enumerate(_divided(stopped, rails))
        },
        "bottles": [
            {"type": "soft", "position": [(k + 0.5) * FILE_PITCH, y], "velocity": [0.0, SPEED if k >= stopped else 0.0]}
            for first, last, y in ranks
            for k in range(first, last)
        ],
        "outputs": NO_OUTPUTS,
    }  # fmt: skip
    return parse_scene(json.dumps(fields))


def _divided(count: int, parts: int) -> list[tuple[int, int]]:
    """Ranges that are as equal as they can be; empty ones are left out."""
    edges = [round(count * i / parts) for i in range(parts + 1)]
    return [(first, last) for first, last in pairwise(edges) if last > first]


def measure(effort: Effort) -> list[Row]:
    """RATE with the paper's effects on one thread."""
    rows = []
    contestants = []
    for n in QUICK_SIZES if effort.quick else SIZES:
        say(f"growth, {n} bottles: packing them")
        settle = SETTLE if n < 30_000 else SETTLE_SHORT
        contestants.append(ours.contestant(OURS, ours.packed(dense_table(n, "paper"), settle, threads=1), n))
    rows += _timed(contestants, effort, BOTTLES)
    parts = PARTS[::3] if effort.quick else PARTS
    shares = SHARES[::4] if effort.quick else SHARES
    rows += _timed([_files(parts_, files(parts_, 1, 1.0)) for parts_ in parts], effort, BELTS)
    rows += _timed([_files(parts_, files(1, parts_, 1.0)) for parts_ in parts], effort, RAILS)
    rows += _timed([_files(share, files(1, 1, share)) for share in shares], effort, TOUCHING)
    return rows


def _files(n: float, scene: Scene) -> Contestant:
    simulation = ours.simulate(scene, threads=1)
    simulation.advance(round(0.2 / scene.tick))
    return ours.contestant(OURS, simulation, n)


def _timed(contestants: Sequence[Contestant], effort: Effort, case: str) -> list[Row]:
    say(f"growth with {case}: {len(contestants)} sizes, {effort.rounds} rounds")
    return in_turns(contestants, effort, case)


def nanoseconds(rows: Rows, case: str, n: float) -> Spread | None:
    """Per bottle-step."""
    rate = rows.spread(case, n, OURS, RATE)
    return rate and Spread(1e3 / rate.middle, 1e3 / rate.greatest, 1e3 / rate.least)


def tables(rows: Rows) -> str:
    """Time per bottle-step, and its ratio to a reference, by what is varied."""
    found = []
    for case, reference in ((BOTTLES, 1_000.0), (BELTS, 1.0), (RAILS, 1.0), (TOUCHING, 0.0)):
        base = nanoseconds(rows, case, reference)
        body = []
        for n in rows.ns(case):
            cost = nanoseconds(rows, case, n)
            body.append([n, cost and base and f"{cost.middle / base.middle:.2f}", cost])
        found.append(markdown([case, f"cost over that at {reference:g}", "ns per bottle-step"], body))
    return "\n\n".join(["The dense table:", found[0], f"{2 * FILES} bottles in files of two:", *found[1:]])
