# SPDX-License-Identifier: Apache-2.0
"""Alarms by ISA-18.2: declarations, states, delays, suppression, first-out."""
