# SPDX-License-Identifier: Apache-2.0
"""Checkpoints: a run goes on from a file as if it had never stopped, or the file is refused with the reason."""

from __future__ import annotations

import hashlib
import io
import json
import math
import os
import re
import resource
import socket
import warnings
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from facts import missing, stating
from scenes import (
    COMMON,
    NO_FLOOR,
    RADIUS,
    SPRINGS_AND_RINGS,
    base,
    belt,
    bottle,
    contact,
    every_law,
    kind,
    line,
    polyline,
    scene,
    with_bends,
)
from swept import QUEUE

from conveyor_sim.accuracy.trajectory import displace
from conveyor_sim.engine.arrays.world import World
from conveyor_sim.errors import CheckpointError
from conveyor_sim.physics.state.checkpoint import FORMAT, to_bytes, versions
from conveyor_sim.physics.state.snapshot import snapshot
from conveyor_sim.physics.state.world_arrays import CONSTANT, FIXED, UNCHECKED, changing_arrays
from conveyor_sim.physics.state.world_checks import indices, ranges
from conveyor_sim.scene import Scene
from conveyor_sim.simulation import Simulation

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
        "effects": COMMON,
    }  # fmt: skip
    return scene(**with_bends({**given, **fields}))


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
        hashes.append(sim.full_state_hash())
        after_tick()
    return hashes


def everything(sim: Simulation) -> list[bytes]:
    """All that can be observed, bit for bit."""
    columns = [*vars(sim.bottles()).values(), *vars(sim.contacts()).values(), *vars(sim.belts()).values()]
    return [column.tobytes() for column in (*columns, sim.signals())]


def test_a_loaded_run_goes_on_bit_for_bit_on_any_number_of_threads(tmp_path: Path) -> None:
    """Saved in a queue whose springs are stretched, with waiting commands and results that were not taken."""
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
        assert (loaded.tick, loaded.integration.threads) == (SAVED, going_on)
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
    displace(sim, np.array([0.0, -1.1 * RADIUS]), np.zeros(2))
    sim.save(tmp_path / "checkpoint")
    loaded = Simulation.load(tmp_path / "checkpoint")
    for each in (sim, loaded):
        each.advance(30)
        assert each.integration.deepest_overlap < 0.75
        assert np.diff(each.bottles().x)[0] > 2.0 * RADIUS
    assert loaded.full_state_hash() == sim.full_state_hash()


BUILT_ANEW = {"scene", "model", "_state", "_every", "_line"}
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
        {name: snapshot(value) for name, value in vars(each).items() if name not in BUILT_ANEW}
        | {"deepest overlap": each.integration.deepest_overlap}
        for each in (sim, loaded)
    )
    assert again == memory
    assert {"tick", "integration"} <= memory.keys()
    assert loaded._line.snapshot() == sim._line.snapshot()
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


@pytest.fixture
def own_socket(tmp_path: Path) -> Iterator[Path]:
    """A socket in the file system."""
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(tmp_path / "socket"))
        yield tmp_path / "socket"


def refusal(path: Path, given: Scene | None = None) -> str:
    """Why a file is not loaded: one sentence that begins with its name."""
    with pytest.raises(CheckpointError) as caught:
        Simulation.load(path, scene=given)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text.removeprefix(f"{path}: ")


