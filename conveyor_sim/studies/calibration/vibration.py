# SPDX-License-Identifier: Apache-2.0
"""Vibration of a chain from the peak in the spectrum of an accelerometer: amplitude, frequency and direction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from conveyor_sim.studies.calibration.estimate import Estimate, by_sample, mean_estimate
from conveyor_sim.studies.calibration.read import Measurement


@dataclass(frozen=True)
class MeasuredVibration:
    """Result of `vibration`."""

    amplitude: Estimate
    """Amplitude of the displacement, m."""
    frequency: Estimate
    """Hz"""
    direction: Estimate
    """Axis of the displacement to the direction of travel, rad, from -pi/2 to pi/2."""


def vibration(rows: Sequence[Measurement]) -> MeasuredVibration:
    """Return the vibration of a chain.

    A sinusoid of acceleration a at frequency f has the displacement a / (2 pi f)^2. Directions are axes: half a turn
    changes nothing, so they are averaged as doubled angles (Mardia and Jupp 2000, 1.1), and the interval is that of the
    deviations from this mean.
    """
    samples = by_sample(rows)
    accelerations, frequencies, directions = (
        np.array([row.values[name] for row in rows]) for name in ("acceleration", "frequency", "direction")
    )
    doubled = np.exp(2j * directions).mean()
    middle = 0.5 * math.atan2(doubled.imag, doubled.real)
    deviations = np.angle(np.exp(2j * (directions - middle))) / 2.0
    # Moved by half a turn, no value is negative, and the estimate is not cut at 0.
    axis = mean_estimate(deviations + math.pi, samples)
    shift = middle - math.pi
    return MeasuredVibration(
        mean_estimate(accelerations / (2.0 * math.pi * frequencies) ** 2, samples),
        mean_estimate(frequencies, samples),
        replace(axis, value=axis.value + shift, low=axis.low + shift, high=axis.high + shift),
    )
