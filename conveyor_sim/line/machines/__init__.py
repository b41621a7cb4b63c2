# SPDX-License-Identifier: Apache-2.0
"""Machines that follow the PackML state model, their counters and time accounts."""
