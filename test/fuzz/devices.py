# SPDX-License-Identifier: Apache-2.0
"""Random devices of a scene: drives, rails that move, machines, spills, sensors and indicators, as data."""

from __future__ import annotations

import math
from typing import Any, Protocol

from fuzz.draws import Data, between, fractions, scaled, signed
from hypothesis import strategies as st

WORK: Data = {
    "sets": {"cap": {"to": 1.0, "share": 0.5}, "bad": {"to": 0.0}},
    "tests": {"cap": {"low": 1.0, "false_accept": 0.3, "false_reject": 0.3}},
}
"""Of a station."""


class Frame(Protocol):
    """Sizes that the parts of a scene share."""

    unit: float
    speed: float
    tick: float
    types: dict[str, Data]

    @property
    def points(self) -> st.SearchStrategy[list[float]]:
        """Points of the area."""


class Clear(Protocol):
    """Where bottles may be born."""

    def of_rails(self, points: Any, radius: float) -> bool:
        """Whether bottles of a radius (m) at points touch no rail."""


OF_DRIVE = ("speed", "speed_limits", "watchdog")
"""Fields of a belt that its named drive has instead."""


@st.composite
def drives(draw: st.DrawFn, frame: Frame, belts: Data) -> Data:
    """Belts with drives: none, one of their own, or a named one; the fields `belts` and `drives`."""
    moved, named = {}, {}
    for n in range(draw(st.integers(0, 2))):
        first = draw(st.sampled_from(sorted(belts))) if belts else None
        taken = {field: belts[first][field] for field in OF_DRIVE if field in belts[first]} if first else {}
        named[f"drive_{n}"] = {**taken, **draw(st.one_of(st.just({}), _drive(frame)))}
    for name, belt in belts.items():
        kind = draw(st.integers(0, 3 if named else 2))
        if kind == 3:
            rest = {field: value for field, value in belt.items() if field not in OF_DRIVE}
            ratio = draw(st.sampled_from([{}, {"ratio": 0.5}, {"ratio": 1.3}]))
            moved[name] = {**rest, "drive": draw(st.sampled_from(sorted(named))), **ratio}
        else:
            moved[name] = {**belt, "drive": draw(_drive(frame))} if kind else belt
    return {"belts": moved, "drives": named} if named else {"belts": moved}


EACH_WHEEL = ("star", "star", "screw", "side belt")
"""Where scenes have the same effects; the first star wheel has many pockets then, which is another effect."""


@st.composite
def axes(draw: st.DrawFn, frame: Frame, belts: Data, drives: Data) -> Data:
    """Axes with gears, and belts that they move; the fields `axes` and `belts`."""
    top = frame.speed / frame.unit
    found: Data = {"axis_0": {"rate": top / 6.3 * draw(between(-1.0, 1.0)), "rate_limit": top / 6.3}}
    for n in range(1, draw(st.integers(2, 4))):
        if drives and draw(st.integers(0, 3)) == 3:
            axis = {"drive": draw(st.sampled_from(sorted(drives))), "travel": 6.3 * frame.unit}
        else:
            ratio = draw(st.sampled_from([1.0, -0.5, "1/12", "-2/3", 0.3819660112501051]))
            axis = {"master": draw(st.sampled_from(sorted(found))), "ratio": ratio, "in_gear": draw(st.booleans())}
            axis["phase"] = draw(between(-math.pi, math.pi))
        found[f"axis_{n}"] = axis
    for axis in found.values():
        axis["acceleration"] = top / (frame.tick * draw(st.sampled_from([0.5, 4.0, 30.0])))
        axis["jog_speed"] = top * draw(between(0.1, 0.5))
        axis["following_limit"] = draw(st.sampled_from(["none", 0.1, 3.0]))
    moved = dict(belts)
    for name, belt in belts.items():
        if "drive" not in belt and draw(st.booleans()):
            rest = {field: value for field, value in belt.items() if field not in OF_DRIVE}
            moved[name] = {**rest, "axis": draw(st.sampled_from(sorted(found))), "travel": 6.3 * frame.unit}
    return {"axes": found, "belts": moved}


