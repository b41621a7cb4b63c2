# SPDX-License-Identifier: Apache-2.0
"""Compiled kernels are cached on disk, and never used for sources that have changed."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import conveyor_sim

FORCE = """
import numpy as np
from conveyor_sim.engine.arrays.contacts import ContactLaw
from conveyor_sim.engine.compiler.compile import kernel
from conveyor_sim.engine.contact.contact import contact_force
contact_force = kernel(contact_force.py_func)
law = ContactLaw(stiffness=np.array([5000.0]), friction=np.array([0.3]))
print(contact_force(law, np.uint64(0), None, 0.01, None, 0.002, 1.0, 0.0, 1.0, None, None)[1])
stats = contact_force.stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""

RUN = """
import importlib, pkgutil
from numba.core.dispatcher import Dispatcher
import conveyor_sim.engine
from conveyor_sim.run.compilation import Compilation
from conveyor_sim.scene import parse_scene
from conveyor_sim.simulation import Simulation
scene = parse_scene('''
name: one
duration: 1.0
floor: none
bottle_types: {bottle: {radius: 0.065, mass: 0.2, material: glass}}
bottles: [{type: bottle, position: [0, 0], velocity: [1, 0]}]
''')
said = []
Compilation(scene, said.append).run()
sim = Simulation(scene)
sim.advance(2)
sim.contacts()
names = [module.name for module in pkgutil.walk_packages(conveyor_sim.engine.__path__, "conveyor_sim.engine.")]
values = [value for name in names for value in vars(importlib.import_module(name)).values()]
kernels = {id(value): value for value in values if isinstance(value, Dispatcher)}
print(sum(sum(kernel.stats.cache_hits.values()) for kernel in kernels.values()))
print(sum(sum(kernel.stats.cache_misses.values()) for kernel in kernels.values()))
print(len(said))
"""


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """Return a folder with a copy of the package, to edit."""
    source = Path(conveyor_sim.__file__).parent
    shutil.copytree(source, tmp_path / "conveyor_sim", ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def python(folder: Path, code: str, **variables: str) -> list[str]:
    """Return the output of a new interpreter that imports from a folder and has its cache there by default."""
    kept = {key: value for key, value in os.environ.items() if key not in ("XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
    environment = {
        **kept,
        "PYTHONPATH": os.pathsep.join([str(folder), *kept.get("PYTHONPATH", "").split(os.pathsep)]),
        "NUMBA_CACHE_DIR": str(folder / "cache"),
        **variables,
    }
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_an_edit_in_a_helper_reaches_its_callers(copied: Path) -> None:
    """Numba's own rule would use the cache of `contact.py` if only `friction.py` changes."""
    assert python(copied, FORCE) == ["-3.0", "0", "1"]
    assert python(copied, FORCE) == ["-3.0", "1", "0"]
    friction = copied / "conveyor_sim" / "engine" / "contact" / "friction.py"
    text = friction.read_text()
    friction.write_text(text.replace("copysign(t * (2.0 - t), slip)", "copysign(2.0, slip)"))
    assert python(copied, FORCE) == ["-6.0", "0", "1"]
    friction.write_text(text)
    assert python(copied, FORCE) == ["-3.0", "1", "0"]
    assert len([folder for folder in (copied / "cache" / "conveyor_sim").iterdir() if folder.name != "sources"]) == 2


def hash_of(folder: Path) -> str:
    """Return the hash of the engine's sources in a folder; the cached hash stays."""
    return python(folder, "from conveyor_sim.engine.compiler.compile import ENGINE_HASH as h; print(h)")[0]


def test_a_better_comment_throws_no_kernels_away(copied: Path) -> None:
    """The hash is over the syntax of sources, without comments, docstrings and layout."""
    friction, before = copied / "conveyor_sim" / "engine" / "contact" / "friction.py", hash_of(copied)
    text = friction.read_text()
    friction.write_text(
        text.replace("two curves p", "two better curves p", 1).replace("\n\n\n", "\n\n\n# Better.\n", 1)
    )
    assert len(friction.read_text()) == len(text) + len("better ") + len("# Better.\n")
    assert hash_of(copied) == before
    friction.write_text(text.replace("copysign(t * (2.0 - t), slip)", "copysign(t * (2.0 - t) * 1.0, slip)"))
    assert hash_of(copied) != before


def test_a_kept_hash_that_is_damaged_is_found_again(copied: Path) -> None:
    before = hash_of(copied)
    (kept,) = (copied / "cache" / "conveyor_sim" / "sources").iterdir()
    whole = kept.read_bytes()
    assert whole.startswith(before.encode())
    other = bytes([whole[3] ^ 1])  # a digit still
    for damaged in (b"", whole[:-1], b"\xff" * len(whole), whole[:3] + other + whole[4:]):
        kept.write_bytes(damaged)
        assert hash_of(copied) == before
        assert kept.read_bytes() == whole


def test_a_second_process_compiles_nothing(copied: Path) -> None:
    """The first process has another process compile for it."""
    for said in (1, 0):
        hits, misses, sentences = (int(number) for number in python(copied, RUN))
        assert hits >= 3
        assert misses == 0
        assert sentences == said


def test_without_a_cache_kernels_come_from_a_process_of_their_own(copied: Path) -> None:
    hits, misses, sentences = (int(number) for number in python(copied, RUN, NUMBA_CACHE_DIR="/proc/nowhere"))
    assert hits >= 3
    assert (misses, sentences) == (0, 1)


def test_where_the_cache_is(copied: Path) -> None:
    """NUMBA_CACHE_DIR, else XDG_CACHE_HOME, else the home's cache."""
    code = (
        "from conveyor_sim.engine.compiler.compile import ENGINE_HASH, KERNELS; print(KERNELS.path.parent, ENGINE_HASH)"
    )
    numba, digest = python(copied, code)
    assert numba == str(copied / "cache" / "conveyor_sim")
    assert len(digest) == 16
    xdg = python(copied, code, NUMBA_CACHE_DIR="", XDG_CACHE_HOME=str(copied / "xdg"))
    assert xdg == [str(copied / "xdg" / "conveyor_sim"), digest]
    home = python(copied, code, NUMBA_CACHE_DIR="", HOME=str(copied))
    assert home == [str(copied / ".cache" / "conveyor_sim"), digest]
