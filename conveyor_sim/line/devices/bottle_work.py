# SPDX-License-Identifier: Apache-2.0
"""Work of stations and carousels on bottles: settings and tests of attributes, changes of type, and their counts."""

from collections.abc import Sequence
from types import SimpleNamespace

import numpy as np

from conveyor_sim.line.device import ScanContext
from conveyor_sim.line.devices.setup import DeviceSetup
from conveyor_sim.line.tag import Tag, count
from conveyor_sim.scene.parts.work import BAD, Acceptance, AttributeRule, Working


def work_tags(name: str, part: Working) -> list[Tag]:
    """Return the signals of `BottleWork.work_values`."""
    return [
        count(f"{name}/good", "counter", "Bottles that passed all tests."),
        count(f"{name}/defective", "counter", "Bottles that failed a test."),
        count(f"{name}/false_accepts", "counter", "Tests passed by values outside their limits."),
        count(f"{name}/false_rejects", "counter", "Tests failed by values within their limits."),
        *(count(f"{name}/defect_{test}", "counter", f"Bottles that failed the test `{test}`.") for test in part.tests),
    ]


class BottleWork:
    """Work of one device on bottles."""

    defects: dict[str, int]
    """Number of defective bottles, by test."""

    def work_as(self, name: str, part: Working, setup: DeviceSetup) -> None:
        """Start without bottles, with a random stream for each setting and test.

        name: prefix of the tags of the device.
        """
        types = setup.model.bottle_types
        self._changes = {types.index(before): types.index(after) for before, after in part.changes.items()}
        self._sets = [
            AttributeSetting(what, setting, setup.random(name, f"sets/{what}")) for what, setting in part.sets.items()
        ]
        self._tests = [
            AttributeTest(what, test, setup.random(name, f"tests/{what}")) for what, test in part.tests.items()
        ]
        named = {f"sets_{setting.attribute}": setting.random for setting in self._sets}
        self.streams = SimpleNamespace(**named, **{f"tests_{test.attribute}": test.random for test in self._tests})
        """Random streams of settings and tests."""
        self.processed = self.good = 0
        self.false_accepts = self.false_rejects = 0
        self.defects = dict.fromkeys(part.tests, 0)

    def type_after(self, kind: int) -> int:
        """Return the type of a finished bottle, by the index of its type before."""
        return self._changes.get(kind, kind)

    def finish(self, bottle: int, now: ScanContext) -> None:
        """Count a processed bottle, set its attributes, and test it."""
        self.processed += 1
        for setting in self._sets:
            if (value := setting.value(self.processed)) is not None:
                now.set_attribute(bottle, setting.attribute, value)
        self.test(bottle, now)

    def test(self, bottle: int, now: ScanContext) -> None:
        """Test the attributes of a bottle. It is bad if it fails a test."""
        defective = False
        for test in self._tests:
            within = test.within(now.attribute(bottle, test.attribute))
            passed = test.passes(within)
            self.false_accepts += passed and not within
            self.false_rejects += within and not passed
            self.defects[test.attribute] += not passed
            defective = defective or not passed
        if defective:
            now.set_attribute(bottle, BAD, 1.0)
        self.good += not defective

    def counts(self) -> tuple[int, int, int]:
        """Return processed bottles, and defective ones among them."""
        return self.processed, self.processed - self.good, 0

    def work_values(self) -> Sequence[float]:
        """Return the values of the signals of `work_tags`."""
        return (
            self.good,
            self.processed - self.good,
            self.false_accepts,
            self.false_rejects,
            *self.defects.values(),
        )


class AttributeSetting:
    """Setting of one attribute by a station."""

    def __init__(self, attribute: str, setting: AttributeRule, random: np.random.Generator) -> None:
        self.attribute, self.random = attribute, random
        self._setting, self._at = setting, frozenset(setting.at)

    def value(self, number: int) -> float | None:
        """Return the new value for the bottle of a number (from 1), None if it keeps its value."""
        setting = self._setting
        # Random numbers are drawn only if they decide.
        chosen = setting.every is None or number % setting.every == 0
        chosen = chosen and (not self._at or number in self._at)
        if chosen and setting.share < 1.0:
            chosen = float(self.random.uniform()) < setting.share
        spread = setting.deviation * float(self.random.standard_normal()) if setting.deviation else 0.0
        return setting.to + spread if chosen else None


class AttributeTest:
    """Test of one attribute by a station."""

    def __init__(self, attribute: str, test: Acceptance, random: np.random.Generator) -> None:
        self.attribute, self.random = attribute, random
        self._test = test

    def within(self, value: float) -> bool:
        """Return True if a value is within the limits."""
        test = self._test
        return (test.low is None or value >= test.low) and (test.high is None or value <= test.high)

    def passes(self, within: bool) -> bool:
        """Return True if the test passes.

        within: True for a value within the limits. A false accept or reject inverts the result.
        """
        wrong = self._test.false_reject if within else self._test.false_accept
        return within != (wrong > 0.0 and float(self.random.uniform()) < wrong)
