"""The fixtures of `kit.py`, where there is what they need; without it each module of tests says what is missing."""

from contextlib import suppress

import pytest

with suppress(pytest.skip.Exception):
    from test.scada.mqtt.kit import broker, line, mosquitto, serve  # noqa: F401
