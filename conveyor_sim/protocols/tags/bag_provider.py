# SPDX-License-Identifier: Apache-2.0
"""`BagTagProvider`: tags of a recording that is played back. It accepts no commands."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path

from conveyor_sim.bag.reader import open_bag
from conveyor_sim.errors import BagError, ConveyorError
from conveyor_sim.line.commands.inputs import Input
from conveyor_sim.line.run_state import ENDED, PAUSED, REPLAYING, RunState
from conveyor_sim.protocols.tags.line_mirror import DRAWING_TOPICS, STATE_TOPICS, LineMirror
from conveyor_sim.protocols.tags.tag_history import TagHistory
from conveyor_sim.protocols.tags.tag_provider import Control
from conveyor_sim.run.calls import CallQueue
from conveyor_sim.run.playback import Playback, PlayedMessage, Player
from conveyor_sim.support.printable import SENTENCE, printable

SHORTEST = 0.005
"""Shortest wall time between two snapshots, s, however fast the playback is."""


class BagTagProvider(LineMirror, AbstractContextManager["BagTagProvider"]):
    """Playback from the start of a recording until close().

    Opening the recording verifies its checksums, which reads the complete file. Messages are then read as they are
    played, through the index of the recording.
    """

    takes_inputs = False
    controls: frozenset[Control] = frozenset({"pause", "resume", "seek", "speed", "loop"})

    def __init__(
        self, path: Path, say: Callable[[str], object], *, speed: float = 1.0, loop: bool = False, paused: bool = False
    ) -> None:
        """Open the recording and start to play it. speed: recorded seconds per wall second, 0 for as fast as possible.
        loop: start again at the end. say: called with a sentence for the user, by a thread of this provider.

        Raises ConveyorError if the recording can't be read or has no signals.
        """
        super().__init__()
        self.recording = path
        self._path, self._say, self._loop = path, say, loop
        self._states: dict[str, bytes] = {}
        self._new_events: list[bytes] = []
        self._shown_at = 0.0  # s of wall time
        self._calls = CallQueue()
        self._bag = open_bag(path)
        self._history = TagHistory(path)
        try:
            if not self._bag.counts.get("signals"):
                raise BagError(f"{path}: holds no message of topic signals, expected some: tags are read from them")
            self._playback = Playback(self._bag, (*STATE_TOPICS, *DRAWING_TOPICS))
            self._player = Player(self._playback, speed, start=None, paused=paused, publish=self._keep, beat=_nothing)
            self._player.seek(self._player.span[0])
            self._bring()
        except BaseException:
            self._bag.close()
            self._history.close()
            raise
        self._thread = threading.Thread(target=self._play, name="bag", daemon=True)
        self._thread.start()

    @property
    def history(self) -> TagHistory:
        """History of the recording."""
        return self._history

    def give(self, request: Input) -> str:
        """Refuse."""
        return f"{self._path}: a recording can't be commanded"

    def control(self, what: Control, value: float, by: str) -> str:
        """Control the playback in the name of `by`. Return the reason for a refusal, "" if the request was accepted."""
        first, last = self._player.span
        if what not in self.controls:
            return f"{what}: expected one of {', '.join(sorted(self.controls))} of a recording"
        if what == "seek" and not first <= value <= last:
            return f"seek: {value:g} given, expected a time of the recording, {first:g} to {last:g} (s)"
        if what == "speed" and not 0.0 <= value <= 1e6:
            return f"speed: {value:g} given, expected a factor of real time from 0 (as fast as possible) to 1e6"
        asked = self._calls.request(partial(self._do, what, value))
        return str(asked.exception()) if asked.done() and asked.exception() else ""

    def close(self) -> None:
        """Stop the playback and close the files."""
        self._calls.end()
        self._thread.join()
        self._bag.close()
        self._history.close()

    def __exit__(self, *_: object) -> None:
        self.close()

    # The playback thread

    def _play(self) -> None:
        player = self._player
        while not self._calls.ended:
            try:
                self._calls.take()
                now = time.monotonic()
                wait = player.step(now)
                if player.ended and self._loop and not player.paused:
                    self._seek(player.span[0])
                    wait = 0.0
                if now > self._shown_at + SHORTEST or wait > SHORTEST:
                    self._shown_at = now
                    self._bring()
            except Exception as error:
                self._fail(error)
                wait = SHORTEST
            self._calls.wait(wait)

    def _fail(self, error: Exception) -> None:
        """Pause at damaged data and report why; other parts of the recording may be valid."""
        self._player.pause()
        text = str(error) if isinstance(error, ConveyorError) else f"{type(error).__name__}: {error}"
        reason = printable(text if str(self._path) in text else f"{self._path}: {text}", SENTENCE)
        self._say(reason)
        self.lose(reason)

    def _do(self, what: Control, value: float) -> None:
        try:
            self._change(what, value)
        except Exception as error:
            self._fail(error)

    def _change(self, what: Control, value: float) -> None:
        match what:
            case "pause":
                self._player.pause()
            case "resume":
                if self._player.ended:
                    self._seek(self._player.span[0])
                self._player.resume()
            case "seek":
                self._seek(value)
            case "speed":
                self._player.set_rate(value)
            case "loop":
                self._loop = bool(value)

    def _seek(self, to: float) -> None:
        self.forget()
        self._states.clear()
        self._player.seek(to)

    def _keep(self, message: PlayedMessage) -> None:
        if message.topic == "events":
            self._new_events.append(message.data)
        else:
            self._states[message.topic] = message.data

    def _bring(self) -> None:
        """Publish everything that was played since the last call, and the state of the playback."""
        state = ENDED if self._player.ended else PAUSED if self._player.paused else REPLAYING
        run = RunState(state, "" if state == ENDED else printable(self._path))
        if not self._states and not self._new_events and run == self.snapshot.run:
            return
        states, self._states = self._states, {}
        events, self._new_events = self._new_events, []
        states.pop("run_state", None)  # the playback has its own state
        self.receive(states, self._playback.decode)
        self.receive_events(events, self._playback.decode)
        self.state_run(run)
        self.show()


def _nothing(stamp_ns: int, now: float) -> None:
    """Ignore the clock, which has no subscribers."""
