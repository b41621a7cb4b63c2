"""`Views`: Browse, BrowseNext and TranslateBrowsePathsToNodeIds of one session, with bounded work.

The library answers with all references at once and has no continuation points. For each reference it walks the tree of
reference types again.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence

from asyncua import ua
from asyncua.server.address_space import AddressSpace

from conveyor_sim.protocols.opcua.limits import OpcUaLimits

Codes = ua.StatusCodes

_REMAINING = ua.Index(4_294_967_295)
"""RemainingPathIndex of a path that was followed to its end (OPC 10000-4, 5.9.4.2)."""


class Views:
    """Browsing of one session, whose requests `WellFormedSession` has checked for their form."""

    def __init__(self, aspace: AddressSpace, limits: OpcUaLimits) -> None:
        """Start without continuation points."""
        self._aspace, self._limits = aspace, limits
        self._points: dict[bytes, tuple[list[ua.ReferenceDescription], int]] = {}
        self.examined = 0
        """References examined so far."""

    def browse(self, params: ua.BrowseParameters) -> list[ua.BrowseResult]:
        """Return the references of each node."""
        asked = params.NodesToBrowse or []
        kinds: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None] = {}
        results, left = [], self._limits.references_per_answer
        for node in asked:
            result = self._browse(node, kinds)
            left -= self._page(result, result.References, params.RequestedMaxReferencesPerNode, left)
            results.append(result)
        return results

    def browse_next(self, params: ua.BrowseNextParameters) -> list[ua.BrowseResult]:
        """Return the next references of each continuation point, or release it."""
        points = params.ContinuationPoints or []
        results, left = [], self._limits.references_per_answer
        for point in points:
            result = ua.BrowseResult()
            references, most = self._points.pop(point or b"", (None, 0))
            if references is None:
                result.StatusCode = ua.StatusCode(Codes.BadContinuationPointInvalid)
            elif not params.ReleaseContinuationPoints:
                left -= self._page(result, references, most, left)
            results.append(result)
        return results

    def translate(self, paths: Sequence[ua.BrowsePath]) -> list[ua.BrowsePathResult]:
        """Return the targets of each path."""
        kinds: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None] = {}
        return [self._translate(path, kinds) for path in paths]

    def _page(self, result: ua.BrowseResult, references: list[ua.ReferenceDescription], most: int, left: int) -> int:
        """Put the first references into a result, the others behind a continuation point. Return how many it put in."""
        count = min(most or len(references), len(references), max(left, 0))
        if count < len(references) and len(self._points) >= self._limits.continuation_points:
            result.StatusCode, result.References = ua.StatusCode(Codes.BadNoContinuationPoints), []
            return 0
        result.References = references[:count]
        if count < len(references):
            result.ContinuationPoint = os.urandom(8)
            self._points[result.ContinuationPoint] = references[count:], most
        return count

    def _browse(
        self, asked: ua.BrowseDescription, kinds: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None]
    ) -> ua.BrowseResult:
        result = ua.BrowseResult()
        node = self._aspace.get(asked.NodeId)
        if node is None:
            result.StatusCode = ua.StatusCode(Codes.BadNodeIdUnknown)
        else:
            wanted = self._kinds(asked.ReferenceTypeId, asked.IncludeSubtypes, kinds)
            both = asked.BrowseDirection == ua.BrowseDirection.Both
            forward = asked.BrowseDirection == ua.BrowseDirection.Forward
            self.examined += len(node.references)
            result.References = [
                reference
                for reference in node.references
                if (both or bool(reference.IsForward) == forward)
                and (wanted is None or reference.ReferenceTypeId in wanted)
                and (not asked.NodeClassMask or asked.NodeClassMask & reference.NodeClass)
            ]
        return result

    def _translate(
        self, path: ua.BrowsePath, kinds: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None]
    ) -> ua.BrowsePathResult:
        elements = path.RelativePath.Elements or []
        code = Codes.Good
        nodes: list[ua.NodeId] = [path.StartingNode]
        if len(elements) > self._limits.path_elements:
            code = Codes.BadTooManyOperations
        elif path.StartingNode not in self._aspace:
            code = Codes.BadNodeIdUnknown
        else:
            for element in elements:
                # Each node once, because paths back and forth would multiply.
                nodes = list(dict.fromkeys(self._children(nodes, element, kinds)))
            code = Codes.Good if nodes else Codes.BadNoMatch
        targets = [ua.BrowsePathTarget(node, _REMAINING) for node in nodes] if code == Codes.Good else []
        return ua.BrowsePathResult(ua.StatusCode(code), targets)

    def _children(
        self,
        nodes: Iterable[ua.NodeId],
        element: ua.RelativePathElement,
        kinds: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None],
    ) -> Iterable[ua.NodeId]:
        wanted = self._kinds(element.ReferenceTypeId, element.IncludeSubtypes, kinds)
        for id in nodes:
            node = self._aspace.get(id)
            for reference in [] if node is None else node.references:
                self.examined += 1
                if (
                    reference.BrowseName == element.TargetName
                    and bool(reference.IsForward) != bool(element.IsInverse)
                    and (wanted is None or reference.ReferenceTypeId in wanted)
                ):
                    yield reference.NodeId

    def _kinds(
        self,
        kind: ua.NodeId,
        subtypes: bool,
        cache: dict[tuple[ua.NodeId, bool], frozenset[ua.NodeId] | None],
    ) -> frozenset[ua.NodeId] | None:
        """Return the reference types that a request accepts; None: all. cache: of one request."""
        if kind.is_null():
            return None
        key = kind, bool(subtypes)
        if key not in cache:
            kinds, rest = {kind}, [kind] if subtypes else []
            while rest:
                node = self._aspace.get(rest.pop())
                for reference in [] if node is None else node.references:
                    self.examined += 1
                    if (
                        reference.IsForward
                        and reference.ReferenceTypeId == _HAS_SUBTYPE
                        and reference.NodeId not in kinds
                    ):
                        kinds.add(reference.NodeId)
                        rest.append(reference.NodeId)
            cache[key] = frozenset(kinds)
        return cache[key]


_HAS_SUBTYPE = ua.NodeId(ua.ObjectIds.HasSubtype)
