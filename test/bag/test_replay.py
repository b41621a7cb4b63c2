# SPDX-License-Identifier: Apache-2.0
"""Recorded lines run again to the same bits; where they do not, the first difference is found."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag.editing import edited
from bag.small_line import SMALL_LINE, record
from physics.test_force_limits import press
from rosbags.rosbag2 import StoragePlugin, Writer
from scenes import NO_OUTPUTS
from wheel_lines import POCKETS, RATE, star_line

from conveyor_sim.bag.messages.encode import Header
from conveyor_sim.bag.messages.topics import TOPICS
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.errors import BagError, SceneError
from conveyor_sim.line.devices.region import ZoneDevice
from conveyor_sim.line.run_state import STOPPED, RunState
from conveyor_sim.line.tag import count
from conveyor_sim.physics.model import build_model
from conveyor_sim.scene import load_scene, parse_scene
from conveyor_sim.scene.recorded import recorded_source


def test_recording_replays_bit_for_bit(bag: Path) -> None:
    told: list[float] = []
    report = replay(bag, lambda done, total: told.append(done / total))
    assert report.difference is None
    assert report.exact
    assert report.environment == ()
    assert (report.first_tick, report.last_tick) == (0, 100)
    assert report.compared == {
        "bottles": 51,
        "contacts": 51,
        "belts": 51,
        "signals": 101,
        "counters": 2,
        "events": 8,
        "outcomes": 5,
        "readback": 4,
        "alarm_states": 2,
    }
    assert told[-1] == pytest.approx(1.0)


def test_a_recorded_ledger_is_compared_too(tmp_path: Path) -> None:
    # A limit for the kernels of test_events.py.
    record(load_scene(SMALL_LINE, {"outputs": {"ledger": 20}, "limits": {"impact_speed": 0.2}}), tmp_path / "kept", 100)
    report = replay(tmp_path / "kept")
    assert report.difference is None
    assert report.compared["ledger"] == 21

    def change(name: str, message: Any) -> None:
        if name == "ledger" and message.tick == 50:
            message.damping = np.nextafter(message.damping, 1.0)

    difference = replay(edited(tmp_path / "kept", tmp_path / "changed", change)).difference
    assert difference is not None
    assert (difference.tick, difference.topic, difference.field) == (50, "ledger", "damping")


@pytest.mark.parametrize(
    ("topic", "field", "tick", "entry", "part"),
    [
        ("bottles", "vy", 42, 3, "bottle 3"),
        ("bottles", "x", 0, 1, "bottle 1"),
        ("signals", "values", 77, 0, "signal belts/straight/speed"),
        ("belts", "actual", 18, 1, "belt turn"),
        ("readback", "value", 21, 0, "command belts/straight/cmd_speed"),
        ("contacts", "tangential_force", 60, 0, None),
    ],
)
def test_one_flipped_bit_is_found(
    bag: Path, tmp_path: Path, topic: str, field: str, tick: int, entry: int, part: str | None
) -> None:
    def flip(name: str, message: Any) -> None:
        if name == topic and message.tick == tick:
            values = getattr(message, field).copy()
            values.view("u8")[entry] ^= 1
            setattr(message, field, values)

    difference = replay(edited(bag, tmp_path / "flipped", flip)).difference
    assert difference is not None
    assert (difference.tick, difference.topic, difference.field) == (tick, topic, field)
    assert difference.recorded != difference.replayed
    if part is not None:
        assert difference.part == part
    if topic == "bottles":
        assert difference.bottle == entry


def test_changed_command_is_found(bag: Path, tmp_path: Path) -> None:
    """The speed that was commanded is replayed, so what differs is the motion that follows."""

    def change(name: str, message: Any) -> None:
        if name == "outcomes" and message.tick == 3:
            message.values = message.values + 0.01

    difference = replay(edited(bag, tmp_path / "changed", change)).difference
    assert difference is not None
    assert difference.tick == 4


def test_what_the_run_was_doing_is_not_compared(bag: Path, tmp_path: Path) -> None:
    """The writer of a command is compared, because a replay repeats each input in the name of its writer."""
    folder = tmp_path / "told"
    with open_bag(bag) as opened, Recorder(folder) as recorder:
        run = TOPICS["run_state"].pack(RunState(STOPPED, "it was told so"), Header(0, 1, "hall"))
        for number, (topic, log_time, data) in enumerate(opened.raw()):
            recorder.write(topic, data, log_time)
            if number == 0:
                recorder.write("run_state", run, log_time)
    assert replay(folder).difference is None
    with open_bag(folder) as opened:
        assert [frame.data for frame in opened.read("run_state")] == [RunState(STOPPED, "it was told so")]

    def another(name: str, message: Any) -> None:
        if name == "readback":
            message.writers = ["somebody" if writer == "commands" else writer for writer in message.writers]

    difference = replay(edited(bag, tmp_path / "another", another)).difference
    assert difference is not None
    assert (difference.topic, difference.field, difference.recorded) == ("readback", "writers", "'somebody'")


def test_outcome_that_can_not_be_is_found(bag: Path, tmp_path: Path) -> None:
    def accept(name: str, message: Any) -> None:
        if name == "outcomes" and message.tick == 35:
            message.accepted = True

    difference = replay(edited(bag, tmp_path / "accepted", accept)).difference
    assert difference is not None
    assert (difference.tick, difference.topic, difference.field) == (35, "outcomes", "accepted")


def test_watchdog_is_compared_not_commanded(bag: Path, tmp_path: Path) -> None:
    def later(name: str, message: Any) -> None:
        if name == "outcomes" and message.source == "watchdog":
            message.tick += 1

    difference = replay(edited(bag, tmp_path / "later", later)).difference
    assert difference is not None
    assert (difference.tick, difference.field) == (60, "the number of outcomes")


def test_other_machine_is_named_and_compared_within_the_tolerance(bag: Path, tmp_path: Path) -> None:
    def elsewhere(name: str, message: Any) -> None:
        if name == "line":
            message.machine = "an abacus"
            message.versions = ["numba=0.1"]
        if name == "bottles":
            message.x = message.x + 1e-9

    report = replay(edited(bag, tmp_path / "elsewhere", elsewhere))
    assert not report.exact
    assert len(report.environment) == 2
    assert "an abacus recorded" in report.environment[1]
    assert report.difference is None
    assert "contacts" not in report.compared


def test_other_machine_that_went_another_way_is_found(bag: Path, tmp_path: Path) -> None:
    def elsewhere(name: str, message: Any) -> None:
        if name == "line":
            message.machine = "an abacus"
        if name == "bottles" and message.tick >= 50:
            message.y = message.y + 1e-3

    difference = replay(edited(bag, tmp_path / "elsewhere", elsewhere)).difference
    assert difference is not None
    assert (difference.tick, difference.field) == (50, "y")


def test_overrides_are_replayed_too(tmp_path: Path) -> None:
    folder = tmp_path / "faster"
    record(load_scene(SMALL_LINE, {"belts": {"straight": {"speed": 0.8}}, "seed": 3}), folder, 30)
    report = replay(folder)
    assert report.difference is None
    assert report.last_tick == 30


def test_a_table_is_replayed_without_its_file(tmp_path: Path) -> None:
    """The recording holds its points."""
    text = SMALL_LINE.read_text(encoding="utf-8")
    assert text.count("stiffness: 5000") == 1
    (tmp_path / "line.yaml").write_text(text.replace("stiffness: 5000", "table: glass.csv"), encoding="utf-8")
    (tmp_path / "glass.csv").write_text("overlap,force\n1e-3,5\n4e-3,30\n", encoding="utf-8")
    record(load_scene(tmp_path / "line.yaml"), tmp_path / "tabled", ticks=20)
    (tmp_path / "glass.csv").unlink()
    report = replay(tmp_path / "tabled")
    assert report.difference is None
    assert report.last_tick == 20


def stock(bag: Path, folder: Path, messages: Iterator[tuple[str, int, bytes]]) -> Path:
    """Write the topics of a node in the namespace /hall as stock rosbag2 does, stamped with wall time."""
    store = typestore()
    with open_bag(bag) as opened, Writer(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connections = {
            topic: writer.add_connection(f"/hall/{topic}", kind, typestore=store)
            for topic, kind in opened.types.items()
        }
        for number, (topic, _, data) in enumerate(messages):
            writer.write(connections[topic], 1_700_000_000_000_000_000 + number * 1_000_000, data)
    return folder


def test_stock_recording_replays(bag: Path, tmp_path: Path) -> None:
    """Another storage, other log times, a namespace, topics in another order, and messages lost on the way."""
    with open_bag(bag) as opened:
        messages = [message for message in opened.raw() if message[0] not in ("markers", "plant")]
    lost = [message for number, message in enumerate(messages) if message[0] in ("line", "outcomes") or number % 7]
    shuffled = sorted(lost, key=lambda message: (message[1] // 100_000_000, message[0]))
    report = replay(stock(bag, tmp_path / "stock", iter(shuffled)))
    assert report.difference is None
    assert report.exact
    assert report.last_tick == 100
    assert report.compared["outcomes"] == 5


def test_stock_recording_across_a_reset_replays_its_first_run(bag: Path, tmp_path: Path) -> None:
    with open_bag(bag) as opened:
        messages = list(opened.raw())
    report = replay(stock(bag, tmp_path / "stock", iter(messages + messages)))
    assert report.difference is None
    assert report.compared["signals"] == 101


def test_commands_after_a_reset_are_not_those_of_the_first_run(
    bag: Path, record_line: Callable[[str, int], Path], tmp_path: Path
) -> None:
    """The first run ends at tick 10 with one command; those of the second, at ticks 3, 20 and 35, are not its own."""
    with open_bag(record_line("short", 10)) as first, open_bag(bag) as second:
        messages = [*first.raw(), *second.raw()]
    report = replay(stock(bag, tmp_path / "stock", iter(messages)))
    assert report.difference is None
    assert (report.last_tick, report.compared["outcomes"]) == (10, 1)


def test_stock_recording_that_began_late_replays_what_it_has(bag: Path, tmp_path: Path) -> None:
    with open_bag(bag) as opened:
        messages = [m for m in opened.raw() if m[1] > 400_000_000 or m[0] in ("line", "outcomes")]
    report = replay(stock(bag, tmp_path / "stock", iter(messages)))
    assert report.difference is None
    assert report.first_tick == 41


def test_a_recording_replays_in_the_steps_and_the_integrator_that_it_ran_in(tmp_path: Path) -> None:
    """The scene of the bag states neither, as of a version that chose others; the replay is exact all the same."""
    ran = {"accuracy": {"integrator": "velocity_verlet", "per_tick": 73}}
    record(load_scene(SMALL_LINE, ran), tmp_path / "ran", 60)

    def forget(name: str, message: Any) -> None:
        if name == "line":
            message.scene_text, message.overrides = recorded_source(load_scene(SMALL_LINE))

    forgetful = edited(tmp_path / "ran", tmp_path / "forgetful", forget)
    with open_bag(forgetful) as opened:
        chosen = build_model(parse_scene(opened.line.scene_text))
    assert (chosen.integrator, chosen.steps_per_tick) != ("velocity_verlet", 73)
    report = replay(forgetful)
    assert report.difference is None
    assert report.exact and report.environment == ()


def test_a_recording_of_more_steps_than_this_version_takes_is_refused(bag: Path, tmp_path: Path) -> None:
    def many(name: str, message: Any) -> None:
        if name == "line":
            message.steps_per_tick = 3_500_000

    with pytest.raises(SceneError, match=r"is refused by this version:\n.*accuracy.per_tick: 3500000 given"):
        replay(edited(bag, tmp_path / "many", many))


def test_effects_that_were_not_recorded_are_said(bag: Path, tmp_path: Path) -> None:
    """Such as those of another default: replayed, and compared within the tolerance."""

    def more(name: str, message: Any) -> None:
        if name == "line":
            message.effects = [*message.effects, "unheard_of"]

    (told,) = replay(edited(bag, tmp_path / "more", more)).environment
    assert told.startswith("effects: ") and "unheard_of recorded, " in told


def test_scene_that_is_refused_today_is_said(bag: Path, tmp_path: Path) -> None:
    def spoil(name: str, message: Any) -> None:
        if name == "line":
            message.scene_text = message.scene_text.replace('"radius": 0.03', '"radius": -0.03')

    with pytest.raises(SceneError, match=r"the recorded scene is refused by this version:\n.*radius"):
        replay(edited(bag, tmp_path / "spoilt", spoil))


def test_bag_without_states_is_refused(bag: Path, tmp_path: Path) -> None:
    with open_bag(bag) as opened:
        messages = [message for message in opened.raw() if message[0] == "line"]
    with pytest.raises(BagError, match="nothing can be compared"):
        replay(stock(bag, tmp_path / "stock", iter(messages)))


def held_up(folder: Path) -> Path:
    """A recording of a pusher that presses a bottle against a wall, is jammed, and comes home again."""
    sim = press(damping=5.0, outputs={**NO_OUTPUTS, "signals": 100, "ledger": 100})
    inputs = {2: "push", 30: "jammed", 45: "jammed", 70: "push"}
    with Recorder(folder) as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run", frame_id="hall")
        outputs.start()
        while sim.tick < 90:
            name = inputs.get(sim.tick)
            if name == "push":
                sim.command(["pushers/p/push"], [float(sim.tick < 50)])
            elif name is not None:
                sim.inject("pushers/p/jammed", float(sim.tick < 40))
            sim.advance()
            outputs.after_tick()
    return folder


def test_a_pusher_that_is_held_up_replays_bit_for_bit(tmp_path: Path) -> None:
    """Its place, its signals and its work."""
    bag = held_up(tmp_path / "pusher")
    with open_bag(bag) as opened:
        column = opened.line.signal_names.index("pushers/p/blocked")
        assert {float(frame.data[column]) for frame in opened.signals()} == {0.0, 1.0}
    report = replay(bag)
    assert (report.difference, report.exact) == (None, True)
    assert report.compared["signals"] == report.compared["ledger"] == 91

    def before(name: str, message: Any) -> None:
        if name == "line":
            at = message.signal_names.index("pushers/p/blocked")
            del message.signal_names[at]

    expected = (
        r"recorded when pushers/p pushed with unlimited force, expected a recording with the signal pushers/p/blocked"
    )
    with pytest.raises(BagError, match=expected):
        replay(edited(bag, tmp_path / "before", before))


AXIS_COMMANDS = {
    5: ("star/phase_shift", 0.02), 40: ("star/phase_shift", 0.0), 60: ("star/gear_out", 1.0),
    80: ("block/rate", 0.5 * RATE), 90: ("star/jog_forward", 1.0), 120: ("star/jog_forward", 0.0),
    121: ("star/jog_backward", 1.0), 150: ("star/jog_backward", 0.0), 170: ("star/gear_in", 1.0),
    230: ("star/jammed", 1.0), 234: ("star/jammed", 0.0),
}  # fmt: skip
"""Inputs of the axes of a star wheel by tick."""


def test_commands_of_axes_replay_bit_for_bit(tmp_path: Path) -> None:
    """A wheel that carries a bottle is shifted, geared out, jogged both ways, geared in, and jammed for a moment."""
    limits = {"acceleration": 20.0, "jog_speed": 1.0, "following_limit": "none"}
    star = {"master": "block", "ratio": f"1/{POCKETS}", **limits}
    sim = star_line(
        axes={"block": {"rate": RATE, **limits}, "star": star},
        outputs={**NO_OUTPUTS, "signals": 100, "bottles": 100, "ledger": 100},
    )
    with Recorder(tmp_path / "wheel") as recorder:
        outputs = OutputWriter(sim, [recorder], run_id="run", frame_id="hall")
        outputs.start()
        while sim.tick < 300:
            name, value = AXIS_COMMANDS.get(sim.tick, ("", 0.0))
            if name.endswith("jammed"):
                sim.inject(f"axes/{name}", value)
            elif name:
                sim.command([f"axes/{name}"], [value])
            sim.advance()
            outputs.after_tick()
    with open_bag(tmp_path / "wheel") as opened:
        names = opened.line.signal_names
        places = [names.index(f"axes/star/{name}") for name in ("speed", "in_gear", "following_error")]
        speed, in_gear, error = np.array([[frame.data[place] for place in places] for frame in opened.signals()]).T
        outcomes = [frame.data.accepted for frame in opened.outcomes()]
    assert speed.min() == -1.0 and speed.max() > 1.0 and error.max() > 0.05
    assert in_gear[0] == in_gear[-1] == 1.0 and in_gear[180] == 0.0
    assert outcomes == [True] * len(AXIS_COMMANDS)
    report = replay(tmp_path / "wheel")
    assert (report.difference, report.exact) == (None, True)
    assert report.compared["signals"] == report.compared["bottles"] == report.compared["ledger"] == 301


OLD = Path(__file__).parent / "old"
"""Bags that earlier versions recorded."""


def test_a_bag_from_before_tags_still_replays() -> None:
    """Its outcomes say neither who gave an input nor what was done: their sources do."""
    report = replay(OLD / "before_tags.mcap")
    assert report.difference is None and not report.exact
    assert (report.compared["outcomes"], report.compared["signals"], report.last_tick) == (4, 13, 60)
    with open_bag(OLD / "before_tags.mcap") as bag:
        given = [(frame.data.writer, frame.data.writer_kind, frame.data.operation) for frame in bag.outcomes()]
    assert given == [
        ("commands", "controller", "set"),
        ("fault", "test", "inject"),
        ("lockstep", "controller", "set"),
        ("watchdog", "line", "set"),
    ]


def test_signals_are_compared_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """So a version that has more of them replays a bag as well; one that lacks some says so."""
    take_tags, values = ZoneDevice._take_tags, ZoneDevice.values
    more = count("zones/end/more", "counter", "More.")
    with monkeypatch.context() as patch:
        patch.setattr(ZoneDevice, "_take_tags", lambda self, tags: take_tags(self, [more, *tags]))
        patch.setattr(ZoneDevice, "values", lambda self, now: (-1.0, *values(self, now)))
        patch.setattr(ZoneDevice, "classify", lambda self, kind: None)  # which would take its tags again
        report = replay(OLD / "before_tags.mcap")
        assert report.difference is None and report.compared["signals"] == 13
        patch.setattr(ZoneDevice, "values", lambda self, now: (-1.0, *(value + 1.0 for value in values(self, now))))
        found = replay(OLD / "before_tags.mcap").difference
        assert found is not None and found.part == "signal zones/end/bottles"
    monkeypatch.setattr(
        ZoneDevice, "_take_tags", lambda self, tags: take_tags(self, [tag for tag in tags if tag.name[-1] != "l"])
    )
    monkeypatch.setattr(ZoneDevice, "values", lambda self, now: values(self, now)[:2])
    with pytest.raises(BagError, match="holds the signal zones/end/full, expected those that this version has"):
        replay(OLD / "before_tags.mcap")
