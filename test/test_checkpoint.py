"""Checkpoints: a run goes on from a file as if it had never stopped, or the file is refused with the reason."""

from __future__ import annotations

import json
import os
import resource
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import NO_FLOOR, RADIUS, base, belt, bottle, contact, every_law, kind, line, polyline, scene

from conveyor_sim.checkpoint import FORMAT, versions
from conveyor_sim.engine.arrays import World
from conveyor_sim.errors import CheckpointError
from conveyor_sim.part_memory import remembered
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.world_arrays import CONSTANT, changing_arrays

SPRING = {"stiffness": 2000.0, "damping": 0.5}
SPRINGS_AND_RINGS: dict[str, Any] = {
    "bottle_types": {"bottle": kind(base_radius=0.04), "slim": kind(0.06, 0.15, base_radius=0.03)},
    "contacts": [
        contact(5000.0, friction=0.2, tangential=SPRING),
        contact(8000.0, "steel", friction=0.2, tangential=SPRING),
    ],
}
INTEGRATORS: dict[str, dict[str, Any]] = {
    "semi_implicit_euler": {"per_tick": 50},
    "velocity_verlet": {"per_tick": 50},
    "rk4": {"per_tick": 25},
    "dormand_prince": {"per_tick": 50, "error": 1e-3},
    "linearly_implicit": {"per_tick": 20},
}
COMMANDS = {20: [{"feeder": 0.55}], 150: [{"feeder": 0.5}, {"end": 99.0}], 200: [{"end": 0.2, "side": 0.4}]}
"""Sets of speeds by tick; one is refused, and the watchdog of the feeder trips at 90 and at 220."""
SAVED, END = 150, 260


def queue(**fields: Any) -> Scene:
    """A feeder that queues up before a slow belt, and a belt that empties; two types of bottles, drawn at random."""
    laws = {"damping": ("normal", 1.0), "friction": 0.2}
    given: dict[str, Any] = {
        "seed": 3,
        "bottle_types": {"bottle": kind(), "slim": kind(0.06, 0.15)},
        "contacts": [contact(5000.0, **laws), contact(8000.0, "steel", **laws)],
        "base": base(0.4),
        "belts": {
            "feeder": belt(0.6, (-1.0, -0.15), 1.6, 0.3, watchdog=0.7),
            "end": belt(0.1, (0.6, -0.15), 0.6, 0.3),
            "side": belt(0.6, (-1.0, 0.85), 1.2, 0.3),
        },
        "rails": {
            "left": polyline([(-1.0, 0.14), (0.3, 0.14), (0.6, 0.1), (1.2, 0.1)]),
            "right": polyline([(-1.0, -0.14), (0.3, -0.14), (0.6, -0.1), (1.2, -0.1)]),
        },
        "infeeds": {
            "packed": {"bottle": "bottle", "position": [-0.9, 0.03], "direction": 0.0, "speed": 0.6, "gap": 0.004,
                       "timing_jitter": 0.01, "lateral_jitter": 0.02},
            "timed": {"bottle": "slim", "position": [-0.9, 1.0], "direction": 0.0, "speed": 0.3, "rate": 3.0,
                      "timing_jitter": 0.05, "lateral_jitter": 0.04},
        },
        "outfeeds": {
            "end": {"region": [[1.0, -0.2], [1.3, -0.2], [1.3, 0.2], [1.0, 0.2]]},
            "side": {"region": [[0.0, 0.8], [0.5, 0.8], [0.5, 1.2], [0.0, 1.2]]},
        },
        "bottles": [{"grid": {"type": "slim", "origin": [-0.2, -0.06], "rows": 2, "columns": 4, "pitch": 0.121}}],
        "accuracy": {"per_tick": 50},
        "effects": {"peaks": "on"},
    }  # fmt: skip
    return scene(**{**given, **fields})


def command(sim: Simulation) -> None:
    """The commands that are due now."""
    for speeds in COMMANDS.get(sim.tick, []):
        sim.command([f"belts/{name}/cmd_speed" for name in speeds], list(speeds.values()))


def run(sim: Simulation, end: int, after_tick: Callable[[], None] = lambda: None) -> list[int]:
    """State hashes, tick by tick. The commands of the present tick are those that are pending, if there are any."""
    hashes = []
    while sim.tick < end:
        if not sim._line._pending:
            command(sim)
        sim.advance()
        hashes.append(sim.state_hash())
        after_tick()
    return hashes


def everything(sim: Simulation) -> list[bytes]:
    """All that can be observed, bit for bit."""
    columns = [*vars(sim.bottles()).values(), *vars(sim.contacts()).values(), *vars(sim.belts()).values()]
    return [column.tobytes() for column in (*columns, sim.signals())]


