# SPDX-License-Identifier: Apache-2.0
"""Messages for foreign forms: each names the form, its place, and the form to use."""

from __future__ import annotations

import re

import pytest

from conveyor_sim.control.st import mistakes, parse
from conveyor_sim.control.st.compile import compile_text
from conveyor_sim.control.st.errors import StructuredTextError
from conveyor_sim.control.st.foreign import WORDS

START = "PROGRAM p VAR x, y : INT; b : BOOL; END_VAR\n"


def refusal(text: str) -> tuple[int, int, str, str]:
    """Return line, column, and the parts before and after `expected` of the refusal of a text."""
    with pytest.raises(StructuredTextError) as error:
        compile_text(text)
    match = re.fullmatch(r"program\.st:(\d+):(\d+): (?:found )?(.*?)(?:, expected (.*))?", str(error.value), re.DOTALL)
    assert match is not None, error.value
    return int(match[1]), int(match[2]), match[3], match[4] or ""


FOREIGN = [  # statement, column, part found, form to use
    ("IF b THEN x := 1; ELSEIF y > 1 THEN x := 2; END_IF;", 19, "ELSEIF", "ELSIF"),
    ("IF b THEN x := 1; ELSE IF y > 1 THEN x := 2; END_IF;", 19, "ELSE IF", "ELSIF"),
    ("IF b THEN x := 1; ENDIF;", 19, "ENDIF", "END_IF"),
    ("x = 5;", 3, "=", "':='"),
    ("x == 5;", 3, "==", "':='"),
    ("IF x == 5 THEN y := 1; END_IF;", 6, "==", "'='"),
    ("IF x := 5 THEN y := 1; END_IF;", 6, ":=", "'='"),
    ("FOR x = 1 TO 5 DO y := x; END_FOR;", 7, "=", "':='"),
    ("x += 1;", 3, "+=", "x := x + y"),
    ("x -= 1;", 3, "-=", "x := x - y"),
    ("x++;", 2, "++", "x := x + 1"),
    ("IF x != 5 THEN y := 1; END_IF;", 6, "!=", "'<>'"),
    ("IF x => 5 THEN y := 1; END_IF;", 6, "=>", "'>='"),
    ("IF x =< 5 THEN y := 1; END_IF;", 6, "=<", "'<='"),
    ("b := b && b;", 8, "&&", "'AND'"),
    ("b := b || b;", 8, "||", "'OR'"),
    ("b := !b;", 6, "!", "'NOT'"),
    ("x := y % 2;", 8, "%", "'MOD'"),
    ("__TRY x := 1; __CATCH(y) x := 2; __ENDTRY", 1, "__TRY", "__TRY"),
    ("x := y^;", 7, "^", "pointers"),
    ("#x := 1;", 1, "#x", "tia"),
    ('"x" := 1;', 1, '"x"', "tia"),
    ("REGION one\nx := 1;\nEND_REGION", 1, "REGION", "tia"),
    ("LD x\nADD 5\nST y", 1, "LD x", "instruction list"),
    ("x := y := 5;", 8, ":=", "one := in a statement"),
    ("b S= y;", 3, "S=", "IF"),
    ("RETURN x;", 1, "RETURN x", "RETURN;"),
    ("x := 'abc", 6, "'abc", "text"),
    ("CASE x OF 1: y := 1; DEFAULT: y := 2; END_CASE;", 22, "DEFAULT", "ELSE"),
    ("b := EDGEPOS(b);", 6, "EDGEPOS", "R_TRIG"),
    ("x := x + ADR(y);", 10, "ADR", "pointers"),
]


@pytest.mark.parametrize(("text", "column", "found", "use"), FOREIGN)
def test_a_foreign_form_is_named_with_the_form_to_use(text: str, column: int, found: str, use: str) -> None:
    line, at, named, expected = refusal(f"{START}{text}\nEND_PROGRAM")
    assert (line, at) == (2, column)
    assert found in named and use in expected


