"""Cost of the filters of monitored items, before an item is created or changed (OPC 10000-4, 7.22)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from asyncua import ua
from asyncua.common.utils import ServiceError

from conveyor_sim.protocols.opcua.limits import OpcUaLimits

Codes = ua.StatusCodes


def filter_units(wanted: Any, limits: OpcUaLimits) -> int:
    """Return the work units per event or change. Raise ServiceError for a filter that costs too much.

    wanted: the filter of one item; None: no filter. `filter_code` checks its form.
    """
    if not isinstance(wanted, ua.EventFilter):
        return 1
    clauses = wanted.SelectClauses or []
    if len(clauses) > limits.select_clauses:
        raise ServiceError(Codes.BadTooManyOperations)
    if any(len(clause.BrowsePath or []) > limits.path_elements for clause in clauses):
        raise ServiceError(Codes.BadTooManyOperations)
    return len(clauses) + _evaluation(wanted.WhereClause.Elements or [], limits)


def _evaluation(elements: Sequence[ua.ContentFilterElement], limits: OpcUaLimits) -> int:
    """Return the greatest number of operands that one evaluation visits; elements referenced twice count twice.

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
            if isinstance(operand, ua.ElementOperand) and place < operand.Index < len(elements):
                costs[place] += costs[operand.Index]
                depths[place] = max(depths[place], 1 + depths[operand.Index])
        if costs[place] > 2 * limits.where_operands or depths[place] > limits.path_elements:
            raise ServiceError(Codes.BadTooManyOperations)
    return costs[0] if costs else 0
