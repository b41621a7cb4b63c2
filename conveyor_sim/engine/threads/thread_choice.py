# SPDX-License-Identifier: Apache-2.0
"""Choice of the number of threads: the fastest one by measurement, which changes with the load on the cores.

Occasionally a tick is taken with half or twice the threads. Every trial that loses doubles the wait for the next, so on
a busy machine trials cost little. A tick that is suddenly much slower starts a trial at once.
"""

LEAST_WORK = 300e-6
"""Duration of a tick on one thread, s, below which waking other threads costs more than they save."""

GAIN = 0.95
"""A trial wins if it takes less than this share of the time."""

SUDDEN = 1.3
"""Slowdown of a tick that starts a trial."""

FIRST_WAIT, LONGEST_WAIT = 4, 512
"""Ticks between trials."""


class ThreadChoice:
    """Chooses the number of threads for the next tick, from 1 to `most`, by the durations of earlier ticks."""

    def __init__(self, most: int) -> None:
        self._sizes = [size for size in (1 << power for power in range(most.bit_length())) if size <= most]
        if self._sizes[-1] != most:
            self._sizes.append(most)
        self._index = 0
        self._trial: int | None = None
        self._last: float | None = None
        self._wait = FIRST_WAIT
        self._until_trial = FIRST_WAIT
        self._upwards = True

    @property
    def size(self) -> int:
        """Return the number of threads for the next tick."""
        return self._sizes[self._index if self._trial is None else self._trial]

    def took(self, seconds: float, work: float) -> None:
        """Record that a tick with `size` threads took `seconds` for an amount of work (bottle-steps)."""
        rate = seconds / work
        if self._trial is not None:
            self._judge(rate)
            return
        sudden = self._last is not None and rate > SUDDEN * self._last
        self._last = rate
        self._until_trial -= 1
        if self._until_trial <= 0 or (sudden and self._index > 0):
            self._start_trial(seconds, downwards=sudden)

    def _judge(self, rate: float) -> None:
        trial, self._trial = self._trial, None
        if trial is not None and self._last is not None and rate < GAIN * self._last:
            self._index, self._last, self._wait = trial, rate, FIRST_WAIT
        else:
            self._wait = min(2 * self._wait, LONGEST_WAIT)
        self._until_trial = self._wait

    def _start_trial(self, seconds: float, downwards: bool) -> None:
        up = self._upwards and not downwards
        self._upwards = not self._upwards
        other = self._index + (1 if up else -1)
        if not 0 <= other < len(self._sizes):
            other = self._index + (-1 if up else 1)
        if not 0 <= other < len(self._sizes) or (self._index == 0 and seconds < LEAST_WORK):
            self._until_trial = self._wait
            return
        self._trial = other
