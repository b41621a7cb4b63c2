# SPDX-License-Identifier: Apache-2.0
"""Bottles that inputs put on a line and remove: the same bits as bottles of the scene, or one reason for a refusal."""

import math
from collections.abc import Sequence
from pathlib import Path

import pytest
from facts import missing
from scenes import NO_OUTPUTS

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.line.commands.inputs import DELETE, SPAWN, CommandOutcome, Input
from conveyor_sim.scene import Scene, load_scene, parse_scene
from conveyor_sim.simulation import Simulation
from conveyor_sim.support.resources import scene_path

SMALL_LINE = Path(__file__).parents[2] / "ros" / "small_line.yaml"
STEPS = {"accuracy": {"per_tick": 200}}
"""Fixed steps: those that the scene needs follow from the number of bottles."""
FREE = (1.2, 0.1)
"""m, on the feeder, where no bottle is at the start."""


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(SMALL_LINE, STEPS)


def spawn(kinds: Sequence[str], values: Sequence[float], texts: Sequence[str] = ()) -> Input:
    return Input("test", "test", "test", SPAWN, tuple(kinds), tuple(values), tuple(texts))


def at(x: float, y: float, theta: float = 0.0, vx: float = 0.0, vy: float = 0.0, omega: float = 0.0) -> list[float]:
    return [x, y, theta, vx, vy, omega]


def delete(*bottles: float) -> Input:
    return Input("test", "test", "test", DELETE, (), bottles)


def results(simulation: Simulation, *requests: Input) -> list[CommandOutcome]:
    """Results of inputs of one tick."""
    for request in requests:
        simulation.give(request)
    simulation.advance()
    return simulation.take_outcomes()


def test_a_bottle_is_put_on_the_line_with_the_next_id(scene: Scene) -> None:
    simulation = Simulation(scene)
    simulation.advance(10)
    new = int(simulation.bottles().id.max()) + 1
    simulation.spawn("bottle", *FREE, vx=0.25, writer="ann")
    simulation.advance()
    (result,) = simulation.take_outcomes()
    assert (result.accepted, result.reason, result.bottles) == (True, "", (new,))
    bottles = simulation.bottles()
    place = bottles.id.tolist().index(new)
    assert (bottles.x[place], bottles.y[place]) == pytest.approx(FREE, abs=0.01)
    events = [event for event in simulation.line.happened if event.kind == "bottle_spawned"]
    assert [(event.at, event.name, event.bottle, event.text) for event in events] == [(10, "ann", new, "bottle")]
    simulation.advance(50)
    assert simulation.bottles().id.tolist().count(new) == 1


def test_spawned_bottles_move_as_bottles_of_the_scene_to_the_bit() -> None:
    source = SMALL_LINE.read_text().split("infeeds:")[0]  # whose bottles would have other ids
    first = "bottles:\n  - {grid: {type: bottle, origin: [2.9, -0.2], rows: 3, columns: 3, pitch: 0.131}}\n"
    more = "  - {type: bottle, position: [1.2, 0.1], velocity: [0.25, 0]}\n  - {type: bottle, position: [1.0, 0.1]}\n"
    whole, part = (Simulation(parse_scene(source + first + rest, "line", STEPS)) for rest in (more, ""))
    (result,) = results(part, spawn(["bottle"] * 2, [*at(*FREE, vx=0.25), *at(1.0, 0.1)]))
    assert result.bottles == (9, 10)
    whole.advance(1)
    for ticks in (0, 150):
        whole.advance(ticks)
        part.advance(ticks)
        assert part.state_hash() == whole.state_hash()


def test_a_deleted_bottle_leaves_without_a_trace(scene: Scene) -> None:
    """Its neighbours move as if it had never been spawned, but later bottles have later ids."""
    one, other = Simulation(scene), Simulation(scene)
    other.spawn("bottle", *FREE)
    other.delete(10)
    for simulation in (one, other):
        simulation.advance(30)
    assert [result.accepted for result in other.take_outcomes()] == [True, True]
    assert [event.kind for event in other.line.happened] == [event.kind for event in one.line.happened]
    assert other.bottles().x.tolist() == one.bottles().x.tolist()
    assert other.bottles().id.max() == one.bottles().id.max() + 1


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        (spawn(["cup"], at(*FREE)), ["cup", "no such bottle type", "bottle"]),
        (spawn(["bottle"], at(1.2, 5.0)), ["(1.2, 5)", "on no belt"]),
        (spawn(["bottle"], at(2.9, -0.2)), ["(2.9, -0.2)", "overlaps bottle 0"]),
        (spawn(["bottle"], at(3.39, 0.4)), ["overlaps rail wall"]),
        (spawn(["bottle"] * 2, [*at(*FREE), *at(1.25, 0.1)]), ["(1.25, 0.1)", "overlaps bottle 10"]),
        (spawn(["bottle"], at(*FREE, vx=2.0)), ["2 m/s", "at most 0.5 m/s"]),
        (spawn(["bottle"], at(*FREE, omega=1e9)), ["1e+09 rad/s", "at most 0.5 m/s"]),
        (spawn(["bottle"], at(*FREE, theta=7.0)), ["theta 7 rad", "full turn"]),
        (spawn(["bottle"], at(math.nan, 0.1)), ["x nan", "finite"]),
        (spawn(["bottle"], at(1e300, 0.1)), ["on no belt"]),
        (spawn(["bottle"], at(0.5, 0.1, vy=-math.inf)), ["vy -inf", "finite"]),
        (spawn([], []), ["0 names and 0 values", "x, y, theta"]),
        (spawn(["bottle"], [1.2, 0.1]), ["1 names and 2 values"]),
        (spawn(["bottle"], at(*FREE), ["name"]), ["1 texts", "none"]),
        (delete(99), ["99", "no such bottle"]),
        (delete(0.5), ["0.5", "no such bottle"]),
        (delete(math.nan), ["nan", "no such bottle"]),
        (delete(1e300), ["1e+300", "no such bottle"]),
        (delete(-1), ["-1", "no such bottle"]),
        (delete(1, 1), ["twice"]),
        (delete(), ["0 values", "IDs"]),
        (delete(0)._replace(names=("0",)), ["1 names", "IDs"]),
    ],
)
def test_a_refused_input_changes_nothing(scene: Scene, request_: Input, reason: list[str]) -> None:
    simulation, untouched = Simulation(scene), Simulation(scene)
    before = simulation.line.refusal(request_)
    (result,) = results(simulation, request_)
    assert (result.accepted, result.bottles) == (False, ())
    assert result.reason == before  # refused between ticks by the same check
    assert missing(result.reason, reason) == []
    untouched.advance()
    assert simulation.state_hash() == untouched.state_hash()


