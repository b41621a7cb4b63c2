# SPDX-License-Identifier: Apache-2.0
"""Choices of a scene: a variant, a format and overrides, laid over the data of its file."""

from collections.abc import Mapping
from typing import Any

from conveyor_sim.scene.layout.fragments import Fragment, Report
from conveyor_sim.scene.layout.parameters import unknown, value_fault, with_value
from conveyor_sim.scene.layout.parts import SceneLayout
from conveyor_sim.scene.problems import Path
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.words import did_you_mean, shown

NOT_IN_VARIANTS = ("include", "variants", "formats", "variant", "ports")
"""Fields of a scene that a variant does not have."""


def with_choices(fragment: Fragment, changes: Mapping[str, Any], report: Report) -> None:
    """Lay the chosen variant, the parameters of the chosen format and the overrides over the data of a scene."""
    for field in ("variants", "formats"):
        entries = fragment.data.get(field, {})
        if not isinstance(entries, dict):
            report(fragment.place_of((field,)), f"{shown(entries)} given, expected a mapping of names to {field}")
            return
        for name in entries:
            if not isinstance(name, str):
                report(fragment.place_of((field, name)), f"{shown(name)} given as a name, expected a text")
    variant = _choice(fragment, changes, "variant", report)
    for name in fragment.data.get("variants", {}):
        if _is_variant(fragment, name, report) and name == variant:
            entry = fragment.data["variants"][name]
            _lay_over(fragment, entry, report, lambda path: ("variants", variant, *path))
    # A variant may choose a format.
    kind = _choice(fragment, changes, "format", report)
    if kind is not None and isinstance(entry := fragment.data["formats"][kind], dict):
        source = ("formats", kind, "set")
        if isinstance(values := entry.get("set", {}), dict):
            known = {name: value for name, value in values.items() if name in _named(fragment.data, "parameters")}
            _lay_over(fragment, {"parameters": known}, report, lambda path: (*source, *path[1:]))
    _lay_over(fragment, changes, report)
    for name in fragment.data.get("formats", {}):
        _check_format(fragment, name, report)


def _choice(fragment: Fragment, changes: Mapping[str, Any], field: str, report: Report) -> str | None:
    """Return the name of the chosen variant or format; None without a choice, or with a reported one."""
    name = changes.get(field, fragment.data.get(field))
    known = fragment.data.get(f"{field}s", {})
    if name is None or (isinstance(name, str) and name in known):
        return name
    expected = did_you_mean(str(name), [str(one) for one in known])
    report(fragment.place_of((field,)), f"{shown(name)} given, which is none of {field}s, {expected}")
    return None


def _is_variant(fragment: Fragment, name: Any, report: Report) -> bool:
    """Return True if a variant is a mapping of fields of a scene. Report it if not."""
    source, entry = ("variants", name), fragment.data["variants"][name]
    if not isinstance(entry, dict):
        report(fragment.place_of(source), f"{shown(entry)} given, expected a mapping of fields of the scene")
        return False
    known = [*Scene.model_fields, *SceneLayout.model_fields, "parameters", "cells", "format"]
    for field in entry:
        at = fragment.place_of((*source, field))
        if field in NOT_IN_VARIANTS:
            report(at, "given in a variant, expected in the scene")
            return False
        if field not in known:
            report(at, f"no such field, {did_you_mean(str(field), known)}")
            return False
    return True


def _check_format(fragment: Fragment, name: Any, report: Report) -> None:
    path, entry = ("formats", name), fragment.data["formats"][name]
    if not isinstance(entry, dict):
        report(fragment.place_of(path), f"{shown(entry)} given, expected a mapping with the fields bottle and set")
        return
    for field, value in entry.items():
        at = fragment.place_of((*path, field))
        if field not in ("bottle", "set"):
            report(at, f"no such field, {did_you_mean(str(field), ['bottle', 'set'])}")
        elif field == "set":
            _check_parameters(fragment, value, (*path, field), report)
            known = _named(fragment.data, "parameters")
            for parameter, quantity in value.items() if isinstance(value, dict) else ():
                if parameter in known and (fault := value_fault(quantity, known)):
                    report(fragment.place_of((*path, field, parameter)), fault)
        elif not isinstance(value, str) or value not in _named(fragment.data, "bottle_types"):
            types = [str(one) for one in _named(fragment.data, "bottle_types")]
            report(at, f"{shown(value)} given, which is none of bottle_types, {did_you_mean(str(value), types)}")


def _check_parameters(fragment: Fragment, values: Any, path: Path, report: Report) -> None:
    """Report parameters of a mapping that the scene does not have."""
    known = _named(fragment.data, "parameters")
    if not isinstance(values, dict):
        report(fragment.place_of(path), f"{shown(values)} given, expected a mapping of parameters to values")
        return
    for name in values:
        if name not in known:
            report(fragment.place_of((*path, name)), unknown(name, known))


def _named(data: Mapping[Any, Any], field: str) -> Mapping[Any, Any]:
    parts = data.get(field)
    return parts if isinstance(parts, dict) else {}


def _lay_over(fragment: Fragment, changes: Mapping[str, Any], report: Report, source: Any = None) -> None:
    """Lay changes over the data. source: returns the path in the file of a changed path; None: of overrides."""
    if "parameters" in changes:
        path: Path = ("parameters",) if source is None else source(("parameters",))
        _check_parameters(fragment, changes["parameters"], path, report)
    leaves: list[Path] = []
    fragment.data = _over(fragment.data, changes, (), leaves)
    for leaf in leaves if source is not None else ():
        fragment.sources.add(leaf, *fragment.sources.origin_of(source(leaf)))


def _over(data: Any, changes: Any, path: Path, leaves: list[Path]) -> Any:
    """Return data with changes: mappings merge, other values replace. leaves: gets the changed paths."""
    if not (isinstance(data, dict) and isinstance(changes, Mapping)):
        leaves.append(path)
        return changes
    new = dict(data)
    for key, change in changes.items():
        at = (*path, key)
        if path == ("parameters",) and not isinstance(change, dict):
            leaves.append(at)
            new[key] = with_value(data.get(key), change)
        else:
            new[key] = _over(data.get(key), change, at, leaves)
    return new


def set_bottle(fragment: Fragment, changes: Mapping[str, Any]) -> None:
    """Give all infeeds and sources the bottle type of the chosen format, unless an override names another."""
    kind = fragment.data.get("format")
    if not isinstance(kind, str):
        return
    entry = _named(fragment.data, "formats").get(kind)
    if not isinstance(entry, dict) or "bottle" not in entry:
        return
    origin = fragment.sources.origin_of(("formats", kind, "bottle"))
    for field in ("infeeds", "machines"):
        for name, part in _named(fragment.data, field).items():
            is_entry = isinstance(part, dict) and (field == "infeeds" or part.get("kind") == "source")
            if is_entry and "bottle" not in _named(_named(changes, field), name):
                fragment.data[field][name] = {**part, "bottle": entry["bottle"]}
                fragment.sources.add((field, name, "bottle"), *origin)