def test_a_loaded_run_goes_on_bit_for_bit_on_any_number_of_threads(tmp_path: Path) -> None:
    """Saved in a queue whose springs are stretched, with commands that wait and outcomes that nobody took."""
    given = queue(**SPRINGS_AND_RINGS)
    reference = Simulation(given, threads=1)
    before = run(reference, SAVED)
    taken = reference.counts
    hashes = run(reference, END)
    for saving, going_on in ((1, 2), (2, 1)):
        sim = Simulation(given, threads=saving)
        assert run(sim, SAVED) == before
        command(sim)
        sim.save(tmp_path / "checkpoint")
        loaded = Simulation.load(tmp_path / "checkpoint", threads=going_on)
        assert (loaded.tick, loaded.threads) == (SAVED, going_on)
        assert run(loaded, END) == hashes
        assert everything(loaded) == everything(reference)
        assert loaded.counts == reference.counts
    # It says little if nothing happens. A spring takes 16 bytes.
    assert len(sim._state.springs()) >= 10 * 16
    assert taken.fed > 5
    assert taken.blocked_ticks > 10
    assert reference.counts.fed > taken.fed + 3
    assert reference.counts.removed > taken.removed + 1


def test_outcomes_and_pending_commands_are_kept(tmp_path: Path) -> None:
    given = queue(**SPRINGS_AND_RINGS)
    sim = Simulation(given)
    run(sim, SAVED)
    command(sim)
    sim.command(["belts/end/cmd_speed"], [float("nan")], "a controller")
    sim.save(tmp_path / "checkpoint")
    loaded = Simulation.load(tmp_path / "checkpoint")
    for each in (sim, loaded):
        run(each, END)
    told, expected = loaded.take_outcomes(), sim.take_outcomes()
    assert repr(told) == repr(expected)  # a NaN is not equal to itself
    assert [(o.tick, o.source, o.accepted) for o in told] == [
        (20, "commands", True),
        (90, "watchdog", True),
        (SAVED, "commands", True),
        (SAVED, "commands", False),
        (SAVED, "a controller", False),
        (200, "commands", True),
        (220, "watchdog", True),
    ]


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_every_integrator_goes_on_bit_for_bit(integrator: str, tmp_path: Path) -> None:
    sim = Simulation(queue(accuracy={"integrator": integrator, **INTEGRATORS[integrator]}))
    run(sim, 60)
    sim.save(tmp_path / "checkpoint")
    loaded = Simulation.load(tmp_path / "checkpoint")
    assert run(loaded, 90) == run(sim, 90)
    assert everything(loaded) == everything(sim)


def test_saving_leaves_no_trace(tmp_path: Path) -> None:
    reference, sim = Simulation(queue()), Simulation(queue())
    assert run(sim, 60, after_tick=lambda: sim.save(tmp_path / "checkpoint")) == run(reference, 60)
    assert everything(sim) == everything(reference)
    assert [file.name for file in tmp_path.iterdir()] == ["checkpoint"]


def test_bottles_put_into_each_other_may_part_after_a_checkpoint_too(tmp_path: Path) -> None:
    """The guard stops a run whose bottles come so deep by themselves."""
    sim = Simulation(
        scene(
            accuracy={"per_tick": 200},
            **every_law([contact(1e3, damping=("normal", 5.0))]),
            bottles=[bottle(0.0, 0.0), bottle(2.2 * RADIUS, 0.0)],
            **NO_FLOOR,
        )
    )
    sim.displace(np.array([0.0, -1.1 * RADIUS]), np.zeros(2))
    sim.save(tmp_path / "checkpoint")
    loaded = Simulation.load(tmp_path / "checkpoint")
    for each in (sim, loaded):
        each.advance(30)
        assert each.deepest_overlap < 0.75
        assert np.diff(each.bottles().x)[0] > 2.0 * RADIUS
    assert loaded.state_hash() == sim.state_hash()


BUILT_ANEW = {"scene", "model", "_state", "_every", "_centre_radius", "_line"}
"""Attributes of a Simulation that follow from its scene or decide nothing."""