def contents(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Header and arrays of a file."""
    with np.load(path) as file:
        arrays = dict(file)
    return json.loads(arrays.pop("header").tobytes()), arrays


def with_header(path: Path, to: Path, **changes: Any) -> Path:
    """The file with other entries in its header, without those that are None, and a checksum that fits."""
    header, arrays = contents(path)
    header = {name: value for name, value in {**header, **changes}.items() if value is not None}
    to.write_bytes(to_bytes(json.dumps(header), arrays))
    return to


def with_arrays(path: Path, to: Path, **changes: Any) -> Path:
    """The file with other arrays and a checksum that fits."""
    header, arrays = contents(path)
    to.write_bytes(to_bytes(json.dumps(header), {**arrays, **changes}))
    return to


def test_the_same_scene_may_be_given_and_last_longer(saved: Path) -> None:
    longer = queue(duration=50.0, description="goes on", start_time="2026-03-01T06:00:00Z", where="hall/line_1")
    loaded = Simulation.load(saved, scene=longer)
    assert loaded.scene is longer
    assert loaded.full_state_hash() == Simulation.load(saved).full_state_hash()
    assert Simulation.load(saved).scene.source_text == queue().source_text


@pytest.mark.parametrize(
    ("fields", "facts"),
    [
        ({"slip_limit": 0.02}, ["slip_limit: 0.01", "0.02"]),
        ({"base": base(0.3)}, ["base[0].friction: 0.4", "0.3"]),
        ({"rails": {"left": polyline([(-1.0, 0.14), (1.2, 0.14)])}}, ["rails.left.points[1][0]: 0.3", "1.2"]),
        ({"effects": {}}, ['effects.peaks: "on"', "nothing"]),
        (
            {"infeeds": {}, "outfeeds": {}},
            ['infeeds.packed: {"bad_share": 0.0, "bad_every": null, "bad_at": [], "late...', "nothing"],
        ),
    ],
)
def test_another_scene_is_refused_with_the_field_that_differs(
    saved: Path, fields: dict[str, Any], facts: list[str]
) -> None:
    assert missing(refusal(saved, queue(**fields)), ["scene", *facts, "same scene"]) == []


def test_the_order_of_belts_matters(saved: Path) -> None:
    """The last of overlapping belts carries, and indices follow the order."""
    one = queue()
    text = json.loads(one.source_text)
    text["belts"] = dict(reversed(text["belts"].items()))
    told = refusal(saved, scene(**text))
    assert told.startswith("saved from a scene with belts: feeder, end, side, spare, which is spare, side, end, feeder")


def test_another_format_is_refused(saved: Path, tmp_path: Path) -> None:
    changed = with_header(saved, tmp_path / "changed", format=FORMAT + 1)
    assert refusal(changed) == f"format {FORMAT + 1} of checkpoints, expected {FORMAT}"


@pytest.mark.parametrize("what", ["engine", "conveyor_sim", "numba"])
def test_another_version_is_refused(saved: Path, tmp_path: Path, what: str) -> None:
    here = versions()
    assert [entry.split("=")[0] for entry in here] == ["engine", "conveyor_sim", "numba", "llvmlite", "numpy"]
    (now,) = (entry for entry in here if entry.startswith(what))
    others = [f"{what}=1.2.3" if entry == now else entry for entry in here]
    text = refusal(with_header(saved, tmp_path / "changed", versions=others))
    assert missing(text, [f"{what}=1.2.3", now, "same bits"]) == []


def test_a_file_cut_short_anywhere_is_refused(saved: Path, tmp_path: Path) -> None:
    whole, cut = saved.read_bytes(), tmp_path / "cut"
    for length in [4, *np.linspace(100, len(whole) - 1, 12, dtype=int)]:
        cut.write_bytes(whole[:length])
        assert refusal(cut).startswith("is damaged or cut short ("), length
        assert refusal(cut).endswith("), expected a complete checkpoint"), length


def test_every_flipped_bit_is_refused(saved: Path, tmp_path: Path) -> None:
    """Wherever it is: in an array, in the header, in the archive's directory, in the checksum itself."""
    whole, flipped = saved.read_bytes(), tmp_path / "flipped"
    directory = whole.index(b"PK\x01\x02")
    drawn = np.random.default_rng(0).integers(0, 8 * len(whole), 200)
    chosen = [8 * (directory + 8), 8 * (directory + 46), 8 * (len(whole) - 70), 8 * (len(whole) - 1)]
    for bit in [*chosen, *drawn.tolist()]:
        content = bytearray(whole)
        content[bit // 8] ^= 1 << bit % 8
        flipped.write_bytes(content)
        reason = refusal(flipped)
        assert reason.startswith(("is damaged or cut short (", "not a checkpoint, ")), bit


def test_the_file_is_one_that_numpy_and_unzip_read(saved: Path) -> None:
    """A flipped bit is none of their business, but to look into a file that the guard left is a user's."""
    header, arrays = contents(saved)
    assert header["format"] == FORMAT
    assert np.isfinite(arrays["bottles.x"]).all()
    with zipfile.ZipFile(saved) as file:
        assert file.testzip() is None
        assert re.fullmatch(b"sha256:[0-9a-f]{64}", file.comment)


def test_arrays_of_another_make_are_refused(saved: Path, tmp_path: Path) -> None:
    x = contents(saved)[1]["bottles.x"]
    for name, array in (("bottles.x", x.astype(np.float32)), ("ring.radius", np.zeros(3))):
        assert f"(array {name} is of float" in refusal(with_arrays(saved, tmp_path / "other", **{name: array}))


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"versions": None}, "header.versions is missing"),
        ({"versions": "one"}, "header.versions is not of its type"),
        ({"versions": ["engine=\x1b[2J"]}, "header.versions.0 is not of its type, or out of bounds"),
        ({"scene": 42}, "header.scene is not of its type"),
        ({"scene": {"text": 1, "name": "a", "overrides": ""}}, "header.scene.text is not of its type"),
        ({"scene": {"text": "a: [", "name": "a", "overrides": ""}}, "its scene is refused: a:1: not valid YAML"),
        ({"memory": []}, "header.memory is not of its type"),
        ({"memory": {}}, "memory has other entries than tick, next_id, held, line"),
        ({"extra": 1}, "header.extra should not be there"),
        ({"format": None}, "header.format is missing"),
        ({"format": "2"}, "header.format is not of its type"),
    ],
)
def test_a_header_with_odd_fields_is_refused(saved: Path, tmp_path: Path, changes: Any, told: str) -> None:
    assert told in refusal(with_header(saved, tmp_path / "odd", **changes))


