# SPDX-License-Identifier: Apache-2.0
"""Damaged and hostile DXF files: each gives one error that names the file."""

from __future__ import annotations

from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from conveyor_sim.errors import ConveyorError
from conveyor_sim.page.drawings import dxf_file, entities
from conveyor_sim.page.drawings.entities import read_plan

ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed: pip install conveyor-sim[cad]")


def valid(draw: Callable[[Any, Any], None] = lambda document, space: None) -> bytes:
    document = ezdxf.new("R2000", units=4)
    document.modelspace().add_line((0, 0), (1, 0), dxfattribs={"layer": "A"})
    draw(document, document.modelspace())
    stream = StringIO()
    document.write(stream)
    encoded: bytes = document.encode(stream.getvalue())
    return encoded


def refused(path: Path, content: bytes) -> str:
    path.write_bytes(content)
    with pytest.raises(ConveyorError) as caught:
        read_plan(path, "mm", lambda layer, block: False)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert "\n" not in text
    return text


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "not a DXF file"),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "not a DXF file"),
        (b"AC1027" + bytes(200), "DWG"),
        (b"AutoCAD Binary DXF\r\n\x1a\x00" + bytes(100), "binary DXF"),
        (b"  0\nSECTION\n  2\nENTITIES\n  0\nENDSEC\n", "EOF"),
        (b"  0\nSECTION\n  2\nHEADER\nnonsense\n1\n  0\nEOF\n", "DXF"),
        (b"  0\nSECTION\n" * 5 + b"  0\nEOF\n", "DXF"),
    ],
    ids=["empty", "picture", "dwg", "binary", "ends early", "nonsense", "sections"],
)
def test_other_content(tmp_path: Path, content: bytes, expected: str) -> None:
    assert expected in refused(tmp_path / "plan.dxf", content)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99])
def test_cut_files(tmp_path: Path, share: float) -> None:
    content = valid()
    refused(tmp_path / "plan.dxf", content[: int(share * len(content))])


@pytest.mark.parametrize("value", ["nan", "inf", "1e300", "-1e12"])
@pytest.mark.parametrize("group", [b"10", b"11"])
def test_impossible_coordinates(tmp_path: Path, value: str, group: bytes) -> None:
    at = {b"10": (123.25, 0), b"11": (0, 0)}[group], {b"10": (0, 0), b"11": (123.25, 0)}[group]
    content = valid(lambda document, space: space.add_line(*at, dxfattribs={"layer": "B"}))
    text = refused(tmp_path / "plan.dxf", content.replace(b"123.25", value.encode()))
    assert "layer B" in text


@pytest.mark.parametrize("field", ["radius", "bulge", "angle", "scale"])
def test_impossible_sizes(tmp_path: Path, field: str) -> None:
    def draw(document: Any, space: Any) -> None:
        if field == "bulge":
            space.add_lwpolyline([(0, 0, 77.125), (1, 0, 0)], format="xyb")
        elif field == "scale":
            document.blocks.new("B").add_line((0, 0), (1, 0))
            space.add_blockref("B", (0, 0), dxfattribs={"xscale": 77.125})
        else:
            space.add_arc((0, 0), 77.125 if field == "radius" else 5.0, 77.125, 90)

    refused(tmp_path / "plan.dxf", valid(draw).replace(b"77.125", b"nan"))


def test_blocks_in_a_circle(tmp_path: Path) -> None:
    def draw(document: Any, space: Any) -> None:
        one, two = document.blocks.new("ONE"), document.blocks.new("TWO")
        one.add_blockref("TWO", (0, 0))
        two.add_blockref("ONE", (0, 0))
        space.add_blockref("ONE", (0, 0))

    assert "ONE" in refused(tmp_path / "plan.dxf", valid(draw))


def test_blocks_that_multiply(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten levels of ten blocks are 1e10 lines."""
    monkeypatch.setattr(entities, "MOST_ENTITIES", 1000)

    def draw(document: Any, space: Any) -> None:
        document.blocks.new("L0").add_line((0, 0), (1, 0))
        for level in range(1, 10):
            block = document.blocks.new(f"L{level}")
            for _ in range(10):
                block.add_blockref(f"L{level - 1}", (0, 0))
        space.add_blockref("L9", (0, 0))

    assert "1000" in refused(tmp_path / "plan.dxf", valid(draw))
    apart = {"row_spacing": 1, "column_spacing": 1}

    def array(document: Any, space: Any) -> None:
        document.blocks.new("B")
        space.add_blockref("B", (0, 0), dxfattribs={"row_count": 30000, "column_count": 30000, **apart})

    many = valid(array)
    assert "900000000" in refused(tmp_path / "plan.dxf", many)


def test_many_entities(tmp_path: Path) -> None:
    """Files are refused before they are parsed."""
    line = b"  0\nLINE\n  8\nA\n 10\n0\n 20\n0\n 11\n1\n 21\n0\n"
    content = b"  0\nSECTION\n  2\nENTITIES\n" + line * 1_000_000 + b"  0\nENDSEC\n  0\nEOF\n"
    assert str(dxf_file.MOST_ENTITIES) in refused(tmp_path / "plan.dxf", content)


def test_missing_files_and_folders(tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "missing.dxf", Path("/dev/zero")):
        with pytest.raises(ConveyorError, match="expected a DXF file"):
            read_plan(path)
