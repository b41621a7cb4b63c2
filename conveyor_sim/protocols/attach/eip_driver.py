# SPDX-License-Identifier: Apache-2.0
"""`EipDriver`: access to the tags of a Rockwell PLC by EtherNet/IP (CIP)."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from typing import Any

from pylogix import PLC
from pylogix.lgx_comm import Connection
from pylogix.utils import bit_of_word, parse_tag_name

from conveyor_sim.protocols.attach.elementary_types import BOOL, REAL, fitted
from conveyor_sim.protocols.attach.vendor_driver import DriverError, PlaceError

TYPES: Mapping[int, str] = {
    0xC1: BOOL,
    0xC2: "SINT",
    0xC3: "INT",
    0xC4: "DINT",
    0xC5: "LINT",
    0xC6: "USINT",
    0xC7: "UINT",
    0xC8: "UDINT",
    0xC9: "ULINT",
    0xCA: REAL,
    0xCB: "LREAL",
    0xD1: "BYTE",
    0xD2: "WORD",
    0xD3: BOOL,
}
"""Elementary types by their code (CIP, volume 1, appendix C-6.1). A BOOL array consists of DWORDs (0xD3)."""

_HEADER = 24
_CONNECTED, _SEQUENCE = 0x70, 44


class _FramedConnection(Connection):  # type: ignore[misc]
    """Connection that takes a complete frame as the answer, and only that of the last request.

    The library reads for ever where a PLC ends the connection within a frame, and takes any frame as the answer.
    """

    def receive_data(self) -> bytes:
        """Return one frame. Raise DriverError if none comes in time, or another one than expected."""
        try:
            header = self._exactly(_HEADER)
            command, length, _, status = struct.unpack_from("<HHII", header)
            frame = header + self._exactly(length)
        except TimeoutError:
            raise DriverError(f"no answer came within {self.parent.SocketTimeout:g} s") from None
        except OSError as error:
            raise DriverError(f"the connection ended: {error}") from error
        if status:
            raise DriverError(f"the request is refused with encapsulation status {status:#x}")
        if command == _CONNECTED:
            (number,) = struct.unpack_from("<H", frame, _SEQUENCE)
            if number != (self._sequence_counter - 1) % 0x10000:
                raise DriverError("an answer to another request came")
        return frame

    def _exactly(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            piece = self.Socket.recv(count - len(data))
            if not piece:
                raise ConnectionResetError("the PLC closed it")
            data += piece
        return data


class EipDriver:
    """One connection. Values travel in packets of several services (CIP, Multiple Service Packet)."""

    def __init__(self, host: str, port: int, slot: int, timeout: float, tags: Mapping[str, str]) -> None:
        """tags: tag of the PLC by our name. timeout: longest time for an answer, s."""
        self._tags = dict(tags)
        self._types: dict[str, str] = {}
        self._plc = PLC(host, slot, timeout, port=port)
        self._plc.conn = _FramedConnection(self._plc)

    def connect(self) -> dict[str, str]:
        """Connect, and read every tag once. Return the type of each name."""
        connected, reason = self._plc.conn.connect()
        if not connected:
            raise DriverError(f"can't be reached ({reason}), expected the EtherNet/IP server of a PLC")
        for name, response in self._responses(list(self._tags)):
            _, base, _ = parse_tag_name(self._tags[name])
            code = self._plc.KnownTags.get(base, (0, 0))[0]
            if response.Status != "Success":
                hint = "expected a tag with external access"
                raise PlaceError(name, f"{response.Status}, {hint}")
            if code not in TYPES or not isinstance(response.Value, (bool, int, float)):
                raise PlaceError(name, f"the type with code {code:#x} given, expected {', '.join(TYPES.values())}")
            self._types[name] = BOOL if bit_of_word(self._tags[name]) else TYPES[code]
        return self._types

    def write(self, values: Mapping[str, float]) -> None:
        """Write values, by our names."""
        pairs = [(self._tags[name], fitted(self._types[name], value)) for name, value in values.items()]
        responses = self._plc.Write(pairs)
        if len(responses) != len(pairs):
            raise DriverError(f"{len(responses)} results came for {len(pairs)} values")
        for (tag, _), response in zip(pairs, responses, strict=True):
            if response.Status != "Success":
                raise DriverError(f"{tag} can't be written: {response.Status}, expected external access Read/Write")

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Return values, by our names."""
        values: dict[str, float] = {}
        for name, response in self._responses(names):
            if response.Status != "Success" or response.Value is None:
                raise DriverError(f"{self._tags[name]} can't be read: {response.Status}")
            values[name] = float(response.Value)
        return values

    def close(self) -> None:
        """Disconnect."""
        self._plc.Close()

    def _responses(self, names: Sequence[str]) -> list[tuple[str, Any]]:
        responses = self._plc.Read([self._tags[name] for name in names])
        tags = [response.TagName for response in responses]
        if tags != [self._tags[name] for name in names]:
            raise DriverError(f"{len(responses)} values came for {len(names)} tags")
        return list(zip(names, responses, strict=True))


def make(host: str, port: int, slot: int, timeout: float, tags: Mapping[str, str]) -> EipDriver:
    """Return the driver for one PLC."""
    return EipDriver(host, port, slot, timeout, tags)
