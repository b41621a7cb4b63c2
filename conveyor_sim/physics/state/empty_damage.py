# SPDX-License-Identifier: Apache-2.0
"""Empty arrays of loads on bottles and rails for a Model, and the places of the rails' bins."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from conveyor_sim.engine.arrays.damage import (
    MOST_TOUCHES,
    BodyBins,
    Crushing,
    DamageArrays,
    Impacts,
    Maximum,
    RailBins,
    ScuffingWork,
    Tipping,
)
from conveyor_sim.engine.arrays.types import F8
from conveyor_sim.engine.threads.workers import UNIT
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.model.moving_rails import ordered_pieces
from conveyor_sim.scene.effect_names import EffectName
from conveyor_sim.scene.geometry import ArcPiece, Piece

BIN = 0.05
"""Largest length of a bin of rail, m."""


LOADS: tuple[EffectName, ...] = ("scuffing", "crushing", "impacts", "tipping")
"""Effects with loads on bottles."""


@dataclass(frozen=True)
class RailPlaces:
    """Places of the rails' bins, (B,), in the order of `_pieces`."""

    rail: NDArray[np.uint32]
    x: F8
    """m, middle of the bin."""
    y: F8
    length: F8
    """m"""


def empty_damage(model: Model, slots: int) -> DamageArrays | None:
    """Return empty arrays for `slots` bottles; None without damage effects."""

    def reals() -> F8:
        return np.zeros(slots)

    def worst() -> Maximum:
        return Maximum(reals(), reals())

    touching, touched = np.zeros((2, slots, MOST_TOUCHES), np.int64)
    damage = DamageArrays(
        scuffing=ScuffingWork(reals(), _rail_bins(model, slots)) if model.has("scuffing") else None,
        crushing=Crushing(worst(), worst()) if model.has("crushing") else None,
        impacts=Impacts(worst(), worst(), reals(), reals(), touching, touched) if model.has("impacts") else None,
        tipping=Tipping(worst(), reals(), reals(), *_levers(model), reals(), reals(), reals())
        if model.has("tipping")
        else None,
    )
    return None if all(group is None for group in damage) else damage


def rail_places(model: Model) -> RailPlaces:
    """Return the places of the bins of all rails. Bins of bodies are placed as the body is at displacement 0."""
    rail, x, y, length = [], [], [], []
    for index, piece in _pieces(model):
        bins = _bins(piece)
        middle = (np.arange(bins) + 0.5) / bins
        rail += [index] * bins
        length += [piece.length / bins] * bins
        if isinstance(piece, ArcPiece):
            angle = piece.start_angle + piece.span * middle
            x += (piece.centre[0] + piece.radius * np.cos(angle)).tolist()
            y += (piece.centre[1] + piece.radius * np.sin(angle)).tolist()
        else:
            x += (piece.p1[0] + (piece.p2[0] - piece.p1[0]) * middle).tolist()
            y += (piece.p1[1] + (piece.p2[1] - piece.p1[1]) * middle).tolist()
    return RailPlaces(np.array(rail, np.uint32), np.array(x), np.array(y), np.array(length))


def _pieces(model: Model) -> Iterator[tuple[int, Piece]]:
    """Yield rail numbers and pieces: straight ones at rest and on bodies, then arcs at rest and on bodies.

    Pieces at rest have the order of `plant_arrays.rail_arrays`. Equal pieces of a machine, as in a train, come once.
    """
    at_rest = [(index, piece) for index, rail in enumerate(model.plant.rails_at_rest) for piece in rail.pieces]
    on_bodies = [*dict.fromkeys(_body_pieces(model))]
    for arc, arrays in ((False, model.segments), (True, model.arcs)):
        for pieces in (at_rest if arrays is not None else [], on_bodies):
            yield from (entry for entry in pieces if isinstance(entry[1], ArcPiece) is arc)


def _body_pieces(model: Model) -> Iterator[tuple[int, Piece]]:
    """Yield rail number and piece for each piece of a body in the order of the engine."""
    plant = model.plant
    if model.has("moving_rails"):
        for body, index in ordered_pieces(plant.moving):
            yield len(plant.rails_at_rest) + plant.machine_of_body[body], plant.moving[body].pieces[index]


def _rail_bins(model: Model, slots: int) -> RailBins | None:
    if model.rail_law is None:
        return None
    pieces = [*_pieces(model)]
    ends = np.cumsum([0, *(_bins(piece) for _, piece in pieces)])
    places = {piece: place for place, piece in enumerate(pieces)}
    fixed = len(model.plant.rails_at_rest)
    straight, bent = (
        [place for place, (rail, piece) in enumerate(pieces) if rail < fixed and isinstance(piece, ArcPiece) is arc]
        for arc in (False, True)
    )
    moving = [places[piece] for piece in _body_pieces(model)]
    units = slots // UNIT + 1
    return RailBins(
        segment_first=_firsts(ends, straight),
        arc_first=_firsts(ends, bent),
        arc_span=_spans(pieces, bent),
        bodies=BodyBins(
            first=ends[moving].astype(np.uint32),
            end=ends[np.array(moving) + 1].astype(np.uint32),
            span=_spans(pieces, moving),
        )
        if moving
        else None,
        work=np.zeros((units, int(ends[-1]))),
        impulse=np.zeros((units, int(ends[-1]))),
    )


def _firsts(ends: NDArray[np.int64], places: list[int]) -> NDArray[np.uint32]:
    """Return the first bins of pieces that follow each other, and the end of the last one."""
    start = places[0] if places else 0
    return ends[start : start + len(places) + 1].astype(np.uint32)


def _spans(pieces: list[tuple[int, Piece]], places: list[int]) -> F8:
    chosen = (pieces[place][1] for place in places)
    return np.array([piece.span if isinstance(piece, ArcPiece) else 0.0 for piece in chosen])


def _bins(piece: Piece) -> int:
    return max(1, math.ceil(piece.length / BIN - 1e-9))


def _levers(model: Model) -> tuple[F8, F8, F8]:
    """Return lever of contacts and of base over base radius, and smoothing time (s), (T,) each."""
    contact, gravity = model.type_heights.T
    radius = model.type_radius.copy()
    if model.type_base_radius is not None:
        radius = np.where(model.type_base_radius > 0.0, model.type_base_radius, radius)
    known = np.isfinite(contact)
    delay = np.sqrt(np.where(known, gravity, 1.0) / model.gravity) if model.gravity > 0.0 else np.ones(radius.size)
    return np.where(known, (contact - gravity) / radius, 0.0), np.where(known, gravity / radius, 0.0), delay
