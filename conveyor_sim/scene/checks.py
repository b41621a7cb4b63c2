# SPDX-License-Identifier: Apache-2.0
"""Checks beyond the schema: unknown names, missing pairs of materials, times that don't fit together."""

import math
from collections.abc import Iterator
from itertools import chain, combinations_with_replacement, islice

from conveyor_sim.scene.accuracy import CHOICES
from conveyor_sim.scene.belts import CurvedBelt, CurvedSurface, PathBelt
from conveyor_sim.scene.check_contacts import contact_problems
from conveyor_sim.scene.check_impulses import impulse_problems
from conveyor_sim.scene.check_shapes import shape_problems
from conveyor_sim.scene.check_wheels import wheel_problems
from conveyor_sim.scene.moving import movers_of
from conveyor_sim.scene.problem_count import MOST_SAID
from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.schema import Grid, Scene
from conveyor_sim.scene.types import TOUCH, is_whole_nanoseconds, nanoseconds
from conveyor_sim.scene.words import listed, shown, some_of


def accuracy_problems(scene: Scene) -> Iterator[Problem]:
    """Yield problems of the choice of the time step."""
    accuracy = scene.accuracy
    choices = [field for field in CHOICES if getattr(accuracy, field) is not None]
    if len(choices) > 1:
        yield Problem(("accuracy",), f"{' and '.join(choices)} given, expected at most one of {listed(list(CHOICES))}")
    if accuracy.error is not None and accuracy.integrator != "dormand_prince":
        yield Problem(
            ("accuracy", "error"),
            f"{shown(accuracy.error)} given, expected none with integrator {accuracy.integrator}: "
            "only dormand_prince chooses its own steps",
        )
    if accuracy.dt is not None and accuracy.dt > scene.tick:
        yield Problem(("accuracy", "dt"), f"{shown(accuracy.dt)} given, expected at most the tick, {scene.tick:g} (s)")


def limit_problems(scene: Scene) -> Iterator[Problem]:
    """Yield problems of single heights of bottle types, and of limits of absent quantities."""
    tips = False
    for name, kind in scene.bottle_types.items():
        given = {"contact_height": kind.contact_height, "gravity_height": kind.gravity_height}
        missing = [field for field, value in given.items() if value is None]
        tips = tips or not missing
        if len(missing) == 1:
            other = next(field for field in given if field not in missing)
            text = f"{shown(given[other])} given without {missing[0]}, expected both or neither"
            yield Problem(("bottle_types", name, other), text)
    limits = scene.limits
    if limits.tipping is not None and not tips:
        text = f"{shown(limits.tipping)} given, expected a bottle type with contact_height and gravity_height"
        yield Problem(("limits", "tipping"), text)
    if limits.clogging_time is not None and not scene.outfeeds:
        text = f"{shown(limits.clogging_time)} given, expected an outfeed that could clog"
        yield Problem(("limits", "clogging_time"), text)


MOVE_RAILS = ("leapfrog", "semi_implicit_euler", "velocity_verlet", "impulses")
"""Integrators with moving rails. The others evaluate forces within a step, or solve for forces of rails at rest."""

VIBRATE = ("leapfrog", "semi_implicit_euler", "velocity_verlet")
"""Integrators with vibrating belts."""


WHEEL_FIELDS = ("stars", "screws", "side_belts")
"""Fields of machines whose surfaces move, beside movers."""


def problems_of(scene: Scene) -> list[Problem]:
    """Return up to MOST_SAID + 1 problems of a scene whose fields are each valid by themselves."""
    checks = (
        _times,
        accuracy_problems,
        impulse_problems,
        contact_problems,
        _repeated,
        _missing_contacts,
        _missing_base,
        _unknown_types,
        _rail_names,
        _devices,
        _alarms,
        _moving_rails,
        wheel_problems,
        _vibrations,
        limit_problems,
        shape_problems,
    )
    # Checks run in order: each begins when the previous one has ended.
    return list(islice(chain.from_iterable(check(scene) for check in checks), MOST_SAID + 1))


