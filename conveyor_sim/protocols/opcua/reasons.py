# SPDX-License-Identifier: Apache-2.0
"""Reasons of refusals in words, for clients that request diagnostics of operations (OPC 10000-4, 7.12).

A status code with a reason is an int, so it passes through all code that handles status codes.
"""

from __future__ import annotations

from typing import Any

from asyncua import ua

ADDITIONAL_INFO = 0x80
"""Bit of ReturnDiagnostics by which a client requests AdditionalInfo of each operation."""


class ReasonedCode(int):
    """Status code with the reason of a refusal."""

    reason: str

    def __new__(cls, code: int, reason: str) -> ReasonedCode:
        """Return a code. reason: one sentence; "": none."""
        made = super().__new__(cls, code)
        made.reason = reason
        return made


class ReasonedStatus(ua.StatusCode):
    """Status code in an answer, with the reason of a refusal. The reason is no field, so it is not encoded."""

    __slots__ = ("reason",)

    def __init__(self, code: ReasonedCode) -> None:
        super().__init__(int(code))
        self.reason = code.reason


def as_status(code: int) -> ua.StatusCode:
    """Return a status code for an answer, with its reason if it has one."""
    return ReasonedStatus(code) if isinstance(code, ReasonedCode) else ua.StatusCode(code)


def add_reasons(response: Any) -> None:
    """Add the reasons to an answer of Write or Call. Answers without reasons stay as they are."""
    if not isinstance(response, ua.WriteResponse | ua.CallResponse):
        return
    statuses = [getattr(result, "StatusCode", result) for result in response.Results or ()]
    reasons = [status.reason if isinstance(status, ReasonedStatus) else "" for status in statuses]
    if any(reasons):
        response.DiagnosticInfos = [ua.DiagnosticInfo(AdditionalInfo=reason or None) for reason in reasons]