@pytest.mark.parametrize(
    ("path", "value", "told"),
    [
        (("tick",), -1, "tick -1"),
        (("tick",), 10.0, "tick is not of its type"),
        (("tick",), 10**12, "tick 1000000000000, which is beyond"),
        (("next_id",), 3, "array bottles.id holds"),
        (("line", "speeds"), [0.6], "line.speeds has the shape (1,), expected (4,)"),
        (("line", "speeds"), [math.nan] * 3, "line.speeds[0] is not finite"),
        (("line", "bad"), ["one"], "line.bad[0] is not of its type"),
        (("line", "pending"), [["plc", "plc", "test", "set", ["a"]]], "line.pending[0][5] is missing"),
        (("line", "read_back", "values"), ["a"], "line.read_back.values[0] is not of its type"),
        (("line", "read_back", "writers"), [], "line.read_back has another number of commands than the 4 of the scene"),
        (("line", "read_back", "since"), [0, 11, 0, 0], "line.read_back.since is not from 0 to 10"),
        (("line", "devices", "belts/feeder", "watchdog"), None, "watchdog has other entries than timeout_ticks"),
        (("line", "devices", "infeeds/packed", "due"), math.inf, "packed.due is not finite"),
        (("line", "devices", "infeeds/packed", "fed"), "two", "packed.fed is not of its type"),
        (("line", "devices", "infeeds/packed", "random", "state"), {}, "random: not the state of a random generator"),
        (("line", "devices", "nothing"), {}, "line.devices has other entries"),
        (("integration", "deepest"), math.nan, "integration.deepest is not finite"),
        (("integration", "events"), [[1]], "integration.events[0][1] is missing"),
    ],
)
def test_a_memory_that_is_no_memory_of_the_scene_is_refused(
    saved: Path, tmp_path: Path, path: tuple[str, ...], value: Any, told: str
) -> None:
    memory = contents(saved)[0]["memory"]
    place = memory
    for part in path[:-1]:
        place = place[part]
    place[path[-1]] = value
    assert told in refusal(with_header(saved, tmp_path / "odd", memory=memory))