@st.composite
def wheels(draw: st.DrawFn, frame: Frame, material: str, found: Data, alike: bool, side_belts: bool) -> Data:
    """Star wheels with carousels, screws and side belts; the fields of these, and `axes` with at least one.

    found: axes of the scene. Their limits of torque suffice for their accelerations. alike: draw EACH_WHEEL.
    side_belts: whether side belts are drawn.
    """
    kinds = EACH_WHEEL if side_belts else EACH_WHEEL[:-1]
    machines: dict[str, dict[str, Data]] = {"axes": dict(found), "stars": {}, "carousels": {}, "screws": {}}
    machines["side_belts"] = {}
    reach, heaviest = 8.0 * frame.unit, max(kind["mass"] for kind in frame.types.values())
    top = frame.speed / reach
    if not found:
        rate = top / 6.3
        machines["axes"]["axis_0"] = {"rate": rate * draw(signed), "rate_limit": rate, "jog_speed": 0.3 * top}
        machines["axes"]["axis_0"]["acceleration"] = top / (frame.tick * draw(st.sampled_from([0.5, 4.0, 30.0])))
        machines["axes"]["axis_1"] = {**machines["axes"]["axis_0"], "master": "axis_0"}
        for field in ("rate", "rate_limit"):
            del machines["axes"]["axis_1"][field]
        machines["axes"]["axis_1"]["ratio"] = draw(st.sampled_from([1.0, -0.5, "1/12"]))
    for axis in machines["axes"].values():
        if spare := draw(st.sampled_from([0.0, 1.01, 10.0])):
            axis["inertia"] = heaviest * reach**2 * draw(scaled(0.3, 30.0))
            axis["torque_limit"] = axis["inertia"] * axis["acceleration"] * spare
    names = sorted(machines["axes"])
    for n in range(len(kinds) if alike else draw(st.integers(1, 3))):
        axis, pocket = draw(st.sampled_from(names)), frame.unit * draw(st.sampled_from([1.02, 1.2, 2.0]))
        on_axis = {"axis": axis, "material": material, "pocket_radius": pocket}
        what = kinds[n] if alike else draw(st.sampled_from(kinds)) if n else "star"
        start, angle = draw(frame.points), draw(between(-math.pi, math.pi))
        length = frame.unit * draw(st.integers(2, 8))
        end = [start[0] + length * math.cos(angle), start[1] + length * math.sin(angle)]
        if what == "side belt":
            belt = {"from": start, "to": end, "material": material}
            if draw(st.booleans()):
                belt |= {"axis": axis, "travel": frame.unit}
            else:
                belt |= {"speed": frame.speed * draw(signed), "speed_limits": [-frame.speed, frame.speed]}
            machines["side_belts"]["side"] = belt
        elif what == "screw":
            pitch = 2.0 * pocket * draw(between(1.0, 1.5))
            points = draw(st.sampled_from([[[0.0, pitch]], [[0.0, pitch], [0.5 * length, 1.4 * pitch]]]))
            side = draw(st.sampled_from(["left", "right"]))
            machines["screws"]["screw"] = {**on_axis, "from": start, "to": end, "side": side, "pitch": points}
        else:
            pockets = 8 if alike and n == 0 else draw(st.sampled_from([1, 2, 3, 8]))
            radius = max(1.3 * pocket * pockets / math.pi, 1.5 * pocket)
            star = {**on_axis, "centre": start, "entry": angle, "turn": draw(st.sampled_from(["left", "right"]))}
            star |= {"pockets": pockets, "pitch_radius": radius, "carry": draw(between(0.5, 6.28))}
            star |= draw(st.sampled_from([{}, {"guide": {"material": material, "clearance": 0.1 * pocket}}]))
            machines["stars"][f"star_{n}"] = star
            if draw(st.booleans()):
                work = {"star": f"star_{n}", "from": 0.0, "to": star["carry"], "sets": {"cap": {"to": 1.0}}}
                machines["carousels"][f"carousel_{n}"] = work
    return {field: parts for field, parts in machines.items() if parts}


