# SPDX-License-Identifier: Apache-2.0
"""`CompiledProgram`: a shared library, built from a PLC program by any compiler, as a controller."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import time
import weakref
from collections.abc import Iterable, Mapping
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from os import PathLike
from pathlib import Path
from typing import Any

from conveyor_sim.control.recorded import patterns
from conveyor_sim.control.scan import ALARMS, PROGRAM, ControlError, Inputs, LineTags
from conveyor_sim.support.child_process import start_python
from conveyor_sim.support.rounded_limit import at_limit

_CHUNK = 65536


class AnswerError(Exception):
    """A missing or wrong answer. The text continues a sentence: "sent more than ... bytes"."""


class LateError(AnswerError):
    """The deadline has passed."""


class EndedError(AnswerError):
    """The child has closed its pipe, before or within the answer."""


def exchange(socket: int, request: bytes, patience: float, most: int) -> bytes:
    """Send a line to a child, and return its next line.

    socket: descriptor. patience: wall time for request and answer together, s. most: largest number of bytes in the
    answer. Raise LateError, EndedError, or AnswerError for a wrong answer.
    """
    os.set_blocking(socket, False)
    end, left, received = time.monotonic() + patience, memoryview(request), bytearray()
    waiting = select.poll()  # select() takes no descriptors from 1024 on
    waiting.register(socket, select.POLLIN | select.POLLOUT)
    while True:
        remaining = end - time.monotonic()
        ready = waiting.poll(max(0.0, remaining) * 1e3) if remaining > 0.0 else []
        if not ready:
            raise LateError(f"took more than {patience:g} s of wall time")
        ((_, events),) = ready
        if left and events & select.POLLOUT:
            left = left[_written(socket, left) :]
            if not left:
                waiting.modify(socket, select.POLLIN)
        if events & ~select.POLLOUT:
            received += (chunk := _read(socket))
            if b"\n" in chunk:
                break
        if len(received) > most:
            raise AnswerError(f"sent more than {most} bytes")
    line, _, rest = bytes(received).partition(b"\n")
    if left or rest or len(line) > most:
        raise AnswerError(f"sent more than {most} bytes" if len(line) > most else "sent data without a request")
    return line


def _written(socket: int, data: memoryview) -> int:
    """Return the number of bytes that the socket took. Raise EndedError."""
    try:
        return os.write(socket, data[:_CHUNK])
    except BlockingIOError:
        return 0
    except OSError:
        raise EndedError("has ended") from None


def _read(socket: int) -> bytes:
    """Return the bytes that have arrived, at least one. Raise EndedError."""
    try:
        chunk = os.read(socket, _CHUNK)
    except OSError:
        chunk = b""
    if not chunk:
        raise EndedError("has ended")
    return chunk


PATIENCE = 60.0
"""Wall time of a call from its request to the end of its answer, s. The watchdog ends a program that exceeds it."""

MOST_BYTES = 65_536
"""Largest length of an answer, bytes. Each output value may add _VALUE_BYTES, a snapshot MOST_STATE_BYTES."""

MOST_STATE_BYTES = 86_000_000
"""Largest length of a snapshot's answer, bytes: 64 MB of state in base 64."""

_VALUE_BYTES = 32

_MOMENT = 1.0
"""Wall time in which a program may end by itself, s."""

_NS = 1e9


