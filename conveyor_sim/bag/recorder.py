"""Records a rosbag2 folder: one chunked, zstd-compressed MCAP file and metadata.yaml. Log time is simulated time."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterable
from pathlib import Path

from conveyor_sim.bag.mcap_file import HASH_KEY, QOS_KEY, McapFile, Schema
from conveyor_sim.bag.metadata import to_yaml, write_metadata
from conveyor_sim.bag.outputs import OUTPUTS
from conveyor_sim.bag.typestore import default_distro, definition, type_hash
from conveyor_sim.errors import BagError

FLUSH_INTERVAL = 1.0
"""s of wall time: what a killed process can lose."""


class Recorder(contextlib.AbstractContextManager["Recorder"]):
    """A sink that records every message it is given; use it as a context manager.

    path: the folder to create, which must not exist or be empty. topics: those of OUTPUTS to record (default: all).
    Raises BagError, before anything is simulated, if the folder can't be written.
    """

    def __init__(self, path: str | Path, *, topics: Iterable[str] | None = None, distro: str | None = None) -> None:
        self.path = Path(path)
        self._distro = distro or default_distro()
        self._ended = False
        name = f"{self.path.resolve().name}_0.mcap"
        self._make_folder()
        try:
            self._stream = (self.path / name).open("xb")
            self._file = McapFile(self._stream, name, self._distro)
            self._channels = {topic: self._register(topic) for topic in (OUTPUTS if topics is None else topics)}
        except OSError as error:
            raise BagError(f"{self.path / name}: can't be written ({error.strerror})") from error
        # The first message, the line, is flushed at once: without it a bag killed early could not be understood.
        self._next_flush = time.monotonic()

    def _make_folder(self) -> None:
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            occupied = any(self.path.iterdir())
        except OSError as error:
            raise BagError(f"{self.path}: can't be created as the folder of a recording ({error.strerror})") from error
        if occupied:
            raise BagError(f"{self.path}: is not empty, expected a new or an empty folder to record into")

    def _register(self, topic: str) -> int:
        output = OUTPUTS[topic]
        schema = Schema(output.type, "ros2msg", definition(output.type, self._distro).encode())
        metadata = {
            QOS_KEY: to_yaml([output.qos.as_rosbag2()]),
            HASH_KEY: type_hash(output.type, self._distro),
        }
        return self._file.add_topic(f"/{topic}", schema, "cdr", metadata)

    def wants(self, topic: str) -> bool:
        """Whether the topic is recorded."""
        return topic in self._channels

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        """Records one message. Raises BagError if the disk is full; what was written before stays recoverable."""
        if self._ended:
            raise BagError(f"{self.path}: the recording has ended and takes no more messages")
        try:
            self._file.add_message(self._channels[topic], data, log_time=stamp_ns, publish_time=stamp_ns)
        except OSError as error:
            self._fail(error)
        if time.monotonic() >= self._next_flush:
            self.flush()

    def flush(self) -> None:
        """Hands everything recorded so far to the operating system.

        Done by itself once a second while messages come; whoever pauses the simulation calls it then.
        """
        if self._ended:
            return
        try:
            self._file.flush()
        except OSError as error:
            self._fail(error)
        self._next_flush = time.monotonic() + FLUSH_INTERVAL

    def close(self) -> None:
        """Ends the recording: index, metadata, metadata.yaml. Does nothing the second time, or after a failure.

        Raises BagError if the disk is full; what was written before stays recoverable.
        """
        if self._ended:
            return
        try:
            information = self._file.finish()
            self._stream.close()
            write_metadata(self.path, information)
        except OSError as error:
            self._fail(error)
        self._ended = True

    def __exit__(self, *_: object) -> None:
        self.close()

    def _fail(self, error: OSError) -> None:
        """Ends the recording where it is, which `recover` can make whole, and raises BagError."""
        self._ended = True
        with contextlib.suppress(OSError):
            self._stream.close()  # tries once more to write what is buffered, which may not fit either
        raise BagError(
            f"{self.path}: recording stopped at {self._file.info.end_ns * 1e-9:.2f} s ({error.strerror}); "
            f"what was written is kept: make room, then `conveyor-sim recover {self.path}`"
        ) from error


def new_run_folder(root: str | Path = "runs") -> Path:
    """A folder name that is not taken yet: ROOT/<UTC time>, such as runs/20250131T120501Z. Nothing is created."""
    stamp = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime())
    candidate, number = Path(root) / stamp, 2
    while candidate.exists():
        candidate = Path(root) / f"{stamp}-{number}"
        number += 1
    return candidate
