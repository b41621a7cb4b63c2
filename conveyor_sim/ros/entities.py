# SPDX-License-Identifier: Apache-2.0
"""Services of simulation_interfaces for entities: the bottles of the line are listed, spawned and deleted.

An entity is a bottle, `bottle_<id>` unless the client that spawned it chose a name. Spawning and deleting are inputs of
the line, applied as the next tick starts. They are answered at once, because the check between two ticks is that of the
tick. Listings contain what waits for that tick.
"""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, TypeVar

import regex  # has a time limit, which the standard library's re lacks
from geometry_msgs.msg import Vector3
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node
from simulation_interfaces import msg, srv
from simulation_interfaces.msg import Bounds, EntityCategory, EntityState, Result, TagsFilter

from conveyor_sim.errors import ConveyorError
from conveyor_sim.line.commands.inputs import DELETE, SPAWN, Input
from conveyor_sim.line.commands.placement import Cause
from conveyor_sim.ros.answers import settled, with_result
from conveyor_sim.ros.clock import to_time
from conveyor_sim.ros.service_names import create_standard_service
from conveyor_sim.run.lockstep import Refused
from conveyor_sim.run.stepper import Stepper
from conveyor_sim.support.printable import printable

T = TypeVar("T")

OWN_NAME = re.compile(r"bottle_\d+")
GIVEN_NAME = re.compile(r"[A-Za-z]\w{0,63}", re.ASCII)
MOST_FILTER = 256
"""Longest regular expression, characters."""
PATIENCE = 0.2
"""Longest time for matching names, s of wall time. Expressions such as (a+)+$ would take years."""
UPRIGHT = 1e-3
"""Largest deviation of a quaternion from a unit rotation about the vertical."""


class Entity(NamedTuple):
    """A bottle of the line, after the inputs that wait for the next tick."""

    name: str
    id: int
    kind: str
    """Name of the bottle type."""
    radius: float
    """Radius, m."""
    x: float
    y: float
    """Position, m."""
    theta: float
    """Angle, rad."""
    vx: float
    vy: float
    """Velocity, m/s."""
    omega: float
    """Angular velocity, rad/s."""


