# SPDX-License-Identifier: Apache-2.0
"""docs/tutorial_plc.md does what it says: one test passes and one fails, and both pass with the correction."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "tutorial_plc.md").read_text()
PLUGIN = ("-p", "conveyor_sim.testing.plugin", "-p", "no:cacheprovider")


def test_the_program_of_the_tutorial(pytester: pytest.Pytester) -> None:
    (program,) = re.findall(r"```\n\(\* stop_feeder.st \*\)\n(.*?)```", PAGE, re.DOTALL)
    (test,) = re.findall(r"```python\n# test_stop_feeder.py\n(.*?)```", PAGE, re.DOTALL)
    (correction,) = re.findall(r"```\n(IF .* THEN)\n```", PAGE)
    (pytester.path / "my_line.yaml").write_text((ROOT / "examples" / "my_line.yaml").read_text())
    (pytester.path / "stop_feeder.st").write_text(program)
    (pytester.path / "test_stop_feeder.py").write_text(test)
    result = pytester.runpytest_inprocess(*PLUGIN)
    result.assert_outcomes(passed=1, failed=1)
    result.stdout.fnmatch_lines(["FAILED *a_photo_eye_that_fails*"])
    assert list(pytester.path.rglob("line.html"))
    assert program.count("IF full THEN") == 1
    (pytester.path / "stop_feeder.st").write_text(program.replace("IF full THEN", correction))
    pytester.runpytest_inprocess(*PLUGIN).assert_outcomes(passed=2)
