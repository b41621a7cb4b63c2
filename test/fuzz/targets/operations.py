# SPDX-License-Identifier: Apache-2.0
"""All that acts on a line, at random: commands, faults, modes, owners, forces, alarms, resets, by all kinds of writers.

A line of stations is run recorded under the eyes of the invariants, again from a checkpoint half-way, and again from
its bag.
"""

from __future__ import annotations

import json
import math
import random
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from fuzz.device_invariants import DeviceWatch
from fuzz.panel_invariants import ExpectedPanel
from fuzz.play import check_sentence
from fuzz.violation import Violation

from conveyor_sim.bag.outputs import OutputWriter
from conveyor_sim.bag.recorder import Recorder
from conveyor_sim.bag.replay import replay
from conveyor_sim.columns.counters import CounterColumns
from conveyor_sim.columns.read_back import ReadBackColumns
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.line.commands.authority import MAY, PEOPLE
from conveyor_sim.line.commands.inputs import SET, WRITER_KINDS, CommandOutcome, Input
from conveyor_sim.line.machines.efficiency import CATEGORIES
from conveyor_sim.line.machines.packml import COMMAND_TEXTS, MODE_STATES, Command, PackMLState
from conveyor_sim.line.machines.stop_reason import BY_HAND, COMMANDED, WORKING
from conveyor_sim.scene import Scene, parse_scene
from conveyor_sim.scene.yaml_lines import Document
from conveyor_sim.simulation import Simulation

BASE = Path(__file__).parents[3] / "config" / "scenarios" / "two_stations.yaml"
KINDS = tuple(kind for kind in WRITER_KINDS if kind != "line")
WRITERS = ("", "plc", "plc", "other", "Jo", "\x1b[2J\n")
TEXTS = ("", "x", "machines/*", "belts/line", "*/line_1/*", "\n", "\u202e", "ü" * 300, "belts//cmd_speed", "%s{0}")
VALUES = (0.0, 1.0, 1.0, 2.0, 3.0, 8.0, 0.5, -1.0, 1e-9, 1e300, math.nan, math.inf, -math.inf)
VALUED = ("set", "inject", "mode", "force")
STOPS = (Command.STOP, Command.ABORT)
STOPPED = {
    Command.STOP: {
        PackMLState.STOPPING,
        PackMLState.STOPPED,
        PackMLState.ABORTING,
        PackMLState.ABORTED,
        PackMLState.CLEARING,
    },
    Command.ABORT: {PackMLState.ABORTING, PackMLState.ABORTED},
}
"""Where a machine is after what a person has stopped it with."""


class TrueLine(Simulation):
    """A line whose signals are true, also where they are forced: what the invariants look at."""

    def signals(self) -> F8:
        """Of what there is."""
        return self.line.signals().truth


def attack(seed: int, folder: Path) -> str:
    """One run; what most came of its inputs. Raises Violation."""
    rng = random.Random(seed)
    scene = drawn(rng)
    script = inputs_of(rng, scene, rng.choice([60, 200, 500]))
    half = rng.randrange(1, max(script) + 1)
    first = run(TrueLine(scene, threads=1), script, max(script) + 5, watched=True, bag=folder / "bag")
    second = run(Simulation(scene, threads=1), script, max(script) + 5, half, folder / "half")
    if first[0] != second[0]:
        raise Violation("checkpoint differs", f"from tick {half}: {first[0][-1]} is {second[0][-1]}")
    for one, other in zip(first[1], second[1], strict=True):
        if repr(one) != repr(other):
            raise Violation("checkpoint differs", f"from tick {half}: {one} is {other}")
    report = replay(folder / "bag")
    if report.difference is not None or not report.exact:
        raise Violation("bag differs", str(report.difference or report.environment))
    came = Counter(outcome.operation for outcome in first[1] if outcome.accepted)
    return max(sorted(came), key=came.__getitem__, default="nothing")


@cache
def _plain() -> str:
    return json.dumps(Document(BASE.read_text(encoding="utf-8"), BASE.name).data)


