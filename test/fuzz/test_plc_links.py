# SPDX-License-Identifier: Apache-2.0
"""A few cases of each kind of link; `make fuzz ARGS="--target plc_links"` plays more."""

from pathlib import Path

import pytest

pytest.importorskip("pymodbus", reason="pymodbus is not installed: pip install conveyor-sim[scada]")

from fuzz.targets.plc_links import attack


@pytest.mark.parametrize("seed", range(10))
def test_a_link_with_a_faulty_plc(seed: int, tmp_path: Path) -> None:
    attack(seed, tmp_path)
