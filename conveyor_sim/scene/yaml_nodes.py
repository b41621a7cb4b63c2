"""YAML text to nodes (https://yaml.org/spec/1.2.2), by one of two libraries.

libyaml is much faster, and follows YAML 1.1: it reads what both understand in the same way. ruamel.yaml, which follows
YAML 1.2, reads all other texts, and says what is wrong with a text.
"""

import re
from functools import lru_cache
from typing import Any

import yaml
from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.resolver import VersionedResolver
from ruamel.yaml.tag import Tag

_LIBYAML = getattr(yaml, "CSafeLoader", None)
"""None where PyYAML was built without it."""
_ORDINARY = re.compile("[\n -~\xa0-\u2027\u202a-\ud7ff\ue000-\ufefe\uff00-\ufffd\U00010000-\U0010ffff]*")
"""Texts without tabs, byte order marks and line ends other than \\n: YAML 1.1 has other rules for these."""
_READ_OTHERWISE = re.compile(r"""[]}"']:\S|[&*][\w-]+[?:%@`]|^\.\.\.""", re.MULTILINE)
"""The two differ in a colon right after a bracket or a quote, in anchors with such signs in their names, in "..."."""

_RESOLVER = VersionedResolver()
_MAPPING, _SEQUENCE, _STRING = (Tag(suffix=f"tag:yaml.org,2002:{name}") for name in ("map", "seq", "str"))


class TooManyError(Exception):
    """A text has more values than are allowed."""

    def __init__(self, line: int) -> None:
        """line: where it was seen, from 1."""
        super().__init__()
        self.line = line


def compose(text: str, most: int) -> Node | None:
    """Read a text of one document. Returns its root; None if the text is empty. An alias is the node that it names.

    most: values, an alias counted as one. Raises TooManyError if there are more, before all of them are in memory;
    RecursionError if they are nested too deeply; ruamel's YAMLError for what is no YAML.
    """
    if _LIBYAML and _ORDINARY.fullmatch(text) and not _READ_OTHERWISE.search(text):
        try:
            return _LibyamlComposer(_LIBYAML(text), most).root()
        except (_OtherwiseError, yaml.YAMLError):
            pass
    return compose_in_full(text, most)


def compose_in_full(text: str, most: int) -> Node | None:
    """As `compose`, but always by ruamel."""
    reader = YAML(typ="safe", pure=True)
    reader.Composer = _RuamelComposer
    reader.composer.left = most
    root: Node | None = reader.compose(text)
    return root


class _RuamelComposer(Composer):
    """Stops where a text has too many values, before all of it is in memory."""

    left = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """One value and all in it."""
        self.left -= 1
        if self.left < 0:
            raise TooManyError(self.parser.peek_event().start_mark.line + 1)
        return super().compose_node(parent, index)


class _OtherwiseError(Exception):
    """Here libyaml and ruamel may read different things."""


class _LibyamlComposer:
    """Makes the nodes that ruamel's composer makes, of libyaml's events."""

    def __init__(self, events: Any, most: int) -> None:
        self._next = events.get_event
        self._left = most
        self._named: dict[str, Node] = {}

    def root(self) -> Node | None:
        self._next()  # the stream begins
        event = self._next()
        if isinstance(event, yaml.StreamEndEvent):
            return None
        if event.version or event.tags:
            raise _OtherwiseError
        root = self._node(self._next())
        self._next()  # the document ends
        if not isinstance(self._next(), yaml.StreamEndEvent):
            raise _OtherwiseError
        return root

    def _node(self, event: Any) -> Node:
        self._left -= 1
        if self._left < 0:
            raise TooManyError(event.start_mark.line + 1)
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self._named:
                raise _OtherwiseError
            return self._named[event.anchor]
        if event.tag is not None or event.anchor in self._named:
            raise _OtherwiseError
        if isinstance(event, yaml.ScalarEvent):
            return self._kept(event, self._scalar(event))
        if isinstance(event, yaml.SequenceStartEvent):
            sequence = self._kept(event, SequenceNode(_SEQUENCE, [], event.start_mark, None))
            while not isinstance(event := self._next(), yaml.SequenceEndEvent):
                sequence.value.append(self._node(event))
            return sequence
        mapping = self._kept(event, MappingNode(_MAPPING, [], event.start_mark, None))
        while not isinstance(event := self._next(), yaml.MappingEndEvent):
            mapping.value.append((self._node(event), self._node(self._next())))
        return mapping

    def _kept(self, event: Any, node: Node) -> Node:
        """Keep a node by its anchor, before its content is read: an alias in there may name it."""
        if event.anchor is not None:
            self._named[event.anchor] = node
        return node

    def _scalar(self, event: Any) -> ScalarNode:
        # The two put an empty value on different lines, and end a block of text at different places.
        if event.style in ("|", ">") or not (event.value or event.style):
            raise _OtherwiseError
        tag = _tag(event.value) if event.implicit[0] else _STRING
        return ScalarNode(tag, event.value, event.start_mark, event.end_mark)


@lru_cache(maxsize=4096)
def _tag(value: str) -> Tag:
    """What a value without quotes is, by the rules of YAML 1.2."""
    tag: Tag = _RESOLVER.resolve(ScalarNode, value, (True, False))
    return tag