def test_inputs_of_one_tick_are_checked_in_their_order(scene: Scene) -> None:
    simulation = Simulation(scene)
    requests = [
        spawn(["bottle"], at(*FREE)),
        spawn(["bottle"], at(*FREE)),  # the first is there
        delete(10),
        spawn(["bottle"], at(*FREE)),
        delete(11),
        delete(10),  # has gone already
    ]
    reasons = []
    for request in requests:
        reasons.append(simulation.line.refusal(request))
        simulation.give(request)
    assert [bool(reason) for reason in reasons] == [False, True, False, False, False, True]
    later = simulation.line.placement.later()
    assert (later.next_id, dict(later.spawned), set(later.deleted)) == (12, {}, set())
    simulation.advance()
    taken = simulation.take_outcomes()
    assert [result.reason for result in taken] == reasons
    assert [result.bottles for result in taken] == [(10,), (), (), (11,), (), ()]


def test_a_single_bottle_gets_no_second_one() -> None:
    """Its model has no contact between bottles."""
    source = SMALL_LINE.read_text().split("infeeds:")[0]
    alone = Simulation(parse_scene(source + "bottles:\n  - {type: bottle, position: [0.5, 0.1]}\n", "alone", STEPS))
    (refused,) = results(alone, spawn(["bottle"], at(*FREE)))
    assert missing(refused.reason, ["single bottle", "contact"]) == []
    removed, added = results(alone, delete(0), spawn(["bottle"], at(*FREE)))
    assert (removed.accepted, added.accepted, added.bottles) == (True, True, (1,))


def test_a_scene_without_belts_takes_bottles_among_its_own() -> None:
    simulation = Simulation(load_scene(scene_path("two_bottles")))
    added, beyond = results(simulation, spawn(["soft"], at(0.0, 0.0)), spawn(["soft"], at(0.0, 5.0)))
    assert added.accepted
    assert missing(beyond.reason, ["(0, 5)", "outside of the scene"]) == []


def test_the_energy_of_bottles_is_booked_as_fed_and_removed() -> None:
    simulation = Simulation(load_scene(SMALL_LINE, {**STEPS, "effects": {"energy_ledger": "on"}}))
    before = simulation.ledger()
    results(simulation, spawn(["bottle"], at(*FREE, vx=0.5)))
    simulation.advance(20)
    results(simulation, delete(10))
    after = simulation.ledger()
    assert before is not None and after is not None
    assert abs(after.residual) < 1e-6
    assert after.removed > 0.0


def test_many_bottles_grow_the_state_and_wait_in_one_queue(scene: Scene) -> None:
    """Each is checked against all that wait; the slots of the state are enlarged."""
    simulation = Simulation(scene)
    places = [(1.6 + 0.131 * column, -0.22 + 0.131 * row) for row in range(5) for column in range(9)]
    for place in places:
        request = spawn(["bottle"], at(*place))
        assert simulation.line.refusal(request) == ""
        simulation.give(request)
    simulation.advance()
    assert all(result.accepted for result in simulation.take_outcomes())
    present = simulation.bottles().id.size
    for _ in range(100):
        simulation.advance()
    assert simulation.bottles().id.size >= present > len(places)


def test_a_checkpoint_holds_inputs_that_wait_and_the_bits_go_on(scene: Scene, tmp_path: Path) -> None:
    simulation = Simulation(scene)
    simulation.advance(5)
    simulation.spawn("bottle", *FREE)
    simulation.delete(0)
    simulation.save(tmp_path / "a.npz")
    again = Simulation.load(tmp_path / "a.npz")
    for run in (simulation, again):
        run.advance(40)
    assert again.full_state_hash() == simulation.full_state_hash()
    assert 0 not in again.bottles().id


def test_a_recording_replays_the_inputs(tmp_path: Path) -> None:
    simulation = Simulation(load_scene(SMALL_LINE, {**STEPS, "outputs": {**NO_OUTPUTS, "bottles": 100}}))
    inputs = {
        3: [spawn(["bottle"], at(*FREE, vx=0.1)), spawn(["bottle"], at(*FREE))],
        20: [delete(0, 1)],
        21: [spawn(["cup"], at(0, 0)), delete(77)],
    }
    with Recorder(tmp_path / "bag") as recorder:
        outputs = OutputWriter(simulation, [recorder], run_id="run", frame_id="world")
        outputs.start()
        while simulation.tick < 60:
            for request in inputs.get(simulation.tick, []):
                simulation.give(request)
            simulation.advance()
            outputs.after_tick()
    report = replay(tmp_path / "bag")
    assert (report.exact, report.difference) == (True, None)
    assert report.compared["outcomes"] == 5
    assert report.compared["events"] > 3
    assert report.last_tick == 60
