# SPDX-License-Identifier: Apache-2.0
"""Fixtures for tests of protocol servers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from protocols.served import Served


@pytest.fixture
def command(tmp_path: Path) -> Iterator[Callable[..., Served]]:
    """Start `conveyor-sim serve` in a separate folder; end what is left of it after the test."""
    started: list[Served] = []

    def start(*arguments: str, fresh: bool = False, **environment: str) -> Served:
        started.append(Served(tmp_path, *arguments, fresh=fresh, **environment))
        return started[-1]

    yield start
    for one in started:
        if one.process.poll() is None:
            one.process.kill()
            one.process.wait()
