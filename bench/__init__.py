# SPDX-License-Identifier: Apache-2.0
"""Measures speed, memory and start, against other ways of doing the same: `python -m bench`.

Raw numbers go to docs/performance/, tables to the pages there. What is compared in a table runs in one process and
one run, turn by turn, so that a machine that gets slower gets slower for all.
"""
