# SPDX-License-Identifier: Apache-2.0
"""Positions in a tick at which an integrator is called."""

START, RESUME = 0, 1
