# SPDX-License-Identifier: Apache-2.0
"""Belts, floor and bases: the belt that carries a bottle, and its friction."""
