# SPDX-License-Identifier: Apache-2.0
"""A server on this machine for the page that shows a scene's plan and problems whenever one of its files is saved."""

from __future__ import annotations

import json
import threading
import zlib
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import Any, NamedTuple

from conveyor_sim.page.http_host import PageHost
from conveyor_sim.support.files import noting_files

_EVERY = 0.25
"""Wall time between two looks at the files, s."""
_WAITING = 10.0
"""Longest wall time for which a request waits for a change, s."""

Examine = Callable[[], Mapping[str, Any]]
"""Examine a scene: return what the page shows, as JSON. It must not raise."""


class _Stamp(NamedTuple):
    """Signs that a file was changed or replaced."""

    time: int
    size: int
    number: int


class CheckServer(AbstractContextManager["CheckServer"]):
    """Server of the page of a scene that is being written. A thread examines the scene."""

    def __init__(self, examine: Examine, port: int = 0) -> None:
        """Examine the scene once, and serve. port: 0 for any free port. Raise ConveyorError if it is taken."""
        self._examine = examine
        self._changed, self._ended = threading.Condition(), threading.Event()
        self._number = 0
        self._result: Mapping[str, Any] = {}
        self._watch: dict[Path, _Stamp | None] = {}
        self._look()
        with ExitStack() as stack:
            self._host = stack.enter_context(PageHost(self.answer, port, "check.html"))
            self._thread = threading.Thread(target=self._follow, name="check", daemon=True)
            self._thread.start()
            self._stack = stack.pop_all()

    @property
    def url(self) -> str:
        """Address of the page."""
        return self._host.url

    def answer(self, name: str) -> bytes:
        """Return the deflated result that follows a number: check/<number>. Raise KeyError for other names.

        It waits for a newer one, but not for ever: then the answer is the same result again.
        """
        kind, _, seen = name.partition("/")
        if kind != "check" or not (seen.isdecimal() and len(seen) < 10):
            raise KeyError(name)
        with self._changed:
            self._changed.wait_for(lambda: self._number != int(seen) or self._ended.is_set(), _WAITING)
            result = {**self._result, "number": self._number}
        return zlib.compress(json.dumps(result).encode(), 1)

    def __exit__(self, *_: object) -> None:
        """Stop the server."""
        self._ended.set()
        with self._changed:
            self._changed.notify_all()
        self._thread.join()
        self._stack.close()

    def _follow(self) -> None:
        while not self._ended.wait(_EVERY):
            if any(_stamp(path) != stamp for path, stamp in self._watch.items()):
                self._look()

    def _look(self) -> None:
        """Examine the scene. A file that changes meanwhile differs from its stamp, so the scene is examined again."""
        before = _stamps(self._watch)
        with noting_files() as used:
            result = self._examine()
        self._watch = {**_stamps(used), **{path: stamp for path, stamp in before.items() if path in used}}
        with self._changed:
            self._result, self._number = result, self._number + 1
            self._changed.notify_all()


def _stamps(paths: Iterable[Path]) -> dict[Path, _Stamp | None]:
    return {path: _stamp(path) for path in paths}


def _stamp(path: Path) -> _Stamp | None:
    """Return the stamp of a file; None if there is none."""
    try:
        entry = path.stat()
    except (OSError, ValueError):
        return None
    return _Stamp(entry.st_mtime_ns, entry.st_size, entry.st_ino)