class CompiledProgram:
    """Library with the functions of include/conveyor_sim_plc.h, in a separate process: a crash is an error here.

    Two programs share nothing, even if the library has variables outside its instances.
    """

    def __init__(
        self,
        path: str | PathLike[str],
        tags: Mapping[str, str],
        *,
        patience: float = PATIENCE,
        record: str | Iterable[str] = (),
    ) -> None:
        """Start the process.

        path: of the library. tags: by variable, as the library names it. patience: wall time for a scan, s. record:
        patterns of variables to record, among those with tags ("*", `control/recorded.py`). Raise ControlError if the
        library can't be loaded.
        """
        self._path, self._tags, self._patience = Path(path), dict(tags), patience
        self.record = patterns(record)
        """Patterns of the variables to record."""
        if not self._path.is_file():
            raise ControlError(f"{path}: no such file, expected a shared library")
        if not self._tags:
            raise ControlError(f"{path}: found no tags, expected a tag for each connected variable")
        self._ins: list[str] = []
        self._outs: list[str] = []
        self._limits: Mapping[str, tuple[float, float]] = {}
        self._shown: dict[str, float] = {}
        self._pipe, its_pipe = Pipe()
        with its_pipe:
            self._process = start_python(
                "conveyor_sim.control.st.library_host", its_pipe, name=str(self._path.resolve())
            )
        self.close = weakref.finalize(self, _end, self._process, self._pipe)
        """Ends the process. Deleting this object ends it too."""
        self._call("bind", [])

    def bind(self, tags: LineTags) -> None:
        """Connect variables to their tags: signals in, commands and alarms out. Raise ControlError."""
        if self._ins or self._outs:
            raise ControlError(f"{self._path}: found a second line, expected a new CompiledProgram for each")
        variables = []
        for name, tag in self._tags.items():
            out = tag in tags.commands or tag.startswith(ALARMS)
            if not (out or tag in tags.signals):
                raise ControlError(f"{self._path}: {name}: found {tag}, expected a tag of this line")
            (self._outs if out else self._ins).append(tag)
            variables.append((name, int(out)))
        self._call("bind", variables)
        self._limits = tags.limits
        self._names = {tag: f"{PROGRAM}{name}" for name, tag in self._tags.items()}
        self._shown = dict.fromkeys(self._names.values(), 0.0)

    def scan(self, inputs: Inputs) -> Mapping[str, float]:
        """Return commands and alarms. Raise ControlError if the program stops, crashes, or does not end its scan."""
        values = [inputs[tag] for tag in self._ins]
        outputs = self._call("scan", round(inputs.time * _NS), values)
        # A REAL is sent as a double, but has only the digits of a REAL.
        answer = {
            tag: at_limit(value, *self._limits[tag]) if tag in self._limits else value
            for tag, value in zip(self._outs, outputs, strict=True)
        }
        self._shown = {
            self._names[tag]: value for tag, value in (*zip(self._ins, values, strict=True), *answer.items())
        }
        return answer

    @property
    def alarm_tags(self) -> tuple[str, ...]:
        """Tags of outputs that are alarms, available after `bind`."""
        return tuple(tag for tag in self._outs if tag.startswith(ALARMS))

    @property
    def variables(self) -> Mapping[str, float]:
        """Variables with tags, as plc/<name>, after the last scan; 0 before the first one."""
        return self._shown

    def snapshot(self) -> dict[str, Any]:
        """Return the program's state as plain data."""
        return {"state": self._call("snapshot")}

    def restore(self, data: Mapping[str, Any]) -> None:
        """Restore a state. Raise ControlError if the program does not accept it."""
        self._call("restore", data["state"])

    def _call(self, do: str, *arguments: Any) -> Any:
        request = json.dumps({"do": do, "with": arguments}).encode() + b"\n"
        most = MOST_BYTES + (MOST_STATE_BYTES if do == "snapshot" else _VALUE_BYTES * len(self._outs))
        try:
            answer = _answer(exchange(self._pipe.fileno(), request, self._patience, most))
            if do == "scan":
                _require_numbers(answer.get("answer", [0.0] * len(self._outs)), len(self._outs))
        except EndedError:
            raise ControlError(f"{self._path}: {self._ended()} in {do}, expected an answer") from None
        except AnswerError as error:
            self._process.kill()
            self.close()
            raise ControlError(f"{self._path}: watchdog: {do} {error}, expected one answer in time") from None
        if "error" in answer:
            raise ControlError(f"{self._path}: {answer['error']}")
        return answer["answer"]

    def _ended(self) -> str:
        code = self._process.wait()
        return f"ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"


def _answer(line: bytes) -> dict[str, Any]:
    """Return an answer of `library_host`. Raise AnswerError."""
    try:
        answer = json.loads(line)
    except (ValueError, RecursionError):
        answer = None
    if not isinstance(answer, dict) or not (isinstance(answer.get("error"), str) or "answer" in answer):
        raise AnswerError("sent a line that is no answer")
    return answer


def _require_numbers(values: Any, count: int) -> None:
    """Raise AnswerError unless these are the values of all outputs."""
    if not isinstance(values, list) or len(values) != count or not all(type(value) is float for value in values):
        raise AnswerError(f"sent a line without the values of {count} outputs")


def _end(process: subprocess.Popen[bytes], pipe: Connection) -> None:
    """Let the process destroy its instance, then end it."""
    pipe.close()
    with suppress(subprocess.TimeoutExpired):
        process.wait(_MOMENT)
    process.kill()
    process.wait()
