# SPDX-License-Identifier: Apache-2.0
"""Entries of a scene from measurements: values, with their intervals in comments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from conveyor_sim.errors import CalibrationError
from conveyor_sim.studies.calibration import restitution as impacts
from conveyor_sim.studies.calibration.estimate import Estimate
from conveyor_sim.studies.calibration.friction import friction, slip_limit
from conveyor_sim.studies.calibration.read import Measurement, read_measurements
from conveyor_sim.studies.calibration.restitution import Restitution, impossible, restitution
from conveyor_sim.studies.calibration.stiffness import Elastic, elastic
from conveyor_sim.studies.calibration.vibration import MeasuredVibration, vibration

_MOST_FRICTION = 2.0
"""Largest coefficient of friction that is plausible. Beyond, a unit in the header is probably wrong."""
_MOST_SAID = 20
"""Largest number of rows that an error lists."""

_CONTACT_KINDS = ("compression", "contact_friction", *impacts.KINDS)

Pair = tuple[str, str]


@dataclass
class ContactValues:
    """Parameters of two materials that touch."""

    between: Pair
    elastic: Elastic | None = None
    friction: Estimate | None = None
    restitution: Restitution | None = None


@dataclass
class Calibration:
    """Result of `calibrate`."""

    base: dict[Pair, Estimate] = field(default_factory=dict)
    """Friction by materials of bottle and belt."""
    contacts: list[ContactValues] = field(default_factory=list)
    slip_limit: Estimate | None = None
    """m/s"""
    vibrations: dict[str, MeasuredVibration] = field(default_factory=dict)
    """Vibrations by material of the chain."""
    remarks: list[str] = field(default_factory=list)
    """Sentences on values that the measurements don't determine."""


def calibrate(path: Path) -> Calibration:
    """Return all parameters that the measurements in a CSV file determine.

    Raise CalibrationError for a file that can't be read, for rows that can't be measurements, and if no parameter is
    determined.
    """
    rows = read_measurements(path)
    _refuse_impossible(path, rows)
    result = Calibration()
    for pair, chosen in _by_pair(rows, "base_friction"):
        result.base[pair] = friction(chosen)
    if slow := [row for row in rows if row.kind == "slip_limit"]:
        slip = slip_limit(slow)
        result.slip_limit = slip.limit
        result.remarks += [slip.remark] if slip.remark else []
        for pair, estimate in slip.friction.items():
            if pair in result.base:
                result.remarks.append(f"base, {_named(pair)}: rows of slip_limit give friction {_said(estimate)}")
            else:
                result.base[pair] = estimate
    for (_, chain), chosen in _by_pair(rows, "vibration"):
        result.vibrations[chain] = vibration(chosen)
    touches = [row for row in rows if row.kind in _CONTACT_KINDS]
    for between in _unordered(touches):
        touching = [row for row in touches if set(row.between) == set(between)]
        result.contacts.append(_contact(between, touching, result.remarks))
    if not (result.base or result.slip_limit or result.vibrations) and not any(map(_has_value, result.contacts)):
        raise CalibrationError(f"{path}: no parameter is determined: {'; '.join(result.remarks)}")
    return result


def _refuse_impossible(path: Path, rows: Sequence[Measurement]) -> None:
    problems = []
    for row in rows:
        reason = impossible(row) if row.kind in impacts.KINDS else _implausible(row)
        problems += [f"{path}:{row.line}: {reason}"] if reason else []
    if problems:
        more = len(problems) - _MOST_SAID
        rest = [f"{path}: {more} more problems"] if more > 0 else []
        raise CalibrationError("\n".join([*problems[:_MOST_SAID], *rest]))


def _implausible(row: Measurement) -> str:
    """Return the reason why a row can't be a measurement of friction; "" if it can."""
    if row.kind in ("compression", "vibration"):
        return ""
    value = friction([row]).value
    if value > _MOST_FRICTION:
        return f"force: gives a friction of {value:.3g}, expected at most {_MOST_FRICTION:g}; are the units right?"
    if value == 0.0 and row.kind != "slip_limit":
        return "force: 0 given, expected a number greater than 0"
    return ""


def _contact(between: Pair, rows: Sequence[Measurement], remarks: list[str]) -> ContactValues:
    values = ContactValues(between)
    name = f"contacts, {_named(between)}"
    if pressed := [row for row in rows if row.kind == "compression"]:
        law = elastic(pressed)
        if isinstance(law, str):
            remarks.append(f"{name}: stiffness: {law}")
        else:
            values.elastic = law
    if pulled := [row for row in rows if row.kind == "contact_friction"]:
        values.friction = friction(pulled)
    if hit := [row for row in rows if row.kind in impacts.KINDS]:
        values.restitution = restitution(hit)
    return values


def _has_value(contact: ContactValues) -> bool:
    return bool(contact.elastic or contact.friction or contact.restitution)


def _by_pair(rows: Sequence[Measurement], kind: str) -> Iterator[tuple[Pair, list[Measurement]]]:
    chosen = [row for row in rows if row.kind == kind]
    for pair in dict.fromkeys(row.between for row in chosen):
        yield pair, [row for row in chosen if row.between == pair]


def _unordered(rows: Iterable[Measurement]) -> list[Pair]:
    """Return the pairs of materials in any order, each once."""
    pairs: dict[frozenset[str], Pair] = {}
    for row in rows:
        pairs.setdefault(frozenset(row.between), row.between)
    return list(pairs.values())


def _named(pair: Pair) -> str:
    return f"{pair[0]} and {pair[1]}"


def _said(estimate: Estimate) -> str:
    return f"{estimate.rounded(estimate.value)} ({estimate})"
