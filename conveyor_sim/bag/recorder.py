# SPDX-License-Identifier: Apache-2.0
"""Recorder of a rosbag2 folder: one chunked, zstd-compressed MCAP file and metadata.yaml, by simulated log time."""

from __future__ import annotations

import contextlib
import errno
import os
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path, PurePath

from conveyor_sim.bag.channels import ENCODING, metadata_of, schema_of
from conveyor_sim.bag.folder import make_folder, remove_folders
from conveyor_sim.bag.input_log import START_NAME
from conveyor_sim.bag.mcap.line_copy import NAME as LINE_COPY
from conveyor_sim.bag.mcap.line_copy import LineCopy
from conveyor_sim.bag.mcap.metadata import write_metadata
from conveyor_sim.bag.mcap.writer import McapFileWriter
from conveyor_sim.bag.messages.topics import OUTPUTS
from conveyor_sim.bag.messages.typestore import default_distro
from conveyor_sim.errors import BagError, CheckpointError
from conveyor_sim.support.file_lock import lock

LINE_TOPIC = "line"
_MEDIA_TYPES = {
    ".yaml": "application/yaml",
    ".csv": "text/csv",
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
}
FLUSH_INTERVAL = 0.5
"""Wall time that a message waits at most until it is handed to the operating system, s. A killed process loses the
messages of this time, and of the delay that a loaded machine adds: less than a second."""


