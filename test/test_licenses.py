# SPDX-License-Identifier: Apache-2.0
"""Every source file names its license."""

import subprocess
from pathlib import Path

ROOT = Path(__file__).parent.parent
KINDS = {".c", ".cmake", ".css", ".h", ".js", ".lark", ".py", ".sh"}
LINE = "SPDX-License-Identifier: Apache-2.0"
LIBRARIES = "conveyor_sim/page/page/lib/"


def test_every_source_file_begins_with_its_license() -> None:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True)
    names = [name for name in listed.stdout.splitlines() if Path(name).suffix in KINDS]
    files = [ROOT / name for name in names if not name.startswith(LIBRARIES)]
    sources = {file: file.read_text() for file in files if file.exists()}
    assert len(sources) > 1000
    # Below `#! ...`, if there is such a line. Empty files need none.
    assert [file for file, text in sources.items() if text and LINE not in "".join(text.splitlines()[:2])] == []
