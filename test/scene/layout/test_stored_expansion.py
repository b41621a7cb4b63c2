# SPDX-License-Identifier: Apache-2.0
"""An expansion keeps its bits: recordings and hashes of states depend on them.

Its layout has quarter turns only, so that no sine or cosine of a library is in the numbers. JSON stores the shortest
text of each double, which reads back to the same bits.
"""

import json
from pathlib import Path

from conveyor_sim.scene.layout.expand import expand
from conveyor_sim.scene.yaml_lines import Document

HERE = Path(__file__).parent


def test_the_expansion_has_the_stored_bits() -> None:
    layout = Document((HERE / "good_layout.yaml").read_text(encoding="utf-8"), "good_layout.yaml").data
    stored = json.loads((HERE / "good_layout_expanded.json").read_text(encoding="utf-8"))
    assert expand(layout).data == stored