@st.composite
def _drive(draw: st.DrawFn, frame: Frame) -> Data:
    """Ramps and encoder of a drive."""
    ticks = draw(st.sampled_from([0.5, 3.0, 17.0]))
    drive: Data = {"acceleration": frame.speed / (ticks * frame.tick)}
    if draw(st.booleans()):
        drive["jerk"] = drive["acceleration"] / (frame.tick * draw(st.sampled_from([0.7, 5.0])))
    if draw(st.booleans()):
        drive["pulses_per_metre"] = draw(scaled(0.1, 1e4))
    return drive


POSITIONED = {"dividers": "lane", "adjustable": "setting"}
"""Fields of movers with several positions, and their field for the initial one."""


@st.composite
def movers(draw: st.DrawFn, frame: Frame, material: str, lifts: bool, alike: bool) -> Data:
    """Gates, pushers, diverters, dividers, adjustable guides and clamps; at least one. alike: the first has a limit."""
    fields = ("gates", "pushers", "diverters", *POSITIONED, "clamps")
    found: dict[str, dict[str, Data]] = {field: {} for field in fields}
    for n in range(draw(st.integers(1, 3))):
        is_lift = lifts and n == 0
        field = "gates" if is_lift else draw(st.sampled_from(sorted(found)))
        start, angle = draw(frame.points), draw(between(-math.pi, math.pi))
        length = frame.unit * draw(st.integers(1, 6))
        end = [start[0] + length * math.cos(angle), start[1] + length * math.sin(angle)]
        speed = frame.speed * draw(between(0.1, 0.7))
        swings = field == "diverters" or (not is_lift and field in ("gates", "dividers") and draw(st.booleans()))
        rail: Data = {"from": start, "to": end, "material": material}
        if field == "gates":
            kind = "swing" if swings else "lift" if is_lift else "slide"
            rail |= {"kind": kind, "open": draw(st.booleans())}
        if field == "dividers":
            rail |= {"kind": "swing" if swings else "slide"}
            rail |= draw(st.sampled_from([{}, {"clearance": 3.0 * frame.unit}]))
        if field in POSITIONED:
            count, unit = draw(st.integers(2, 4)), 0.3 if swings else frame.unit
            steps = [draw(st.integers(-4, 4)) for _ in range(count - 1)]
            rail |= {
                "positions": [unit * place for place in (*steps, 5)],
                POSITIONED[field]: draw(st.integers(0, count - 1)),
            }
        elif swings:
            rail |= {"angle": draw(between(0.2, 2.0)) * draw(st.sampled_from([1.0, -1.0]))}
        else:
            rail |= {"stroke": frame.unit * draw(between(0.3, 5.0))}
        rail["max_speed"] = speed / length if swings else speed
        if field == "clamps":
            rail["opening"] = 2.0 * rail["stroke"] + frame.unit * draw(between(0.1, 3.0))
        if not swings and rail.get("kind") != "lift":
            rail["direction"] = draw(between(-math.pi, math.pi))
        rail["acceleration"] = rail["max_speed"] / (frame.tick * draw(st.sampled_from([0.5, 4.0, 30.0])))
        rail |= draw(_drives(frame, swings, length, rail["acceleration"], alike and n == 0))
        found[field][f"mover_{n}"] = rail
    return found


@st.composite
def row_pushers(draw: st.DrawFn, frame: Frame, pushers: Data, zones: Data) -> None:
    """Let some pushers push by themselves."""
    for pusher in pushers.values():
        if draw(st.booleans()):
            pusher["zone"] = draw(st.sampled_from(sorted(zones)))
            pusher["settle"] = frame.tick * draw(st.sampled_from([0.0, 3.5]))
            zones[pusher["zone"]].setdefault("full_at", 2)


@st.composite
def _drives(draw: st.DrawFn, frame: Frame, swings: bool, length: float, acceleration: float, limited: bool) -> Data:
    """Limit and mass of a rail that can follow its profile without bottles: with little to spare, much, or no limit."""
    mass = max(kind["mass"] for kind in frame.types.values()) * draw(scaled(0.3, 30.0))
    names = ("torque_limit", "inertia") if swings else ("force_limit", "moving_mass")
    mass *= length**2 / 3.0 if swings else 1.0
    spare = draw(st.sampled_from([1.01, 3.0, 100.0] if limited else [1.01, 3.0, 100.0, 0.0]))
    return {names[0]: mass * acceleration * spare if spare else "none", names[1]: mass}


