# SPDX-License-Identifier: Apache-2.0
"""Observations as columns of numbers: one array per quantity."""
