# SPDX-License-Identifier: Apache-2.0
"""Evaluation of a line's sensors in a tick: blocked beams, crossed lines, regions with bottles."""