def test_all_that_changes_is_in_the_file(tmp_path: Path) -> None:
    """The arrays with their lists as they are, and what the simulation itself and its parts remember."""
    sim = Simulation(queue(**SPRINGS_AND_RINGS))
    run(sim, SAVED)
    command(sim)
    sim.save(tmp_path / "checkpoint")
    loaded = Simulation.load(tmp_path / "checkpoint")
    arrays, kept = changing_arrays(sim._state.world), changing_arrays(loaded._state.world)
    assert {name: (array.shape, array.tobytes()) for name, array in arrays.items()} == {
        name: (array.shape, array.tobytes()) for name, array in kept.items()
    }
    assert len(arrays) > 50
    assert loaded._state.next_id == sim._state.next_id
    assert sorted(loaded._state._free) == sorted(sim._state._free)
    memory, again = (
        {name: remembered(value) for name, value in vars(each).items() if name not in BUILT_ANEW}
        | {"deepest overlap": each.deepest_overlap}
        for each in (sim, loaded)
    )
    assert again == memory
    assert {"tick", "_integration"} <= memory.keys()
    assert loaded._line.memory() == sim._line.memory()
    assert memory["deepest overlap"] > 0.0


def bits(value: Any) -> Any:
    """The contents of a group of arrays."""
    return [bits(part) for part in value] if isinstance(value, tuple) else getattr(value, "tobytes", lambda: value)()


def test_what_is_taken_for_constant_is() -> None:
    """Bends, springs and arcs among it."""
    sim, fresh = Simulation(scene(**line())), Simulation(scene(**line()))
    sim.advance(100)
    assert set(World._fields) > CONSTANT
    for name in CONSTANT:
        assert bits(getattr(sim._state.world, name)) == bits(getattr(fresh._state.world, name)), name


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkpoint of the queue at tick 10."""
    path = tmp_path_factory.mktemp("saved") / "checkpoint.npz"
    sim = Simulation(queue())
    sim.advance(10)
    sim.save(path)
    return path


def refusal(path: Path, given: Scene | None = None) -> str:
    """Why a file is not loaded: one sentence that begins with its name."""
    with pytest.raises(CheckpointError) as caught:
        Simulation.load(path, scene=given)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text.removeprefix(f"{path}: ")


def with_header(path: Path, to: Path, **changes: Any) -> Path:
    """The file with other entries in its header."""
    with np.load(path) as file:
        contents = dict(file)
    header = {**json.loads(contents["header"].tobytes()), **changes}
    contents["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    with to.open("wb") as stream:
        np.savez(stream, **contents)
    return to


def test_the_same_scene_may_be_given_and_last_longer(saved: Path) -> None:
    longer = queue(duration=50.0, description="goes on")
    loaded = Simulation.load(saved, scene=longer)
    assert loaded.scene is longer
    assert loaded.state_hash() == Simulation.load(saved).state_hash()
    assert Simulation.load(saved).scene.source_text == queue().source_text


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"slip_limit": 0.02}, "slip_limit: 0.01, which is 0.02"),
        ({"base": base(0.3)}, "base[0].friction: 0.4, which is 0.3"),
        ({"rails": {"left": polyline([(-1.0, 0.14), (1.2, 0.14)])}}, "rails.left.points[1][0]: 0.3, which is 1.2"),
        ({"effects": {}}, 'effects.peaks: "on", which is nothing'),
        (
            {"infeeds": {}, "outfeeds": {}},
            'infeeds.packed: {"bottle": "bottle", "position": [-0.9, 0.03], "direction..., which is nothing',
        ),
    ],
)
def test_another_scene_is_refused_with_the_field_that_differs(saved: Path, fields: dict[str, Any], told: str) -> None:
    assert refusal(saved, queue(**fields)) == (
        f"saved from a scene with {told} in the scene given; expected the same scene"
    )


def test_the_order_of_belts_matters(saved: Path) -> None:
    """Where belts overlap, the last listed carries; and indices follow the order."""
    one = queue()
    text = json.loads(one.source_text)
    text["belts"] = dict(reversed(text["belts"].items()))
    told = refusal(saved, scene(**text))
    assert told.startswith("saved from a scene with belts: feeder, end, side, which is side, end, feeder in the scene")


def test_another_format_is_refused(saved: Path, tmp_path: Path) -> None:
    changed = with_header(saved, tmp_path / "changed", format=FORMAT + 1)
    assert refusal(changed) == f"format {FORMAT + 1} of checkpoints, expected {FORMAT}"


@pytest.mark.parametrize("what", ["engine", "conveyor_sim", "numba"])
def test_another_version_is_refused(saved: Path, tmp_path: Path, what: str) -> None:
    here = versions()
    assert [entry.split("=")[0] for entry in here] == ["engine", "conveyor_sim", "numba", "llvmlite", "numpy"]
    (now,) = (entry for entry in here if entry.startswith(what))
    others = [f"{what}=1.2.3" if entry == now else entry for entry in here]
    assert refusal(with_header(saved, tmp_path / "changed", versions=others)) == (
        f"saved with {what}=1.2.3, expected {now}: no other version goes on to the same bits"
    )


def test_a_file_cut_short_anywhere_is_refused(saved: Path, tmp_path: Path) -> None:
    whole, cut = saved.read_bytes(), tmp_path / "cut"
    for length in [4, *np.linspace(100, len(whole) - 1, 12, dtype=int)]:
        cut.write_bytes(whole[:length])
        assert refusal(cut).startswith("is damaged or cut short ("), length
        assert refusal(cut).endswith("), expected a whole checkpoint"), length


def test_a_flipped_bit_is_found(saved: Path, tmp_path: Path) -> None:
    contents = bytearray(saved.read_bytes())
    with zipfile.ZipFile(saved) as file:
        largest = max(file.infolist(), key=lambda member: member.file_size)
    contents[largest.header_offset + 1000] ^= 1
    assert largest.file_size > 2000
    (tmp_path / "flipped").write_bytes(contents)
    assert refusal(tmp_path / "flipped").startswith(f"is damaged or cut short (Bad CRC-32 for file '{largest.filename}")


def test_flipped_bits_of_the_directory_are_found(saved: Path, tmp_path: Path) -> None:
    """Those by which a member claims to be encrypted or patched, and its name."""
    whole, flipped = saved.read_bytes(), tmp_path / "flipped"
    entry = whole.index(b"PK\x01\x02")
    for place, bit, told in ((8, 1, "is encrypted"), (8, 32, "patched data"), (46, 1, "without a header")):
        contents = bytearray(whole)
        contents[entry + place] ^= bit
        flipped.write_bytes(contents)
        assert told in refusal(flipped)


def test_arrays_of_another_make_are_refused(saved: Path, tmp_path: Path) -> None:
    with np.load(saved) as file:
        contents = dict(file)
    for name, array in (("bottles.x", contents["bottles.x"].astype(np.float32)), ("ring.radius", np.zeros(3))):
        with (tmp_path / "other").open("wb") as stream:
            np.savez(stream, **{**contents, name: array})
        assert f"(array {name} is of float" in refusal(tmp_path / "other")


def test_what_is_no_checkpoint_is_refused(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("name: a scene\n")
    (tmp_path / "empty").write_bytes(b"")
    np.savez(tmp_path / "arrays.npz", x=np.zeros(3))
    assert refusal(tmp_path / "scene.yaml") == "not a checkpoint, expected a file that was saved as one"
    assert refusal(tmp_path / "empty") == "not a checkpoint, expected a file that was saved as one"
    assert refusal(tmp_path / "arrays.npz") == "a .npz without a header, expected a checkpoint"
    assert refusal(tmp_path / "nowhere") == "no such file, expected a checkpoint"
    assert refusal(tmp_path) == "is a folder, expected a checkpoint"
    assert refusal(tmp_path / "empty" / "file") == "can't be read (Not a directory), expected a checkpoint"


@contextmanager
def as_nobody() -> Iterator[None]:
    """Without root's right to write everywhere."""
    user = os.geteuid()
    if user == 0:
        os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(user)


