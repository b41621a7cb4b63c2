# SPDX-License-Identifier: Apache-2.0
"""Threads that step together, with the bits of a single one."""
