"""One request line to a child process and one answer line from it, within a deadline and a length."""

from __future__ import annotations

import os
import select
import subprocess
import time

_CHUNK = 65536


class AnswerError(Exception):
    """A missing or wrong answer. The text continues a sentence: "sent more than ... bytes"."""


class LateError(AnswerError):
    """The deadline has passed."""


class EndedError(AnswerError):
    """The child has closed its pipe, before or within the answer."""


def exchange(process: subprocess.Popen[bytes], request: bytes, patience: float, most: int) -> bytes:
    """Send a line to the standard input of a child, and return the next line of its standard output.

    patience: wall time for request and answer together, s. most: largest number of bytes in the answer. The pipes must
    be unbuffered. Raise LateError, EndedError, or AnswerError for a wrong answer.
    """
    assert process.stdin is not None and process.stdout is not None
    inward, outward = process.stdout.fileno(), process.stdin.fileno()
    for pipe in (inward, outward):
        os.set_blocking(pipe, False)
    end, left, received = time.monotonic() + patience, memoryview(request), bytearray()
    waiting = select.poll()  # select() takes no descriptors from 1024 on
    waiting.register(inward, select.POLLIN)
    waiting.register(outward, select.POLLOUT)
    while True:
        remaining = end - time.monotonic()
        ready = dict(waiting.poll(max(0.0, remaining) * 1e3)) if remaining > 0.0 else {}
        if not ready:
            raise LateError(f"took more than {patience:g} s of wall time")
        if outward in ready and left:
            left = left[_written(outward, left) :]
            if not left:
                waiting.unregister(outward)
        if inward in ready:
            received += (chunk := _read(inward))
            if b"\n" in chunk:
                break
        if len(received) > most:
            raise AnswerError(f"sent more than {most} bytes")
    line, _, rest = bytes(received).partition(b"\n")
    if left or rest or len(line) > most:
        raise AnswerError(f"sent more than {most} bytes" if len(line) > most else "sent data without a request")
    return line


def _written(pipe: int, data: memoryview) -> int:
    """Return the number of bytes that the pipe took. Raise EndedError."""
    try:
        return os.write(pipe, data[:_CHUNK])
    except BlockingIOError:
        return 0
    except OSError:
        raise EndedError("has ended") from None


def _read(pipe: int) -> bytes:
    """Return the bytes that have arrived, at least one. Raise EndedError."""
    chunk = os.read(pipe, _CHUNK)
    if not chunk:
        raise EndedError("has ended")
    return chunk