CAPACITIES = {"near_segments.piece", "near_arcs.piece", "belts.candidate"}
"""Lists without springs, whose length is what room there is."""


def spoilt(name: str, array: Any) -> list[tuple[Any, str]]:
    """An array as it can't be, and why: cut short, not finite, pointing out of bounds."""
    wrong = [(array[:-1], "has the shape")] if array.size and name not in CAPACITIES else []
    if array.dtype.kind == "f" and array.size and not name.startswith((*UNCHECKED, *FIXED)):
        wrong += [(np.full_like(array, value), "is not finite") for value in (np.nan, np.inf)]
    if name in indices({name: array}) and array.size:
        wrong.append((np.full_like(array, np.iinfo(array.dtype).max), f"array {name} holds"))
    if name.startswith(FIXED):
        wrong.append((array + array.dtype.type(1), f"array {name} is not that of the scene"))
    return wrong


def test_arrays_that_can_not_be_are_refused(saved: Path, tmp_path: Path) -> None:
    """The kernels trust every length and every index: what is wrong in one would be read beyond the end of another."""
    arrays, state = contents(saved)[1], Simulation.load(saved)._state
    world, told = state.world, Counter[str]()
    for name, array in arrays.items():
        for wrong, reason in spoilt(name, array):
            with pytest.raises(ValueError, match=re.escape(reason)):
                state.restore({**arrays, name: wrong}, state.next_id, [])
            assert state.world is world
            told[reason.split()[-1]] += 1
    assert all(told[word] > 5 for word in ("shape", "finite", "holds", "scene"))
    for name in ("bottles.x", "pairs.i"):
        cut = with_arrays(saved, tmp_path / "wrong", **{name: arrays[name][:-1]})
        assert refusal(cut).startswith("is damaged or cut short (array ")


def test_bottles_that_can_not_be_are_refused(saved: Path, tmp_path: Path) -> None:
    _, arrays = contents(saved)
    twice, heavy = arrays["bottles.id"].copy(), arrays["bottles.weight"].copy()
    twice[:2] = 0
    heavy[0] *= 2.0
    assert "holds an id twice" in refusal(with_arrays(saved, tmp_path / "wrong", **{"bottles.id": twice}))
    assert "bottles.weight does not fit" in refusal(with_arrays(saved, tmp_path / "wrong", **{"bottles.weight": heavy}))


def test_every_index_is_known(saved: Path) -> None:
    """An array of whole numbers that is new must be given its range, or be named as one that indexes nothing."""
    others = (scene(**line()), queue(**SPRINGS_AND_RINGS), queue(**QUEUE))
    for sim in (Simulation.load(saved), *(Simulation(other) for other in others)):
        arrays = changing_arrays(sim._state.world)
        assert indices(arrays) == ranges(sim._state.world, sim.model, 1).keys() & arrays.keys()


