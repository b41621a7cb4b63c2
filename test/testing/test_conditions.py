# SPDX-License-Identifier: Apache-2.0
"""Texts of conditions."""

from conveyor_sim.testing.conditions import text_of, words_of
from conveyor_sim.testing.scenario import Present

LIMIT = 3


def nearly_full(s: Present) -> bool:
    return s["a"] > LIMIT


def test_a_function_is_told_by_its_name() -> None:
    assert text_of(nearly_full) == "nearly_full"


def test_a_lambda_is_told_by_its_text() -> None:
    assert text_of(lambda s: s["a"] > LIMIT) == 's["a"] > LIMIT'
    over_lines = text_of(
        lambda s: (
            s["a_device_with_a_long_name"] > LIMIT
            and s["some_device_with_a_long_name"] == 0
            and s["another_device_with_a_long_name"]
        )
    )
    assert over_lines.startswith(
        's["a_device_with_a_long_name"] > LIMIT and s["some_device_with_a_long_name"] == 0 and'
    )


def test_two_in_a_line_are_told_apart_where_they_can_be() -> None:
    first, second = (lambda s: s["a"] > 1), (lambda s: s["b"] > 2)
    assert (text_of(first), text_of(second)) == ('s["a"] > 1', 's["b"] > 2')
    more, less = (lambda s: s["a"] > 1), (lambda s: s["a"] < 1)
    assert text_of(more) == text_of(less) == 's["a"] < 1 or s["a"] > 1'


def test_one_without_a_source_is_told_by_its_place() -> None:
    condition = eval(compile("lambda s: s['a'] > 1", "<typed>", "eval"))
    assert text_of(condition) == "the lambda in line 1 of <typed>"


def test_a_callable_object_is_told_by_its_repr() -> None:
    class Full:
        def __call__(self, s: Present) -> bool:
            return s["a"] > 1

        def __repr__(self) -> str:
            return "Full()"

    assert text_of(Full()) == "Full()"


def test_reading_is_noted() -> None:
    present = Present({"a": 1.0, "b": 2.0, "c": 3.0}, 0.0, 0, 0.01)
    assert present["b"] == 2.0 and present.on("a") and present.get("d") is None
    assert list(present.read) == ["b", "a"]


def test_a_condition_is_put_into_words_with_names_and_values_in_place_of_python() -> None:
    name, most = "table", 40
    pairs = [
        (words_of(lambda s: s["belts/table/bottles"] <= 90), "belts/table/bottles ≤ 90"),
        (words_of(lambda s: s[f"belts/{name}/bottles"] >= most), "belts/table/bottles ≥ 40"),
        (words_of(lambda s: not s["a/blocked"] and s.on("b/full")), "not a/blocked and b/full"),
        (words_of(lambda s: abs(s["a"] - s["b"]) < LIMIT or s.time > 1), "abs(a - b) < 3 or time > 1"),
        (words_of(lambda s, least=2: s["a"] != least), "a ≠ 2"),
        (words_of(lambda s: {"x == y": 1}[s["a"]] == 1), "{'x == y': 1}[a] = 1"),
    ]
    assert [words for words, _ in pairs] == [expected for _, expected in pairs]
    assert words_of(nearly_full) == "nearly full"
    assert words_of(eval(compile("lambda s: s['a'] > 1", "<typed>", "eval"))) == "the lambda in line 1 of <typed>"


def test_names_without_a_short_value_stay_names() -> None:
    long = "x" * 1000
    condition = lambda s: s["a"] > later or s[long]  # noqa: E731
    assert words_of(condition) == "a > later or s[long]"
    later = 2
    assert words_of(condition) == "a > 2 or s[long]"
