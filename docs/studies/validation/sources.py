# SPDX-License-Identifier: Apache-2.0
"""All sources of the validation, in the order of docs/validation.md."""

from __future__ import annotations

from importlib import import_module

from validation.source import Source

MODULES = (
    "chung_ooi_2011",
    "tipping",
    "wang_2020",
    "aguirre_2010",
    "aguirre_2014",
    "to_2001",
    "karim_corwin_2014",
    "mankoc_2007",
    "two_machine_line",
    "longer_line",
    "labellers",
)
"""Modules of this folder that have a `SOURCE`."""


def source(name: str) -> Source:
    """Return the source of a module."""
    found: Source = import_module(f"validation.{name}").SOURCE
    return found


def sources() -> list[Source]:
    """Return all sources."""
    return [source(name) for name in MODULES]