def _times(scene: Scene) -> Iterator[Problem]:
    if not is_whole_nanoseconds(scene.tick):
        yield Problem(("tick",), f"{shown(scene.tick)} given, expected a whole number of nanoseconds (s)")
        return
    tick = f"{scene.tick:g} s"
    if not is_whole_nanoseconds(scene.duration) or nanoseconds(scene.duration) % scene.tick_ns:
        yield Problem(("duration",), f"{shown(scene.duration)} given, expected a whole number of ticks of {tick} (s)")
    elif scene.duration >= 2**31:
        text = f"{shown(scene.duration)} given, expected less than 2^31 (s): a time stamp of ROS holds no more"
        yield Problem(("duration",), text)
    tick_rate = 1e9 / scene.tick_ns
    for topic in scene.TOPICS:
        if topic == "counters" and topic not in scene.outputs.model_fields_set:
            continue  # older scenes have ticks that its default rate does not divide
        rate = getattr(scene.outputs, topic)
        ticks = tick_rate / rate if rate else 1.0
        if ticks < 0.5 or not math.isclose(ticks, round(ticks), rel_tol=1e-12):
            yield Problem(
                ("outputs", topic),
                f"{shown(rate)} given, expected 0, or the tick rate divided by a whole number: "
                f"{tick_rate:g}, {tick_rate / 2:g}, {tick_rate / 4:g}, {tick_rate / 5:g} ... (Hz)",
            )


def _repeated(scene: Scene) -> Iterator[Problem]:
    """Yield a problem for each pair of materials that is given twice."""
    contacts = [tuple(sorted(contact.between)) for contact in scene.contacts]
    for field, pairs in (("contacts", contacts), ("base", [base.between for base in scene.base])):
        seen: dict[tuple[str, ...], int] = {}
        for index, pair in enumerate(pairs):
            if (first := seen.setdefault(pair, index)) < index:
                yield Problem(
                    (field, index, "between"),
                    f"{shown(pair)} given, expected each pair once ({field}[{first}] is the same pair)",
                )


def _missing_contacts(scene: Scene) -> Iterator[Problem]:
    """Yield a problem for each pair of materials that can touch without a contact."""
    known = {frozenset(contact.between) for contact in scene.contacts}
    for pair, what in _touching(scene):
        if pair not in known:
            known.add(pair)
            names = ", ".join(sorted(pair) if len(pair) == 2 else [*pair, *pair])
            yield Problem(("contacts",), f"no entry for {what}, expected one with between: [{names}]")


def _touching(scene: Scene) -> Iterator[tuple[frozenset[str], str]]:
    """Yield pairs of materials that can touch, and the parts that consist of them."""
    bottles = _bottle_materials(scene)
    if _several_bottles(scene):
        for one, other in combinations_with_replacement(bottles, 2):
            yield frozenset((one, other)), f"bottle of {one} and bottle of {other}"
    first: dict[str, str] = {}
    for name, rail in scene.rails.items():
        first.setdefault(rail.material, f"rail {name}")
    for name, belt in scene.belts.items():
        if isinstance(belt, CurvedBelt) and belt.rails.material and (belt.rails.inner or belt.rails.outer):
            first.setdefault(belt.rails.material, f"rails of belt {name}")
    for path, mover in movers_of(scene):
        first.setdefault(mover.material, f"{path[0]}.{path[1]}")
    for field in WHEEL_FIELDS:
        for name, part in getattr(scene, field).items():
            first.setdefault(part.material, f"{field}.{name}")
    for name, star in scene.stars.items():
        if star.guide is not None:
            first.setdefault(star.guide.material, f"guide of stars.{name}")
    for material, what in first.items():
        for one in bottles:
            yield frozenset((one, material)), f"bottle of {one} and {what} of {material}"


def _missing_base(scene: Scene) -> Iterator[Problem]:
    """Yield a problem for each pair of bottle and belt or plate materials without base friction."""
    known = {base.between for base in scene.base}
    first: dict[str, str] = {}
    for name, belt in scene.belts.items():
        first.setdefault(belt.material, f"belt {name}")
    for name, plate in scene.plates.items():
        first.setdefault(plate.material, f"plate {name}")
    for material, surface in first.items():
        for one in _bottle_materials(scene):
            if (one, material) not in known:
                known.add((one, material))
                yield Problem(
                    ("base",),
                    f"no entry for bottle of {one} on {surface} of {material}, "
                    f"expected one with between: [{one}, {material}]",
                )


