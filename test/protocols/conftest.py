"""What tests of SCADA faces share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from protocols.served import Served


@pytest.fixture
def command(tmp_path: Path) -> Iterator[Callable[..., Served]]:
    """Starts `conveyor-sim serve` in a folder of its own; what is left of it is ended."""
    started: list[Served] = []

    def start(*arguments: str, fresh: bool = False, **environment: str) -> Served:
        started.append(Served(tmp_path, *arguments, fresh=fresh, **environment))
        return started[-1]

    yield start
    for one in started:
        if one.process.poll() is None:
            one.process.kill()
            one.process.wait()
