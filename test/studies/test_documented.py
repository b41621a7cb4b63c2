# SPDX-License-Identifier: Apache-2.0
"""docs/studies.md is true: its study runs, and it leaves out no field and no metric."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from conveyor_sim.studies.check import check_study
from conveyor_sim.studies.design import points_of
from conveyor_sim.studies.load import load_study
from conveyor_sim.studies.metrics import WORDS
from conveyor_sim.studies.parameter import Parameter
from conveyor_sim.studies.results import FIXED_UNITS, read_results
from conveyor_sim.studies.study import RESERVED, Seeds, Study, Until

ROOT = Path(__file__).parent.parent.parent
EXAMPLES = sorted((ROOT / "examples" / "studies").glob("*.yaml"))
SHIPPED = sorted((ROOT / "docs" / "studies").glob("*/study.yaml"))
PAGE = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_examples_can_be_run(path: Path) -> None:
    setup = load_study(path)
    check_study(setup)
    assert points_of(setup.study)


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.parent.name)
def test_results_that_are_shipped_are_those_of_the_study_beside_them(path: Path) -> None:
    pytest.importorskip("pyarrow")
    found = read_results(path.parent / "results.parquet")
    assert found.study == path.read_text(encoding="utf-8")
    assert {row.status for row in found.rows} == {"finished"}
    assert sum(row.cpu for row in found.rows) < 60.0 * 60.0  # so that a slower machine can repeat it, too


def test_the_first_study_is_the_example() -> None:
    shown = re.search(r"```yaml\n# table_length.yaml\n(.*?)```", PAGE, re.DOTALL)
    assert shown is not None
    example = load_study(ROOT / "examples" / "studies" / "table_length.yaml").study
    from ruamel.yaml import YAML

    assert Study.model_validate(YAML(typ="safe").load(shown.group(1))) == example.model_copy(update={"description": ""})


def test_every_field_metric_and_column_is_on_the_page() -> None:
    text = re.sub(r"```.*?```", "", PAGE, flags=re.DOTALL)
    words = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`]+)`", text))))
    fields = {*Study.model_fields, *Parameter.model_fields, *Seeds.model_fields, *Until.model_fields}
    assert {*fields, *WORDS, *RESERVED, *FIXED_UNITS} - {"optimise"} <= words