class Recorder(contextlib.AbstractContextManager["Recorder"]):
    """A sink that records every message; use it as a context manager.

    path: the folder to create; an existing folder must be empty. topics: names of OUTPUTS to record (default: all).
    start: writes the checkpoint at which the run begins to a path, because a replay begins there; None: tick 0.
    sources: files that the scene was read from, by path from its folder; they are attached to the file.
    namespace: prefix of all topics, such as "/cell_1".
    A separate thread flushes, also when no more messages come. Any thread may call the methods.
    Raise BagError before the simulation starts if the folder can't be written; then the folder is removed.
    """

    def __init__(
        self,
        path: str | Path,
        *,
        topics: Iterable[str] | None = None,
        distro: str | None = None,
        start: Callable[[Path], object] | None = None,
        sources: Mapping[str, bytes] | None = None,
        namespace: str = "",
    ) -> None:
        self.path = Path(path)
        self._sources = sources or {}
        self._namespace = namespace
        self._distro = distro or default_distro()
        self._ended = False
        self._failure: BagError | None = None
        self._waiting_since: float | None = None  # s of wall time; None: all has been flushed
        self._changed = threading.Condition()  # its lock guards the file
        name = f"{self.path.resolve().name}_0.mcap"
        self._made = make_folder(self.path)
        self._storage = self.path / name
        try:
            self._stream = self._storage.open("xb")
        except OSError as error:  # another process may have made the file in the meantime
            remove_folders(self._made)
            raise BagError(f"{self._storage}: can't be written ({error.strerror})") from error
        try:
            lock(self._stream)
            self._file = McapFileWriter(self._stream, name, self._distro)
            self._channels = {topic: self._register(topic) for topic in (OUTPUTS if topics is None else topics)}
            self._file.flush()  # a full disk raises here
            if start is not None:
                start(self.path / START_NAME)
        except (OSError, CheckpointError) as error:
            self._leave_nothing()
            reason = error.strerror if isinstance(error, OSError) else error
            raise BagError(f"{self._storage}: can't be written ({reason})") from error
        self._begun = False  # the first message, the line, is flushed at once: without it a bag can't be read
        self._flusher = threading.Thread(target=self._keep_flushing, name="recorder", daemon=True)
        self._flusher.start()

    def _register(self, topic: str) -> int:
        schema, metadata = schema_of(topic, self._distro), metadata_of(topic, self._distro)
        return self._file.add_topic(f"{self._namespace}/{topic}", schema, ENCODING, metadata)

    def wants(self, topic: str) -> bool:
        """Return True if the topic is recorded."""
        return topic in self._channels

    def write(self, topic: str, data: bytes, stamp_ns: int) -> None:
        """Record one message. Raise BagError if the disk is full; earlier messages stay recoverable."""
        with self._changed:
            self._raise_failure()
            if self._ended:
                raise BagError(f"{self.path}: the recording has ended and takes no more messages")
            try:
                if topic == LINE_TOPIC and not self._begun:
                    line = LineCopy(f"{self._namespace}/{topic}", OUTPUTS[topic].type, stamp_ns, data)
                    self._file.add_metadata(LINE_COPY, line.to_record())
                    for name, content in self._sources.items():
                        kind = _MEDIA_TYPES.get(PurePath(name).suffix, "text/plain")
                        self._file.add_attachment(name, kind, content, stamp_ns, create_time=0)
                self._file.add_message(self._channels[topic], data, log_time=stamp_ns, publish_time=stamp_ns)
                if not self._begun:
                    self._file.flush()
                    self._begun = True
                elif self._waiting_since is None:
                    self._waiting_since = time.monotonic()
                    self._changed.notify()
            except OSError as error:
                self._fail(error)

    def flush(self) -> None:
        """Hand all messages so far to the operating system at once.

        Raise BagError if the disk is full, also if the flushing thread noticed it earlier.
        """
        with self._changed:
            self._raise_failure()
            if not self._ended:
                self._flush()

    def close(self) -> None:
        """End the recording: write index, metadata, metadata.yaml. A call after the end or a failure does nothing.

        Raise BagError if the disk is full; earlier messages stay recoverable.
        """
        with self._changed:
            self._raise_failure()
            if self._ended:
                return
            self._ended = True
            self._changed.notify()
            try:
                information = self._file.finish()
                self._stream.close()
                write_metadata(self.path, information)
            except OSError as error:
                self._fail(error)

    def __exit__(self, *_: object) -> None:
        self.close()

    def _keep_flushing(self) -> None:
        """Flush messages that have waited for FLUSH_INTERVAL, until the recording ends."""
        with self._changed:
            while not self._ended:
                if self._waiting_since is None:
                    self._changed.wait()
                elif (left := self._waiting_since + FLUSH_INTERVAL - time.monotonic()) > 0.0:
                    self._changed.wait(left)
                else:
                    try:
                        self._flush()
                    except BagError as error:
                        self._failure = error  # raised by the next write, flush or close

    def _flush(self) -> None:
        try:
            self._file.flush()
            if os.fstat(self._stream.fileno()).st_nlink == 0:
                raise FileNotFoundError(errno.ENOENT, "the file was deleted")
        except OSError as error:
            self._fail(error)
        self._waiting_since = None

    def _raise_failure(self) -> None:
        """Raise the error that ended the recording in the meantime, once."""
        if self._failure is not None:
            failure, self._failure = self._failure, None
            raise failure

    def _fail(self, error: OSError) -> None:
        """End the recording without its index, which `recover` can repair, and raise BagError."""
        self._ended = True
        self._changed.notify()
        with contextlib.suppress(OSError):
            self._stream.close()  # tries once more to write the buffer, which may not fit either
        if not self._begun:
            self._leave_nothing()
            raise BagError(
                f"{self.path}: can't be recorded to ({error.strerror}): there is no room for the first message; "
                "nothing was left there"
            ) from error
        stopped = f"{self.path}: recording stopped at {self._file.info.end_ns * 1e-9:.2f} s"
        if isinstance(error, FileNotFoundError):
            raise BagError(
                f"{stopped}, for the folder or its file was moved or deleted; if it was moved, `conveyor-sim recover` "
                "repairs it where it is now"
            ) from error
        raise BagError(
            f"{stopped} ({error.strerror}); "
            f"what was written is kept: make room, then `conveyor-sim recover {self.path}`"
        ) from error

    def _leave_nothing(self) -> None:
        """Remove the files from before the first message, so that the same folder can be recorded to later."""
        with contextlib.suppress(OSError):
            self._stream.close()
        for file in (self._storage, self.path / START_NAME):
            with contextlib.suppress(OSError):
                file.unlink(missing_ok=True)
        remove_folders(self._made)


def new_run_folder(root: str | Path = "runs") -> Path:
    """Make a folder ROOT/<UTC time>, such as runs/20250131T120501Z, which no other process has. Raise BagError."""
    stamp = time.strftime("%Y%m%dT%H%M%SZ", time.gmtime())
    candidate, number = Path(root) / stamp, 2
    while True:
        try:
            candidate.mkdir(parents=True)
        except FileExistsError:
            candidate = Path(root) / f"{stamp}-{number}"
            number += 1
        except OSError as error:
            raise BagError(f"{candidate}: can't be created as the folder of a recording ({error.strerror})") from error
        else:
            return candidate


@contextlib.contextmanager
def run_folder(chosen: Path | None) -> Iterator[Path]:
    """Yield the chosen folder, or a new one of `new_run_folder`, which is removed afterwards if it is empty."""
    folder = chosen or new_run_folder()
    try:
        yield folder
    finally:
        if chosen is None:
            for empty in (folder, folder.parent):
                with contextlib.suppress(OSError):
                    empty.rmdir()
