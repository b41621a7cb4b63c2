# SPDX-License-Identifier: Apache-2.0
"""pytest plugin of `same_bits.py record`: copies the input log of every scenario to the folder in SAME_BITS_INPUTS."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture(autouse=True)
def keep_inputs(request: pytest.FixtureRequest) -> Iterator[None]:
    """Copy the logs of the lines that a test made, after the test and before they are removed."""
    if "line" not in request.fixturenames:
        yield
        return
    lines: Any = request.getfixturevalue("line")
    yield
    name = re.sub(r"[^\w.]+", "-", f"{request.node.path.stem}.{request.node.name}")
    folder = Path(os.environ["SAME_BITS_INPUTS"]) / name
    for number, (scenario, inputs) in enumerate(lines.made):
        scenario.close()
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(inputs / "inputs.jsonl", folder / f"inputs_{number}.jsonl")
