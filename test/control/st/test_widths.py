# SPDX-License-Identifier: Apache-2.0
"""Intermediate results of integers against a model that computes each operation as the page states.

The model has no ranges and no chains: every result is wrapped at the width in docs/structured_text.md.
"""

from __future__ import annotations

import random
from typing import NamedTuple

from conveyor_sim.control.st.compile import compile_text
from conveyor_sim.control.st.program import Program

BITS = {"SINT": 8, "INT": 16, "DINT": 32, "LINT": 64, "USINT": 8, "UINT": 16, "UDINT": 32, "ULINT": 64}
SIGNED = ("SINT", "INT", "DINT", "LINT")
ORDER = ("SINT", "USINT", "INT", "UINT", "DINT", "UDINT", "LINT", "ULINT")


class Computed(NamedTuple):
    type: str
    value: int


def holds(kind: str) -> tuple[int, int]:
    bits = BITS[kind]
    return (-(1 << bits - 1), (1 << bits - 1) - 1) if kind in SIGNED else (0, (1 << bits) - 1)


def wrap(value: int, kind: str) -> int:
    low, _ = holds(kind)
    return (value - low) % (1 << BITS[kind]) + low


def register(kind: str) -> str:
    return kind if BITS[kind] >= 32 else "DINT" if kind in SIGNED else "LINT"


def common(left: str, right: str) -> str | None:
    for kind in ORDER:
        low, high = holds(kind)
        if all(low <= holds(one)[0] and holds(one)[1] <= high for one in (left, right)):
            return kind
    return None


def towards_zero(a: int, b: int) -> int:
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


def computed(operator: str, left: Computed, right: Computed) -> Computed | None:
    kind = common(left.type, right.type)
    if kind is None:
        return None
    a, b = wrap(left.value, register(kind)), wrap(right.value, register(kind))
    if operator in ("/", "MOD") and b == 0:
        return None
    exact = {
        "+": lambda: a + b,
        "-": lambda: a - b,
        "*": lambda: a * b,
        "/": lambda: towards_zero(a, b),
        "MOD": lambda: a - towards_zero(a, b) * b,
        "MAX": lambda: max(a, b),
        "MIN": lambda: min(a, b),
    }[operator]()
    return Computed(kind, wrap(exact, register(kind)))


class Expressions:
    """Random expressions of variables, with the value and the type that the model gives them."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self.declared: list[str] = []
        self.constants: list[str] = []

    def _variable(self) -> tuple[str, str, Computed]:
        kind = self._random.choice([*BITS, "SINT", "INT", "USINT", "UINT"])
        low, high = holds(kind)
        value = self._random.choice([low, high, high - 1, 0, 1, 2, 7, self._random.randint(low, high)])
        value = min(max(value, low), high)
        name = f"v{len(self.declared)}"
        self.declared.append(f"{name} : {kind} := {value};")
        return name, f"{kind}#{value}", Computed(kind, value)

    def expression(self, depth: int) -> tuple[str, str, Computed]:
        """Return an expression in variables, the same in constants, and its value."""
        if depth == 0 or self._random.random() < 0.2:
            return self._variable()
        while True:
            if self._random.random() < 0.15:
                text, constant, found = self.expression(depth - 1)
                kind = register(found.type)
                if self._random.random() < 0.5:
                    return f"(-{text})", f"(-{constant})", Computed(found.type, wrap(-found.value, kind))
                return f"ABS({text})", f"ABS({constant})", Computed(found.type, wrap(abs(found.value), kind))
            operator = self._random.choice(["+", "+", "-", "-", "*", "/", "MOD", "MAX", "MIN"])
            left, first, a = self.expression(depth - 1)
            right, second, b = self.expression(depth - 1)
            if (found := computed(operator, a, b)) is None:
                continue
            if operator in ("MAX", "MIN"):
                return f"{operator}({left}, {right})", f"{operator}({first}, {second})", found
            return f"({left} {operator} {right})", f"({first} {operator} {second})", found


def test_every_operation_has_the_width_that_the_page_gives_it() -> None:
    for seed in range(300):
        maker = Expressions(seed)
        text, constant, found = maker.expression(3)
        kind, value = found
        targets = [other for other in BITS if common(kind, other) == other]
        own = "".join(f"r_{other} : {other}; k_{other} : {other};\n" for other in targets)
        body = "".join(f"r_{other} := {text}; k_{other} := {constant};\n" for other in targets)
        whole = f"PROGRAM main VAR\n{own}r : LREAL; same : BOOL;\n{' '.join(maker.declared)} END_VAR\n{body}"
        whole += f"r := LINT_TO_LREAL(TO_LINT({text})); same := {text} = {constant};\nEND_PROGRAM"
        running = Program(compile_text(whole))
        running.run(0)
        for other in targets:
            for how in ("r", "k"):
                read = running.variables[f"main/{how}_{other.lower()}"].read()
                assert read == wrap(value, other), (seed, text, kind, value, other, how)
        assert running.variables["main/r"].read() == float(wrap(value, "LINT")), (seed, text, value)
        assert running.variables["main/same"].read() is True, (seed, text)
