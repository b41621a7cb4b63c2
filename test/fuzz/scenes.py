# SPDX-License-Identifier: Apache-2.0
"""Random scenes of a family, as data: mostly valid, small, crowded, with edges that meet exactly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from fuzz.checked import checked
from fuzz.devices import axes, drives, machines, movers, panel, row_pushers, sensors, wheels
from fuzz.draws import Data, between, fractions, scaled, signed
from fuzz.families import Family
from hypothesis import strategies as st

from conveyor_sim.scene.geometry import rail_shapes
from conveyor_sim.scene.moving import axes_of, bodies_at, bodies_of

STEEL, CHAIN = "steel", "chain"
MATERIALS = ("glass", "pet", "glass")
"""Of the types of bottles, in order."""

TICKS = (0.05, 0.02, 0.01, 0.005, 0.002, 0.001)

WILD = "faster, softer or more unequal than contacts can hold"

angles = st.one_of(
    st.sampled_from([0.0, math.pi / 2, -math.pi / 2, math.pi, math.pi / 4]),
    between(-math.pi, math.pi),
    st.integers(-8, 8).map(lambda n: f"{45 * n} deg"),
)


@st.composite
def scenes(draw: st.DrawFn, family: Family, beyond: bool = True) -> Data:
    """A scene of a family, such that rails can hold the bottles.

    beyond: in one of 20 they can't (its description is WILD), and steps may be given that are too long.
    """
    wild = beyond and draw(st.integers(0, 19)) == 19
    frame = _Frame(draw, family, wild)
    data: Data = {
        "name": "fuzz",
        "description": WILD if wild else "",
        "seed": draw(st.integers(0, 2**64 - 1)),
        "gravity": draw(st.sampled_from([9.81, 9.81, 1.62])),
        "slip_limit": draw(st.sampled_from([0.01, 0.01, 0.05, 0.001])),
        "friction_curve": "atan" if family.atan else "polynomial",
        "friction_solver": "implicit" if family.implicit_friction else "explicit",
        "lever_arm": draw(st.sampled_from(["overlap", "radius"])),
        "tick": frame.tick,
        "duration": round(1000 * frame.tick, 9),
        "accuracy": draw(_accuracies(family, beyond)),
        "bottle_types": frame.types,
        "contacts": draw(_contacts(family, frame)),
        "base": [
            {"between": [material, CHAIN], "friction": draw(between(0.02, 2.0 if wild else 0.7))}
            for material in frame.materials
        ],
        "belts": {f"belt_{n}": belt for n, belt in enumerate(draw(_belts(family, frame)))},
        "plates": {f"plate_{n}": plate for n, plate in enumerate(draw(_plates(family, frame)))},
        "rails": {f"rail_{n}": rail for n, rail in enumerate(draw(_rails(family, frame)))},
        "floor": {"friction": draw(between(0.02, 0.7))} if family.base_friction else "none",
        "outputs": draw(_outputs(frame.tick)),
        "effects": dict(family.effects),
    }
    if not family.base_friction:
        data["base"] = [{**base, "friction": 0.0} for base in data["base"]]
    if family.base_springs:
        spring = {"stiffness": frame.stiffness * draw(between(0.1, 1.0)), "damping": draw(scaled(0.1, 10.0))}
        data["base"] = [{**base, "tangential": spring} for base in data["base"]]
    if family.drives:
        data |= draw(drives(frame, data["belts"]))
    if family.axes:
        data |= draw(axes(frame, data["belts"], data.get("drives", {})))
    if family.wheels:
        data |= draw(wheels(frame, STEEL, data.get("axes", {}), family.alike, family.side_belts))
    if family.movers:
        data |= draw(movers(frame, STEEL, family.lifts, family.alike))
    clear = _Clear(data, frame)
    if family.machines:
        data |= draw(machines(frame, clear))
    if family.sensors:
        data |= draw(sensors(frame, list(data["belts"])))
        if family.movers:
            draw(row_pushers(frame, data["pushers"], data["zones"]))
    if family.ledger:
        data["outputs"]["ledger"] = round(1.0 / frame.tick)
    if family.infeeds:
        data["infeeds"] = {f"in_{n}": feed for n, feed in enumerate(draw(_infeeds(frame, clear)))}
    if family.outfeeds:
        data["outfeeds"] = {f"out_{n}": {"region": region} for n, region in enumerate(draw(_regions(frame)))}
    data["bottles"] = draw(_bottles(frame, clear))
    if family.panel:
        data |= draw(panel(frame))
    return data


class _Frame:
    """Sizes that the parts of a scene share: lengths in units of the largest radius, speeds of what rails can hold."""

    def __init__(self, draw: st.DrawFn, family: Family, wild: bool) -> None:
        self.wild = wild
        radius = draw(st.sampled_from([0.033, 0.065, 0.01, 0.001, 0.3]))
        density = draw(scaled(50.0, 500.0)) * radius
        self.unit = radius
        self.types: dict[str, Data] = {}
        for n in range(family.types):
            small = 1.0 if n == 0 else draw(scaled(0.05 if wild else 0.3, 0.95))
            kind: Data = {"radius": radius * small, "material": MATERIALS[n]}
            kind["mass"] = density * kind["radius"] ** 2 * (draw(scaled(1e-2, 1e2)) if wild else 1.0)
            if draw(st.booleans()):
                kind["inertia"] = kind["mass"] * kind["radius"] ** 2 * draw(scaled(0.01 if wild else 0.3, 2.0))
            if family.ring and (n == 0 or draw(st.booleans())):
                kind["base_radius"] = kind["radius"] * draw(between(0.3, 1.0))
            self.types[f"type_{n}"] = kind
        self.materials = list(dict.fromkeys(MATERIALS[: family.types]))
        self.least_radius = min(kind["radius"] for kind in self.types.values())
        self.most_radius = max(kind["radius"] for kind in self.types.values())
        self.least_mass = min(kind["mass"] for kind in self.types.values())
        self.most_mass = max(kind["mass"] for kind in self.types.values())
        # Thirty bottles' weight, driven by friction, presses a bottle by a thirtieth of its radius.
        floor = 900.0 * self.most_mass * 9.81 / self.least_radius
        self.stiffness = floor * (draw(scaled(1e-4, 1.0)) if wild else draw(scaled(1.0, 1e3)))
        # A quarter of the speed at which an impact on a rail is as deep as the radius; no faster than belts are.
        barrier = self.least_radius * math.sqrt(self.stiffness / self.most_mass)
        self.speed = 20.0 * barrier if wild else min(0.25 * barrier, 3.0) * draw(st.sampled_from([0.1, 0.2, 1.0]))
        # In a tick half a radius at most, so that a way through a rail is seen; not much less, so that bottles meet.
        short = [tick for tick in TICKS if 2.0 * self.speed * tick <= 0.5 * self.least_radius] or [TICKS[-1]]
        self.tick = draw(st.sampled_from([short[0], short[0], *short[:2]]))
        far = draw(st.sampled_from([0.0, 0.0, 0.0, 100.0, -1e4]))
        self.origin = (far, draw(st.sampled_from([0.0, far / 2])))
        self.width = draw(st.integers(8, 24)) * radius
        self.height = draw(st.integers(6, 16)) * radius

    def place(self, u: float, v: float) -> list[float]:
        """A point of the area, from (0, 0) to (1, 1)."""
        return [self.origin[0] + u * self.width, self.origin[1] + v * self.height]

    @property
    def points(self) -> st.SearchStrategy[list[float]]:
        """Points of the area, often on a lattice of radii."""
        return st.tuples(fractions, fractions).map(lambda at: self.place(*at))


def _accuracies(family: Family, beyond: bool) -> st.SearchStrategy[Data]:
    if family.integrator == "impulses":
        steps, sweeps = st.integers(4, 12), st.integers(1, 3)
        fast = st.just({"preset": "fast"})
        return st.one_of(fast, st.fixed_dictionaries({"per_tick": steps, "sweeps": sweeps}).map(_impulses))
    choices: list[Data] = [{}, {"preset": "draft"}, {"preset": "standard"}, {"tolerance": 0.1}, {"tolerance": 0.03}]
    steps = st.integers(1, 100).map(lambda n: {"per_tick": n})
    given = st.one_of(*[st.sampled_from(choices)] * 2, *[steps, scaled(1e-5, 1e-3).map(lambda dt: {"dt": dt})] * beyond)
    error = st.sampled_from([{}, {"error": 1e-5}]) if family.integrator == "dormand_prince" else st.just({})
    return st.tuples(given, error).map(lambda both: {"integrator": family.integrator, **both[0], **both[1]})


def _impulses(steps: Data) -> Data:
    return {"integrator": "impulses", **steps}


@st.composite
def _contacts(draw: st.DrawFn, family: Family, frame: _Frame) -> list[Data]:
    """Every pair of materials, its laws from those of the family in turn."""
    others = [*frame.materials, STEEL]
    pairs = [(one, other) for n, one in enumerate(frame.materials) for other in others[n:]]
    contacts = []
    for n, pair in enumerate(pairs):
        stiffness = frame.stiffness * draw(scaled(1.0, 10.0))
        elastic = family.elastic[n % len(family.elastic)]
        damping = family.damping[n % len(family.damping)]
        if damping in ("tsuji", "viscoelastic"):
            elastic = "hertz"
        contact: Data = {"between": list(pair), **_elastic(elastic, stiffness, frame)}
        contact["damping"] = draw(_damping(damping, elastic, stiffness, frame))
        if family.friction:
            contact["friction"] = draw(between(0.05, 2.0 if frame.wild else 0.6))
        if family.springs and (n == 0 or draw(st.booleans())):
            contact["tangential"] = {"stiffness": stiffness * draw(between(0.2, 1.0)), "damping": 0.0}
        contacts.append(contact)
    return contacts


def _elastic(law: str, stiffness: float, frame: _Frame) -> Data:
    """The law that at an overlap of half the least radius is as stiff."""
    deep = 0.5 * frame.least_radius
    if law == "hertz":
        return {"hertz_stiffness": stiffness / (1.5 * math.sqrt(deep))}
    if law == "table":
        return {"table": [[0.1 * deep, 0.05 * stiffness * deep], [0.5 * deep, 0.5 * stiffness * deep],
                          [deep, 1.5 * stiffness * deep]]}  # fmt: skip
    return {"stiffness": stiffness}


def _damping(law: str, elastic: str, stiffness: float, frame: _Frame) -> st.SearchStrategy[Data]:
    critical = 2.0 * math.sqrt(stiffness * frame.least_mass / 2.0)
    coefficient = between(0.01, 1.2).map(lambda share: {"law": law, "coefficient": share * critical})
    restitution = between(0.1, 0.99).map(lambda share: {"law": law, "restitution": share})
    if law == "none":
        return st.just({})
    if law == "tsuji":
        return restitution.map(lambda data: {**data, "law": "normal"})
    if law in ("onset", "viscoelastic"):
        return restitution.map(lambda data: {**data, "speed": frame.speed})
    linear = elastic == "linear"
    return st.one_of(coefficient, restitution) if linear else coefficient


@st.composite
def _belts(draw: st.DrawFn, family: Family, frame: _Frame) -> list[Data]:
    belts = []
    for kind in family.belts:
        for _ in range(draw(st.integers(1, 2))):
            limit = frame.speed
            belt: Data = {"kind": kind, "material": CHAIN, "speed": draw(between(1.0, -1.0)) * limit}
            belt["speed_limits"] = [-limit, limit]
            if draw(st.booleans()):
                belt["watchdog"] = frame.tick * draw(st.sampled_from([1, 7, 20.5]))
            if family.vibration and (not belts or draw(st.booleans())):
                belt["vibration"] = draw(_vibrations(kind))
            if draw(st.integers(0, 3)):
                belts.append({**belt, **draw(_area(kind, frame, "arc" in family.rails)), **draw(_turn(kind))})
            else:
                belts.append(
                    {**belt, "kind": "path", "surfaces": draw(st.lists(_surface(kind, frame), min_size=1, max_size=3))}
                )
    return draw(st.permutations(belts))


def _vibrations(kind: str) -> st.SearchStrategy[Data]:
    """Vibrations that are slower than belts, and shorter than bottles; along travel on surfaces that turn."""
    directions = st.sampled_from([0.0, math.pi]) if kind == "curved" else angles
    return st.fixed_dictionaries(
        {"amplitude": scaled(1e-6, 1e-4), "frequency": scaled(1.0, 200.0), "direction": directions}
    )


@st.composite
def _surface(draw: st.DrawFn, kind: str, frame: _Frame) -> Data:
    """A surface of a path belt, no faster than its belt."""
    return {"kind": kind, "ratio": draw(between(0.2, 1.0)), **draw(_area(kind, frame)), **draw(_turn(kind))}


def _turn(kind: str) -> st.SearchStrategy[Data]:
    turns = st.sampled_from([{}, {"turn": "left"}, {"turn": "right"}])
    return turns if kind == "curved" else st.just({})


@st.composite
def _plates(draw: st.DrawFn, family: Family, frame: _Frame) -> list[Data]:
    return [
        {"kind": kind, "material": CHAIN, **draw(_area(kind, frame))}
        for kind in family.belts
        if draw(st.integers(0, 4)) == 0
    ]


def _area(kind: str, frame: _Frame, railed: bool = False) -> st.SearchStrategy[Data]:
    return _straight(frame) if kind == "straight" else _curved(frame, railed)


@st.composite
def _straight(draw: st.DrawFn, frame: _Frame) -> Data:
    if draw(st.integers(0, 2)) < 2:
        return {"start": frame.place(0.0, 0.0), "angle": 0.0, "length": frame.width, "width": frame.height}
    sizes = draw(between(0.3, 2.0)) * frame.width, draw(between(0.2, 2.0)) * frame.height
    return {"start": draw(frame.points), "angle": draw(angles), "length": sizes[0], "width": sizes[1]}


@st.composite
def _curved(draw: st.DrawFn, frame: _Frame, railed: bool) -> Data:
    inner = draw(st.integers(0, 8)) * frame.unit
    rails = {"inner": inner > 0 and draw(st.booleans()), "outer": draw(st.booleans()), "material": STEEL}
    belt: Data = {"inner_radius": inner, "width": draw(st.integers(1, 8)) * frame.unit}
    if railed and draw(st.booleans()):
        belt["rails"] = rails
    if inner > 0 and draw(st.booleans()):
        start, angle = draw(frame.points), draw(between(-math.pi, math.pi))
        chord = 2.0 * inner * draw(between(0.1, 1.0))
        end = [start[0] + chord * math.cos(angle), start[1] + chord * math.sin(angle)]
        return {**belt, "from": start, "to": end, "side": draw(st.sampled_from(["left", "right"]))}
    return {**belt, "centre": draw(frame.points), "start_angle": draw(angles), "span": draw(_spans())}


def _spans() -> st.SearchStrategy[Any]:
    return st.one_of(st.sampled_from(["90 deg", "180 deg", "360 deg", 2.0 * math.pi]), between(0.05, 6.2))


@st.composite
def _rails(draw: st.DrawFn, family: Family, frame: _Frame) -> list[Data]:
    rails: list[Data] = []
    if "segment" in family.rails:
        if draw(st.integers(0, 2)) < 2:
            corners = [frame.place(*at) for at in ((0, 0), (1, 0), (1, 1), (0, 1))]
            rails.append({"kind": "polyline", "material": STEEL, "points": corners, "closed": True})
        for group in draw(st.lists(_straight_rails(frame), min_size=1, max_size=3)):
            rails += group
    if "arc" in family.rails:
        rails += draw(st.lists(_arc_rails(frame), min_size=1, max_size=2))
    return rails


@st.composite
def _straight_rails(draw: st.DrawFn, frame: _Frame) -> list[Data]:
    """A segment, a polyline, or two segments that meet at a point: a wedge, or a joint."""
    count = draw(st.sampled_from([2, 2, 3, 5]))
    points = [draw(frame.points)]
    for _ in range(count - 1):
        point = draw(frame.points)
        if math.dist(point, points[-1]) < 1e-6:
            point = [point[0] + frame.unit, point[1]]
        points.append(point)
    if count == 3 and draw(st.booleans()):
        return [
            {"kind": "segment", "material": STEEL, "from": points[0], "to": points[1]},
            {"kind": "segment", "material": STEEL, "from": points[1], "to": points[2]},
        ]
    if count == 2:
        return [{"kind": "segment", "material": STEEL, "from": points[0], "to": points[1]}]
    return [{"kind": "polyline", "material": STEEL, "points": points}]


@st.composite
def _arc_rails(draw: st.DrawFn, frame: _Frame) -> Data:
    radius = frame.unit * draw(st.one_of(st.integers(1, 10), between(0.2, 12.0)))
    return {"kind": "arc", "material": STEEL, "centre": draw(frame.points), "radius": radius,
            "start_angle": draw(angles), "span": draw(_spans())}  # fmt: skip


@st.composite
def _outputs(draw: st.DrawFn, tick: float) -> Data:
    rate = round(1.0 / tick)
    return {topic: draw(st.sampled_from([rate, rate, rate / 2, rate / 5, 0])) for topic in
            ("poses", "contacts", "belts", "signals")} | {"bottles": rate}  # fmt: skip


class _Clear:
    """Where bottles may be born: away from rails, and from those that are there."""

    def __init__(self, data: Data, frame: _Frame) -> None:
        self._taken: list[tuple[float, float, float]] = []
        scene, rails = checked(data), []
        if scene is not None:
            rails = [
                *rail_shapes(scene),
                *bodies_at(bodies_of(scene), {axis.name: axis.first for axis in axes_of(scene)}),
            ]
        self._pieces = [piece for rail in rails for piece in rail.pieces]

    def of_rails(self, points: Any, radius: float) -> bool:
        """Whether bottles of a radius (m) at points touch no rail."""
        at = np.asarray(points, float).reshape(-1, 2)
        return all((piece.distance(at) >= radius).all() for piece in self._pieces)

    def take(self, point: list[float], radius: float) -> bool:
        """Whether a bottle may be at a point, which is then taken."""
        free = all(math.dist(point, (x, y)) >= radius + other for x, y, other in self._taken)
        if free and self.of_rails(point, radius):
            self._taken.append((point[0], point[1], radius))
            return True
        return False


@st.composite
def _infeeds(draw: st.DrawFn, frame: _Frame, clear: _Clear) -> list[Data]:
    feeds = []
    for _ in range(draw(st.integers(1, 3))):
        name = draw(st.sampled_from(sorted(frame.types)))
        radius = frame.types[name]["radius"]
        direction = draw(between(-math.pi, math.pi))
        feed: Data = {"bottle": name, "position": draw(frame.points), "direction": direction}
        feed["speed"] = frame.speed * draw(between(1.0, 0.0))
        if draw(st.booleans()):
            feed["gap"] = radius * draw(st.sampled_from([0.0, 0.1, 1.0]))
            feed["timing_jitter"] = frame.tick * draw(st.sampled_from([0.0, 3.0]))
        else:
            feed["rate"] = draw(scaled(0.02, 1.0)) / frame.tick
            feed["timing_jitter"] = draw(st.sampled_from([0.0, 0.5])) / feed["rate"]
        feed["lateral_jitter"] = radius * draw(st.sampled_from([0.0, 0.5]))
        feed["start"] = frame.tick * draw(st.sampled_from([0.0, 2.5]))
        if draw(st.booleans()):
            feed["count"] = draw(st.integers(1, 30))
        aside = feed["lateral_jitter"]
        x, y = feed["position"]
        births = [
            [x - share * aside * math.sin(direction), y + share * aside * math.cos(direction)]
            for share in (-1.0, 0.0, 1.0)
        ]
        if clear.of_rails(births, radius):
            feeds.append(feed)
    return feeds


@st.composite
def _regions(draw: st.DrawFn, frame: _Frame) -> list[list[list[float]]]:
    regions = []
    for _ in range(draw(st.integers(1, 2))):
        x, y = draw(frame.points)
        w, h = draw(st.integers(1, 6)) * frame.unit, draw(st.integers(1, 6)) * frame.unit
        regions.append([[x, y], [x + w, y], [x + w, y + h], [x, y + h]][: draw(st.sampled_from([4, 3]))])
    return regions


@st.composite
def _bottles(draw: st.DrawFn, frame: _Frame, clear: _Clear) -> list[Data]:
    """A grid now and then, and single bottles that touch, or are near, their neighbours."""
    entries: list[Data] = []
    if draw(st.booleans()):
        rows, columns, pattern = (
            draw(st.integers(1, 6)),
            draw(st.integers(1, 6)),
            draw(st.sampled_from(["square", "hexagonal"])),
        )
        origin, radius = draw(frame.points), frame.types["type_0"]["radius"]
        pitch = 2.0 * radius * draw(st.sampled_from([1.0, 1.001, 1.2]))
        high = pitch * (math.sqrt(3.0) / 2.0 if pattern == "hexagonal" else 1.0)
        at = [
            [origin[0] + pitch * (c + (r % 2 / 2 if pattern == "hexagonal" else 0)), origin[1] + high * r]
            for r in range(rows)
            for c in range(columns)
        ]
        if clear.of_rails(at, radius):
            clear._taken += [(x, y, radius * 1.000001) for x, y in at]
            entries.append({"grid": {"type": "type_0", "origin": origin, "rows": rows, "columns": columns,
                                     "pitch": pitch, "pattern": pattern}})  # fmt: skip
    pitch = 2.0 * frame.most_radius * draw(st.sampled_from([1.0, 1.0, 1.01, 1.5]))
    columns = max(1, int(frame.width / pitch))
    last = columns * max(1, int(frame.height / pitch)) - 1
    least = min(draw(st.sampled_from([6, 16, 30])), last)
    cells = draw(st.lists(st.integers(0, last), min_size=least, max_size=30, unique=True))
    moving = draw(st.integers(0, 2)) < 2
    for cell in cells:
        name = draw(st.sampled_from(sorted(frame.types)))
        row, column = divmod(cell, columns)
        point = [frame.origin[0] + pitch * (column + 0.5), frame.origin[1] + pitch * (row + 0.5)]
        if not clear.take(point, frame.types[name]["radius"]):
            continue
        bottle: Data = {"type": name, "position": point}
        if moving:
            bottle["velocity"] = [0.7 * frame.speed * draw(signed), 0.7 * frame.speed * draw(signed)]
            bottle["spin"] = draw(st.sampled_from([0.0, 0.0, 5.0]))
        entries.append(bottle)
    return entries
