# SPDX-License-Identifier: Apache-2.0
"""`full_state_hash`: state that changes a future changes it, and observers do not."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from line.machines.test_station import LOADED, stationed
from physics.state.test_checkpoint import INTEGRATORS, queue, run
from scenes import SPRINGS_AND_RINGS, line, scene
from swept import QUEUE

from conveyor_sim.physics.state.hashes import MEMORY, full_state_hash
from conveyor_sim.physics.state.world_arrays import FIXED, LIMITED, OBSERVERS, SCRATCH, changing_arrays
from conveyor_sim.scene import Scene
from conveyor_sim.scene.limits import Limits
from conveyor_sim.simulation import Simulation

LIMITS = {"scuffing_work": 1e-6, "impact_speed": 0.05, "crushing_force": 0.5, "tipping": 0.01, "clogging_time": 0.2}
SCENES: dict[str, Callable[[], Scene]] = {
    "springs": lambda: queue(**SPRINGS_AND_RINGS),
    "limits": lambda: queue(**SPRINGS_AND_RINGS, limits=LIMITS),
    "bends": lambda: scene(**line()),
    "impulses": lambda: queue(**QUEUE),
    **{name: (lambda name=name: queue(accuracy={"integrator": name, **INTEGRATORS[name]})) for name in INTEGRATORS},
}
AHEAD = 12
"""Ticks that are played on; lists are made anew in them, and bottles come."""


@pytest.fixture(scope="module", params=SCENES)
def saved(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a checkpoint of a scene at tick 60."""
    sim = Simulation(SCENES[request.param](), threads=1)
    run(sim, 60)
    path = tmp_path_factory.mktemp("saved") / "checkpoint.npz"
    sim.save(path)
    return path


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a checkpoint of a line of machines with failures. One of them holds a bottle, and commands wait."""
    sim = stationed(4.0, rate=2.0, ramp_up=0.4, sets={"cap": {"to": 1.0, "share": 0.6}}, **LOADED)
    while not sim.counts.held:
        sim.advance()
    path = tmp_path_factory.mktemp("saved") / "checkpoint.npz"
    sim.save(path)
    return path


def left_out(name: str, sim: Simulation) -> bool:
    """Return True if an array is declared not to decide a future."""
    limited = any(getattr(sim.scene.limits, limit) for limit in Limits.model_fields if limit != "clogging_time")
    return name.startswith((*FIXED, *SCRATCH, *OBSERVERS, *(() if limited else LIMITED)))


def hash_of(sim: Simulation, memory: Any) -> int:
    return full_state_hash(memory, changing_arrays(sim._state.world), sim.scene.limits)


def test_every_array_of_a_checkpoint_is_hashed_or_declared(saved: Path) -> None:
    """One element of each is changed, the last one and one in the middle."""
    sim = Simulation.load(saved, threads=1)
    before = sim.full_state_hash()
    covered = 0
    for name, array in changing_arrays(sim._state.world).items():
        flat = array.reshape(-1)
        for place in {flat.size // 2, flat.size - 1} if flat.size else set():
            kept = flat[place]
            flat[place] = not kept if array.dtype.kind == "b" else kept + 1
            assert (sim.full_state_hash() != before) is not left_out(name, sim), (name, place)
            flat[place] = kept
            covered += not left_out(name, sim)
    assert covered > 60
    assert sim.full_state_hash() == before


def test_what_is_left_out_does_not_change_the_future(saved: Path) -> None:
    """All of it is changed at once to values that no run leaves there; the next ticks equal those of the checkpoint."""
    sim, other = (Simulation.load(saved, threads=1) for _ in range(2))
    spoilt = set()
    for name, array in changing_arrays(other._state.world).items():
        if left_out(name, other) and not name.startswith(FIXED) and array.size:
            array[...] = np.nan if array.dtype.kind == "f" else 1
            spoilt.add(name)
    assert len(spoilt) > 5
    other.take_events()
    other.integration._memory.deepest = 0.9
    other.integration._memory.shortened_ticks = 7
    for _ in range(AHEAD):
        assert other.full_state_hash() == sim.full_state_hash()
        sim.advance()
        other.advance()
    assert other.full_state_hash() == sim.full_state_hash()
    assert other.state_hash() == sim.state_hash()


def leaves(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Every value below mappings and lists, by path; empty ones too."""
    if isinstance(data, (dict, list)) and data:
        for key, value in data.items() if isinstance(data, dict) else enumerate(data):
            yield from leaves(value, (*path, key))
    else:
        yield path, data


def other_value(value: Any) -> Any:
    """Return a value that differs."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, (int, float)):
        return value + 1 if value + 1 != value else -value
    return value + "x" if isinstance(value, str) else 1


def test_every_part_of_the_memory_is_hashed_or_declared(station: Path) -> None:
    """Devices, random streams, commands, held bottles, alarms, counters, ... of lines with all of them."""
    seen = set()
    waiting = Simulation(SCENES["springs"](), threads=1)
    run(waiting, 30)
    waiting.command(["belts/end/cmd_speed"], [0.2])
    for sim in (Simulation.load(station, threads=1), waiting):
        memory = json.loads(json.dumps(sim._snapshot()))
        before = hash_of(sim, memory)
        assert before == sim.full_state_hash()
        for place, value in leaves(memory):
            changed = copy.deepcopy(memory)
            inner = changed
            for step in place[:-1]:
                inner = inner[step]
            inner[place[-1]] = [[0, [0, 0.0, []]]] if place == ("held",) else other_value(value)
            is_declared = any(place[: len(declared)] == declared for declared in MEMORY)
            is_load = place[0] == "held" and place[2:4] == (1, 2) and not any(vars(sim.scene.limits).values())
            assert (hash_of(sim, changed) != before) is not (is_declared or is_load), place
            seen.add(place[0])
        assert hash_of(sim, {**memory, "something new": 1}) != before
    assert {"tick", "next_id", "held", "line", "integration"} <= seen


def test_states_that_look_equal_and_have_other_futures_differ(station: Path) -> None:
    """A random stream, a spring that is slack but kept, a law of a pair, a watchdog: `state_hash` sees none of them."""
    sim, other = (Simulation.load(station, threads=1) for _ in range(2))
    stream = next(
        place for place, value in leaves(json.loads(json.dumps(sim._snapshot()))) if place[-1] == "inc" and value
    )
    device: Any = next(device for device in other._line._devices if device.name == stream[2])
    for step in stream[3:-2]:
        device = device[step] if isinstance(device, dict) else getattr(device, step)
    device.random()
    assert other.state_hash() == sim.state_hash()
    assert other.full_state_hash() != sim.full_state_hash()


@pytest.mark.parametrize("name", ["springs", "bends", "linearly_implicit", "impulses"])
def test_threads_calls_and_lookers_on_change_nothing(name: str, tmp_path: Path) -> None:
    one, two = Simulation(SCENES[name](), threads=1), Simulation(SCENES[name](), threads=2)
    one.advance(50)
    for tick in range(50):
        two.advance()
        two.take_outcomes()
        two.bottles(), two.contacts(), two.belts(), two.signals(), two.ledger(), two.damage()
        if tick == 25:
            two.save(tmp_path / "there")
    assert two.full_state_hash() == one.full_state_hash()
    assert Simulation.load(tmp_path / "there").full_state_hash() != one.full_state_hash()
    there = Simulation.load(tmp_path / "there", threads=1)
    there.advance(24)
    assert there.full_state_hash() == one.full_state_hash()
