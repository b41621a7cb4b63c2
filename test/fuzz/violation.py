# SPDX-License-Identifier: Apache-2.0
"""Something that must never be."""


class Violation(AssertionError):
    """What was found, by kind."""

    def __init__(self, kind: str, sentence: str) -> None:
        super().__init__(f"{kind}: {sentence}")
        self.kind = kind
