# SPDX-License-Identifier: GPL-3.0-or-later
"""The corners around some vertices, each with the corner of the next face around its vertex."""

from dataclasses import dataclass

import numpy as np

from ..core.mesh import Bools, Ints


@dataclass(frozen=True)
class Fans:
    """Corners at chosen vertices of (3, m) faces: (c,) arrays.

    Attributes
    ----------
    vertex, following, preceding : ndarray, (c,) int64
        A corner's vertex and the face's other two, in its winding.
    slot : ndarray, (c,) int64
        Row * m + face.
    successor, predecessor : ndarray, (c,) int64
        The corner whose `following` is this one's `preceding`, and the other way; -1 where there is none.
    repeated : ndarray, (r,) int64
        Vertices with two corners with one `following`: there is no order around them.
    """

    vertex: Ints
    following: Ints
    preceding: Ints
    slot: Ints
    successor: Ints
    predecessor: Ints
    repeated: Ints


def fans_at(faces: Ints, chosen: Bools) -> Fans:
    """Find the corners at the chosen vertices and link them face by face.

    Parameters
    ----------
    faces : ndarray, (3, m) int64
    chosen : ndarray, (n,) bool
    """
    width = faces.shape[1]
    rows = [np.flatnonzero(chosen.take(row)) for row in faces]
    vertex = np.concatenate([faces[row].take(face) for row, face in enumerate(rows)])
    following = np.concatenate([faces[(row + 1) % 3].take(face) for row, face in enumerate(rows)])
    preceding = np.concatenate([faces[(row + 2) % 3].take(face) for row, face in enumerate(rows)])
    slot = np.concatenate([face + row * width for row, face in enumerate(rows)])
    own = vertex * len(chosen) + following
    wanted = vertex * len(chosen) + preceding
    successor, repeated = _match(own, wanted)
    predecessor = np.full(len(slot), -1)
    linked = np.flatnonzero(successor >= 0)
    predecessor[successor.take(linked)] = linked
    return Fans(vertex, following, preceding, slot, successor, predecessor, vertex.take(repeated))


def _match(own: Ints, wanted: Ints) -> tuple[Ints, Ints]:
    """Return the place of each wanted key among the own ones, else -1; and places of keys that come again."""
    count = len(own)
    if count == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    bits = max((4 * count).bit_length(), 4)
    table = np.zeros(1 << bits, np.int64)  # where nothing is written is a key that does not fit
    numbers = np.arange(count)
    home = _hash(own, bits)
    table[home] = numbers
    winner = table.take(home)
    hidden = np.flatnonzero(winner != numbers)  # another key has their place: these few are sorted
    repeated = hidden[own.take(hidden) == own.take(winner.take(hidden))]
    found = table.take(_hash(wanted, bits))
    found[own.take(found) != wanted] = -1
    if len(hidden):
        hidden = hidden[np.argsort(own.take(hidden), kind="stable")]
        keys = own.take(hidden)
        repeated = np.concatenate((repeated, hidden[1:][keys[1:] == keys[:-1]]))
        lost = np.flatnonzero(found < 0)
        place = np.searchsorted(keys, wanted.take(lost)).clip(max=len(keys) - 1)
        found[lost] = np.where(keys.take(place) == wanted.take(lost), hidden.take(place), -1)
    return found, repeated


def _hash(keys: Ints, bits: int) -> Ints:
    return (keys * -0x61C8864680B583EB >> (64 - bits)) & ((1 << bits) - 1)