def drawn(rng: random.Random) -> Scene:
    """The line with what its machines can have, drawn; none of it calls for other kernels."""
    scene: dict[str, Any] = json.loads(_plain())
    scene |= {"seed": rng.randrange(1000), "outputs": {"signals": 100, "bottles": 10, "counters": 10}}
    scene["conveyors"]["line"] |= rng.choice([{}, {"watchdog": 0.1}])
    for machine in scene["machines"].values():
        if machine["kind"] in ("source", "sink", "station"):
            states = rng.sample(["starting", "stopping", "holding", "aborting", "resetting", "completing"], 2)
            machine |= {
                "suspend_after": rng.choice([0.0, 0.03, 2.0]),
                "ramp_up": rng.choice([0.0, 0.5]),
                "acting_times": {state: rng.choice([0.0, 0.01, 0.1]) for state in states},
                "rate": rng.choice([2.0, 20.0, 97.0]),
                "rate_limit": 100.0,
                "failures": {"jam": drawn_failure(rng)} if rng.random() < 0.5 else {},
                "planned_stops": {f"stop_{n}": drawn_stop(rng) for n in range(rng.choice([0, 0, 1, 3]))},
            }
            if machine["kind"] == "station":
                machine |= rng.choice([{}, {"capacity": 1 + rng.randrange(4)}])
            if machine["kind"] == "sink":
                machine |= {"run_down": rng.choice([0.0, 0.2])}
                machine.pop("start_fill", None)
                machine.pop("start_zone", None)
    table = {"tag": "zones/before_capper/bottles", "high": 2, "deadband": 1, "on_delay": rng.choice([0.0, 0.05])}
    lost = {"tag": "machines/capper/holds", "low": 0.5, "latching": True, "suppressed_by": ["full"]}
    scene["alarms"] = {"full": table, "lost": lost} if rng.random() < 0.7 else {}
    cuts = rng.choice([[], ["machines"], ["drives", "machines"]])
    stop = {"kind": "emergency_stop", "cuts": cuts} | ({"deceleration": 1.0} if "drives" in cuts else {})
    button = {"kind": "button", "bounce": rng.choice([0.0, 0.05])}
    scene["panel"] = {"stop": stop, "start": button, "lamp": {"kind": "lamp"}} if rng.random() < 0.7 else {}
    return parse_scene(json.dumps(scene), "scene.yaml")


def drawn_failure(rng: random.Random) -> dict[str, Any]:
    """Often, and short."""
    times = [
        {"kind": "exponential", "mean": 0.3},
        {"kind": "weibull", "mean": 0.2, "shape": 2.0},
        {"kind": "list", "times": [0.05, 0.4, 0.01]},
    ]
    return {"between": rng.choice(times), "repair": rng.choice(times), "counted": rng.choice(["running", "clock"])}


def drawn_stop(rng: random.Random) -> dict[str, Any]:
    """Such that several of a machine overlap."""
    duration = rng.choice([0.01, 0.3, 1.0])
    return {"start": rng.choice([0.0, 0.1, 0.5]), "duration": duration, "every": duration + rng.choice([0.01, 1.0])}


def inputs_of(rng: random.Random, scene: Scene, ticks: int) -> dict[int, list[Input]]:
    """Inputs by the tick after which they are given: bursts, and ticks without any."""
    names = Names(Simulation(scene, threads=1))
    script: dict[int, list[Input]] = {ticks: []}
    for _ in range(rng.choice([10, 40, 120])):
        burst = [names.drawn(rng) for _ in range(rng.choice([1, 1, 1, 2, 6]))]
        script.setdefault(rng.randrange(ticks), []).extend(burst)
    if rng.random() < 0.2:
        script.setdefault(rng.randrange(ticks), []).append(flood(rng))
    return script


def flood(rng: random.Random) -> Input:
    """Alarms that nobody has declared, often more than there can be; most of them do not hold."""
    names = tuple(f"alarms/{rng.choice('ab')}{number}" for number in range(rng.choice([900, 1500])))
    return Input("commands", "plc", "controller", "set", names, tuple(float(rng.random() < 0.1) for _ in names))


