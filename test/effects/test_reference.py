"""The list of effects in the docs is what the declarations say."""

from pathlib import Path

from conveyor_sim.effects.reference import reference

DOCS = Path(__file__).parents[2] / "docs" / "effects.md"


def test_docs_are_current() -> None:
    assert DOCS.read_text(encoding="utf-8") == reference(), (
        "run `python -m conveyor_sim.effects.reference > docs/effects.md`"
    )