def failure_to_save(sim: Simulation, path: Path) -> str:
    with pytest.raises(CheckpointError) as caught:
        sim.save(path)
    return str(caught.value).removeprefix(f"{path}: ")


def test_a_file_that_can_not_be_written_is_told_and_nothing_is_left(saved: Path, tmp_path: Path) -> None:
    sim, locked = Simulation.load(saved), tmp_path / "locked"
    assert failure_to_save(sim, tmp_path / "no" / "file") == (
        f"can't be written (No such file or directory), expected the folder {tmp_path / 'no'} to be there"
    )
    assert failure_to_save(sim, tmp_path) == "is a folder, expected a file to write a checkpoint to"
    locked.mkdir(mode=0o500)
    with as_nobody():
        assert failure_to_save(sim, locked / "file").startswith("can't be written (Permission denied), expected ")
    assert list(locked.iterdir()) == []


def test_a_full_disk_leaves_the_checkpoint_that_was_there(saved: Path, tmp_path: Path) -> None:
    sim, file = Simulation.load(saved), tmp_path / "checkpoint"
    sim.save(file)
    before, whole = resource.getrlimit(resource.RLIMIT_FSIZE), file.read_bytes()
    sim.advance()
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(whole) // 2, before[1]))
    try:
        told = failure_to_save(sim, file)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert told == "can't be written (File too large), expected a file that can be written, and room for it"
    assert file.read_bytes() == whole
    assert [left.name for left in tmp_path.iterdir()] == ["checkpoint"]
