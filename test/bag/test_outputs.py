# SPDX-License-Identifier: Apache-2.0
"""Topics are written at their ticks, and only if a sink wants them."""

from collections.abc import Callable
from pathlib import Path

from bag.small_line import COMMANDS, SMALL_LINE, record

from conveyor_sim.bag.messages.encode import BOOL
from conveyor_sim.bag.messages.topics import OUTPUTS, photo_eye_topics
from conveyor_sim.bag.messages.typestore import typestore
from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.reader import open_bag
from conveyor_sim.scene import Scene, load_scene
from conveyor_sim.simulation import Simulation

SILENT = {"ledger", "guard", "damage", "rail_wear", "damage_events"}
"""Topics without messages in these runs, because their causes are absent."""


class Collector:
    """A sink that keeps what it is given."""

    def __init__(self, wanted: set[str]) -> None:
        self.wanted = wanted
        self.taken: list[tuple[str, bytes, int]] = []

    def wants(self, topic: str) -> bool:
        return topic in self.wanted

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        self.taken.append((topic, data, stamp_ns))


def run(scene: Scene, sinks: list[Collector], ticks: int) -> Simulation:
    """Runs a scene into sinks."""
    simulation = Simulation(scene)
    outputs = OutputWriter(simulation, sinks, run_id="run", frame_id="hall")
    outputs.start()
    for _ in range(ticks):
        for names, values in COMMANDS.get(simulation.tick, []):
            simulation.command(names, values)
        simulation.advance()
        outputs.after_tick()
    return simulation


def test_every_sink_gets_what_it_wants_and_the_same_bytes(scene: Scene) -> None:
    everything, some, nothing = Collector(set(OUTPUTS)), Collector({"poses", "outcomes"}), Collector(set())
    run(scene, [everything, some, nothing], 40)
    assert nothing.taken == []
    assert some.taken == [message for message in everything.taken if message[0] in some.wanted]


def test_rates_are_those_of_the_scene(scene: Scene) -> None:
    sink = Collector(set(OUTPUTS))
    run(scene, [sink], 40)
    counts = {name: sum(topic == name for topic, _, _ in sink.taken) for name in OUTPUTS}
    every_other_tick = 21  # 50 Hz, tick 0 included
    assert counts == {
        "line": 1,
        "readback": 3,
        "alarm_states": 1,
        "run_state": 0,
        "variables": 0,
        "plant": 1,
        "outcomes": 4,
        "bottles": every_other_tick,
        "poses": every_other_tick,
        "markers": every_other_tick,
        "contacts": every_other_tick,
        "belts": every_other_tick,
        "signals": 41,
        "counters": 1,
        "events": 6,
        **dict.fromkeys(SILENT, 0),
    }


def test_an_output_that_is_switched_off_is_not_written() -> None:
    scene = load_scene(SMALL_LINE, {"outputs": {"poses": 0, "contacts": 0}})
    sink = Collector(set(OUTPUTS))
    run(scene, [sink], 10)
    off = {"poses", "markers", "contacts", "run_state", "variables"}  # the caller of the simulation writes the last two
    assert {topic for topic, _, _ in sink.taken} == set(OUTPUTS) - SILENT - off


def test_stamps_are_simulated_time_above_zero_and_never_go_back(scene: Scene) -> None:
    sink = Collector(set(OUTPUTS))
    run(scene, [sink], 40)
    stamps = [stamp for _, _, stamp in sink.taken]
    assert stamps[0] == 1
    assert stamps == sorted(stamps)
    assert stamps[-1] == 400_000_000


def test_outcomes_are_returned_and_stamped_with_the_tick_that_applied_them(scene: Scene, bag: Path) -> None:
    simulation = Simulation(scene)
    outputs = OutputWriter(simulation, [], run_id="run")
    outputs.start()
    simulation.command(["belts/turn/cmd_speed"], [0.1])
    simulation.advance()
    assert [outcome.accepted for outcome in outputs.after_tick()] == [True]
    with open_bag(bag) as opened:
        found = [(f.tick, f.data.source, f.data.accepted) for f in opened.outcomes()]
    assert found == [
        (3, "commands", True),
        (20, "commands", True),
        (20, "commands", False),
        (35, "commands", False),
        (60, "watchdog", True),
    ]


def test_two_runs_give_the_same_bytes(scene: Scene, record_line: Callable[[str, int], Path], tmp_path: Path) -> None:
    """Line holds the name of its run, and the names are equal here, so all messages have the same bytes."""
    first, second = record_line("first", 60), tmp_path / "second"
    record(scene, second, 60)
    with open_bag(first) as one, open_bag(second) as two:
        assert list(one.raw()) == list(two.raw())


def test_watching_changes_nothing(scene: Scene) -> None:
    watched = run(scene, [Collector(set(OUTPUTS))], 80)
    alone = run(scene, [], 80)
    assert watched.full_state_hash() == alone.full_state_hash()


def test_a_photo_eye_is_told_at_the_start_and_when_it_changes_and_is_not_recorded() -> None:
    """One that the bottles there block and leave, one that stays free; `signals` tell the same."""
    eyes = {"busy": {"from": [0.75, 0.1], "to": [0.75, 0.3]}, "free": {"from": [0.0, 0.9], "to": [0.1, 0.9]}}
    scene = load_scene(SMALL_LINE, {"photo_eyes": eyes})
    topics = photo_eye_topics(eyes)
    assert [output.type for output in topics.values()] == [BOOL] * 2
    assert {output.qos.durability for output in topics.values()} == {"transient_local"}
    sink = Collector({*topics, "signals"})
    simulation = run(scene, [sink], 40)
    told: dict[str, list[tuple[int, bool]]] = {topic: [] for topic in topics}
    shown: dict[str, list[tuple[int, bool]]] = {topic: [] for topic in topics}
    for topic, data, stamp in sink.taken:
        if topic in topics:
            told[topic].append((stamp, typestore().deserialize_cdr(data, BOOL).data))
            continue
        values = dict(zip(simulation.process_image.signal_names, typestore().deserialize_cdr(
            data, "conveyor_msgs/msg/Signals").values, strict=True))  # fmt: skip
        for eye, seen in shown.items():
            level = bool(values[f"{eye}/blocked"])
            if not seen or seen[-1][1] is not level:
                seen.append((stamp, level))
    assert told == shown
    assert told["photo_eyes/free"] == [(1, False)]
    assert [level for _, level in told["photo_eyes/busy"]][:2] == [True, False]
    assert not set(topics) & set(OUTPUTS)
