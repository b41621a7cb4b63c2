# SPDX-License-Identifier: Apache-2.0
"""Checks of a scene with integrator impulses: laws that it does not have."""

from collections.abc import Iterator

from conveyor_sim.scene.problems import Path, Problem
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.words import shown

_WITH = "with integrator impulses, or another integrator"


def impulse_problems(scene: Scene) -> Iterator[Problem]:
    """Yield problems of the fields that belong to integrator impulses, and of those that it does not support."""
    accuracy = scene.accuracy
    if accuracy.preset == "fast":
        yield Problem(
            ("accuracy", "preset"), '"fast" given beside other fields, expected it alone, or integrator impulses'
        )
        return
    if accuracy.integrator != "impulses":
        if accuracy.sweeps is not None:
            yield Problem(
                ("accuracy", "sweeps"),
                f"{accuracy.sweeps} given, expected none with integrator {accuracy.integrator}: only impulses sweeps",
            )
        return
    for field in ("preset", "tolerance"):
        if (value := getattr(accuracy, field)) is not None:
            yield Problem(("accuracy", field), f"{shown(value)} given, expected per_tick or dt {_WITH}")
            return
    if accuracy.per_tick is None and accuracy.dt is None:
        yield Problem(("accuracy",), f"neither per_tick nor dt given, expected per_tick, such as 8, {_WITH}")
    yield from _laws(scene)


def _laws(scene: Scene) -> Iterator[Problem]:
    for index, contact in enumerate(scene.contacts):
        path: Path = ("contacts", index)
        for field in ("hertz_stiffness", "table"):
            if getattr(contact, field) is not None:
                yield Problem((*path, field), f"given, expected stiffness {_WITH}")
        if contact.damping.law not in ("none", "normal"):
            yield Problem(
                (*path, "damping", "law"), f'{shown(contact.damping.law)} given, expected "normal" or "none" {_WITH}'
            )
    if scene.friction_curve != "polynomial":
        yield Problem(("friction_curve",), f'{shown(scene.friction_curve)} given, expected "polynomial" {_WITH}')
    for name, kind in scene.bottle_types.items():
        if kind.base_radius is not None:
            yield Problem(
                ("bottle_types", name, "base_radius"), f"{shown(kind.base_radius)} given, expected none {_WITH}"
            )
