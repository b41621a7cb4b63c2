# SPDX-License-Identifier: Apache-2.0
"""A sample of structured OPC UA requests by strangers, always the same cases; what the target looks for is noticed."""

from __future__ import annotations

import random
from collections.abc import Iterator

import pytest

pytest.importorskip("asyncua", reason="asyncua is not installed: pip install conveyor-sim[scada]")

from fuzz.targets.opcua_sessions import Station
from fuzz.violation import Violation

SEEDS = range(12)


@pytest.fixture(scope="module")
def station() -> Iterator[Station]:
    one = Station()
    yield one
    one.close()


def test_whatever_strangers_send_an_operators_screen_stays(station: Station) -> None:
    came = {station.play(random.Random(seed)) for seed in SEEDS}
    assert len(came) >= 2


def test_a_screen_that_shows_nothing_any_more_is_noticed(station: Station) -> None:
    station.publish(False)
    try:
        with pytest.raises(Violation, match="silenced"):
            station.advance(patience=0.5)
    finally:
        station.publish(True)


@pytest.mark.parametrize("change", ["_publishing_enabled", "session_id"])
def test_an_effect_on_the_operators_subscription_is_noticed(station: Station, change: str) -> None:
    subscription = station.subscriptions[station.victim[1].subscription_id]

    class Changing(random.Random):
        def choice(self, values: object) -> object:
            setattr(subscription, change, False)
            return super().choice(values)  # type: ignore[arg-type,misc]

    with pytest.raises(Violation, match="foreign subscription"):
        station.play(Changing(1))
