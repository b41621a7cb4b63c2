# SPDX-License-Identifier: Apache-2.0
"""Text of a calibration: YAML that can be pasted into a scene, with intervals in comments."""

from __future__ import annotations

from collections.abc import Iterator

from conveyor_sim.studies.calibration.calibrate import Calibration, ContactValues
from conveyor_sim.studies.calibration.estimate import Estimate
from conveyor_sim.studies.calibration.restitution import Restitution
from conveyor_sim.support.printable import printable


def entries(calibration: Calibration, source: str) -> str:
    """Return the entries `base`, `contacts` and `slip_limit`, SI. source: name of the file of measurements.

    A contact without stiffness is a comment, because a scene would refuse it. A vibration is one, too, because it
    belongs into an entry that the scene has.
    """
    return "\n".join([f"# from {printable(source)}, by conveyor-sim calibrate", *_lines(calibration)]) + "\n"


def _lines(calibration: Calibration) -> Iterator[str]:
    if calibration.base:
        yield "base:"
        for (bottle, belt), estimate in calibration.base.items():
            yield f"  - between: [{bottle}, {belt}]"
            yield f"    friction: {_valued(estimate)}"
    complete = [contact for contact in calibration.contacts if contact.elastic is not None]
    if complete:
        yield "contacts:"
        for contact in complete:
            yield from _contact(contact)
    if calibration.slip_limit is not None:
        yield f"slip_limit: {_valued(calibration.slip_limit)}"
    for contact in calibration.contacts:
        rest = list(_contact(contact))[1:] if contact.elastic is None else []
        if rest:
            yield f"# contacts, {' and '.join(contact.between)}: no stiffness, expected rows of compression; the rest:"
            yield from (f"#{line}" for line in rest)
    for chain, vibration in calibration.vibrations.items():
        yield f"# {chain}: in its entry of conveyors or belts, with 95 % intervals below"
        values = [(name, getattr(vibration, name)) for name in ("amplitude", "frequency", "direction")]
        yield f"# vibration: {{{', '.join(f'{name}: {_number(estimate)}' for name, estimate in values)}}}"
        yield from (f"#   {name}, {estimate}" for name, estimate in values)
    for remark in calibration.remarks:
        yield f"# {remark}"


def _contact(contact: ContactValues) -> Iterator[str]:
    yield f"  - between: [{', '.join(contact.between)}]"
    if contact.elastic is not None:
        if contact.elastic.value is not None:
            yield f"    {contact.elastic.field}: {_valued(contact.elastic.value)}"
        else:
            points = ", ".join(f"[{overlap:.6g}, {force:.6g}]" for overlap, force in contact.elastic.points)
            yield f"    table: [{points}]"
        yield from (f"    # {remark}" for remark in contact.elastic.remarks)
    if contact.friction is not None:
        yield f"    friction: {_valued(contact.friction)}"
    if contact.restitution is not None:
        yield from _damping(contact.elastic.field if contact.elastic else "stiffness", contact.restitution)


def _damping(field: str, restitution: Restitution) -> Iterator[str]:
    """Yield the damping with the simplest law that the elastic law permits and the trend with the speed needs."""
    estimate = restitution.value
    law, speed = "normal", ""
    if restitution.falls or field == "table":
        law = "viscoelastic" if field == "hertz_stiffness" else "onset"
        speed = f", speed: {restitution.speed:.3g}"
    value = f"restitution: {estimate.rounded(estimate.value)}{speed}"
    yield f"    damping: {{law: {law}, {value}}}  # restitution, {estimate}"
    yield from (f"    # {remark}" for remark in restitution.remarks)


def _valued(estimate: Estimate) -> str:
    return f"{_number(estimate)}  # {estimate}"


def _number(estimate: Estimate) -> str:
    """Return a value that YAML 1.1 reads as a number, too: with a point in front of an exponent."""
    text = estimate.rounded(estimate.value)
    mantissa, mark, exponent = text.partition("e")
    return f"{mantissa}.0e{exponent}" if mark and "." not in mantissa else text
