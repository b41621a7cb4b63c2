# SPDX-License-Identifier: Apache-2.0
"""Child process of `same_bits.py record`: simulates entries of the corpus with the checkout that PYTHONPATH names.

Reads a JSON object from stdin: source (folder of the checkout), out (folder to write to), entries (by name, as in
entries.yaml). Each entry becomes a folder with the recordings and hashes.json. The layout of the package may change, so
classes are looked up by name in the sources, and members of a simulation on it or one attribute below.
"""

from __future__ import annotations

import importlib
import json
import math
import re
import sys
from pathlib import Path
from typing import Any

CORPUS = Path(__file__).parent
HASH_INTERVAL = 0.25
"""s between two state hashes."""
OPERATIONS = ("acknowledge", "reset", "shelve", "unshelve", "remove_from_service", "return_to_service")
OPERATOR = "operator 1"


def class_named(source: Path, names: str, method: str) -> Any:
    """Return the class with one of these names (separated by `|`), in whose file a method of this name is defined."""
    head, body = re.compile(rf"^class ({names})\b", re.MULTILINE), re.compile(rf"^    def {method}\(", re.MULTILINE)
    texts = {file: file.read_text("utf-8") for file in (source / "conveyor_sim").rglob("*.py")}
    matches = {file: match for file, text in texts.items() if body.search(text) and (match := head.search(text))}
    if len(matches) != 1:
        raise LookupError(f"class {names}: {len(matches)} definitions in {source}, expected one")
    ((file, match),) = matches.items()
    return getattr(importlib.import_module(".".join(file.relative_to(source).with_suffix("").parts)), match[1])


def member(simulation: Any, name: str) -> Any:
    """Return a member of a simulation, or of one of the objects that it is divided into."""
    if hasattr(simulation, name):
        return getattr(simulation, name)
    parts = [getattr(simulation, part) for part in dir(simulation) if not part.startswith("_")]
    owners = [part for part in parts if hasattr(part, name) and type(part).__module__.startswith("conveyor_sim")]
    if not owners:
        raise LookupError(f"{name}: no such member of Simulation or of its parts")
    return getattr(owners[0], name)


Step = tuple[str, tuple[Any, ...]]
"""Method of a simulation, and its arguments; those of `give` are the fields of an Input."""


