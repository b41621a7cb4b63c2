# SPDX-License-Identifier: Apache-2.0
"""Streams of commands and requests, good and bad, over real DDS against a `sim_node` of its own."""

from __future__ import annotations

import atexit
import math
import os
import random
import shutil
import signal
import struct
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from functools import cache
from pathlib import Path
from typing import Any

from conveyor_msgs import srv
from conveyor_msgs.msg import Commands
from ctrl_c import restore_for_children
from fuzz.invariants import Violation
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import serialize_message
from ros.line_client import LineClient
from simulation_interfaces import srv as standard_srv
from simulation_interfaces.msg import SimulationState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from conveyor_sim.bag.replay import replay
from conveyor_sim.line.commands.authority import MAY
from conveyor_sim.ros.child import Child
from conveyor_sim.ros.domain import in_environment, own_domain

SMALL_LINE = Path(__file__).parents[2] / "ros" / "small_line.yaml"
FEEDER, TABLE, EYE = "belts/feeder/cmd_speed", "belts/table/cmd_speed", "photo_eyes/entry/stuck_on"
SPEEDS = {FEEDER: (0.5, 0.0, 1.0), TABLE: (0.2, -0.5, 0.5)}
"""At the start, least and greatest, m/s."""

PATIENCE = 60.0  # s of wall time for any answer, on a busy machine
MEMORY = 1e9  # bytes beyond what the node had at its start; DDS keeps a hundred messages for each topic
LATE = 4  # cases: so much later a message may still arrive on a busy machine, behind floods
LIFE = 150  # cases of one node; then it is ended and looked at, and another is started
ACCOUNT = 10  # cases between two looks at the counts, which are told once a second

VALUES = (0.0, -0.0, 0.25, 0.5, -0.5, 1.0, math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324, 1e-320, 1.0000001)
TEXTS = ("", "x", "\n", "\r\n[ERROR] forged", "\x1b[2J", "\u202e", "ü" * 300, "belts//cmd_speed", "a b", "%s%n{0}", "'")
NAMES = (FEEDER, TABLE, FEEDER, TABLE, "belts/nowhere/cmd_speed", EYE, *TEXTS)


@cache
def _station() -> Station:
    station = Station()
    atexit.register(station.close)
    return station


def attack(seed: int, folder: Path) -> str:
    """One stream in a run of its own, which is replayed afterwards; what came of it. Raises Violation."""
    return _station().play(random.Random(seed), folder)


def finish() -> None:
    """End the node as Ctrl-C does, and look at the start of the next one: a flood, and a late request.

    Raises Violation.
    """
    station = _station()
    station.renew()
    for _ in range(3000):
        station.publish("commands", Commands(names=["nowhere"], values=[0.0]))
    station.require_account()
    station.ask(standard_srv.StepSimulation, "step_simulation", wait=False, steps=99_000)  # as if it came after a reset
    station.settle()