def archive(*members: tuple[str, bytes], compression: int = zipfile.ZIP_STORED) -> bytes:
    """A .zip with a checksum that fits."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of names that are there twice
        for name, content in members:
            file.writestr(name, content)
        file.comment = b"sha256:" + b"0" * 64
    content = buffer.getvalue()[:-64]
    return content + hashlib.sha256(content).hexdigest().encode()


def npy(shape: str, data: bytes, kind: str = "<f8") -> bytes:
    """Return a .npy file with any header."""
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + data


@pytest.mark.parametrize(
    ("members", "told"),
    [
        ([("a.npy", npy("(10**12,)", b""))], "is damaged"),
        ([("a.npy", npy("(1000000000000,)", b""))], "an array of shape (1000000000000,) in 0 bytes"),
        ([("a.npy", npy("(-1,)", b"12345678"))], "an array of shape (-1,) in 8 bytes"),
        ([("a.npy", npy("(1,)", b"12345678", "|O"))], "an array of object, not of numbers"),
        ([("a.npy", npy("(1,)", b"12345678", "<U2"))], "an array of <U2, not of numbers"),
        ([("a.npy", b"\x93NUMPY\x09\x00")], "an array of another version"),
        ([("a.npy", b"")], "is damaged"),
        ([("a.npy", npy("(0,)", b"")), ("a.npy", npy("(0,)", b""))], "two arrays of one name"),
        ([("header.npy", npy("(2,)", b"[]", "|u1"))], "header.format is missing"),
        ([("header.npy", npy("(2,)", b"42", "|u1"))], "is damaged"),
        ([("header.npy", npy("(100000,)", b"[" * 100000, "|u1"))], "is damaged"),
        ([("header.npy", npy("(10000,)", b"9" * 10000, "|u1"))], "is damaged"),
    ],
)
def test_an_archive_that_somebody_made_up_is_refused(tmp_path: Path, members: Any, told: str) -> None:
    (tmp_path / "made up").write_bytes(archive(*members))
    assert told in refusal(tmp_path / "made up")


def test_an_archive_takes_no_more_memory_than_it_has_bytes(tmp_path: Path) -> None:
    packed = archive(("a.npy", npy("(10000000,)", bytes(80_000_000))), compression=zipfile.ZIP_DEFLATED)
    assert len(packed) < 100_000
    (tmp_path / "bomb").write_bytes(packed)
    assert "(it is compressed)" in refusal(tmp_path / "bomb")


def test_a_file_of_the_old_format_is_refused_in_one_sentence(saved: Path, tmp_path: Path) -> None:
    """It has no checksum."""
    header, arrays = contents(saved)
    text = np.frombuffer(json.dumps({**header, "format": 1}).encode(), np.uint8)
    with (tmp_path / "old").open("wb") as stream:
        np.savez(stream, header=text, **arrays)
    assert refusal(tmp_path / "old") == f"format 1 of checkpoints, expected {FORMAT}"


def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path, own_socket: Path) -> None:
    """The pipe has no writer, and the devices have no end."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "round").symlink_to(tmp_path / "round")
    (tmp_path / "to zero").symlink_to("/dev/zero")
    for path, told in (
        (tmp_path / "pipe", "is a named pipe, not a regular file, expected a checkpoint"),
        (Path("/dev/zero"), "is a device, not a regular file, expected a checkpoint"),
        (Path("/dev/tty"), "is a device, not a regular file, expected a checkpoint"),
        (tmp_path / "to zero", "is a device, not a regular file, expected a checkpoint"),
        (own_socket, "is a socket, not a regular file, expected a checkpoint"),
        (tmp_path / "round", "can't be read (Too many levels of symbolic links), expected a checkpoint"),
        (tmp_path / ("x" * 300), "can't be read (File name too long), expected a checkpoint"),
        (tmp_path / "a\0b", "can't be read (not a path), expected a checkpoint"),
    ):
        assert refusal(path) == told


def test_a_huge_file_is_refused_unread(tmp_path: Path) -> None:
    with (tmp_path / "huge").open("wb") as stream:
        stream.truncate(10**12)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert missing(refusal(tmp_path / "huge"), ["1000000 MB", "more than", "512 MB", "checkpoint"]) == []
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # kB


