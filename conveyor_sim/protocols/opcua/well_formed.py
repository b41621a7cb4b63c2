# SPDX-License-Identifier: Apache-2.0
"""Checks of the form of requests, with the status codes of OPC 10000-4. The library has few such checks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeVar
from urllib.parse import urlparse

from asyncua import ua
from asyncua.common.utils import ServiceError
from asyncua.server.internal_session import InternalSession

from conveyor_sim.protocols.opcua.filter_codes import filter_code
from conveyor_sim.protocols.opcua.ownership import REFRESH

Request = TypeVar("Request")
Result = TypeVar("Result")
Codes = ua.StatusCodes

_TIME = 8
"""bytes of a continuation point of HistoryRead: a time (OPC 10000-6, 5.2.2.5)."""


def require_url(url: str | None) -> None:
    """Raise ServiceError for an endpoint URL that can't be parsed."""
    try:
        _ = urlparse(url or "").port
    except ValueError as error:
        raise ServiceError(Codes.BadTcpEndpointUrlInvalid) from error


class WellFormedSession(InternalSession):
    """Session whose services refuse requests that the library would fail on.

    Requests without operations do not arrive here: `Processor` refuses them when it reads the number of operations.
    """

    async def create_session(self, params: ua.CreateSessionParameters, *others: Any, **named: Any) -> Any:
        """Create the session. A timeout that is no finite number is treated as 0."""
        if not math.isfinite(params.RequestedSessionTimeout):
            params.RequestedSessionTimeout = 0.0
        return await super().create_session(params, *others, **named)

    async def read(self, params: ua.ReadParameters) -> list[ua.DataValue]:
        """Raise ServiceError for a request with an invalid age or invalid timestamps."""
        if not params.MaxAge >= 0.0:
            raise ServiceError(Codes.BadMaxAgeInvalid)
        _require_timestamps(params.TimestampsToReturn)
        return await super().read(params)

    async def history_read(self, params: ua.HistoryReadParameters) -> list[ua.HistoryReadResult]:
        """Return BadContinuationPointInvalid for continuation points that this server did not issue."""
        _require_timestamps(params.TimestampsToReturn)
        return await _each(
            params.NodesToRead,
            lambda node: Codes.Good if len(node.ContinuationPoint or b"") in (0, _TIME) else _CONTINUATION,
            lambda nodes: super(WellFormedSession, self).history_read(_with(params, NodesToRead=nodes)),
            lambda code: ua.HistoryReadResult(StatusCode=ua.StatusCode(code)),
        )

    async def browse(self, params: ua.BrowseParameters) -> list[ua.BrowseResult]:
        """Return a status code for each node that can't be browsed as requested."""
        if not params.View.ViewId.is_null():
            raise ServiceError(Codes.BadViewIdUnknown)
        return await _each(
            params.NodesToBrowse,
            self._browse_code,
            lambda nodes: super(WellFormedSession, self).browse(_with(params, NodesToBrowse=nodes)),
            lambda code: ua.BrowseResult(ua.StatusCode(code)),
        )

    async def translate_browsepaths_to_nodeids(self, params: list[ua.BrowsePath]) -> list[ua.BrowsePathResult]:
        """Return a status code for each path without elements or with empty names."""
        return await _each(
            params,
            _path_code,
            super().translate_browsepaths_to_nodeids,
            lambda code: ua.BrowsePathResult(ua.StatusCode(code)),
        )

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        """Return a status code for each ConditionRefresh whose arguments are not one id (ConditionRefresh2: two)."""
        return await _each(
            params,
            lambda request: _refresh_code(request) if request.MethodId in REFRESH else Codes.Good,
            super().call,
            lambda code: ua.CallMethodResult(ua.StatusCode(code), [], [], []),
        )

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        """Return a status code for each item with an invalid filter."""
        _require_timestamps(params.TimestampsToReturn)
        return await _each(
            params.ItemsToCreate,
            self._item_code,
            lambda items: super(WellFormedSession, self).create_monitored_items(_with(params, ItemsToCreate=items)),
            lambda code: ua.MonitoredItemCreateResult(ua.StatusCode(code)),
        )

    async def modify_monitored_items(
        self, params: ua.ModifyMonitoredItemsParameters
    ) -> list[ua.MonitoredItemModifyResult]:
        """Raise ServiceError for a request with invalid timestamps."""
        _require_timestamps(params.TimestampsToReturn)
        return await super().modify_monitored_items(params)

    def _browse_code(self, node: ua.BrowseDescription) -> int:
        if node.BrowseDirection == ua.BrowseDirection.Invalid:
            return int(Codes.BadBrowseDirectionInvalid)
        if not node.ReferenceTypeId.is_null():
            kind = self.aspace.read_attribute_value(node.ReferenceTypeId, ua.AttributeIds.NodeClass).Value
            if kind is None or kind.Value != ua.NodeClass.ReferenceType:
                return int(Codes.BadReferenceTypeIdInvalid)
        return int(Codes.Good)

    def _item_code(self, item: ua.MonitoredItemCreateRequest) -> int:
        of_events = item.ItemToMonitor.AttributeId == ua.AttributeIds.EventNotifier
        return filter_code(item.RequestedParameters.Filter, self.aspace if of_events else None)


_CONTINUATION = Codes.BadContinuationPointInvalid


async def _each(
    requests: Sequence[Request], judge: Callable[[Request], int], serve: Any, refusal: Callable[[int], Result]
) -> list[Result]:
    """Serve together the requests that `judge` calls Good; return results in the order of the requests."""
    codes = [judge(request) for request in requests]
    good = [request for request, code in zip(requests, codes, strict=True) if code == Codes.Good]
    results = iter(await serve(good) if good else ())
    return [next(results) if code == Codes.Good else refusal(code) for code in codes]


def _with(params: Any, **fields: Any) -> Any:
    for name, value in fields.items():
        setattr(params, name, value)
    return params


def _require_timestamps(wanted: ua.TimestampsToReturn) -> None:
    if wanted == ua.TimestampsToReturn.Invalid:
        raise ServiceError(Codes.BadTimestampsToReturnInvalid)


def _path_code(path: ua.BrowsePath) -> int:
    elements = path.RelativePath.Elements
    if not elements:
        return int(Codes.BadNothingToDo)
    return int(Codes.Good if all(element.TargetName.Name for element in elements) else Codes.BadBrowseNameInvalid)


def _refresh_code(request: ua.CallMethodRequest) -> int:
    arguments, expected = request.InputArguments or [], 1 + (request.MethodId == _REFRESH_ITEM)
    if len(arguments) != expected:
        missing = len(arguments) < expected
        return int(Codes.BadArgumentsMissing if missing else Codes.BadTooManyArguments)
    ids = all(each.VariantType is ua.VariantType.UInt32 and isinstance(each.Value, int) for each in arguments)
    return int(Codes.Good if ids else Codes.BadInvalidArgument)


_REFRESH_ITEM = ua.NodeId(ua.ObjectIds.ConditionType_ConditionRefresh2)
