# SPDX-License-Identifier: Apache-2.0
"""`AdsDriver`: access to the symbols of a Beckhoff PLC by ADS."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator, Mapping, Sequence

from pyads import constants, structs
from pyads import pyads_ex as ads

from conveyor_sim.protocols.attach.elementary_types import BOOL, REAL, packed, size, unpacked
from conveyor_sim.protocols.attach.vendor_driver import DriverError, PlaceError

MOST = 100
"""Largest number of values in one sum request. Beckhoff's limit is 500."""

TYPES: Mapping[int, str] = {
    constants.ADST_BIT: BOOL,
    constants.ADST_INT8: "SINT",
    constants.ADST_UINT8: "USINT",
    constants.ADST_INT16: "INT",
    constants.ADST_UINT16: "UINT",
    constants.ADST_INT32: "DINT",
    constants.ADST_UINT32: "UDINT",
    constants.ADST_INT64: "LINT",
    constants.ADST_UINT64: "ULINT",
    constants.ADST_REAL32: REAL,
    constants.ADST_REAL64: "LREAL",
}
"""Elementary types by their ADS data type."""

_NOT_FOUND = 0x710
"""ADS error: symbol not found."""


class AdsDriver:
    """One connection. Values travel in sum requests, by handles.

    A handle becomes invalid when another program is loaded. An address would then be that of another variable.
    """

    def __init__(
        self, net_id: str, port: int, host: str, local: str, timeout: float, symbols: Mapping[str, str]
    ) -> None:
        """host: address, with ":port" if it is not 48898. local: our AMS Net ID; "": from our IP address.

        timeout: longest time for an answer, s. symbols: symbol of the PLC by our name.
        """
        self._target = structs.AmsAddr(net_id, port)
        self._host, self._local, self._timeout = host, local, timeout
        self._symbols = dict(symbols)
        self._types: dict[str, str] = {}
        self._handles: dict[str, int] = {}
        self._port = 0

    def connect(self) -> dict[str, str]:
        """Open a route, get handles and types of all symbols, and read them once. Return the type of each name."""
        if self._local:
            ads.adsSetLocalAddress(structs.AmsAddr(self._local, 0).netIdStruct())
        self._port = ads.adsPortOpenEx()
        try:
            ads.adsAddRoute(self._target.netIdStruct(), self._host)
        except ads.ADSError as error:
            raise DriverError(f"no route to {self._host}: {error}, expected an ADS router at that address") from error
        ads.adsSyncSetTimeoutEx(self._port, round(1000.0 * self._timeout))
        for name, symbol in self._symbols.items():
            try:
                info = ads.adsGetSymbolInfo(self._port, self._target, symbol)
                self._handles[name] = ads.adsGetHandle(self._port, self._target, symbol)
            except ads.ADSError as error:
                if error.err_code != _NOT_FOUND:
                    raise DriverError(f"{symbol}: {error}; expected an AMS route back to this machine") from error
                raise PlaceError(name, f"{error}, expected a symbol of the program") from error
            kind = TYPES.get(info.dataType)
            if kind is None or info.size != size(kind):
                given = f"{info.symbol_type} of {info.size} bytes"
                raise PlaceError(name, f"{given} given, expected a number or BOOL")
            self._types[name] = kind
        self.read(list(self._symbols))
        return self._types

    def write(self, values: Mapping[str, float]) -> None:
        """Write values in their order, by our names."""
        for names in _parts(list(values)):
            data = b"".join(packed(self._types[name], values[name], "<") for name in names)
            request = bytearray(bytes(self._requests(names)) + data)
            self._require(names, self._sum(constants.ADSIGRP_SUMUP_WRITE, names, request), "written")

    def read(self, names: Sequence[str]) -> dict[str, float]:
        """Return values, by our names."""
        values: dict[str, float] = {}
        for part in _parts(names):
            answer = self._sum(constants.ADSIGRP_SUMUP_READ, part, self._requests(part))
            self._require(part, answer, "read")
            at = 4 * len(part)
            for name in part:
                kind = self._types[name]
                values[name] = unpacked(kind, answer[at : at + size(kind)], "<")
                at += size(kind)
        return values

    def close(self) -> None:
        """Release the handles and close the port."""
        if self._port:
            for handle in self._handles.values():
                ads.adsReleaseHandle(self._port, self._target, handle)
            ads.adsPortCloseEx(self._port)
            self._port = 0

    def _requests(self, names: Sequence[str]) -> ctypes.Array[ctypes.Structure]:
        requests: ctypes.Array[ctypes.Structure] = (structs.SAdsSumRequest * len(names))()
        for request, name in zip(requests, names, strict=True):
            request.iGroup = constants.ADSIGRP_SYM_VALBYHND
            request.iOffset, request.size = self._handles[name], size(self._types[name])
        return requests

    def _sum(self, group: int, names: Sequence[str], request: object) -> bytes:
        """Return the complete answer to a sum request."""
        answer = ads.adsSyncReadWriteReqEx2(self._port, self._target, group, len(names), None, request, None)
        return bytes(answer)

    def _require(self, names: Sequence[str], answer: bytes, action: str) -> None:
        """Raise DriverError for the first value with an error code."""
        for number, name in enumerate(names):
            if code := int.from_bytes(answer[4 * number : 4 * number + 4], "little"):
                raise DriverError(f"{self._symbols[name]} can't be {action}: {ads.ADSError(code)}")


def _parts(names: Sequence[str]) -> Iterator[Sequence[str]]:
    for first in range(0, len(names), MOST):
        yield names[first : first + MOST]


def make(net_id: str, port: int, host: str, local: str, timeout: float, symbols: Mapping[str, str]) -> AdsDriver:
    """Return the driver for one PLC."""
    return AdsDriver(net_id, port, host, local, timeout, symbols)
