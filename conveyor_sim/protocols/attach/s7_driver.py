# SPDX-License-Identifier: Apache-2.0
"""`S7Driver`: access to data blocks, bit memory, inputs and outputs of a Siemens PLC by S7 communication (PUT/GET)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from snap7 import Area, Client, WordLen
from snap7.error import S7Error

from conveyor_sim.protocols.attach.elementary_types import BOOL, packed, unpacked
from conveyor_sim.protocols.attach.s7_address import S7Address
from conveyor_sim.protocols.attach.vendor_driver import PlaceError

GAP = 16
"""Largest number of unmapped bytes between two tags that are read in one request."""
OVERHEAD = 40
"""Bytes of a PDU that hold no data, rounded up. The library would split a longer run inside a value."""


class S7Driver:
    """One connection. Neighbouring addresses are one request, up to the negotiated PDU size."""

    def __init__(self, host: str, port: int, rack: int, slot: int, addresses: Sequence[S7Address]) -> None:
        """Store the parameters of the connection."""
        self._at = (host, rack, slot, port)
        self._addresses = {each.name: each for each in addresses}
        self._client = Client()

    def connect(self) -> dict[str, str]:
        """Connect, and read every place once. Return the type of each name."""
        host, rack, slot, port = self._at
        self._client.connect(host, rack, slot, port)
        for run in self._runs(self._addresses.values(), GAP):
            self._read_run(run)
        return {name: each.kind for name, each in self._addresses.items()}

    def write(self, values: Mapping[str, float]) -> None:
        """Write values: first all bytes, in runs without a gap, then single bits.

        Eight mapped bits of a byte are written as that byte. The bits of other bytes are one request each, because
        the remaining bits belong to the program of the PLC.
        """
        addresses = [self._addresses[name] for name in values]
        bits = [each for each in addresses if each.kind == BOOL]
        octets = {(each.area, each.db, each.byte): [False] * 8 for each in bits}
        counts = dict.fromkeys(octets, 0)
        for each in bits:
            octets[each.area, each.db, each.byte][each.bit] = values[each.name] != 0.0
            counts[each.area, each.db, each.byte] += 1
        full = [key for key, count in counts.items() if count == 8]
        pieces = [(each, packed(each.kind, values[each.name], ">")) for each in addresses if each.kind != BOOL]
        for area, db, byte in full:
            octet = sum(bit << number for number, bit in enumerate(octets[area, db, byte]))
            pieces.append((S7Address("", area, db, byte, 0, "BYTE"), bytes([octet])))
        data = dict(pieces)
        for run in self._runs(data, 0):
            first, content = run[0], bytearray().join(data[each] for each in run)
            self._client.write_area(Area[first.area], first.db, first.byte, content)
        for each in bits:
            if (each.area, each.db, each.byte) not in full:
                bit = bytearray([values[each.name] != 0.0])
                self._client.write_area(Area[each.area], each.db, 8 * each.byte + each.bit, bit, WordLen.Bit)

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Return values, by our names."""
        values: dict[str, float] = {}
        for run in self._runs((self._addresses[name] for name in names), GAP):
            data, first = self._read_run(run), run[0].byte
            for each in run:
                if each.kind == BOOL:
                    values[each.name] = float(data[each.byte - first] >> each.bit & 1)
                else:
                    values[each.name] = unpacked(each.kind, data[each.byte - first : each.end - first], ">")
        return values

    def close(self) -> None:
        """Disconnect."""
        self._client.disconnect()

    def _runs(self, addresses: Iterable[S7Address], gap: int) -> Iterator[list[S7Address]]:
        """Yield runs in one area that fit in one request, with at most `gap` unmapped bytes between two neighbours."""
        most = self._client.pdu_length - OVERHEAD
        run: list[S7Address] = []
        end = 0
        for each in sorted(addresses, key=lambda each: (each.area, each.db, each.byte, each.bit)):
            if run and (
                (each.area, each.db) != (run[0].area, run[0].db)
                or each.byte > end + gap
                or each.end - run[0].byte > most
            ):
                yield run
                run, end = [], 0
            run.append(each)
            end = max(end, each.end)
        if run:
            yield run

    def _read_run(self, run: Sequence[S7Address]) -> bytes:
        first, count = run[0], max(each.end for each in run) - run[0].byte
        try:
            data = bytes(self._client.read_area(Area[first.area], first.db, first.byte, count))
        except S7Error as error:
            if error.error_code is None and "failed" not in str(error):
                raise  # no refusal of the PLC, but a lost connection or a malformed answer
            hint = "expected an existing address, PUT/GET permitted, and a data block without optimised access"
            raise PlaceError(first.name, f"{error}, {hint}") from error
        if len(data) != count:
            raise PlaceError(first.name, f"{len(data)} bytes came, expected {count}")
        return data


def make(host: str, port: int, rack: int, slot: int, addresses: Sequence[S7Address]) -> S7Driver:
    """Return the driver for one PLC."""
    return S7Driver(host, port, rack, slot, addresses)