class Names:
    """What there is on a line to name, by operation."""

    def __init__(self, sim: Simulation) -> None:
        image = sim.process_image
        self._ranges = {tag.name: tag for tag in (*image.commands, *image.faults)}
        self._machines = [name for name in image.command_names if name.endswith("/cntrl_cmd")]
        devices = sorted({tag.device for tag in image.tags if tag.name.endswith("/mode")})
        alarms = [alarm.id for alarm in sim.line.alarms]
        said = ["alarms/plc one", "alarms/plc two", "alarms/full"]
        self._of: dict[str, tuple[str, ...]] = {
            "set": (*image.command_names, *self._machines * 3, *said),
            "inject": image.fault_names,
            "mode": tuple(devices),
            "own": (),
            "disown": (),
            "force": image.signal_names,
            "unforce": image.signal_names,
            "declare": ("plc one", "plc two", "full", "x" * 200),
            "reset_counters": (*devices, "line"),
        }
        self._alarms = (*alarms, "plc one", "plc two")

    def drawn(self, rng: random.Random) -> Input:
        """One input; mostly one that can be."""
        operation = rng.choice([*MAY, "set", "set", "set", "inject", "mode", "mode"])
        kinds = KINDS if rng.random() < 0.3 else MAY[operation].writers
        known = self._of.get(operation, self._alarms)
        names = tuple(rng.choice(known) for _ in range(rng.choice([0, 1, 1, 1, 1, 2]))) if known else ()
        values = tuple(self._value(rng, operation, name) for name in names)
        texts: tuple[str, ...] = ()
        if operation == "declare":
            values, texts = (), tuple(self._declaration(rng) for _ in names)
        elif operation == "own":
            texts = tuple(rng.sample(TEXTS[2:5], rng.randrange(3)))
        elif operation not in (*VALUED, "shelve") or (operation == "shelve" and rng.random() < 0.5):
            values = ()
        if rng.random() < 0.1:
            names = tuple(rng.choice([*TEXTS, "belts/nowhere/cmd_speed"]) for _ in range(rng.randrange(3)))
        if rng.random() < 0.05:
            values = tuple(rng.choice(VALUES) for _ in range(rng.randrange(4)))
        if rng.random() < 0.05:
            texts = tuple(rng.choice(TEXTS) for _ in range(rng.randrange(3)))
        wrong = rng.random() < 0.02
        source, writer = rng.choice(["commands", "operate"]), rng.choice(WRITERS)
        return Input(source, writer, "nobody" if wrong else rng.choice(kinds), operation, names, values, texts)

    def _value(self, rng: random.Random, operation: str, name: str) -> float:
        if rng.random() < 0.1:
            return rng.choice(VALUES)
        if operation == "mode":
            return float(rng.randint(1, 3))
        if operation == "shelve":
            return rng.choice([0.01, 0.2, 30.0])
        tag = self._ranges.get(name)
        if tag is None or tag.kind == "bool":
            return float(rng.randrange(2))
        if tag.kind == "enumeration":
            return float(rng.choice(list(COMMAND_TEXTS)))
        return rng.choice([tag.low, tag.high, float(rng.randint(math.ceil(tag.low), math.floor(tag.high)))])

    def _declaration(self, rng: random.Random) -> str:
        fields = {"text": rng.choice(TEXTS), "latching": rng.random() < 0.5, "on_delay": rng.choice([0.0, 0.03])}
        measured = {"tag": rng.choice(self._of["force"]), "high": rng.choice([0.0, 0.5])}
        odd = rng.choice(["", "[]", '{"text": 1}', '{"on_delay": 1e999}', "{" * 2000])
        return (
            odd if rng.random() < 0.1 else json.dumps(fields | rng.choice([{}, measured, {"suppressed_by": ["full"]}]))
        )


def run(
    sim: Simulation,
    script: dict[int, list[Input]],
    ticks: int,
    half: int = -1,
    place: Path | None = None,
    watched: bool = False,
    bag: Path | None = None,
) -> tuple[list[str], list[CommandOutcome]]:
    """What is to be the same however it is run, at its end and by the tick, and all outcomes. half: it goes on from a
    checkpoint of that tick, inputs that wait included. watched: under the eyes of the invariants.
    """
    recorder = None if bag is None else Recorder(bag)
    outputs = OutputWriter(sim, [] if recorder is None else [recorder], run_id="fuzz")
    outputs.start()
    watch = Watch(sim) if watched else None
    states, outcomes = [], []
    while sim.tick < ticks:
        given = script.get(sim.tick, [])
        expected = None if watch is None or not given else sim.line.refusal(given[0])
        for one in given:
            sim.give(one)
        if sim.tick == half and place is not None:
            sim.save(place)
            sim = Simulation.load(place, threads=1)
        sim.advance()
        made = sim.take_outcomes() if recorder is None else outputs.after_tick()
        outcomes += made
        if watch is not None:
            watch.after_tick(given, made, expected)
        states.append(_state(sim))
    if recorder is not None:
        recorder.close()
    return states, outcomes


def _state(sim: Simulation) -> str:
    """Bottles, what is read and what is true, alarms, counters, and what is commanded."""
    image, line = sim.line.signals(), sim.line
    read = image.values.tobytes().hex(), image.truth.tobytes().hex()
    alarms = [(alarm.id, alarm.state, alarm.shelved) for alarm in line.alarms]
    counters, read_back = _exact(line.counters()), _exact(line.read_back.columns())
    return repr((sim.full_state_hash(), read, alarms, counters, read_back, line.modes.modes, line.modes.owner))


def _exact(columns: CounterColumns | ReadBackColumns) -> list[Any]:
    """All columns with every digit, and none left out: NumPy's own words of an array are short, and slow to make."""
    return [value.tolist() if isinstance(value, np.ndarray) else value for value in vars(columns).values()]


