"""Messages that a damaged file has lost: how many, and between which log times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Loss:
    """Messages that can't be read any more."""

    messages: int | None
    """None: not known."""
    start_ns: int | None
    """Log times between which they were; None: from the beginning, or to the end."""
    end_ns: int | None

    def __str__(self) -> str:
        count = "an unknown number of messages" if self.messages is None else f"{self.messages} messages"
        start = "the beginning" if self.start_ns is None else seconds(self.start_ns)
        end = "the end" if self.end_ns is None else seconds(self.end_ns)
        return f"lost: {count} from {start} to {end}"


def seconds(time_ns: int) -> str:
    """Return a log time in words."""
    return f"{time_ns * 1e-9:.2f} s"


def lose(losses: list[Loss], loss: Loss, starts: Sequence[int]) -> None:
    """Add a loss. Join it to the last one, unless a valid chunk starts between them (`starts`)."""
    last = losses[-1] if losses else None
    if last is not None and _adjoin(last, loss, starts):
        known = last.messages is not None and loss.messages is not None
        count = (last.messages or 0) + (loss.messages or 0) if known else None
        losses[-1] = Loss(count, last.start_ns, loss.end_ns)
    elif last is None or (last.start_ns, last.end_ns) != (loss.start_ns, loss.end_ns):
        losses.append(loss)


def without_one(losses: Sequence[Loss], time_ns: int) -> list[Loss]:
    """Return losses less one message of a log time, which was restored."""
    left = []
    restored = False
    for loss in losses:
        after = loss.start_ns is None or loss.start_ns <= time_ns
        before = loss.end_ns is None or time_ns <= loss.end_ns
        if not restored and after and before and loss.messages is not None:
            restored = True
            loss = Loss(loss.messages - 1, loss.start_ns, loss.end_ns)
        if loss.messages != 0:
            left.append(loss)
    return left


def _adjoin(first: Loss, second: Loss, starts: Sequence[int]) -> bool:
    if first.end_ns is None or second.start_ns is None:
        return False
    return not any(first.end_ns <= start <= second.start_ns for start in starts)
