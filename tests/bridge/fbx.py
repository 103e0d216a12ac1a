# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a binary FBX file's tree, to look at the order in it: importers sort."""

import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Node:
    """A node of the file: its name, its values, its children."""

    name: str
    values: list
    children: list["Node"] = field(default_factory=list)

    def all(self, name: str) -> list["Node"]:
        """List the children of a name."""
        return [child for child in self.children if child.name == name]


def read_fbx(path: Path) -> Node:
    """Read a binary file."""
    data = path.read_bytes()
    assert data.startswith(b"Kaydara FBX Binary  \x00")
    wide = struct.unpack_from("<I", data, 23)[0] >= 7500
    root, at = Node("", []), 27
    while True:
        node, at = _node(data, at, wide)
        if node is None:
            return root
        root.children.append(node)


def children_of(root: Node) -> dict[str, list[str]]:
    """Give the names of each model's children, in the order of the connections; "" is the scene."""
    models = {node.values[0]: node.values[1].split(b"\x00")[0].decode() for node in _objects(root, "Model")}
    found: dict[str, list[str]] = {}
    for link in root.all("Connections")[0].all("C"):
        kind, child, parent = link.values[:3]
        if kind == b"OO" and child in models and (parent == 0 or parent in models):
            found.setdefault(models.get(parent, ""), []).append(models[child])
    return found


def types_of(root: Node) -> dict[str, str]:
    """Give the type of each node attribute, such as LodGroup, by its name."""
    return {node.values[1].split(b"\x00")[0].decode(): node.values[2].decode()
            for node in _objects(root, "NodeAttribute")}


def _objects(root: Node, name: str) -> list[Node]:
    return root.all("Objects")[0].all(name)


def _node(data: bytes, at: int, wide: bool) -> tuple[Node | None, int]:
    head = "<QQQB" if wide else "<IIIB"
    end, count, _, length = struct.unpack_from(head, data, at)
    at += struct.calcsize(head)
    if end == 0:
        return None, at
    name = data[at : at + length].decode()
    at += length
    values = []
    for _ in range(count):
        value, at = _value(data, at)
        values.append(value)
    node = Node(name, values)
    while at < end:
        child, at = _node(data, at, wide)
        if child is not None:
            node.children.append(child)
    return node, end


def _value(data: bytes, at: int) -> tuple[object, int]:
    kind = chr(data[at])
    at += 1
    plain = {"Y": "<h", "C": "<b", "B": "<b", "I": "<i", "F": "<f", "D": "<d", "L": "<q"}
    if kind in plain:
        return struct.unpack_from(plain[kind], data, at)[0], at + struct.calcsize(plain[kind])
    if kind in "SR":
        length = struct.unpack_from("<I", data, at)[0]
        return data[at + 4 : at + 4 + length], at + 4 + length
    count, encoding, length = struct.unpack_from("<III", data, at)
    raw = data[at + 12 : at + 12 + length]
    raw = zlib.decompress(raw) if encoding else raw
    letter = {"f": "f", "d": "d", "l": "q", "i": "i", "b": "b", "c": "b"}[kind]
    return struct.unpack(f"<{count}{letter}", raw), at + 12 + length
