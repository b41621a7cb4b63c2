"""The laws along the normal of a contact, a file each: elastic ones and damping ones, and the lists of both.

A law is plain functions of numbers and a declaration of them. The kernels add up those of the lists (`law_sums.py`);
columns, effects, bounds and predictions are made from the same declarations. Order decides that of columns and effects.
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
