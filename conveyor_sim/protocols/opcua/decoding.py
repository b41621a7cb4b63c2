"""`BoundedBuffer`: the bytes of one message, decoded only within an allowance.

The library builds Python objects for everything that a message announces. This class relies on how it reads
(`asyncua.ua.ua_binary`). Every element of an array costs at least one `read`. A length is a `read(4)` directly before
the bytes that it announces. The body of an extension object is a `copy`. Elements of arrays of null values cost no
`read`, so their length itself is checked.
"""

from __future__ import annotations

from dataclasses import dataclass

from asyncua import ua
from asyncua.common.utils import NotEnoughData, ServiceError

from conveyor_sim.protocols.opcua.asyncua_internals import OpenBuffer

_ARRAYS_OF_NULL = (b"\x80", b"\xc0")
"""First byte of a variant that holds an array of null values, without and with dimensions (OPC 10000-6, 5.2.2.16)."""

_ITEM_SIZES = (2, 4, 8)
"""Bytes of one number in arrays that the library reads as a block."""

_OBJECT = 3
"""Steps for a byte that is read alone: it usually begins an object, which costs more than a number."""


@dataclass
class Allowance:
    """Limits on decoding one message, and the steps used so far."""

    steps: int
    """Elementary values that may be decoded, `_OBJECT` for each single byte."""
    array_length: int
    """Elements of one array of numbers or null values."""
    string_bytes: int
    """Bytes of one string, byte string, or array of bytes."""
    exceeded: bool = False
    """True once a limit was exceeded."""
    used: int = 0
    """Steps so far."""

    def spend(self, steps: int) -> None:
        """Count steps. Raise ServiceError with BadEncodingLimitsExceeded beyond the limit."""
        self.used += steps
        if self.used > self.steps:
            self.refuse()

    def refuse(self) -> None:
        """Raise ServiceError with BadEncodingLimitsExceeded."""
        self.exceeded = True
        raise ServiceError(ua.StatusCodes.BadEncodingLimitsExceeded)


class BoundedBuffer(OpenBuffer):
    """A buffer whose copies share one allowance."""

    def __init__(self, data: bytes, allowance: Allowance, start: int = 0, size: int = -1) -> None:
        """Begin at byte `start` of `data` and end after `size` bytes; -1: at the end of `data`."""
        super().__init__(data, start, size)
        self.allowance = allowance
        self._before = self._last = b""

    def read(self, size: int) -> bytes:
        """Return the next `size` bytes. Raise NotEnoughData, or ServiceError beyond the allowance."""
        if size < 0:
            # The library would step back and decode the same bytes again.
            raise NotEnoughData(f"{size} bytes announced, expected at least 0")
        if len(self._last) == 4 and size > 4:
            self._check_block(size)
        data = super().read(size)
        self.allowance.spend(_OBJECT if size == 1 else 1)
        self._before, self._last = self._last, data
        if size == 4 and self._before in _ARRAYS_OF_NULL:
            count = int.from_bytes(data, "little", signed=True)
            if count > self.allowance.array_length:
                self.allowance.refuse()
            self.allowance.spend(max(0, count))
        return data

    def _check_block(self, size: int) -> None:
        """Check an array or string of `size` bytes against the length that was read before it."""
        count = int.from_bytes(self._last, "little", signed=True)
        too_long = count == size and count > self.allowance.string_bytes
        if too_long or (count > self.allowance.array_length and any(count * item == size for item in _ITEM_SIZES)):
            self.allowance.refuse()

    def copy(self, size: int = -1) -> BoundedBuffer:
        """Return a buffer over the next `size` bytes with the same allowance; -1: over all that is left."""
        data, start, size = self.window(size)
        return BoundedBuffer(data, self.allowance, start, size)
