# SPDX-License-Identifier: Apache-2.0
"""Description of this machine, for measurements."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("numpy", "numba", "llvmlite")
VECTORS = ("avx512f", "avx2", "sse4_2")
"""Widest first."""


def machine(packages: Sequence[str] = PACKAGES) -> str:
    """Return processor, cores, system and versions of installed packages, in one line."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    facts = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    flags = facts.get("flags", "").split()
    vector = next((name for name in VECTORS if name in flags), "no vector units")
    processor = f"{facts.get('model name', platform.machine())} (family {facts.get('cpu family')}, {vector})"
    versions = ", ".join(f"{name} {number}" for name in packages if (number := installed(name)))
    return (
        f"{processor}, {len(os.sched_getaffinity(0))} cores, Linux {platform.release().split('-')[0]}, "
        f"CPython {platform.python_version()}, {versions}"
    )


def installed(package: str) -> str:
    """Return the version of a package, "" if it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""