class Watch:
    """What must hold after every tick. Raises Violation."""

    def __init__(self, sim: Simulation) -> None:
        self._sim = sim
        self._panel = ExpectedPanel(sim)
        self._devices = DeviceWatch(sim, self._panel)
        self._bottles = sim.bottles()
        self._machines = [
            name.removesuffix("/cntrl_cmd") for name in sim.process_image.command_names if name.endswith("/cntrl_cmd")
        ]
        self._states, self._modes = self._state_of_machines(), dict(sim.line.modes.modes)

    def after_tick(self, given: list[Input], outcomes: list[CommandOutcome], expected: str | None) -> None:
        """expected: why the first input was to be refused, as it was told before it was given."""
        now = self._sim.bottles()
        self._check_panel(outcomes)
        self._devices.check(self._bottles, now, outcomes)
        self._bottles = now
        self._answers(given, outcomes, expected)
        self._hands(given, outcomes)
        self._times()
        self._alarms()
        self._states, self._modes = self._state_of_machines(), dict(self._sim.line.modes.modes)

    def _check_panel(self, outcomes: list[CommandOutcome]) -> None:
        """The panel follows accepted inputs, also those beside refused commands for other devices."""
        for outcome in outcomes:
            if outcome.accepted and outcome.operation == SET:
                for name, value in zip(outcome.names, outcome.values, strict=True):
                    self._panel.take(name, value)
        self._panel.begin()
        self._panel.check(dict(zip(self._sim.process_image.signal_names, self._sim.signals().tolist(), strict=True)))

    def _answers(self, given: list[Input], outcomes: list[CommandOutcome], expected: str | None) -> None:
        """Each input has its outcome, or two where it was divided; who is refused is told why, in words."""
        answered = [outcome for outcome in outcomes if outcome.input.writer_kind != "line"]
        whole = [outcome for outcome in answered if not outcome.part]
        if len(whole) != len(given):
            raise Violation("no answer", f"{len(given)} inputs, {answered}")
        for outcome in answered:
            if outcome.accepted == bool(outcome.reason):
                raise Violation("no reason", str(outcome))
            if not outcome.accepted:
                check_sentence(f"inputs: {outcome.reason}")
                if not outcome.reason.isprintable():
                    raise Violation("words of a refusal", repr(outcome.reason))
        if expected is not None and (told := answered[0]) and not told.part and told.reason != expected:
            raise Violation("other answer", f"{given[0]}: {expected!r} was told, {told.reason!r} came")

    def _hands(self, given: list[Input], outcomes: list[CommandOutcome]) -> None:
        """Nobody commands without control, but people stop machines; modes change where machines stand."""
        if len(given) != 1 or not outcomes or not outcomes[-1].accepted:
            return  # what came of one of several is not known
        (one,), modes, now = given, self._sim.line.modes.modes, self._state_of_machines()
        for name, value in zip(one.names, one.values, strict=False):
            machine = name.removesuffix("/cntrl_cmd")
            changed = one.operation == "mode" and modes[name] != self._modes[name]
            if changed and self._states.get(name, PackMLState.STOPPED) not in MODE_STATES:
                raise Violation("mode", f"{name}: changed in state {self._states[name]}")
            stopped = one.operation == "set" and machine != name and value in STOPS and one.writer_kind in PEOPLE
            if stopped and now[machine] not in STOPPED[Command(int(value))]:
                raise Violation("stop", f"{machine}: state {now[machine]} after {value:g} of {one.writer_kind}")
            if stopped and self._states[machine] in WORKING and COMMANDED[value] + BY_HAND != self._reason(machine):
                raise Violation("stop reason", f"{machine}: {self._reason(machine)} after {value:g} by hand")

    def _times(self) -> None:
        """Where the time of each machine went adds up to the time since its reset."""
        counters = self._sim.line.counters()
        assert counters is not None
        for row, name in enumerate(counters.name):
            spent = sum(float(getattr(counters, category)[row]) for category in CATEGORIES)
            length = (self._sim.tick - int(counters.since[row])) * self._sim.scene.tick
            if name in self._states and not math.isclose(spent, length, abs_tol=1e-9):
                raise Violation("times", f"{name}: {spent} s of {length} s")

    def _alarms(self) -> None:
        """Counts and signals of alarms are those that stand."""
        truth = dict(zip(self._sim.process_image.signal_names, self._sim.signals().tolist(), strict=True))
        standing = {alarm.id for alarm in self._sim.line.alarms if alarm.stands}
        counted = sum(truth[f"alarm_counts/{name}"] for name in ("errors", "warnings", "messages"))
        shown = {name.removeprefix("alarms/") for name, value in truth.items() if name.startswith("alarms/") and value}
        if counted != len(standing) or not shown <= standing:
            raise Violation("alarms", f"{standing} stand, {counted} counted, {shown} shown")

    def _reason(self, machine: str) -> int:
        names, truth = self._sim.process_image.signal_names, self._sim.signals()
        return int(truth[names.index(f"{machine}/stop_reason")])

    def _state_of_machines(self) -> dict[str, int]:
        truth = dict(zip(self._sim.process_image.signal_names, self._sim.signals().tolist(), strict=True))
        return {name: int(truth[f"{name}/state"]) for name in self._machines}