DECLARATIONS = [
    ("<?xml version='1.0'?>\n<TcPlcObject/>", (1, 1), "XML", "Structured Text"),
    ("FUNCTION f(x : INT) : INT END_FUNCTION", (1, 1), "FUNCTION f(", "VAR_INPUT"),
    ("FUNCTION BLOCK f VAR END_VAR END_FUNCTION_BLOCK", (1, 1), "FUNCTION BLOCK", "FUNCTION_BLOCK"),
    ("PROGRAM p VAR INT x; END_VAR END_PROGRAM", (1, 15), "INT x", "x : INT"),
    ("PROGRAM p VAR x : INT = 5; END_VAR END_PROGRAM", (1, 23), "=", "':='"),
    ("PROGRAM p VAR x : ARRAY(1..3) OF INT; END_VAR END_PROGRAM", (1, 19), "ARRAY(", "ARRAY ["),
    ("PROGRAM p VAR x : S5TIME; END_VAR END_PROGRAM", (1, 19), "S5TIME", "TIME"),
    ("PROGRAM p VAR x : VARIANT; END_VAR END_PROGRAM", (1, 19), "VARIANT", "type"),
    ('ORGANIZATION_BLOCK "Main"\nBEGIN END_ORGANIZATION_BLOCK', (1, 1), "ORGANIZATION_BLOCK", "tia"),
    ("FUNCTION_BLOCK f EXTENDS g END_FUNCTION_BLOCK", (1, 18), "EXTENDS", "classes"),
    ("FUNCTION_BLOCK ABSTRACT f VAR END_VAR END_FUNCTION_BLOCK", (1, 1), "ABSTRACT", "classes"),
    ("PROGRAM p VAR b : TON(TRUE, T#1s); END_VAR END_PROGRAM", (1, 19), "TON(TRUE,", "FB_init"),
    ("INTERFACE i END_INTERFACE", (1, 1), "INTERFACE", "classes"),
    ("FUNCTION_BLOCK f METHOD m END_METHOD END_FUNCTION_BLOCK", (1, 18), "METHOD", "classes"),
    ("PROGRAM p VAR x : POINTER TO INT; END_VAR END_PROGRAM", (1, 19), "POINTER", "pointers"),
    ("PROGRAM p INITIAL_STEP s: END_STEP END_PROGRAM", (1, 11), "INITIAL_STEP", "SFC"),
]


@pytest.mark.parametrize(("text", "place", "found", "use"), DECLARATIONS)
def test_a_foreign_declaration_is_named_with_the_form_to_use(
    text: str, place: tuple[int, int], found: str, use: str
) -> None:
    line, at, named, expected = refusal(text)
    assert (line, at) == place
    assert found in named and use in expected


def test_no_message_has_a_name_of_the_grammar() -> None:
    """Each token of the grammar has words, and those with one text are shown as they are written."""
    parser, _ = parse._parser()
    fixed = parse.terminals(parser)
    ignored = set(parser.ignore_tokens)
    for terminal in {one.name for one in parser.terminals} - ignored:
        shown = mistakes.word_of(terminal, fixed)
        assert shown.strip("'").upper() == fixed.get(terminal, "").upper() or shown != terminal


@pytest.mark.parametrize("word", sorted(WORDS))
def test_a_foreign_word_may_be_a_name(word: str) -> None:
    """A declared variable of that name is a variable, and an error after it is not blamed on its name."""
    text = f"PROGRAM p VAR {word} : INT; END_VAR {word} := {word} + 1; "
    assert compile_text(text + "END_PROGRAM").programs


@pytest.mark.parametrize("word", ["INTERFACE", "CLASS", "POINTER", "NAMESPACE", "REFERENCE", "METHOD", "STEP"])
def test_a_word_of_an_unsupported_feature_may_be_a_field(word: str) -> None:
    text = f"TYPE t : STRUCT {word} : INT; END_STRUCT END_TYPE PROGRAM p VAR x : t; END_VAR x.{word} := 1; END_PROGRAM"
    assert compile_text(text).programs


def test_a_variable_with_a_foreign_name_is_not_blamed() -> None:
    _, column, found, _ = refusal("PROGRAM p VAR default, x : INT; END_VAR x := default x; END_PROGRAM")
    assert (column, found) == (54, "'x'")
