# SPDX-License-Identifier: Apache-2.0
"""Experimental designs: the points of a study, each with one value per parameter."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.errors import StudyError
from conveyor_sim.studies.code import require_package
from conveyor_sim.studies.parameter import Parameter
from conveyor_sim.studies.study import Study

Point = dict[str, Any]
"""Values by parameter."""


def points_of(study: Study) -> list[Point]:
    """Return the points in order, equal for equal studies.

    Raise StudyError if a package is missing, and for an optimisation, whose points depend on earlier results.
    """
    if study.optimise is not None:
        raise StudyError(f"{study.name}: optimise given, expected conveyor-sim optimise for this study")
    names, parameters = list(study.parameters), list(study.parameters.values())
    if study.design in ("grid", "list"):
        values = [parameter.values or () for parameter in parameters]
        rows = itertools.product(*values) if study.design == "grid" else zip(*values, strict=True)
        return [dict(zip(names, row, strict=True)) for row in rows]
    shares = _shares(study, len(names))
    columns = [[value_at(parameter, share) for share in shares[:, i]] for i, parameter in enumerate(parameters)]
    return [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)]


def value_at(parameter: Parameter, share: float) -> float | int:
    """Return the value of a range at a cumulative share from 0 to 1."""
    low, high = float(parameter.low or 0.0), float(parameter.high or 0.0)
    if parameter.whole:  # each whole number has an equal part of the range
        return min(int(high), math.ceil(low) + math.floor(share * (math.floor(high) - math.ceil(low) + 1)))
    if parameter.log:
        return math.exp(math.log(low) + share * (math.log(high) - math.log(low)))
    return low + share * (high - low)


def _shares(study: Study, count: int) -> NDArray[np.float64]:
    """(points, parameters), each from 0 to 1."""
    wanted = study.points or 1
    require_package("scipy", f"design: {study.design}")
    from scipy.stats import qmc

    if study.design == "saltelli":
        return saltelli(list(study.parameters), wanted, study.design_seed)
    if study.design == "latin_hypercube":
        return np.asarray(qmc.LatinHypercube(count, rng=study.design_seed).random(wanted))
    # A sequence of Sobol is balanced over its first 2^m points: any number of the first ones is taken of such.
    points = qmc.Sobol(count, rng=study.design_seed).random_base2(math.ceil(math.log2(wanted)))
    return np.asarray(points[:wanted])


def saltelli(names: Sequence[str], base: int, seed: int) -> NDArray[np.float64]:
    """Return base x (parameters + 2) points for SALib's analysis of first-order and total indices (Saltelli 2010)."""
    require_package("SALib", "design: saltelli")
    from SALib.sample import sobol

    return np.asarray(sobol.sample(salib_problem(names), base, calc_second_order=False, seed=seed))


def salib_problem(names: Sequence[str]) -> dict[str, Any]:
    """Shares from 0 to 1, as SALib describes them."""
    return {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}
