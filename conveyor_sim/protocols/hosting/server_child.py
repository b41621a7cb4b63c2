# SPDX-License-Identifier: Apache-2.0
"""`ServerChild`: a process for one protocol server. It imports its libraries before the line is known."""

from __future__ import annotations

import subprocess
from contextlib import suppress
from multiprocessing import Pipe

from conveyor_sim.support.child_process import start_python

PROCESS = "conveyor_sim.protocols.hosting.server_process"


class ServerChild:
    """One process with its pipes, from its start until `end`. It dies with the thread that starts it."""

    def __init__(self, name: str) -> None:
        """Start the process. name: of the protocol server."""
        self.pipe, its_pipe = Pipe()
        """Calls and answers."""
        its_frames, self.frames = Pipe(duplex=False)
        """Pipe end that sends frames to the process."""
        with its_pipe, its_frames:
            self.process = start_python(PROCESS, its_frames, its_pipe, name=name)

    def kill(self, patience: float) -> None:
        """Wait up to `patience` seconds for the end of the process, then kill it."""
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(patience)
        self.process.kill()
        self.process.wait()

    def close(self) -> None:
        """Close the pipes, which no thread uses any more."""
        self.pipe.close()
        self.frames.close()

    def end(self) -> None:
        """End it at once. Harmless if it has ended."""
        self.kill(0.0)
        self.close()
