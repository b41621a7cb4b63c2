# SPDX-License-Identifier: Apache-2.0
"""`Nodes`: adds the nodes of a line, whose IDs are made of names and never change."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timezone
from typing import Any, Protocol

from asyncua import ua
from asyncua.server.internal_server import InternalServer

NAMESPACE = "urn:conveyor_sim:line"
"""Namespace of all nodes of a line."""

INDEX = 2
"""Index of the namespace. It is constant, because clients store it with the IDs."""

LINE = "line"
"""ID of the object that represents the line."""

NEVER = datetime(1601, 1, 1, tzinfo=timezone.utc)
"""Date that stands for no date in OPC UA (OPC 10000-6, 5.2.2.5)."""

READ, WRITE, READ_HISTORY = 1, 2, 4
"""Bits of AccessLevel."""

READ_AND_WRITE = READ | WRITE


def node_id(name: str) -> ua.NodeId:
    """Return the ID of a tag, a device or another named node: `ns=2;s=belts/feeder/speed`."""
    return ua.NodeId(name, INDEX, ua.NodeIdType.String)


def name_of(node: ua.NodeId) -> str:
    """Return the name in the ID of a node; empty if it is not a node of the line."""
    return node.Identifier if node.NamespaceIndex == INDEX and isinstance(node.Identifier, str) else ""


class Noted(Protocol):
    """Observer of all values of variables."""

    def __contains__(self, name: str) -> bool:
        """Return True if it stores the values of a variable."""

    def note(self, name: str, value: ua.DataValue) -> None:
        """Take a new value of a variable."""


class Nodes:
    """Address space of a server, to which nodes are added."""

    def __init__(self, server: InternalServer, history: Noted) -> None:
        """Prepare an address space that has the nodes of the standard. history: stores values of variables."""
        self._server, self._history = server, history

    def __contains__(self, name: str) -> bool:
        """Return True if there is a node of this name."""
        return node_id(name) in self._server.aspace

    def folder(self, name: str, label: str, parent: ua.NodeId) -> ua.NodeId:
        """Add a folder."""
        attributes = ua.ObjectAttributes(DisplayName=ua.LocalizedText(label), Description=ua.LocalizedText(label))
        return self._add(
            name, label, parent, ua.ObjectIds.Organizes, ua.NodeClass.Object, ua.ObjectIds.FolderType, attributes
        )

    def object(self, name: str, label: str, parent: ua.NodeId, description: str) -> ua.NodeId:
        """Add an object that can have variables and methods."""
        attributes = ua.ObjectAttributes(DisplayName=ua.LocalizedText(label), Description=ua.LocalizedText(description))
        return self._add(
            name, label, parent, ua.ObjectIds.HasComponent, ua.NodeClass.Object, ua.ObjectIds.BaseObjectType, attributes
        )

    def variable(
        self,
        name: str,
        label: str,
        parent: ua.NodeId,
        value: ua.Variant,
        description: str,
        type_id: int = ua.ObjectIds.BaseDataVariableType,
        access: int = READ,
    ) -> ua.NodeId:
        """Add a variable with its initial value."""
        attributes = _variable(label, description, value, ua.NodeId(value.VariantType.value), access)
        if name in self._history:
            attributes.Historizing = True
            attributes.AccessLevel = attributes.UserAccessLevel = access | READ_HISTORY
        return self._add(name, label, parent, ua.ObjectIds.HasComponent, ua.NodeClass.Variable, type_id, attributes)

    def property(
        self, name: str, parent: ua.NodeId, value: Any, data_type: int, kind: ua.VariantType, index: int = 0
    ) -> ua.NodeId:
        """Add a property `name`; the last part is its browse name.

        index: namespace index of the browse name; 0: that of the standard.
        """
        browse = name.rpartition("/")[2]
        variant = ua.Variant(value, kind, is_array=isinstance(value, list))
        attributes = _variable(browse, browse, variant, ua.NodeId(data_type), READ)
        return self._add(
            name,
            browse,
            parent,
            ua.ObjectIds.HasProperty,
            ua.NodeClass.Variable,
            ua.ObjectIds.PropertyType,
            attributes,
            index,
        )

    def method(self, name: str, parent: ua.NodeId, description: str, arguments: Sequence[ua.Argument]) -> ua.NodeId:
        """Add a method. The session handles its calls."""
        label = name.rpartition("/")[2]
        attributes = ua.MethodAttributes(
            DisplayName=ua.LocalizedText(label),
            Description=ua.LocalizedText(description),
            Executable=True,
            UserExecutable=True,
        )
        method = self._add(
            name, label, parent, ua.ObjectIds.HasComponent, ua.NodeClass.Method, ua.ObjectIds.Null, attributes
        )
        if arguments:
            self.property(
                f"{name}/InputArguments",
                method,
                list(arguments),
                ua.ObjectIds.Argument,
                ua.VariantType.ExtensionObject,
            )
        return method

    def event_type(self, name: str, label: str, base: int, fields: Sequence[tuple[str, ua.VariantType]]) -> ua.NodeId:
        """Add a type of events, with properties beside those of its base type."""
        attributes = ua.ObjectTypeAttributes(DisplayName=ua.LocalizedText(label), Description=ua.LocalizedText(label))
        made = self._add(
            name,
            label,
            ua.NodeId(base),
            ua.ObjectIds.HasSubtype,
            ua.NodeClass.ObjectType,
            ua.ObjectIds.Null,
            attributes,
        )
        for field, kind in fields:
            self.property(f"{name}/{field}", made, nothing(kind), kind.value, kind, INDEX)
        return made

    def refer(self, source: ua.NodeId, target: ua.NodeId, kind: int, target_class: ua.NodeClass) -> None:
        """Add a reference from one node to another."""
        item = ua.AddReferencesItem(source, ua.NodeId(kind), True, "", target, target_class)
        for result in self._server.node_mgt_service.add_references([item]):
            result.check()

    async def write(self, name: str, value: ua.Variant, stamp: datetime, status: int = ua.StatusCodes.Good) -> None:
        """Write a value of a variable. stamp: its SourceTimestamp."""
        data_value = ua.DataValue(value, ua.StatusCode(status), stamp, datetime.now(timezone.utc))
        self._history.note(name, data_value)
        await self._server.write_attribute_value(node_id(name), data_value)

    def _add(
        self,
        name: str,
        label: str,
        parent: ua.NodeId,
        reference: int,
        node_class: ua.NodeClass,
        type_id: int,
        attributes: Any,
        index: int = INDEX,
    ) -> ua.NodeId:
        item = ua.AddNodesItem(
            ParentNodeId=parent,
            ReferenceTypeId=ua.NodeId(reference),
            RequestedNewNodeId=node_id(name),
            BrowseName=ua.QualifiedName(label, index),
            NodeClass=node_class,
            NodeAttributes=attributes,
            TypeDefinition=ua.NodeId(type_id),
        )
        (result,) = self._server.node_mgt_service.add_nodes([item])
        result.StatusCode.check()
        return node_id(name)


def nothing(kind: ua.VariantType) -> Any:
    """Return the null value of an OPC UA type."""
    if kind is ua.VariantType.DateTime:
        return NEVER
    return None if kind is ua.VariantType.String else ua.get_default_value(kind)


def _variable(
    label: str, description: str, value: ua.Variant, data_type: ua.NodeId, access: int
) -> ua.VariableAttributes:
    return ua.VariableAttributes(
        DisplayName=ua.LocalizedText(label),
        Description=ua.LocalizedText(description),
        Value=value,
        DataType=data_type,
        ValueRank=ua.ValueRank.OneDimension if value.is_array else ua.ValueRank.Scalar,
        AccessLevel=access,
        UserAccessLevel=access,
    )
