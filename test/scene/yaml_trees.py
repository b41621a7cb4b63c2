"""What two readers of YAML make of a text, to be compared."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, ScalarNode

from conveyor_sim.scene.yaml_nodes import TooManyError

MOST = 100_000
"""Values."""


def outcome(compose: Callable[[str, int], Any], text: str) -> Any:
    """The tree, or why there is none."""
    try:
        return _tree(compose(text, MOST))
    except YAMLError as error:
        return str(error)
    except RecursionError:
        return "nested too deeply"
    except TooManyError as error:
        return f"too many values in line {error.line}"


def _tree(root: Any) -> Any:
    """Kinds, values and lines; a node that was there before by its number."""
    numbers: dict[int, int] = {}

    def of(node: Any) -> Any:
        if id(node) in numbers:
            return numbers[id(node)]
        numbers[id(node)] = len(numbers)
        head = type(node).__name__, node.tag, node.start_mark.line
        if isinstance(node, ScalarNode):
            return *head, node.value
        pairs = isinstance(node, MappingNode)
        return *head, [(of(item[0]), of(item[1])) if pairs else of(item) for item in node.value]

    return None if root is None else of(root)
