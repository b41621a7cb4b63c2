# SPDX-License-Identifier: Apache-2.0
"""Laws along the normal of a contact, one file each: elastic and damping laws, and the lists of both.

A law is plain functions of numbers and a declaration of them. The kernels add up the laws in the lists (`law_sums.py`);
columns, effects, bounds and predictions derive from the same declarations. The order of columns and effects is that of
the lists.
"""

from conveyor_sim.engine.contact.laws.declaration import DampingLaw, ElasticLaw
from conveyor_sim.engine.contact.laws.hertz import HERTZ
from conveyor_sim.engine.contact.laws.linear import LINEAR
from conveyor_sim.engine.contact.laws.normal import NORMAL
from conveyor_sim.engine.contact.laws.onset import ONSET
from conveyor_sim.engine.contact.laws.paper import PAPER
from conveyor_sim.engine.contact.laws.table import TABLE
from conveyor_sim.engine.contact.laws.tsuji import TSUJI
from conveyor_sim.engine.contact.laws.viscoelastic import VISCOELASTIC

__all__ = ["DAMPING", "ELASTIC", "DampingLaw", "ElasticLaw"]

ELASTIC: tuple[ElasticLaw, ...] = (LINEAR, HERTZ, TABLE)
DAMPING: tuple[DampingLaw, ...] = (PAPER, NORMAL, TSUJI, ONSET, VISCOELASTIC)
