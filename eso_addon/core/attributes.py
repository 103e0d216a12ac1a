# SPDX-License-Identifier: GPL-3.0-or-later
"""Named arrays on the vertices, corners, faces or edges of a mesh: what they are, checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .mesh import Ints, MeshError

DOMAINS = ("vertex", "corner", "face", "edge")
# uv, color, value: interpolated. normal, rotation: interpolated to unit length. label: taken from the nearest.
# material: a label whose borders are lines. seam, sharp: marks of edges that are lines.
KINDS = ("uv", "normal", "color", "value", "rotation", "label", "material", "seam", "sharp")
_UNIT = ("normal", "rotation")


@dataclass(frozen=True, eq=False)
class Attribute:
    """A named array with what it means, where that cannot be told from its shape.

    Attributes
    ----------
    values : array_like
        One row for each element of the domain; corners may be (m, 3, …) or (3 m, …).
    domain : str
        "vertex", "corner", "face" or "edge".
    kind : str
        "uv", "normal", "color" or "value" (floats, interpolated), "rotation" (quaternions), "label" (whatever else,
        taken from the nearest), "material" (a label of faces whose borders are lines), "seam" or "sharp" (marks of
        edges that are lines).
    """

    values: ArrayLike
    domain: str
    kind: str = ""


@dataclass(frozen=True, eq=False)
class Layer:
    """An attribute as the engine has it.

    Attributes
    ----------
    name, domain, kind : str
    rows : ndarray, (elements, width)
    shape : tuple of int
        Of one element as it was given.
    per_corner : bool
        A corner attribute that was given as (m, 3, …).
    """

    name: str
    domain: str
    kind: str
    rows: NDArray
    shape: tuple[int, ...]
    per_corner: bool

    @property
    def interpolated(self) -> bool:
        """Whether values between have a meaning."""
        return self.kind in ("uv", "normal", "color", "value", "rotation")

    @property
    def fits(self) -> bool:
        """Whether values at vertices are chosen for what is seen between them."""
        return self.kind in ("uv", "normal", "color") and self.rows.shape[1] > 0

    def shaped(self, rows: NDArray) -> NDArray:
        """Return rows of new elements in the shape and dtype in which the attribute was given."""
        lead = (-1, 3) if self.per_corner else (len(rows),)
        return rows.astype(self.rows.dtype, copy=False).reshape(*lead, *self.shape)


@dataclass(frozen=True, eq=False)
class AttributeSet:
    """All that a mesh carries.

    Attributes
    ----------
    layers : tuple of Layer
    edges : ndarray, (e, 2) int64
        The edges that edge attributes belong to.
    messages : tuple of str
        What was mended.
    """

    layers: tuple[Layer, ...]
    edges: Ints
    messages: tuple[str, ...]

    def on(self, domain: str) -> list[Layer]:
        """Return the layers of a domain."""
        return [layer for layer in self.layers if layer.domain == domain]


def check_attributes(attributes: Mapping[str, ArrayLike | Attribute], vertex_count: int, face_count: int,
                     edges: ArrayLike | None = None) -> AttributeSet:
    """Return attributes as layers, or say what is wrong with them.

    Parameters
    ----------
    attributes : mapping of str to array_like or Attribute
        Plain arrays are told apart by their shape: (m, 3, 2) or (m, 3, 3) floats and (3 m, …) are on corners, (n, …) on
        vertices, (m, …) on faces. Floats are interpolated; corners with two of them are UV; names with "normal" or
        "col" in them are normals and colours. Whole numbers on faces are materials.
    vertex_count, face_count : int
    edges : array_like, (e, 2), optional
        Vertices of the edges that edge attributes belong to.

    Returns
    -------
    AttributeSet

    Raises
    ------
    MeshError
        A shape that fits nothing or more than one domain, an unknown domain or kind.
    """
    pairs = _checked_edges(edges, vertex_count)
    counts = {"vertex": vertex_count, "corner": 3 * face_count, "face": face_count, "edge": len(pairs)}
    layers, messages = [], []
    for name, given in attributes.items():
        layer = _layer(str(name), given, counts)
        if layer.rows.dtype.kind == "f" and not np.isfinite(layer.rows).all():
            broken = ~np.isfinite(layer.rows)
            messages.append(f"{name} has {int(broken.any(axis=1).sum())} values that are not finite: taken as 0")
            layer = replace(layer, rows=np.where(broken, layer.rows.dtype.type(0), layer.rows))
        layers.append(layer)
    return AttributeSet(tuple(layers), pairs, tuple(messages))


def _checked_edges(edges: ArrayLike | None, vertex_count: int) -> Ints:
    pairs = np.zeros((0, 2), np.int64) if edges is None else np.asarray(edges)
    if pairs.size == 0:
        return np.zeros((0, 2), np.int64)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or pairs.dtype.kind not in "iu":
        raise MeshError(f"edges must be an (e, 2) array of vertices, not {pairs.shape} {pairs.dtype}")
    if pairs.min() < 0 or pairs.max() >= vertex_count:
        raise MeshError(f"edges names a vertex that is not there ({vertex_count} vertices)")
    return pairs.astype(np.int64)


def _layer(name: str, given: ArrayLike | Attribute, counts: dict[str, int]) -> Layer:
    wanted = given if isinstance(given, Attribute) else None
    try:
        values = np.asarray(wanted.values if wanted is not None else given)
    except ValueError:
        raise MeshError(f"attribute {name!r} must be an array: its rows differ in length") from None
    if values.dtype.kind not in "fiubUSO":
        raise MeshError(f"attribute {name!r} holds {values.dtype}: give numbers, booleans or strings")
    domain = wanted.domain if wanted is not None else _domain_of(name, values, counts)
    if domain not in DOMAINS:
        raise MeshError(f"attribute {name!r} is on {domain!r}: choose one of {', '.join(DOMAINS)}")
    count = counts[domain]
    per_corner = domain == "corner" and values.shape[:2] == (count // 3, 3) and values.shape[:1] != (count,)
    if not per_corner and values.shape[:1] != (count,):
        raise MeshError(f"attribute {name!r} has shape {values.shape}: it must begin with {count}, one row for each "
                        f"{domain}")
    shape = values.shape[2:] if per_corner else values.shape[1:]
    rows = values.reshape(count, int(np.prod(shape)))
    kind = (wanted.kind if wanted is not None else "") or _kind_of(name, domain, rows)
    if kind not in KINDS:
        raise MeshError(f"attribute {name!r} is of kind {kind!r}: choose one of {', '.join(KINDS)}")
    if kind in ("uv", "normal", "color", "value", "rotation") and rows.dtype.kind not in "fiub":
        raise MeshError(f"attribute {name!r} holds {rows.dtype}: only numbers can be interpolated")
    return Layer(name, domain, kind, rows, shape, per_corner)


def _domain_of(name: str, values: NDArray, counts: dict[str, int]) -> str:
    """Tell the domain from the shape."""
    faces = counts["face"]
    fitting = [domain for domain in ("vertex", "corner", "face") if values.shape[:1] == (counts[domain],)]
    if values.ndim >= 3 and values.shape[:2] == (faces, 3):
        fitting = ["corner", *(domain for domain in fitting if domain == "vertex")]
    if len(fitting) != 1:
        reason = f"fits {' and '.join(fitting)}" if fitting else "fits no vertices, corners or faces"
        raise MeshError(f"attribute {name!r} of shape {values.shape} {reason}: give an Attribute with a domain")
    return fitting[0]


def _kind_of(name: str, domain: str, rows: NDArray) -> str:
    """Tell the kind from name, type and width."""
    if rows.dtype.kind != "f":
        return "material" if domain == "face" and rows.dtype.kind in "iu" else "label"
    lower, width = name.lower(), rows.shape[1]
    if "normal" in lower and width == 3:
        return "normal"
    if "col" in lower and width in (3, 4):
        return "color"
    return "uv" if width == 2 and domain in ("corner", "vertex") else "value"


def blended(layer: Layer, rows: Ints, weights: NDArray) -> NDArray:
    """Return values between elements.

    Parameters
    ----------
    layer : Layer
    rows : ndarray, (3, k) int64
        Three elements for each value.
    weights : ndarray, (3, k) float64
        What each counts; where one of them counts alone its value comes unchanged.

    Returns
    -------
    ndarray, (k, width)
    """
    nearest = rows[weights.argmax(axis=0), np.arange(rows.shape[1])]
    alone = layer.rows.take(nearest, axis=0)
    if not layer.interpolated or layer.rows.shape[1] == 0:
        return alone
    mixed = np.flatnonzero(weights.max(axis=0, initial=0.0) < 1)
    parts = [layer.rows.take(row.take(mixed), axis=0).astype(np.float64) for row in rows]
    share = weights.take(mixed, axis=1)[:, :, None]
    if layer.kind == "rotation":  # q and -q are the same rotation
        parts = [part * np.where((part * parts[0]).sum(axis=1, keepdims=True) < 0, -1.0, 1.0) for part in parts]
    total = share[0] * parts[0] + share[1] * parts[1] + share[2] * parts[2]
    if layer.kind in _UNIT:
        length = np.sqrt((total * total).sum(axis=1, keepdims=True))
        total = np.where(length > 1e-6, total / np.maximum(length, 1e-300), alone.take(mixed, axis=0))
    # between equal values lies the same value, to the last bit
    first = parts[0]
    same = (first == parts[1]) & (first == parts[2])
    total = np.where(same.all(axis=1, keepdims=True), first, total)
    if layer.rows.dtype.kind in "iub":
        total = np.rint(total)
    alone[mixed] = total
    return alone
