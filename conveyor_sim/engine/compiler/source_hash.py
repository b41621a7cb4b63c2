# SPDX-License-Identifier: Apache-2.0
"""Hash over the syntax of sources, without comments, docstrings and layout. It is equal on all versions of Python.

Parsing takes a quarter of a second at every start, so the hash is cached in a file, named by a hash over the bytes.
"""

import ast
import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path

from conveyor_sim.engine.compiler.cache_folder import choose_cache_folder


def source_hash(root: Path, sources: Iterable[Path], size: int) -> str:
    """Return 2 size hex digits over the syntax of files, and their names below a folder."""
    contents = {source.relative_to(root).as_posix(): source.read_bytes() for source in sorted(sources)}
    folder, _ = choose_cache_folder("sources")
    if folder is None:
        return _parsed(contents, size)
    file = folder / _hash((part for item in contents.items() for part in (item[0].encode(), item[1])), 16)
    with suppress(OSError):
        cached = file.read_bytes()
        if cached == _with_checksum(cached[: 2 * size]):
            return cached[: 2 * size].decode()
    digits = _parsed(contents, size)
    with suppress(OSError):
        temporary = file.with_name(f"{file.name}.{os.getpid()}")
        temporary.write_bytes(_with_checksum(digits.encode()))
        temporary.replace(file)
    return digits


def _with_checksum(digits: bytes) -> bytes:
    return digits + b" " + _hash([digits], 16).encode()


def _parsed(contents: Mapping[str, bytes], size: int) -> str:
    parts = ("\0".join((name, *_syntax(ast.parse(content)))) for name, content in contents.items())
    return _hash((part.encode() for part in parts), size)


def _hash(parts: Iterable[bytes], size: int) -> str:
    digest = hashlib.blake2b(digest_size=size)
    for part in parts:
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()


def _syntax(node: ast.AST) -> Iterator[str]:
    """Yield kinds and fields of a node and of those below. Empty fields are skipped: newer versions add some."""
    yield type(node).__name__
    for name, value in ast.iter_fields(node):
        if isinstance(value, list):
            parts = [part for part in value if not _is_text(part)]
            if parts:
                yield f"{name} {len(parts)}"
                for part in parts:
                    yield from _syntax(part) if isinstance(part, ast.AST) else (repr(part),)
        elif isinstance(value, ast.AST):
            yield name
            yield from _syntax(value)
        elif value is not None:
            yield f"{name} {value!r}"


def _is_text(part: object) -> bool:
    """Return True for a statement that is only a text, such as a docstring."""
    return isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant) and isinstance(part.value.value, str)