class Station:
    """A node under attack, and a participant that attacks it."""

    def __init__(self) -> None:
        self._open = ExitStack()
        self._folder = Path(self._open.enter_context(tempfile.TemporaryDirectory(prefix="conveyor_sim_fuzz_")))
        self._environment = self._open.enter_context(own_domain()) | {"ROS_LOG_DIR": str(self._folder / "ros")}
        with in_environment(self._environment):
            self.line = LineClient()
        self._open.callback(self.line.close)
        self._node: Child | None = None
        self._cases = self._nodes = self._sent = 0
        self.others = 0
        """Commands that may have come in other ways: in lockstep requests, in checkpoints."""
        self._publishers: dict[str, Any] = {}
        self.futures: list[Any] = []
        self.valid = {name: {speeds[0]} for name, speeds in SPEEDS.items()}
        """Speeds that a belt may have by what was sent, m/s."""
        self._earlier: list[dict[str, set[float]]] = []
        """The same of the cases before."""

    def close(self) -> None:
        """End everything."""
        if self._node is not None:
            self._node.stop()
        self._open.close()

    def play(self, rng: random.Random, folder: Path) -> str:
        """One case."""
        if self._node is None or self._cases >= LIFE:
            self.renew()
        self._cases += 1
        self._earlier = [*self._earlier[1 - LATE :], self.valid]
        self.valid = {name: {speeds[0]} for name, speeds in SPEEDS.items()}
        happened = "quiet"
        for _ in range(rng.randint(1, 12)):
            happened = rng.choice(ACTIONS)(self, rng, folder)
        self._require_alive()
        self._require_known_speeds()
        self._reset()
        self.settle()
        if self._cases % ACCOUNT == 0:
            self.require_account()
        self._replay()
        return happened

    def renew(self) -> None:
        """End the node, look at how it ended, and start another one."""
        if self._node is not None:
            self.require_account()
            os.kill(self._node.pid, signal.SIGINT)
            self._wait(lambda: self._node is not None and self._node.exit_code is not None, "the end on Ctrl-C")
            log = self._node.log.read_text(errors="replace")
            if self._node.exit_code != 0 or "Traceback" in log:
                raise Violation("bad end", f"status {self._node.exit_code}: {log[-2000:]}")
            self._wait(lambda: not self.line.node.count_services("conveyor_sim/lockstep"), "the end of its services")
            self._node = None
        # Before the next node starts: it would count them as publishers that have not sent anything yet.
        for publisher in self._publishers.values():
            self.line.node.destroy_publisher(publisher)
        self._nodes += 1
        self._cases = self._sent = self.others = 0
        place = self._folder / str(self._nodes)
        place.mkdir()
        self._bag = place / "bag"
        given = {
            "scene": SMALL_LINE,
            "start_paused": True,
            "real_time_factor": 0.0,
            "duration": 1000.0,
            "checkpoint_folder": "/",
        }
        restore_for_children()
        self._node = Child("sim_node", given | {"record": self._bag, "threads": 1}, self._environment, place)
        self.present()
        self._publishers = {
            name: self.line.publisher(kind, name, qos)
            for name, kind, qos in (
                ("commands", Commands, "commands"),
                (FEEDER, Float64, "cmd_speed"),
                (TABLE, Float64, "cmd_speed"),
            )
        }
        self._introduce()
        self._memory = self._resident()

    def _introduce(self) -> None:
        """Send a first message of each publisher, which is refused, and wait for it.

        The node counts lost commands from the first one that it receives of a publisher. A flood that begins before it
        knows the publisher would not be counted as a whole.
        """
        self.publish("commands", Commands())
        for name in SPEEDS:
            self.publish(name, Float64(data=math.nan))
        self._wait(lambda: self._told()["received commands"] == self._sent, "the first commands")

    # What actions use

    def publish(self, topic: str, message: Any) -> None:
        """A message, or the bytes of one; DDS itself sends none that is larger than its type can be."""
        with suppress(rclpy_implementation.RCLError):
            self._publishers[topic].publish(message)
            self._sent += 1

    def ask(self, kind: Any, service: str, /, wait: bool = True, **fields: Any) -> Any:
        """A request; its answer where it is waited for."""
        future = self.line.client(kind, service).call_async(kind.Request(**fields))
        if not wait:
            self.futures.append(future)
            return None
        return self._wait(lambda: future.done() and future.result(), f"an answer of {service}")

    def present(self) -> Any:
        """Tick, signals and run as they are, by a request that is refused."""
        return self.ask(srv.Lockstep, "lockstep", run_id="look", target_tick=0)

    # What must hold

    def _wait(self, condition: Callable[[], Any], what: str) -> Any:
        end = time.monotonic() + PATIENCE
        while not (value := condition()):
            if self._node is not None and self._node.exit_code not in (None, 0):
                raise Violation("node died", self._node.obituary())
            if time.monotonic() > end:
                raise Violation("no answer", f"in vain: {what}")
            time.sleep(0.001)
        return value

    def _require_alive(self) -> None:
        self.ask(standard_srv.GetSimulationState, "get_simulation_state")
        grown = self._resident() - self._memory
        if grown > MEMORY:
            raise Violation("memory", f"{grown / 1e6:.0f} MB more than at the start")

    def _require_known_speeds(self) -> None:
        speeds = self.present().signals.values
        for name, speed in ((FEEDER, speeds[0]), (TABLE, speeds[2])):
            if not any(speed in valid[name] for valid in (self.valid, *self._earlier)):
                raise Violation("belt", f"{name} came to {speed} m/s, which no good command asked for")

    def settle(self) -> None:
        """Wait for an answer to every request, after a reset. Raises Violation."""
        self._wait(self._answered, "an answer to every request after a reset")
        self.futures.clear()

    def _answered(self) -> bool:
        """Return whether every request has its answer. Reset again if a late one has begun in the new run.

        DDS keeps no order between services: a request may come after the reset that was sent after it.
        """
        if all(future.done() for future in self.futures):
            return True
        if self.present().tick:
            self._reset()
        return False

    def _reset(self) -> None:
        self.ask(Trigger, "pause")
        before, late = self.present().sim_run_id, not all(future.done() for future in self.futures)
        result = self.ask(standard_srv.ResetSimulation, "reset_simulation").result
        if result.result != result.RESULT_OK:
            raise Violation("no reset", result.error_message)
        now = self.present()
        if now.sim_run_id == before or (now.tick and not late):
            raise Violation("no reset", f"run {now.sim_run_id} after {before}, tick {now.tick}")

    def require_account(self) -> None:
        """Of every command that was sent: it was lost, or it came and was applied, was refused, or waits."""
        told: dict[str, int] = {}

        def complete() -> bool:
            told.update(self._told())
            came, sent = told["received commands"], self._sent
            known = sum(told[f"{name} commands"] for name in ("applied", "refused", "waiting"))
            return came == known and sent <= came + told["lost commands"] <= sent + self.others

        try:
            self._wait(complete, "an account of all commands")
        except Violation as error:
            raise Violation("no account", f"{self._sent} sent, {self.others} others, {told}: {error}") from error

    def _told(self) -> dict[str, int]:
        """Return the numbers of commands in the next diagnostics."""
        _, values = self.line.diagnostics()
        return {name: int(value) for name, value in values.items() if name.endswith(" commands")}

    def _replay(self) -> None:
        """Every recording that is closed, which is all but the last, and remove it."""
        bags = sorted(self._bag.parent.glob("bag*"), key=lambda path: path.stat().st_mtime_ns)
        numbers = {path: int(path.name.partition("_")[2] or 0) for path in bags}
        for path in sorted(bags, key=lambda path: numbers[path])[:-1]:
            report = replay(path)
            if report.difference is not None or not report.exact:
                kept = shutil.copytree(path, Path(tempfile.mkdtemp()) / path.name)
                raise Violation("replay", f"{report.difference}; {kept}")
            shutil.rmtree(path)

    def _resident(self) -> int:
        assert self._node is not None
        return int(Path(f"/proc/{self._node.pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


# The actions: each returns one word for what it did


def _good(station: Station, rng: random.Random, _: Path) -> str:
    name = rng.choice(list(SPEEDS))
    _, low, high = SPEEDS[name]
    value = rng.uniform(low, high)
    station.valid[name].add(value)
    if rng.random() < 0.5:
        station.publish(name, Float64(data=value))
    else:
        station.publish("commands", Commands(names=[name], values=[value]))
    return "applied"


def _speed(station: Station, rng: random.Random, _: Path) -> str:
    name, value = rng.choice(list(SPEEDS)), rng.choice(VALUES)
    _note_if_valid(station, [name], [value])
    station.publish(name, Float64(data=value))
    return "speeds"


def _names(station: Station, rng: random.Random, _: Path) -> str:
    names, values = _odd(rng)
    _note_if_valid(station, names, values)
    station.publish("commands", Commands(names=names, values=values))
    return "names"


def _many_names(station: Station, rng: random.Random, _: Path) -> str:
    count = rng.choice([100, 3000, 30_000])
    names = [f"{rng.choice(NAMES)[:50]}{number}" for number in range(count)]
    station.publish("commands", Commands(names=names, values=[0.0] * rng.choice([count, count, 0, 7])))
    return "many"


def _long_name(station: Station, rng: random.Random, _: Path) -> str:
    station.publish("commands", Commands(names=["\x1b" * rng.choice([1000, 200_000, 2_000_000])], values=[0.1]))
    return "long"


def _garbage(station: Station, rng: random.Random, _: Path) -> str:
    """Bytes: of a good message with some changed or cut off, or random ones."""
    topic = rng.choice(["commands", FEEDER, TABLE])
    if rng.random() < 0.3:
        data = bytearray(rng.randbytes(rng.choice([1, 3, 4, 5, 12, 100, 5000, 500_000])))
    else:
        # A value that no belt may have, so that a message still readable changes nothing.
        set_of_two = Commands(names=["nowhere", FEEDER], values=[9.0, 9.0])
        data = bytearray(serialize_message(set_of_two if topic == "commands" else Float64(data=math.nan)))
        before_numbers = len(data) - (16 if topic == "commands" else 8)  # what those become could be a speed
        for _ in range(rng.randint(1, 6)):
            data[rng.randrange(before_numbers)] = rng.choice([0, 255, rng.randrange(256)])
        if rng.random() < 0.4:
            del data[rng.randrange(1, len(data)) :]
    arrives = bytes(data).ljust(len(data) + -len(data) % 4, b"\0")  # DDS fills up to whole words of four bytes
    if topic != "commands" and len(arrives) >= 12:
        station.valid[topic] |= _any_speed(topic, arrives)
    station.publish(topic, bytes(data))
    return "garbage"


def _flood(station: Station, rng: random.Random, _: Path) -> str:
    if rng.random() < 0.7:
        station.ask(Trigger, "pause")
    names, values = _odd(rng)
    _note_if_valid(station, names, values)
    message = Commands(names=names, values=values)
    for _ in range(rng.choice([200, 1500, 5000])):
        station.publish("commands", message)
    return "flood"


def _lockstep(station: Station, rng: random.Random, _: Path) -> str:
    names, values = _odd(rng)
    _note_if_valid(station, names, values)
    present = station.present()
    station.others += 1
    target = rng.choice([present.tick + rng.randint(1, 50), present.tick + 1, 0, 99_999, 100_001, 2**64 - 1])
    station.ask(
        srv.Lockstep,
        "lockstep",
        wait=False,
        run_id=rng.choice(["plc", "plc", "plc", *TEXTS, "y" * 100_000]),
        target_tick=target,
        names=names,
        values=values,
        release=rng.random() < 0.5,
        sim_run_id=rng.choice(["", "", present.sim_run_id, *TEXTS]),
    )
    return "lockstep"


def _fault(station: Station, rng: random.Random, _: Path) -> str:
    for _ in range(rng.choice([1, 1, 3])):
        station.ask(srv.InjectFault, "inject_fault", name=rng.choice([EYE, EYE, *NAMES]), value=rng.choice(VALUES))
    return "faults"


def _operate(station: Station, rng: random.Random, _: Path) -> str:
    """What operators and engineers do, and what they may not. Speeds are not forced: belts are judged by them."""
    operation = rng.choice([*MAY, "mode", "set", *TEXTS])
    if operation == "set":
        names, values = _odd(rng)
        _note_if_valid(station, names, values)
    else:
        known = ("belts/feeder", "belts/table", "photo_eyes/entry/blocked", "belts/feeder/watchdog", "line", *TEXTS)
        names = [rng.choice(known) for _ in range(rng.choice([0, 1, 1, 2]))]
        values = [rng.choice([1.0, 3.0, *VALUES]) for _ in names] if rng.random() < 0.8 else []
    station.others += 1
    station.ask(
        srv.Operate,
        "operate",
        writer=rng.choice(["Jo", "Jo", *TEXTS]),
        writer_kind=rng.choice(["operator", "engineer", "controller", *TEXTS]),
        operation=operation,
        names=names,
        values=values,
        texts=[rng.choice(TEXTS) for _ in range(rng.choice([0, 0, 0, 2]))],
    )
    return "operated"


def _go(station: Station, rng: random.Random, _: Path) -> str:
    station.ask(Trigger, rng.choice(["pause", "pause", "resume"]))
    return "went"


def _step(station: Station, rng: random.Random, _: Path) -> str:
    station.ask(Trigger, "pause")
    steps = rng.choice([0, 1, 2, 20, 20, 99_000, 100_001, 2**64 - 1])
    station.ask(standard_srv.StepSimulation, "step_simulation", wait=steps < 99_000, steps=steps)
    return "stepped"


def _set_state(station: Station, rng: random.Random, _: Path) -> str:
    state = SimulationState(state=rng.choice([0, 1, 2, 4, 100, 255]))
    station.ask(standard_srv.SetSimulationState, "set_simulation_state", state=state)
    _after_new_run(station)
    return "state"


def _reset(station: Station, rng: random.Random, _: Path) -> str:
    station.ask(standard_srv.ResetSimulation, "reset_simulation", scope=rng.choice([0, 255, 3, 1, 4, 128]))
    _after_new_run(station)
    return "reset"


def _checkpoint(station: Station, rng: random.Random, folder: Path) -> str:
    whole, pipe = folder / "checkpoint", folder / "pipe"
    if not pipe.exists():
        os.mkfifo(pipe)
    odd = [
        "", "/", "~", "~nobody_at_all/x", "../../etc/passwd", "/proc/version", "/dev/zero", "/dev/tty", "/no/such/file",
        str(folder), str(pipe), "\n\x1b[2J/", "x/" * 3000,
    ]  # fmt: skip
    path = rng.choice([str(whole), str(whole), *odd])
    if rng.random() < 0.6 and path not in odd:
        station.ask(srv.SaveCheckpoint, "save_checkpoint", path=path)
        return "checkpoint"
    if whole.exists() and rng.random() < 0.3:
        content = bytearray(whole.read_bytes())
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
        whole.write_bytes(content)
    station.ask(srv.LoadCheckpoint, "load_checkpoint", path=path)
    station.others += 1000  # those that waited when it was saved
    return "checkpoint"


def _parameter(station: Station, rng: random.Random, _: Path) -> str:
    value = ParameterValue(
        type=rng.randrange(5), bool_value=True, integer_value=rng.choice([-1, 0, 0, 2**63 - 1]),
        double_value=rng.choice([v for v in VALUES if not 0.0 < v <= 1e6]), string_value=rng.choice(TEXTS),
    )  # fmt: skip
    name = rng.choice(["real_time_factor", "real_time_factor", "scene", "rates.poses", "use_sim_time_", *TEXTS])
    station.ask(SetParameters, "conveyor_sim/set_parameters", parameters=[Parameter(name=name, value=value)])
    return "parameters"


ACTIONS = (
    _good, _good, _speed, _names, _names, _many_names, _long_name, _garbage, _garbage, _garbage, _flood, _lockstep,
    _lockstep, _lockstep, _fault, _operate, _operate, _go, _step, _step, _set_state, _reset, _checkpoint, _parameter,
)  # fmt: skip


def _odd(rng: random.Random) -> tuple[list[str], list[float]]:
    names = [rng.choice(NAMES) for _ in range(rng.choice([0, 1, 1, 2, 2, 5]))]
    count = max(0, len(names) + rng.choice([0, 0, 0, 1, -1]))
    return names, [rng.choice(VALUES) for _ in range(count)]


def _note_if_valid(station: Station, names: list[str], values: list[float]) -> None:
    """What a belt may come to, if the line takes such a command."""
    good = len(names) == len(values) == len(set(names)) > 0 and set(names) <= set(SPEEDS)
    if good and all(SPEEDS[name][1] <= value <= SPEEDS[name][2] for name, value in zip(names, values, strict=True)):
        for name, value in zip(names, values, strict=True):
            station.valid[name].add(value)


def _any_speed(topic: str, data: bytes) -> set[float]:
    """What the bytes of a number may be read as, if it is a speed that the belt may have."""
    _, low, high = SPEEDS[topic]
    read = {struct.unpack(f"{order}d", data[4:12])[0] for order in "<>"}
    return {value for value in read if low <= value <= high}


def _after_new_run(station: Station) -> None:
    """Belts may be at their first speeds again; a command on its way may still arrive."""
    for name, (speed, _, _) in SPEEDS.items():
        station.valid[name].add(speed)
