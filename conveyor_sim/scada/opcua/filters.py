"""Checks of the filters of monitored items, before an item is created or changed (OPC 10000-4, 7.22)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.ua.uaprotocol_auto import DataChangeFilter

from conveyor_sim.scada.opcua.limits import Limits

Codes = ua.StatusCodes


def require_filter(given: Any, of_events: bool, limits: Limits) -> int:
    """Return the work units per event or change. Raise ServiceError for a filter that does not fit or costs too much.

    given: the filter of one item; None: no filter. of_events: True for an item that monitors events.
    """
    if given and not isinstance(given, ua.EventFilter if of_events else DataChangeFilter):
        raise ServiceError(Codes.BadMonitoredItemFilterUnsupported)
    if not isinstance(given, ua.EventFilter):
        return 1
    clauses = given.SelectClauses or []
    if len(clauses) > limits.select_clauses:
        raise ServiceError(Codes.BadTooManyOperations)
    if any(len(clause.BrowsePath or []) > limits.path_elements for clause in clauses):
        raise ServiceError(Codes.BadTooManyOperations)
    return len(clauses) + _evaluation(given.WhereClause.Elements or [], limits)


def _evaluation(elements: Sequence[ua.ContentFilterElement], limits: Limits) -> int:
    """Return the operands that one evaluation visits at most; elements that are referenced twice count twice.

    An element may only reference later ones, which excludes cycles (OPC 10000-4, 7.7.4.2).
    """
    if (
        len(elements) > limits.where_operands
        or sum(len(element.FilterOperands or []) for element in elements) > limits.where_operands
    ):
        raise ServiceError(Codes.BadTooManyOperations)
    costs = [0] * len(elements)
    depths = [0] * len(elements)
    for place in reversed(range(len(elements))):
        costs[place], depths[place] = 1, 1
        for operand in elements[place].FilterOperands or []:
            costs[place] += 1
            if isinstance(operand, ua.ElementOperand):
                if not place < operand.Index < len(elements):
                    raise ServiceError(Codes.BadFilterOperandInvalid)
                costs[place] += costs[operand.Index]
                depths[place] = max(depths[place], 1 + depths[operand.Index])
        if costs[place] > 2 * limits.where_operands or depths[place] > limits.path_elements:
            raise ServiceError(Codes.BadTooManyOperations)
    return costs[0] if costs else 0
