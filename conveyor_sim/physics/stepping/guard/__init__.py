"""The guard: looks at every tick for what no bottle can do, has it done again in shorter steps, or stops the run.

`guard.py` looks and decides, `world_snapshot.py` keeps the state to go back to, `violation.py` and `squeeze.py` find
the words, `chatter.py` hears friction that shakes from step to step. It looks at `engine/observers/guard_probe.py`.
"""

from conveyor_sim.physics.stepping.guard.guard import Guard
from conveyor_sim.physics.stepping.guard.violation import Violation

__all__ = ["Guard", "Violation"]
