# SPDX-License-Identifier: Apache-2.0
"""`Accounts`: the energy ledger, the damage and the clogging of a simulation, each if the scene enables it."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import Any

from conveyor_sim.columns.damage import DamageEvent
from conveyor_sim.physics.accounts.clogging import clogging_of
from conveyor_sim.physics.accounts.damage import DamageAccount
from conveyor_sim.physics.accounts.energy import EnergyAccount
from conveyor_sim.physics.state import State
from conveyor_sim.physics.state.snapshot import restore, snapshot, typed
from conveyor_sim.scene import Scene

UNBOOKED = nullcontext()
"""Context without a ledger."""


class Accounts:
    """Accounts of one State. An attribute is None if the scene does not enable it."""

    def __init__(self, state: State, scene: Scene) -> None:
        """Open all accounts but the energy ledger (`open_ledger`)."""
        self._state = state
        self.energy: EnergyAccount | None = None
        self.damage = None if state.world.damage is None else DamageAccount(state, scene.limits)
        self.clogging = clogging_of(state, scene)

    def open_ledger(self) -> None:
        """Open the energy ledger with the present state, if the scene enables it."""
        if self._state.model.has("energy_ledger"):
            self.energy = EnergyAccount(self._state)

    def end(self, tick: int, removed: Callable[[], Mapping[str, int]]) -> list[DamageEvent]:
        """End a tick. Return the limits that were passed in it. removed: returns the bottles taken by each device."""
        passed = [] if self.damage is None else self.damage.end(tick)
        if self.clogging is not None:
            passed += self.clogging.end(tick, removed())
        return passed

    def clogged(self) -> Mapping[str, bool]:
        """Return whether each outfeed is clogged; empty if clogging is not monitored."""
        return {} if self.clogging is None else self.clogging.clogged()

    def take_events(self) -> list[DamageEvent]:
        """Return the limits that were passed since the last call, by tick."""
        watches = (self.damage, self.clogging)
        events = [event for watch in watches if watch is not None for event in watch.take_events()]
        return sorted(events, key=lambda event: event.tick)

    def feeding(self) -> AbstractContextManager[None]:
        """Book energy gained inside the context as brought by bottles."""
        return UNBOOKED if self.energy is None else self.energy.feeding()

    def removing(self) -> AbstractContextManager[None]:
        """Book energy lost inside the context as carried away by removed bottles."""
        return UNBOOKED if self.energy is None else self.energy.removing()

    def snapshot(self) -> dict[str, Any]:
        """Return the memory of all accounts, as plain data."""
        return {name: None if account is None else snapshot(account) for name, account in self._named()}

    def restore(self, memory: Mapping[str, Any]) -> None:
        """Continue from a snapshot. Raise ValueError for data that can't be one."""
        for name, account in self._named():
            if account is None:
                typed(type(None), memory[name], name)
            else:
                restore(account, memory[name], name)

    def _named(self) -> tuple[tuple[str, Any], ...]:
        return (("account", self.energy), ("damage", self.damage), ("clogging", self.clogging))
