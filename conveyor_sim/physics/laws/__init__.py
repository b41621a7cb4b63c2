# SPDX-License-Identifier: Apache-2.0
"""Coefficients of the contact laws by pair of materials, and dashpots from restitutions."""
