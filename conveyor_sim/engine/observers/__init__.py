# SPDX-License-Identifier: Apache-2.0
"""Observers: contacts as columns, the energy ledger, damage, the guard."""
