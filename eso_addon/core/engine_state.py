# SPDX-License-Identifier: GPL-3.0-or-later
"""What the engine works on: its rules, the mesh on its way down, and a batch of collapses."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from .blocks import Blocks
from .mesh import Bools, Floats, Ints

# above every collapse and every key
NONE = np.iinfo(np.int64).max
# faces a block: its arrays stay in the second cache
BLOCK = 65536


@dataclass(frozen=True)
class Rules:
    """What the engine may do.

    Attributes
    ----------
    endpoint : bool
        Keep one of the two vertices where it stands (half-edge collapse); else move it to the optimal place.
    memory : float
        How strongly a vertex holds to its place, relative to its quadric.
    flip : float
        Least cosine between a face's normals before and after.
    guard : bool
        The link condition: no collapse changes the topology.
    share : float
        The part of the edges, the cheapest, from which a batch is chosen.
    careful : float
        On small meshes the share shrinks with the faces, to this part of it.
    few : int
        Where no more edges than this are left to try, all of them may go.
    passes : int
        How often a batch is filled up with edges that are cheapest among those that its vertices leave over.
    spread : float
        These edges cost at most so many times what the cheapest eighth of them does.
    curvature_factor : bool
        Multiply costs by Equation 5, renewed where collapses change it.
    """

    endpoint: bool = False
    memory: float = 1e-9
    flip: float = 0.5
    guard: bool = True
    share: float = 0.5
    careful: float = 0.3
    few: int = 0
    passes: int = 1
    spread: float = 3.0
    curvature_factor: bool = False


class Guide(Protocol):
    """Weighs edges by the mesh as it is before each batch, in place of the quadrics; survivors stay where they are."""

    def hold(self, vertices: Bools) -> None:
        """Keep these vertices, (n,) bool."""

    def weigh(self, points: Floats, faces: Ints, survivor: Ints, blocks: Blocks) -> np.ndarray:
        """Return the cost of each side, (3, m) float32, infinite where neither end may go."""

    def swaps(self, one: Ints, other: Ints) -> Bools:
        """Tell where the first vertex of an edge goes and the second stays."""

    def clashes(self, survivor: Ints, label: Ints) -> Ints:
        """Return the collapses of the batch that must not be done beside the others."""


@dataclass
class State:
    """The mesh on its way down; n vertices in Morton order, m faces, and a vertex n for dead faces."""

    rules: Rules
    blocks: Blocks
    points: Floats  # (n + 1, 4) rows, the last column unused: rows of 32 bytes are gathered fastest
    quadrics: Floats  # (n, 12 or wider)
    faces: Ints  # (3, m)
    boundary: Bools  # (n + 1,)
    fans: Ints  # (n + 1,) runs of faces from boundary to boundary
    locked: Bools | None  # (n,)
    alive: int
    guide: Guide | None = None
    costs: np.ndarray = field(init=False)  # (3, m) float32
    base: np.ndarray = field(init=False)  # (3, m) float32, costs before the curvature factor
    dead: int = 0

    def __post_init__(self) -> None:
        count = self.nowhere
        sides = self.points.take(self.faces[0], axis=0) - self.points.take(self.faces[1], axis=0)
        # normals are compared in single precision: in units of an edge their squares neither vanish nor overflow
        self.unit = 1.0 / max(float(np.sqrt((sides * sides).sum(axis=1)).mean()), 1e-300)
        before = (self.points * self.unit).astype(np.float32)
        self.rows = np.concatenate((before, before))
        self.before, self.after = self.rows[: count + 1], self.rows[count + 1 :]  # `after` as the batch would have it
        self.open = bool(self.boundary.any())
        self.best = np.full(count + 1, NONE)
        self.label = ~np.arange(count + 1)  # of vertices in no collapse: negative, each its own
        self.survivor = np.arange(count + 1)
        self.owner = np.zeros(4 * count + 8, np.int64)

    @property
    def nowhere(self) -> int:
        """The vertex of dead faces: one more than there are."""
        return len(self.points) - 1


@dataclass
class Batch:
    """Collapses by rising cost: (c,) arrays, and what they touch block by block."""

    one: Ints
    other: Ints
    slot: Ints
    cost: np.ndarray
    quadrics: Floats
    places: Floats  # (c, 4)
    stays: Bools
    bad: Bools
    at_boundary: Bools
    unsure: Bools  # refused beside a cheaper one that was refused too: they may pass without it
    falling: Ints = field(init=False)
    touched: list["Touched"] = field(default_factory=list)


@dataclass
class Touched:
    """Faces with a corner in the batch: (t,) indices, (3, t) corners and labels, and the collapse that removes each."""

    face: Ints
    corner: Ints
    label: Ints
    gone: Ints
    mixed: Ints  # those in several collapses, as places in the arrays above

    def take(self, faces: Ints) -> "Touched":
        """Return some of the faces, all of them mixed."""
        return Touched(self.face.take(faces), self.corner.take(faces, axis=1), self.label.take(faces, axis=1),
                        self.gone.take(faces), np.arange(len(faces)))
