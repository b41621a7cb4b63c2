# SPDX-License-Identifier: Apache-2.0
"""Reader of the snippets of Markdown pages."""

import pytest
from shell_blocks import Block, Command, commands, snippets

PAGE = """# Title

    one "a b"      # a comment
    two \\
        -p "{x: 1,
      y: 2}" && three; four

```mermaid
flowchart LR
```

```python
# file.py
    indented = 1
```
"""


def test_commands_and_blocks_come_in_order_without_comments_and_diagrams() -> None:
    assert list(snippets(PAGE)) == [
        Command(("one", "a b")),
        Command(("two", "-p", "{x: 1,\n  y: 2}")),
        Command(("three",)),
        Command(("four",)),
        Block("python", "file.py", "    indented = 1\n"),
    ]


def test_a_quotation_that_is_not_closed_is_an_error() -> None:
    with pytest.raises(ValueError, match="isn't closed"):
        list(commands('echo "a'))
