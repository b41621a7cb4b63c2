# SPDX-License-Identifier: Apache-2.0
"""`VendorDriver`: blocking access to a PLC by the library of a vendor's protocol, in a separate process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from conveyor_sim.errors import ConveyorError


class DriverError(ConveyorError):
    """A request that the PLC refused, or did not answer correctly or in time."""


class PlaceError(ConveyorError):
    """A place of the map that the PLC does not have, or whose type has no number."""

    def __init__(self, name: str, reason: str) -> None:
        """name: tag of the line. reason: what the PLC or its library reports."""
        super().__init__(reason)
        self.name, self.reason = name, reason


class VendorDriver(Protocol):
    """One connection. Names are tags of the line; methods raise DriverError or any exception of the library."""

    def connect(self) -> dict[str, str]:
        """Connect, and check all places. Return the elementary type of each name. Raise PlaceError."""

    def write(self, values: Mapping[str, float]) -> None:
        """Write values in their order, in as many requests as they need."""

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Return values in as many requests as they need."""

    def close(self) -> None:
        """Disconnect. Harmless without a connection."""