class EntityError(ConveyorError):
    """A request that is answered with a code of simulation_interfaces."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code


class EntityNames:
    """Names of the bottles of the present run."""

    def __init__(self) -> None:
        self._run_id = ""
        self._names: dict[int, str] = {}

    def in_run(self, run_id: str) -> EntityNames:
        """Forget the names of another run. Return this object."""
        if run_id != self._run_id:
            self._run_id, self._names = run_id, {}
        return self

    def of(self, bottle: int) -> str:
        """Return the name of a bottle."""
        return self._names.get(bottle, f"bottle_{bottle}")

    def give(self, bottle: int, name: str) -> None:
        """Name a bottle."""
        self._names[bottle] = name

    def retain(self, bottles: set[int]) -> None:
        """Forget the names of bottles that have left."""
        for bottle in self._names.keys() - bottles:
            del self._names[bottle]


class EntityServices:
    """Answers requests between two ticks."""

    def __init__(self, node: Node, executor: Executor, stepper: Stepper, frame_id: str) -> None:
        """frame_id: frame of poses. A service that the installed package does not have is not offered."""
        self._executor = executor
        self._stepper = stepper
        self._frame_id = frame_id
        self._names = EntityNames()
        group = ReentrantCallbackGroup()
        handlers = {
            "GetEntities": self._get_entities,
            "GetEntitiesStates": self._get_states,
            "GetEntityState": self._get_state,
            "GetEntityInfo": self._get_info,
            "GetEntityBounds": self._get_bounds,
            "GetSpawnables": self._get_spawnables,
            "SpawnEntity": self._spawn,
            "SpawnEntities": self._spawn_all,
            "DeleteEntity": self._delete,
        }
        for kind, handler in handlers.items():
            if hasattr(srv, kind):
                name = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", kind).lower()
                answer = self._between_ticks(handler)
                create_standard_service(node, getattr(srv, kind), name, answer, callback_group=group)

    def _between_ticks(self, handler: Callable[[Any, Any], None]) -> Callable[[Any, Any], Any]:
        """Return a callback that runs a handler in the stepping thread. The handler may raise EntityError."""

        async def answer(request: Any, response: Any) -> Any:
            try:
                await settled(self._executor, self._stepper.call(lambda: handler(request, response)))
            except EntityError as error:
                return with_result(response, error.code, str(error))
            except Refused as error:
                return with_result(response, Result.RESULT_OPERATION_FAILED, str(error))
            return response if response.result.result else with_result(response, Result.RESULT_OK)

        return answer

    def _entities(self) -> list[Entity]:
        """Return all bottles, ordered by ID."""
        simulation = self._stepper.simulation
        types, radius = simulation.model.bottle_types, simulation.model.type_radius.tolist()
        later, names = simulation.line.placement.later(), self._names.in_run(self._stepper.run_id)
        columns = simulation.bottles()
        fields = (columns.id, columns.type, columns.x, columns.y, columns.theta, columns.vx, columns.vy, columns.omega)
        rows = [row for row in zip(*(column.tolist() for column in fields), strict=True) if row[0] not in later.deleted]
        rows += [tuple(spawned) for spawned in later.spawned.values()]
        names.retain({int(row[0]) for row in rows} | set(simulation.line.held))
        return [Entity(names.of(id), id, types[kind], radius[kind], *rest) for id, kind, *rest in rows]

    def _entity(self, name: str) -> Entity:
        """Return a bottle by name. Raise EntityError."""
        for entity in self._entities():
            if entity.name == name:
                return entity
        raise EntityError(Result.RESULT_NOT_FOUND, f"{printable(name)}: no such entity, expected one of get_entities")

    def _get_entities(self, request: Any, response: Any) -> None:
        response.entities = [entity.name for entity in _filtered(self._entities(), request.filters)]

    def _get_states(self, request: Any, response: Any) -> None:
        entities = _filtered(self._entities(), request.filters)
        response.entities = [entity.name for entity in entities]
        response.states = [self._state(entity) for entity in entities]

    def _get_state(self, request: Any, response: Any) -> None:
        response.state = self._state(self._entity(request.entity))

    def _get_info(self, request: Any, response: Any) -> None:
        entity = self._entity(request.entity)
        response.info.category.category = EntityCategory.CATEGORY_DYNAMIC_OBJECT
        response.info.description = f"bottle {entity.id} of type {entity.kind}"
        response.info.tags = [entity.kind]

    def _get_bounds(self, request: Any, response: Any) -> None:
        response.bounds = _box(self._entity(request.entity).radius)

    def _get_spawnables(self, request: Any, response: Any) -> None:
        model = self._stepper.simulation.model
        for name, radius, mass in zip(model.bottle_types, model.type_radius, model.type_mass, strict=True):
            spawnable = msg.Spawnable(
                description=f"bottle, radius {radius:g} m, {mass:g} kg", spawn_bounds=_box(radius)
            )
            _resource(spawnable).uri = name
            response.spawnables.append(spawnable)
        text = ""
        if request.sources:
            unknown = ", ".join(map(printable, request.sources[:10]))
            text = f"unknown sources: {unknown}; spawnable are the bottle types of the scene"
        with_result(response, Result.RESULT_OK, text)

    def _spawn(self, request: Any, response: Any) -> None:
        response.entity_name = self._spawned(request, type(response))

    def _spawn_all(self, request: Any, response: Any) -> None:
        for one in request.spawn_requests:
            result = msg.SpawnResult()
            try:
                result.entity_name = self._spawned(one, msg.SpawnResult)
                with_result(result, Result.RESULT_OK)
            except EntityError as error:
                with_result(result, error.code, str(error))
            response.results.append(result)
        failed = [
            result.result.error_message for result in response.results if result.result.result != Result.RESULT_OK
        ]
        if failed:
            text = f"{len(failed)} of {len(response.results)} failed, the first one: {failed[0]}"
            with_result(response, response.ENTITIES_SPAWN_FAILED, text)

    def _spawned(self, request: Any, codes: Any) -> str:
        """Queue a bottle and return its name. codes: class with the codes of spawning. Raise EntityError."""
        if reason := self._stepper.run.standstill:
            raise EntityError(Result.RESULT_INCORRECT_STATE, reason)
        if request.entity_namespace:
            text = f"entity_namespace: {printable(request.entity_namespace)!r} given, expected none for a bottle"
            raise EntityError(codes.NAMESPACE_INVALID, text)
        kind = _bottle_type(_resource(request), codes)
        x, y, theta = self._placed(request.initial_pose, getattr(codes, "INVALID_POSE", Result.RESULT_OPERATION_FAILED))
        name = self._checked_name(request, codes)
        command = Input("spawn_entity", "spawn_entity", "test", SPAWN, (kind,), (x, y, theta, 0.0, 0.0, 0.0))
        placement = self._stepper.simulation.line.placement
        later = placement.later()
        bottle = later.next_id
        if (refusal := later.refusal(command)) is not None:
            raise EntityError(_spawn_code(refusal.cause, codes), refusal.reason)
        if reason := self._stepper.offer(command):
            raise EntityError(Result.RESULT_OPERATION_FAILED, reason)
        if name:
            self._names.give(bottle, name)
        return self._names.of(bottle)

    def _checked_name(self, request: Any, codes: Any) -> str:
        """Return the name that a bottle gets, "" for `bottle_<id>`. Raise EntityError."""
        name = request.name
        if request.allow_renaming and (not name or OWN_NAME.fullmatch(name)):
            return ""
        if not GIVEN_NAME.fullmatch(name) or OWN_NAME.fullmatch(name):
            expected = "a letter, then up to 63 letters, digits and _, not bottle_<number>, or allow_renaming"
            raise EntityError(codes.NAME_INVALID, f"name: {printable(name)!r} given, expected {expected}")
        if any(entity.name == name for entity in self._entities()):
            if request.allow_renaming:
                return ""
            raise EntityError(codes.NAME_NOT_UNIQUE, f"name: {name} given, which another entity has")
        return str(name)

    def _placed(self, stamped: Any, code: int) -> tuple[float, float, float]:
        """Return x, y (m) and the angle (rad) of a pose. Raise EntityError with a code."""
        frame = stamped.header.frame_id
        if frame not in ("", "world", self._frame_id):
            raise EntityError(code, f"frame_id: {printable(frame)!r} given, expected {self._frame_id!r} or none")
        place, turn = stamped.pose.position, stamped.pose.orientation
        if place.z != 0.0:
            raise EntityError(code, f"z: {place.z:g} m given, expected 0, the height of the belts")
        size = math.hypot(turn.x, turn.y, turn.z, turn.w)
        if not abs(size - 1.0) <= UPRIGHT or max(abs(turn.x), abs(turn.y)) > UPRIGHT:
            text = f"orientation: ({turn.x:g}, {turn.y:g}, {turn.z:g}, {turn.w:g}) given"
            raise EntityError(code, f"{text}, expected a unit quaternion about the vertical")
        return place.x, place.y, 2.0 * math.atan2(turn.z, turn.w)

    def _delete(self, request: Any, response: Any) -> None:
        if reason := self._stepper.run.standstill:
            raise EntityError(Result.RESULT_INCORRECT_STATE, reason)
        bottle = self._entity(request.entity).id
        command = Input("delete_entity", "delete_entity", "test", DELETE, (), (float(bottle),))
        if reason := self._stepper.offer(command):
            raise EntityError(Result.RESULT_OPERATION_FAILED, reason)

    def _state(self, entity: Entity) -> EntityState:
        state = EntityState()
        state.header.frame_id = self._frame_id
        state.header.stamp = to_time(self._stepper.simulation.stamp_ns)
        state.pose.position.x, state.pose.position.y = entity.x, entity.y
        state.pose.orientation.z, state.pose.orientation.w = math.sin(entity.theta / 2), math.cos(entity.theta / 2)
        state.twist.linear.x, state.twist.linear.y = entity.vx, entity.vy
        state.twist.angular.z = entity.omega
        return state


def _resource(message: Any) -> Any:
    """Return the part of a message that has `uri`. It is the message itself in SpawnEntity.srv."""
    return getattr(message, "entity_resource", message)


def _bottle_type(resource: Any, codes: Any) -> str:
    """Return the bottle type of a request. Raise EntityError."""
    if not resource.uri and resource.resource_string:
        text = "resource_string given, expected the name of a bottle type of the scene as uri"
        raise EntityError(Result.RESULT_FEATURE_UNSUPPORTED, text)
    if not resource.uri:
        raise EntityError(codes.NO_RESOURCE, "uri: none given, expected the name of a bottle type of the scene")
    return str(resource.uri)


def _spawn_code(cause: Cause, codes: Any) -> int:
    if cause == "type":
        return int(Result.RESULT_NOT_FOUND)
    if cause == "place":
        return int(getattr(codes, "INVALID_POSE", Result.RESULT_OPERATION_FAILED))
    return int(Result.RESULT_OPERATION_FAILED)


def _box(radius: float) -> Bounds:
    """Return the bounds of a bottle, relative to its axis."""
    corners = [Vector3(x=sign * radius, y=sign * radius) for sign in (1.0, -1.0)]
    return Bounds(type=Bounds.TYPE_BOX, points=corners)


def _filtered(entities: Sequence[Entity], filters: Any) -> list[Entity]:
    """Return the entities that match all filters. Raise EntityError."""
    chosen = list(entities)
    if filters.filter:
        pattern = _pattern(filters.filter)
        end = time.monotonic() + PATIENCE
        try:
            chosen = [
                entity for entity in chosen if pattern.search(entity.name, timeout=max(0.0, end - time.monotonic()))
            ]
        except TimeoutError as error:
            given = f"filter: {printable(filters.filter)!r} took more than {PATIENCE:g} s"
            raise EntityError(Result.RESULT_OPERATION_FAILED, f"{given}, expected a simpler one") from error
    wanted = {category.category for category in filters.categories}
    if wanted and EntityCategory.CATEGORY_DYNAMIC_OBJECT not in wanted:
        chosen = []
    if filters.tags.tags:
        tags = set(filters.tags.tags)
        every = filters.tags.filter_mode == TagsFilter.FILTER_MODE_ALL
        chosen = [entity for entity in chosen if (tags <= {entity.kind} if every else entity.kind in tags)]
    if filters.bounds.type != Bounds.TYPE_EMPTY:
        touches = _overlap(filters.bounds)
        chosen = [entity for entity in chosen if touches(entity)]
    return chosen


def _pattern(text: str) -> regex.Pattern[str]:
    if len(text) > MOST_FILTER:
        reason = f"filter: {len(text)} characters given, expected at most {MOST_FILTER}"
        raise EntityError(Result.RESULT_OPERATION_FAILED, reason)
    try:
        return regex.compile(text)
    except (regex.error, OverflowError, RecursionError) as error:
        reason = f"filter: {printable(text)!r} given, which is no regular expression ({error})"
        raise EntityError(Result.RESULT_OPERATION_FAILED, reason) from error


def _overlap(bounds: Any) -> Callable[[Entity], bool]:
    """Return a function that tells if a bottle overlaps bounds, both seen from above. Raise EntityError."""
    if bounds.type not in (Bounds.TYPE_BOX, Bounds.TYPE_SPHERE):
        text = f"bounds.type: {bounds.type} given, expected TYPE_BOX (1) or TYPE_SPHERE (3)"
        raise EntityError(Result.RESULT_FEATURE_UNSUPPORTED, text)
    if len(bounds.points) != 2:
        text = f"bounds.points: {len(bounds.points)} given, expected 2"
        raise EntityError(Result.RESULT_OPERATION_FAILED, text)
    first, second = ((point.x, point.y) for point in bounds.points)
    if not all(map(math.isfinite, (*first, *second))):
        raise EntityError(Result.RESULT_OPERATION_FAILED, "bounds.points: expected finite numbers")
    if bounds.type == Bounds.TYPE_SPHERE:
        return lambda entity: math.dist(first, (entity.x, entity.y)) <= second[0] + entity.radius

    def touches(entity: Entity) -> bool:
        nearest = [
            min(max(value, low), high) for value, low, high in zip((entity.x, entity.y), second, first, strict=True)
        ]
        return math.dist(nearest, (entity.x, entity.y)) <= entity.radius

    if second[0] > first[0] or second[1] > first[1]:
        text = "bounds.points: expected the upper right corner of the box, then the lower left one"
        raise EntityError(Result.RESULT_OPERATION_FAILED, text)
    return touches
