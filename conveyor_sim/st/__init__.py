"""PLC programs in Structured Text (IEC 61131-3:2013), as controllers of a line.

A text goes one way: `parse.py` (with `grammar.lark`) makes the tree of `tree.py`; `declarations.py` its types
(`types.py`) and names (`scope.py`); `expressions.py`, `calls.py` and `statements.py` check what is done and write it as
Python, and `compile.py` puts that together. `functions.py`, `conversions.py` and `blocks.py` are the standard library,
`operations.py` what code needs at run time. `program.py` runs it. What the standard leaves open is decided in
docs/structured_text.md.
"""