def test_a_path_can_not_leave_a_folder(saved: Path, tmp_path: Path) -> None:
    """By `..`, as an absolute path, by a link to a file or to a folder; links that stay in it are followed."""
    folder, outside = tmp_path / "folder", tmp_path / "outside"
    (folder / "inner").mkdir(parents=True)
    outside.mkdir()
    for place in (folder / "inner" / "file", outside / "file"):
        place.write_bytes(saved.read_bytes())
    (folder / "out").symlink_to(outside)
    (folder / "file out").symlink_to(outside / "file")
    (folder / "in").symlink_to(folder / "inner")
    for path in ("inner/file", "in/file", "inner/../in/file", folder / "inner" / "file"):
        assert Simulation.load(path, folder=folder).tick == 10
    sim = Simulation.load(saved)
    for path in ("../outside/file", "out/file", "file out", outside / "file", "inner/../../outside/file", "out/new"):
        with pytest.raises(CheckpointError) as caught:
            Simulation.load(path, folder=folder)
        if path != "out/new":
            assert str(caught.value).startswith(f"{path}: ")
            assert missing(str(caught.value), ["out of the folder", "checkpoint in", str(folder)]) == []
        if path != "file out":
            with pytest.raises(CheckpointError, match="leads out of the folder"):
                sim.save(path, folder)
    assert [file.name for file in outside.iterdir()] == ["file"]
    assert (outside / "file").read_bytes() == saved.read_bytes()
    sim.save("file out", folder)  # the link is replaced
    assert (folder / "file out").is_file()
    assert not (folder / "file out").is_symlink()
    assert (outside / "file").read_bytes() == saved.read_bytes()


def test_a_folder_is_made_for_the_first_file(saved: Path, tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    with pytest.raises(CheckpointError, match=stating("file", "no such file", "checkpoint in", str(folder))):
        Simulation.load("file", folder=folder)
    Simulation.load(saved).save("file", folder)
    assert Simulation.load("file", folder=folder).tick == 10


def test_only_a_regular_file_is_replaced(saved: Path, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert failure_to_save(Simulation.load(saved), tmp_path / "pipe").startswith("is a named pipe, not a regular file")
    assert (tmp_path / "pipe").is_fifo()
    assert [file.name for file in tmp_path.iterdir()] == ["pipe"]


def test_what_is_refused_changes_nothing(saved: Path, tmp_path: Path) -> None:
    """A run that is under way, and the random draws of one that is loaded afterwards."""
    sim, reference = Simulation.load(saved), Simulation.load(saved)
    memory = contents(saved)[0]["memory"]
    memory["integration"]["deepest"] = math.nan  # the last that is looked at before the arrays
    refusal(with_header(saved, tmp_path / "wrong", memory=memory))
    assert run(sim, 40) == run(reference, 40) == run(Simulation.load(saved), 40)


def test_what_is_no_checkpoint_is_refused(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("name: a scene\n")
    (tmp_path / "empty").write_bytes(b"")
    np.savez(tmp_path / "arrays.npz", x=np.zeros(3))
    for path, facts in (
        (tmp_path / "scene.yaml", ["not a checkpoint", "saved"]),
        (tmp_path / "empty", ["not a checkpoint", "saved"]),
        (tmp_path / "arrays.npz", [".npz without a header"]),
        (tmp_path / "nowhere", ["no such file"]),
        (tmp_path, ["is a folder"]),
        (tmp_path / "empty" / "file", ["can't be read", "Not a directory"]),
    ):
        assert missing(refusal(path), [*facts, "checkpoint"]) == []


@contextmanager
def without_privileges() -> Iterator[None]:
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
    text = failure_to_save(sim, tmp_path / "no" / "file")
    assert missing(text, ["can't be written", "No such file or directory", "folder", str(tmp_path / "no")]) == []
    assert missing(failure_to_save(sim, tmp_path), ["is a folder", "new name", "checkpoint", "room"]) == []
    locked.mkdir(mode=0o500)
    with without_privileges():
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
    assert missing(told, ["can't be written", "File too large", "new name", "checkpoint", "room"]) == []
    assert file.read_bytes() == whole
    assert [left.name for left in tmp_path.iterdir()] == ["checkpoint"]
