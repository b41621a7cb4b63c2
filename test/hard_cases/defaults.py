# SPDX-License-Identifier: Apache-2.0
"""Rows at defaults: the paper's integrator, preset `standard`, one thread. Each is run once for all tests of a process.

Rows of impulses alone run in 8 steps with 2 sweeps.
"""

from __future__ import annotations

from functools import cache

from hard_cases.case import Case, read_table
from hard_cases.measures import Outcome, run

CASES = {case.name: case for case in read_table()}


@cache
def run_at_defaults(name: str) -> Outcome:
    """Run a row on one thread."""
    return run_on_threads(CASES[name], 1)


def run_on_threads(case: Case, threads: int) -> Outcome:
    """Run a row at defaults, but on some threads. The state of a symmetric row is hashed a tick before the end."""
    setting = ("impulses", "8x2") if tuple(case.integrators) == ("impulses",) else ("leapfrog", "standard")
    # No row of a file expects anything of the ledger; without, it has the kernels of the scene as it is shipped.
    scene = case.scene(*setting, ledger="file" not in case.given)
    hash_at = scene.duration_ticks - 1 if case.family == "symmetry" else -1
    return run(case, scene, threads=threads, hash_at=hash_at)
