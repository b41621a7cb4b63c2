"""One request line to a child process and one answer line from it, within a deadline and a length."""

from __future__ import annotations

import os
import select
import time

_CHUNK = 65536


class AnswerError(Exception):
    """A missing or wrong answer. The text continues a sentence: "sent more than ... bytes"."""


class LateError(AnswerError):
    """The deadline has passed."""


class EndedError(AnswerError):
    """The child has closed its pipe, before or within the answer."""


def exchange(socket: int, request: bytes, patience: float, most: int) -> bytes:
    """Send a line to a child, and return its next line.

    socket: descriptor. patience: wall time for request and answer together, s. most: largest number of bytes in the
    answer. Raise LateError, EndedError, or AnswerError for a wrong answer.
    """
    os.set_blocking(socket, False)
    end, left, received = time.monotonic() + patience, memoryview(request), bytearray()
    waiting = select.poll()  # select() takes no descriptors from 1024 on
    waiting.register(socket, select.POLLIN | select.POLLOUT)
    while True:
        remaining = end - time.monotonic()
        ready = waiting.poll(max(0.0, remaining) * 1e3) if remaining > 0.0 else []
        if not ready:
            raise LateError(f"took more than {patience:g} s of wall time")
        ((_, events),) = ready
        if left and events & select.POLLOUT:
            left = left[_written(socket, left) :]
            if not left:
                waiting.modify(socket, select.POLLIN)
        if events & ~select.POLLOUT:
            received += (chunk := _read(socket))
            if b"\n" in chunk:
                break
        if len(received) > most:
            raise AnswerError(f"sent more than {most} bytes")
    line, _, rest = bytes(received).partition(b"\n")
    if left or rest or len(line) > most:
        raise AnswerError(f"sent more than {most} bytes" if len(line) > most else "sent data without a request")
    return line


def _written(socket: int, data: memoryview) -> int:
    """Return the number of bytes that the socket took. Raise EndedError."""
    try:
        return os.write(socket, data[:_CHUNK])
    except BlockingIOError:
        return 0
    except OSError:
        raise EndedError("has ended") from None


def _read(socket: int) -> bytes:
    """Return the bytes that have arrived, at least one. Raise EndedError."""
    try:
        chunk = os.read(socket, _CHUNK)
    except OSError:
        chunk = b""
    if not chunk:
        raise EndedError("has ended")
    return chunk