def exercises(image: Any, ticks: int) -> dict[int, list[Step]]:
    """Return inputs by tick: every command and fault with valid and refused values, and every operation."""
    plan: list[Step] = []
    for turn, share in enumerate((1.0, 0.0, 0.5, 0.75)):
        plan += _commands(image, share)
        plan += _faults(image, 1.0 - share)
        plan += _operations(image, turn)
    by_tick: dict[int, list[Step]] = {}
    for number, step in enumerate(plan):
        by_tick.setdefault(3 + number * max(1, ticks - 6) // len(plan), []).append(step)
    return by_tick


def _commands(image: Any, share: float) -> list[Step]:
    plan: list[Step] = []
    for number, command in enumerate(image.commands):
        name, low, high, kind = command.name, command.low, command.high, command.kind
        top = min(high, 1000.0)
        values = (
            [low + share * (top - low)]
            if kind in ("bool", "number")
            else [float(value) for value in range(int(top) + 1)]
        )
        plan += [("command", ((name,), (value,))) for value in values]
        if number % 5 == 3:
            plan.append(("command", ((name,), (high + 1e6,))))
            plan.append(("command", ((name, name), (values[0], values[0]))))
            plan.append(("command", ((name, "belts/nowhere/cmd_speed"), (values[0], 1.0))))
            plan.append(("command", ((name,), (math.nan,))))
    plan.append(("command", (("alarms/ours", "alarms/übel\n"), (1.0, float(share > 0.6)))))
    return plan


def _faults(image: Any, share: float) -> list[Step]:
    plan: list[Step] = []
    for number, fault in enumerate(image.faults):
        name, low, high = fault.name, fault.low, fault.high
        plan.append(("inject", (name, min(high, 2.0) if share else max(low, 0.0))))
        if number % 7 == 2:
            plan.append(("inject", (name, high + 1e6)))
            plan.append(("inject", ("zones/nowhere/offset", 1.0)))
    return plan


def _operations(image: Any, turn: int) -> list[Step]:
    """Return operations on alarms, signals, modes and the ownership of the line, by an operator and by others."""
    plan: list[Step] = [("operate", (operation, ids, ())) for ids in (("ours",), ()) for operation in OPERATIONS]
    plan.append(("operate", ("shelve", ("ours",), (0.5,))))
    plan += [("operate", ("reset_counters", (), ())), ("operate", ("unknown operation", ("ours",), (1.0,)))]
    engineer, other = ("operate", "engineer 1", "engineer"), ("commands", "controller 2", "controller")
    devices = [name.rsplit("/", 1)[0] for name in image.command_names]
    moving = [signal.name for signal in image.signals if signal.kind == "number"]
    declared = ("theirs", "ours")
    texts = ('{"text": "theirs", "alarm_class": "error", "latching": true}', '{"priority": 0}' if turn else "{}")
    plan += [
        ("give", (*engineer, "remove_from_service", ("ours",), (), ())),
        ("give", (*engineer, "return_to_service", ("ours",), (), ())),
        ("give", (*engineer, "force", tuple(moving[:2]), (0.25, 0.5)[: len(moving)], ())),
        ("give", (*engineer, "force", ("signals/nowhere",), (1.0,), ())),
        ("give", (*other, "declare", declared, (), texts)),
        ("give", (*other, "set", ("alarms/theirs",), (float(turn % 2),), ())),
        ("give", (*other, "own", (), (), ("*/nowhere",) if turn == 1 else ())),
    ]
    if devices:
        plan.append(("give", (*engineer, "mode", (devices[0],), (3.0,), ())))
        plan.append(("command", ((image.commands[0].name,), (image.commands[0].high,))))
        plan.append(("give", (*other, "set", (image.commands[-1].name,), (image.commands[-1].low,), ())))
        plan.append(("operate", ("mode", (devices[0],), (1.0,))))
        plan.append(("give", (*engineer, "mode", (devices[0],), (1.0,), ())))
    plan += [("give", (*other, "disown", (), (), ())), ("operate", ("unforce", (), ()))]
    plan.append(("give", (*engineer, "unforce", (), (), ())))
    return plan


class Entry:
    """One entry of the corpus: a simulation, its recordings and its hashes."""

    def __init__(self, source: Path, out: Path, entry: dict[str, Any]) -> None:
        self._source, self._out, self._entry = source, out, entry
        self._hashes: list[list[Any]] = []
        self._simulation_class = importlib.import_module("conveyor_sim.simulation").Simulation
        self._outputs = class_named(source, "OutputWriter|Outputs", "after_tick")
        self._recorder = class_named(source, "Recorder", "write")
        self._input = class_named(source, "Input", "by_line")
        self._error = importlib.import_module("conveyor_sim.errors").ConveyorError

    def run(self) -> None:
        """Simulate the entry, and the half after its checkpoint again."""
        load_scene = importlib.import_module("conveyor_sim.scene").load_scene
        path = self._entry["scene"]
        file = CORPUS / path.removeprefix("corpus/") if path.startswith("corpus/") else self._source / path
        scene = load_scene(file, {"duration": self._entry["seconds"]} | self._entry.get("overrides", {}))
        threads = self._entry.get("threads", 1)
        ticks = round(self._entry["seconds"] / scene.tick)
        self._out.mkdir(parents=True)
        simulation = self._simulation_class(scene, threads)
        inputs: dict[int, list[Step]] = {}
        if self._entry.get("exercise"):
            inputs = exercises(member(simulation, "process_image"), ticks)
        half = ticks // 2 if self._entry.get("checkpoint") else 0
        start = self._out / "half.npz"
        self._play(simulation, "bag", inputs, ticks, half, start)
        if half:
            self._play(self._simulation_class.load(start, threads), "continued", inputs, ticks)
            start.unlink()
        (self._out / "hashes.json").write_text(json.dumps(self._hashes, indent=0) + "\n")

    def _play(
        self, simulation: Any, name: str, inputs: dict[int, Any], ticks: int, half: int = 0, start: Path | None = None
    ) -> None:
        interval = max(1, round(HASH_INTERVAL / simulation.scene.tick))
        recorder = self._recorder(self._out / name, distro=self._entry.get("distro", "jazzy"))
        with recorder:
            outputs = self._outputs(simulation, [recorder], run_id="same bits")
            outputs.start()
            while simulation.tick < ticks:
                if half and simulation.tick == half:
                    member(simulation, "save")(start)
                for kind, arguments in inputs.get(simulation.tick, []):
                    if kind == "give":
                        member(simulation, kind)(self._input(*arguments))
                    else:
                        member(simulation, kind)(*arguments, **({"writer": OPERATOR} if kind == "operate" else {}))
                try:
                    simulation.advance()
                except self._error:
                    outputs.after_failure()
                    self._hash(name, simulation, "stopped")
                    return
                outputs.after_tick()
                if simulation.tick % interval == 0 or simulation.tick == ticks:
                    self._hash(name, simulation, "reached")

    def _hash(self, name: str, simulation: Any, state: str) -> None:
        hashes = f"{member(simulation, 'state_hash')():016x}", f"{member(simulation, 'full_state_hash')():016x}"
        self._hashes.append([name, simulation.tick, state, *hashes])


def main() -> None:
    """Simulate the entries."""
    request = json.load(sys.stdin)
    source = Path(request["source"])
    package = importlib.import_module("conveyor_sim")
    if Path(str(package.__file__)).resolve().parent.parent != source.resolve():
        raise SystemExit(f"conveyor_sim: imported from {package.__file__}, expected {source}")
    for name, entry in request["entries"].items():
        print(name, flush=True)
        Entry(source, Path(request["out"]) / name, entry).run()


if __name__ == "__main__":
    main()
