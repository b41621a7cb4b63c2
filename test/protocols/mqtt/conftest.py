# SPDX-License-Identifier: Apache-2.0
"""Fixtures of `kit.py`, if their requirements are installed; otherwise each module of tests says what is missing."""

from contextlib import suppress
from pathlib import Path

import pytest

with suppress(pytest.skip.Exception):
    from test.protocols.mqtt.kit import broker, line, mosquitto, serve  # noqa: F401


@pytest.fixture(autouse=True)
def state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Set the folder for the state of this user, for one test."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "state"