def _bottle_materials(scene: Scene) -> list[str]:
    return list(dict.fromkeys(kind.material for kind in scene.bottle_types.values()))


def _several_bottles(scene: Scene) -> bool:
    """Return True if two bottles can meet."""
    return any(scene.entries()) or len(scene.bottles) > 1 or any(isinstance(entry, Grid) for entry in scene.bottles)


def _unknown_types(scene: Scene) -> Iterator[Problem]:
    used: list[tuple[Path, str]] = []
    for entry_path, part in scene.entries():
        used += [((*entry_path, "bottle"), part.bottle)]
        used += [((*entry_path, "types"), kind) for kind in part.kinds if kind != part.bottle]
    for index, entry in enumerate(scene.bottles):
        if isinstance(entry, Grid):
            used.append((("bottles", index, "grid", "type"), entry.grid.type))
        else:
            used.append((("bottles", index, "type"), entry.type))
    known = some_of(scene.bottle_types)
    for path, name in used:
        if name not in scene.bottle_types:
            yield Problem(path, f"{shown(name)} given, expected a name from bottle_types: {known}")


def _devices(scene: Scene) -> Iterator[Problem]:
    others = scene.named()
    for path, part in scene.devices():
        yield from part.problems(path, others)


def _alarms(scene: Scene) -> Iterator[Problem]:
    for name, alarm in scene.alarms.items():
        yield from (Problem(("alarms", name, field), text) for field, text in alarm.wrong())


def _moving_rails(scene: Scene) -> Iterator[Problem]:
    chosen = scene.accuracy.integrator
    wheels = ((field, name) for field in WHEEL_FIELDS for name in getattr(scene, field))
    path = next(chain((path for path, _ in movers_of(scene)), wheels), None)
    if path is not None and chosen not in MOVE_RAILS:
        yield Problem(
            ("accuracy", "integrator"),
            f"{shown(chosen)} given, expected {listed(list(MOVE_RAILS))}, as {path[0]}.{path[1]} moves: "
            "the other integrators take rails to be at rest within a step",
        )


def _vibrations(scene: Scene) -> Iterator[Problem]:
    """Yield problems of vibrating belts: another integrator, and turning surfaces that would vibrate across travel."""
    for name, belt in scene.belts.items():
        if belt.vibration is None:
            continue
        path: Path = ("belts", name, "vibration")
        if scene.accuracy.integrator not in VIBRATE:
            yield Problem(
                path,
                f"given, expected none with integrator {scene.accuracy.integrator}, or integrator "
                f"{listed(list(VIBRATE))}",
            )
        turns = isinstance(belt, CurvedBelt) or (
            isinstance(belt, PathBelt) and any(isinstance(surface, CurvedSurface) for surface in belt.surfaces)
        )
        if turns and abs(math.sin(belt.vibration.direction)) > TOUCH:
            yield Problem(
                (*path, "direction"),
                f"{shown(belt.vibration.direction)} given, expected 0 or half a turn: a surface of the belt turns, and "
                "vibrates along travel only (rad)",
            )


def _rail_names(scene: Scene) -> Iterator[Problem]:
    for name, belt in scene.belts.items():
        if isinstance(belt, CurvedBelt):
            for side, wanted in (("inner", belt.rails.inner), ("outer", belt.rails.outer)):
                derived = f"{name}_{side}"
                if wanted and derived in scene.rails:
                    yield Problem(
                        ("rails", derived),
                        f"{shown(derived)} given as a name, expected another one: "
                        f"the {side} rail of belt {name} is called so",
                    )
    for name, star in scene.stars.items():
        derived = f"{name}_guide"
        if star.guide is not None and derived in scene.rails:
            text = f"{shown(derived)} given as a name, expected another one: the guide of stars.{name} is called so"
            yield Problem(("rails", derived), text)
