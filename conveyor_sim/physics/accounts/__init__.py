# SPDX-License-Identifier: Apache-2.0
"""Ledgers of a run: energy, damage, clogging, elastic energy of contacts."""
