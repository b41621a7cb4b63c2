# SPDX-License-Identifier: Apache-2.0
"""Form and cost of the filters of monitored items (OPC 10000-4, 7.7, 7.22): the library evaluates filters unchecked.

A null array is None after decoding, and means the same as an empty one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.ua.uaprotocol_auto import DataChangeFilter

from conveyor_sim.protocols.opcua.limits import OpcUaLimits
from conveyor_sim.protocols.opcua.where_clause import is_event_type

Codes = ua.StatusCodes


def filter_units(wanted: Any, limits: OpcUaLimits) -> int:
    """Return the number of fields and operands of an event filter, and 1 for other filters.

    Operands are counted once per visit in one evaluation. Raise ServiceError for a filter that costs too much.

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


Operators = ua.FilterOperator

_LEAST_OPERANDS = {
    Operators.IsNull: 1,
    Operators.Not: 1,
    Operators.OfType: 1,
    Operators.Between: 3,
    Operators.InList: 2,
}
"""Number of operands by operator; InList takes more as well. Operators that are not listed have two."""

_UNSUPPORTED = {
    Operators.Like,
    Operators.InView,
    Operators.RelatedTo,
    Operators.BitwiseAnd,
    Operators.BitwiseOr,
}
"""Operators that the library does not evaluate."""


def filter_code(wanted: Any, event_types: Any | None) -> int:
    """Return the status code of the filter of a monitored item.

    wanted: decoded filter; None or an empty extension object: without a filter. event_types: address space with the
    types of events, if the item monitors events; None: it monitors a value.
    """
    if not wanted:
        return int(Codes.Good if event_types is None else Codes.BadEventFilterInvalid)
    if event_types is not None:
        known = isinstance(wanted, ua.EventFilter)
        return _event_code(wanted, event_types) if known else int(Codes.BadMonitoredItemFilterUnsupported)
    if not isinstance(wanted, DataChangeFilter):
        return int(Codes.BadMonitoredItemFilterUnsupported)
    valid = wanted.DeadbandType in set(ua.DeadbandType) and 0.0 <= wanted.DeadbandValue < math.inf
    return int(Codes.Good if valid else Codes.BadDeadbandFilterInvalid)


def _event_code(wanted: ua.EventFilter, event_types: Any) -> int:
    for clause in wanted.SelectClauses or []:
        if any(not name.Name for name in clause.BrowsePath or []):
            return int(Codes.BadBrowseNameInvalid)
        if clause.AttributeId not in set(ua.AttributeIds):
            return int(Codes.BadAttributeIdInvalid)
    return _content_code(wanted.WhereClause.Elements or [], event_types)


def _content_code(elements: Sequence[ua.ContentFilterElement], event_types: Any) -> int:
    """Return the status code of a where clause.

    An element may refer to later elements only, so that the evaluation ends (OPC 10000-4, 7.7.1). A literal of OfType
    must be the ID of a type of events.
    """
    for place, element in enumerate(elements):
        if element.FilterOperator in _UNSUPPORTED:
            return int(Codes.BadFilterOperatorUnsupported)
        operands, least = element.FilterOperands or [], _LEAST_OPERANDS.get(element.FilterOperator, 2)
        if len(operands) < least or (len(operands) > least and element.FilterOperator != Operators.InList):
            return int(Codes.BadFilterOperandCountMismatch)
        for operand in operands:
            if (code := _operand_code(operand, place, len(elements))) != Codes.Good:
                return code
        if element.FilterOperator == Operators.OfType and isinstance(operands[0], ua.LiteralOperand):
            literal = operands[0].Value
            if literal is None or not is_event_type(event_types, literal.Value):
                return int(Codes.BadFilterOperandInvalid)
    return int(Codes.Good)


def _operand_code(operand: Any, place: int, count: int) -> int:
    if isinstance(operand, ua.ElementOperand):
        return int(Codes.Good if place < operand.Index < count else Codes.BadFilterOperandInvalid)
    if isinstance(operand, ua.SimpleAttributeOperand):
        names = [name.Name for name in operand.BrowsePath or []]
    elif isinstance(operand, ua.AttributeOperand):
        names = [element.TargetName.Name for element in operand.BrowsePath.Elements or []]
    else:
        return int(Codes.Good if isinstance(operand, ua.LiteralOperand) else Codes.BadFilterOperandInvalid)
    return int(Codes.Good if all(names) else Codes.BadBrowseNameInvalid)