@st.composite
def machines(draw: st.DrawFn, frame: Frame, clear: Clear) -> Data:
    """Sources, sinks, stations, inspections, rejects and spills; at least one."""
    found: dict[str, dict[str, Data]] = {"machines": {}, "spills": {}}
    for n in range(draw(st.integers(1, 5))):
        what = draw(st.sampled_from(["source", "sink", "station", "inspection", "reject", "spill"]))
        if what in ("source", "spill"):
            kind, at = draw(st.sampled_from(sorted(frame.types))), draw(frame.points)
            if not clear.of_rails([at], frame.types[kind]["radius"]):
                continue
            if what == "spill":
                found["spills"][f"spill_{n}"] = {"bottle": kind, "position": at, "count": draw(st.integers(1, 4))}
                continue
            entry: Data = {"kind": what, "bottle": kind, "position": at, "direction": draw(between(-math.pi, math.pi))}
            entry["speed"] = frame.speed * draw(fractions)
            entry |= draw(st.sampled_from([{}, {"bad_every": 2}, {"bad_share": 0.3}, {"bad_share": 1.0}]))
        elif what == "inspection":
            entry = {"kind": what, **draw(_lines(frame))}
        elif what == "station":
            at = draw(frame.points)
            if not clear.of_rails([at], max(kind["radius"] for kind in frame.types.values())):
                continue
            entry = {"kind": what, "region": draw(_regions(frame)), "position": at}
            entry |= {"direction": draw(between(-math.pi, math.pi)), "speed": frame.speed * draw(fractions)}
            entry |= draw(st.sampled_from([{}, WORK]))
        else:
            entry = {"kind": what, "region": draw(_regions(frame))}
            if what == "sink":
                entry |= draw(st.sampled_from([{}, {"at_once": 3}]))
        if what in ("source", "sink", "station"):
            entry["rate"] = draw(scaled(0.02, 2.0)) / frame.tick
            entry |= draw(st.sampled_from([{}, {"rate_limit": 3.0 * entry["rate"]}]))
            if what == "station":
                entry |= draw(_insides(entry["rate"], sorted(frame.types)))
            entry |= draw(_habits(frame.tick))
        elif what == "reject":
            entry |= {"delay": frame.tick * draw(st.sampled_from([0.0, 2.5])),
                      "window": frame.tick * draw(st.sampled_from([0.5, 4.0]))}  # fmt: skip
        found["machines"][f"machine_{n}"] = entry
    return found


@st.composite
def _insides(draw: st.DrawFn, rate: float, types: list[str]) -> Data:
    """Return random fields of a station: the bottles that it holds, their time there, and changes of their types."""
    capacity = draw(st.integers(1, 5))
    found = draw(st.sampled_from([{}, {"capacity": capacity}, {"capacity": capacity, "hold": 0.6 * capacity / rate}]))
    changes = {before: after for before in types if (after := draw(st.sampled_from(types))) != before}
    return {**found, "changes": changes} if draw(st.booleans()) else found


@st.composite
def _habits(draw: st.DrawFn, tick: float) -> Data:
    """What a machine does by itself: most have none of it."""
    times = st.sampled_from([0.5, 3.0, 20.0]).map(lambda ticks: ticks * tick)
    found: Data = {"suspend_after": draw(times)}
    if draw(st.booleans()):
        return found
    way = st.sampled_from(["exponential", "weibull", "list"])
    failure: Data = {"counted": draw(st.sampled_from(["running", "clock"]))}
    for what in ("between", "repair"):
        kind, time = draw(way), draw(times)
        more = {"exponential": {"mean": time}, "weibull": {"mean": time, "shape": 1.7}, "list": {"times": [time, tick]}}
        failure[what] = {"kind": kind, **more[kind]}
    found |= draw(st.sampled_from([{}, {"failures": {"jam": failure}}]))
    found |= draw(st.sampled_from([{}, {"ramp_up": 7.0 * tick}]))
    found |= draw(st.sampled_from([{}, {"acting_times": {"holding": 2.0 * tick, "starting": tick}}]))
    found |= draw(st.sampled_from([{}, {"planned_stops": {"rest": {"start": tick, "duration": draw(times)}}}]))
    return found


@st.composite
def panel(draw: st.DrawFn, frame: Frame) -> Data:
    """Push-buttons, selector switches, emergency stops, lamps, horns, stack lights and numeric fields; at least one."""
    deceleration = frame.speed / (frame.tick * draw(st.sampled_from([0.5, 3.0, 17.0])))
    cuts = st.sampled_from([[], ["drives"], ["machines"], ["drives", "machines"]])
    found: dict[str, Data] = {}
    for n in range(draw(st.integers(1, 5))):
        kinds = ["emergency_stop", "button", "emergency_stop", "selector", "lamp", "horn", "stack_light", "numeric"]
        part: Data = {"kind": draw(st.sampled_from(kinds))}
        if part["kind"] == "button":
            part |= {"contact": draw(st.sampled_from(["NO", "NC"]))}
            part |= {"action": draw(st.sampled_from(["momentary", "maintained"]))}
            part |= {"bounce": frame.tick * draw(st.sampled_from([0.0, 0.4, 5.0]))}
        elif part["kind"] == "selector":
            part |= {"positions": ["off", "hand", "auto"][: draw(st.integers(2, 3))]}
            part |= draw(st.sampled_from([{}, {"initial": "hand"}]))
        elif part["kind"] == "emergency_stop":
            part |= {"cuts": draw(cuts)}
            part |= {"deceleration": deceleration} if "drives" in part["cuts"] else {}
        elif part["kind"] == "numeric":
            part |= {"limits": [draw(between(-2.0, 0.0)), draw(between(0.1, 3.0))]}
            part |= {"written_by": draw(st.sampled_from(["operator", "controller", "both"]))}
        found[f"part_{n}"] = part
    return {"panel": found}


@st.composite
def sensors(draw: st.DrawFn, frame: Frame, belts: list[str]) -> Data:
    """Photo-eyes, zones, counters, and an indicator where there is a belt for it."""
    delays = st.sampled_from([0.0, 0.0, 0.4 * frame.tick, 2.0 * frame.tick, 7.3 * frame.tick])
    eyes = [
        {**draw(_lines(frame)), "debounce": draw(delays), "on_delay": draw(delays), "off_delay": draw(delays)}
        for _ in range(draw(st.integers(1, 2)))
    ]
    zones: list[Data] = [{"region": draw(_regions(frame))} for _ in range(draw(st.integers(1, 2)))]
    zones[0]["full_at"] = draw(st.integers(1, 5))
    found: Data = {
        "photo_eyes": {f"eye_{n}": eye for n, eye in enumerate(eyes)},
        "zones": {f"zone_{n}": zone for n, zone in enumerate(zones)},
        "counters": {f"counter_{n}": draw(_lines(frame)) for n in range(draw(st.integers(1, 2)))},
    }
    if belts:
        indicator: Data = {"counter": "counter_0", "belt": belts[0], "zone": f"zone_{len(zones) - 1}"}
        indicator |= {"jam_time": frame.tick * draw(st.sampled_from([0.5, 6.0]))}
        indicator |= draw(st.sampled_from([{}, {"window": 5.0 * frame.tick}, {"starved_time": 3.0 * frame.tick}]))
        if len(belts) > 1 and draw(st.booleans()):
            indicator["downstream"] = belts[1]
        if len(zones) > 1 and draw(st.booleans()):
            indicator["backup"] = "zone_0"
        found["indicators"] = {"exit": indicator}
    return found


@st.composite
def _lines(draw: st.DrawFn, frame: Frame) -> Data:
    start, angle = draw(frame.points), draw(st.sampled_from([0.0, math.pi / 2, 1.0]))
    length = frame.unit * draw(st.integers(1, 12)) * draw(st.sampled_from([1.0, -1.0]))
    return {"from": start, "to": [start[0] + length * math.cos(angle), start[1] + length * math.sin(angle)]}


@st.composite
def _regions(draw: st.DrawFn, frame: Frame) -> list[list[float]]:
    x, y = draw(frame.points)
    w, h = draw(st.integers(1, 10)) * frame.unit, draw(st.integers(1, 10)) * frame.unit
    return [[x, y], [x + w, y], [x + w, y + h], [x, y + h]][: draw(st.sampled_from([4, 3]))]
