# SPDX-License-Identifier: GPL-3.0-or-later
"""A second reader of .esopm files, in plain Python, written from docs/format.md alone: slow, and short."""

import json
import struct
import zlib
from collections import defaultdict
from math import prod


class Model:
    def __init__(self, contexts: int, symbols: int, shared: bool = False) -> None:
        self.contexts, self.symbols = contexts, symbols
        self.counts = [[0] * symbols for _ in range(contexts)]
        self.shared = [0] * (contexts + symbols) if shared else None

    def frequencies(self, context: int) -> list[int]:
        k = [32 * count + 1 for count in self.counts[context]]
        if self.shared is not None:
            k = [v + self.shared[s - context + self.contexts] * 128 // self.contexts for s, v in enumerate(k)]
        f = [1 + v * (4096 - self.symbols) // sum(k) for v in k]
        f[k.index(max(k))] += 4096 - sum(f)
        return f

    def learn(self, contexts: list[int], symbols: list[int]) -> None:
        self.counts = [[count >> 1 for count in row] for row in self.counts]
        for context, symbol in zip(contexts, symbols, strict=True):
            self.counts[context][symbol] += 1
            if self.shared is not None:
                self.shared[symbol - context + self.contexts] += 1


class Coder:
    def __init__(self, states: bytes) -> None:
        self.states = list(struct.unpack(f"<{len(states) // 4}I", states))

    def feed(self, words: bytes, plain: bytes) -> None:
        self.words = iter(struct.unpack(f"<{len(words) // 2}H", words))
        self.plain = int.from_bytes(plain, "little")

    def run(self, model: Model, contexts: list[int]) -> list[int]:
        tables, found, lanes = {c: model.frequencies(c) for c in set(contexts)}, [], len(self.states)
        for i, context in enumerate(contexts):
            x, start, symbol = self.states[i % lanes], 0, 0
            while x & 4095 >= start + tables[context][symbol]:
                start, symbol = start + tables[context][symbol], symbol + 1
            x = tables[context][symbol] * (x >> 12) + (x & 4095) - start
            if x < 1 << 16:
                x = x << 16 | next(self.words)
            self.states[i % lanes] = x
            found.append(symbol)
        model.learn(contexts, found)
        return found

    def bits(self, count: int) -> int:
        value = self.plain & (1 << count) - 1
        self.plain >>= count
        return value

    def small(self, model: Model, contexts: list[int]) -> list[int]:
        return [self.bits(32) if s == 15 else s for s in self.run(model, contexts)]

    def numbers(self, model: Model, contexts: list[int]) -> list[int]:
        return [self.signed(c) for c in self.run(model, contexts)]

    def signed(self, c: int) -> int:
        if c == 0:
            return 0
        length = max(c >> 1, 1)
        value = self.bits(length)
        a = c if c < 2 else (2 + (c & 1) << length - 1) + (value >> 1)
        return -a if value & 1 else a


def class_of(a: int) -> int:
    length = a.bit_length()
    return a if a < 2 else 2 * length - 4 + (a >> length - 2)


class Columns:
    def __init__(self, data: bytes) -> None:
        self.raw = zlib.decompress(data, -15) if data else b""

    def column(self, width: int, expected: list[int]) -> list[int]:
        n, mask, out = len(expected), (1 << 8 * width) - 1, []
        for i in range(n):
            folded = sum(self.raw[plane * n + i] << 8 * plane for plane in range(width))
            out.append(((folded >> 1 ^ -(folded & 1)) + expected[i]) & mask)
        self.raw = self.raw[n * width :]
        return out

    def running(self, width: int, n: int) -> list[int]:
        before, out = 0, []
        for step in self.column(width, [0] * n):
            before = (before + step) & (1 << 8 * width) - 1
            out.append(before)
        return out


def float_of(place: int) -> float:
    bits = place if place >= 0 else (-1 - place) & 0x7FFFFFFF | 0x80000000
    return struct.unpack("<f", struct.pack("<I", bits))[0]


def place_of(value: float) -> int:
    bits = struct.unpack("<i", struct.pack("<f", value))[0]
    return bits if bits >= 0 else -1 - (bits & 0x7FFFFFFF)


class Mesh:
    """One mesh of a file, block by block."""

    def __init__(self, header: dict, base: bytes) -> None:
        self.header = header
        self.kind, self.scale, *self.origin, self.shift = header["grid"]
        self.wedged, self.turns = "wedges" in header["needs"], "turned" in header["needs"]
        self.coder = Coder(base[len(base) - 4 * header["lanes"] :])
        self.models = Model(64, 2), Model(16, 16), Model(128, 16), Model(3, 4), Model(2, 2)
        self.axes = [Model(72, 72, shared=True) for _ in range(3)]
        self.numbers: list[list[int]] = []
        self.points: list[list[int]] = []
        self.faces: list[list[int]] = []
        self.parents: list[int] = []
        self.wedges: list[list[int]] = []  # of each place: its wedges' numbers in all
        self.wedge_parent: list[int] = []
        self.wedge_vertex: list[int] = []
        self.corner_wedge: list[list[int]] = []
        self.values = {(d, n): [] for d, n, _, _ in header["attributes"]}
        self.turned: list[int] = []
        self.base(Columns(base[: len(base) - 4 * header["lanes"]]))

    def point(self, numbers: list[int]) -> list[int]:
        if self.kind != 2:
            return numbers
        return [round(float_of(n) * self.scale) for n in numbers]

    def position(self, numbers: list[int]) -> tuple:
        if self.kind == 2:
            return tuple(float_of(n) for n in numbers)
        scaled = [n * self.scale if self.kind == 0 else n / self.scale for n in numbers]
        return struct.unpack("<3f", struct.pack("<3f", *(s + o for s, o in zip(scaled, self.origin, strict=True))))

    def base(self, block: Columns) -> None:
        count, width, extra = self.header["base"][0], self.header["base"][1], self.header["extra"]
        axes = [[n - (n >> 31 << 32) for n in block.running(4, count)] for _ in range(3)]
        self.numbers = [list(row) for row in zip(*axes, strict=True)]
        self.points = [self.point(row) for row in self.numbers]
        self.parents = [-1] * count
        self.faces, self.extra = self.base_faces(block, width), self.base_faces(block, extra)
        self.new_wedges(block, 0)
        whole = self.extra + self.faces
        wedges = [[0] * 3 for _ in whole]
        self.code_wedges(block, whole, wedges, [(f, row) for f in range(len(whole)) for row in range(3)])
        self.extra_wedge, self.corner_wedge = wedges[:extra], wedges[extra:]
        self.face_columns(block, [-1] * len(whole), 0)
        first = block.running(4, self.header["edges"])
        self.edges = list(zip(first, block.column(4, first), strict=True))
        self.attributes(block, "edge", len(self.edges), None)

    def base_faces(self, block: Columns, count: int) -> list[list[int]]:
        first = block.running(4, count)
        return [list(face) for face in zip(first, block.column(4, first), block.column(4, first), strict=True)]

    def attributes(self, block: Columns, domain: str, count: int, source: list[int] | None) -> None:
        """Add `count` rows; each is expected to be the row `source` of those before, or runs."""
        for where, name, dtype, shape in self.header["attributes"]:
            if where != domain:
                continue
            size = int(dtype[2:])
            width = min(size, 4)
            items = prod(shape) * (3 if domain == "side" else 1) * (size // width)
            rows = self.values[domain, name]
            columns = []
            for item in range(items):
                if source is None:
                    columns.append(block.running(width, count))
                else:
                    columns.append(block.column(width, [rows[s if s < len(rows) else 0][item] for s in source]))
            rows += [list(row) for row in zip(*columns, strict=True)]

    def new_wedges(self, block: Columns, first: int) -> None:
        """Add the wedges of the places from `first` on."""
        new = list(range(first, len(self.parents)))
        counts = block.column(4, [1] * len(new)) if self.wedged else [1] * len(new)
        begin, vertices = len(self.wedge_parent), max(self.wedge_vertex, default=-1) + 1
        for count in counts:
            self.wedges.append(list(range(len(self.wedge_parent), len(self.wedge_parent) + count)))
            self.wedge_parent += [-1] * count
        old = [(w, self.wedges[self.parents[p]]) for p in new if self.parents[p] >= 0 for w in self.wedges[p]]
        several = [w for w, at in old if len(at) > 1]
        local = dict(zip(several, block.column(4, [0] * len(several)), strict=True)) if several else {}
        for w, at in old:
            self.wedge_parent[w] = at[local.get(w, 0)]
        inner = [w for p in new for w in self.wedges[p][1:]]
        fresh = dict(zip(inner, block.column(1, [1] * len(inner)), strict=True))
        seen, of_vertex = vertices - 1, []
        for w in range(begin, len(self.wedge_parent)):
            if fresh.get(w, 1):
                seen += 1
                of_vertex.append(w)
            self.wedge_vertex.append(seen)
        base = first == 0
        self.attributes(block, "corner", len(self.wedge_parent) - begin, None if base else self.wedge_parent[begin:])
        become = None if base else [self.wedge_vertex[self.wedge_parent[w]] for w in of_vertex]
        self.attributes(block, "vertex", len(of_vertex), become)

    def code_wedges(self, block: Columns, faces: list, wedges: list, corners: list[tuple[int, int]]) -> None:
        if not self.wedged:
            return
        sizes = [len(self.wedges[faces[f][row]]) for f, row in corners]
        several = [corner for corner, size in zip(corners, sizes, strict=True) if size > 1]
        for f, row in corners:
            wedges[f][row] = 0
        width = 1 if max(sizes, default=1) <= 256 else 4
        for (f, row), wedge in zip(several, block.column(width, [0] * len(several)), strict=True):
            wedges[f][row] = wedge

    def face_columns(self, block: Columns, beside: list[int], first: int) -> None:
        source = None if first == 0 else beside
        self.attributes(block, "face", len(beside), source)
        self.attributes(block, "side", len(beside), source)
        count = len(beside) - (self.header["extra"] if first == 0 else 0)
        self.turned += block.column(1, [0] * count) if self.turns else [0] * count

    def batch(self, data: bytes) -> None:
        s, b = struct.unpack_from("<II", data)
        self.coder.feed(data[8 : 8 + s], data[8 + s : 8 + s + b])
        block, coder, n, m = Columns(data[8 + s + b :]), self.coder, len(self.parents), len(self.faces)
        corners = defaultdict(list)  # of each place: (row, face), by slot
        for row in range(3):
            for f, face in enumerate(self.faces):
                corners[face[row]].append((row, f))
        able = sorted(corners)
        flags = coder.run(self.models[0], [min(len(corners[v]), 20) for v in able])
        split = [v for v, flag in zip(able, flags, strict=True) if flag]
        label = {v: i for i, v in enumerate(split)}
        degree = [len(corners[v]) for v in split]
        length = coder.small(self.models[1], [min(d, 15) for d in degree])
        likely = [self.by_likelihood(v, corners[v], size) for v, size in zip(split, length, strict=True)]
        ranks = coder.small(self.models[2], [8 * min(d, 15) + min(size, 7)
                                             for d, size in zip(degree, length, strict=True)])
        start = [order[rank] for order, rank in zip(likely, ranks, strict=True)]
        arcs = [self.arc(corners[v], at, max(size, 1)) for v, at, size in zip(split, start, length, strict=True)]
        ends = [(self.before(corners[v], arc[0]) is None, self.after(corners[v], arc[-1]) is None)
                for v, arc in zip(split, arcs, strict=True)]
        asked = [i for i in range(len(split)) if any(ends[i]) or length[i] == 0]
        told = coder.run(self.models[3], [2 if length[i] == 0 else int(all(ends[i])) for i in asked])
        there = [3] * len(split)
        for i, symbol in zip(asked, told, strict=True):
            there[i] = symbol
        moved = [list(face) for face in self.faces]
        for i, arc in enumerate(arcs):
            for row, f in arc if length[i] else ():
                moved[f][row] = n + i
        third = self.thirds(split, label, length, arcs, there, moved, n)
        rings = [([split[i], self.sides(arc, there[i], length[i])[0], *(self.q(c) for c in arc)] if length[i]
                  else [split[i], self.sides(arc, there[i], 0)[0]]) for i, arc in enumerate(arcs)]
        numbers = self.positions(split, [arc if length[i] else [] for i, arc in enumerate(arcs)], rings)
        self.numbers += numbers
        self.points += [self.point(row) for row in numbers]
        self.parents += split
        beside = []
        self.faces = moved
        for i, v in enumerate(split):
            for which, pair in enumerate(((n + i, v), (v, n + i))):
                if there[i] >> which & 1:
                    self.faces.append([*pair, third[which, i]])
                    self.corner_wedge.append([0] * 3)
                    beside.append(self.header["extra"] + start[i][1])
        self.new_wedges(block, n)
        steps = [arc[step][::-1] for step in range(max(length, default=0))
                 for i, arc in enumerate(arcs) if step < length[i]]
        fresh = [(f, row) for f in range(m, len(self.faces)) for row in range(3)]
        self.code_wedges(block, self.faces, self.corner_wedge, steps + fresh)
        self.face_columns(block, beside, self.header["extra"] + m)

    def p(self, corner: tuple[int, int]) -> int:
        return self.faces[corner[1]][(corner[0] + 1) % 3]

    def q(self, corner: tuple[int, int]) -> int:
        return self.faces[corner[1]][(corner[0] + 2) % 3]

    def after(self, corners: list, corner: tuple[int, int]) -> tuple[int, int] | None:
        return next((c for c in corners if self.p(c) == self.q(corner)), None)

    def before(self, corners: list, corner: tuple[int, int]) -> tuple[int, int] | None:
        return next((c for c in corners if self.q(c) == self.p(corner)), None)

    def arc(self, corners: list, start: tuple[int, int], length: int) -> list:
        arc = [start]
        while len(arc) < length:
            arc.append(self.after(corners, arc[-1]))
        return arc

    def by_likelihood(self, v: int, corners: list, length: int) -> list:
        near = {v, *(end for at in corners for end in (self.p(at), self.q(at)))}
        c = {place: [x >> self.shift for x in self.points[place]] for place in near}
        off = {at: [c[self.p(at)][k] + c[self.q(at)][k] - 2 * c[v][k] for k in range(3)] for at in corners}
        pull = [sum(off[at][k] for at in corners) // len(corners) for k in range(3)]
        toward = {at: sum(a * b for a, b in zip(pull, off[at], strict=True)) for at in corners}

        def score(at: tuple[int, int]) -> float:
            total, steps = toward[at], 1
            while steps < min(length, 8):
                at = self.after(corners, at)
                if at is None:
                    break
                total, steps = total + toward[at], steps + 1
            return struct.unpack("<f", struct.pack("<f", total))[0]

        return sorted(corners, key=lambda at: -score(at))

    def sides(self, arc: list, there: int, length: int) -> tuple[int, int]:
        """Return x and y."""
        if length:
            return self.p(arc[0]), self.q(arc[-1])
        x = self.q(arc[0]) if there & 1 else self.p(arc[0])
        return x, x

    def thirds(self, split: list, label: dict, length: list, arcs: list, there: list, moved: list, n: int) -> dict:
        opening = {}  # (place, ring place) -> (which, split)
        for which in range(2):
            for i, v in enumerate(split):
                if there[i] >> which & 1:
                    opening[v, self.sides(arcs[i], there[i], length[i])[which]] = which, i
        found, torn = {}, []
        for (v, j), (which, i) in opening.items():
            if (j, v) in opening:
                torn.append((v, j))
                continue
            if length[i] == 0:
                (row, f), at = arcs[i][0], 2 if which == 0 else 1
            else:
                (row, f), at = (arcs[i][0], 1) if which == 0 else (arcs[i][-1], 2)
            found[which, i] = moved[f][(row + at) % 3]
        ask = [key for k, key in enumerate(torn) if (key[1], key[0]) not in torn[:k]]
        symbols = dict(zip(ask, self.coder.run(self.models[4], [0] * len(ask)), strict=True)) if ask else {}
        for v, j in torn:
            symbol = symbols.get((v, j), symbols.get((j, v)))
            which, i = opening[v, j]
            other, k = opening[j, v]
            # 1: what j has become in the face from v to j, which its `after` opens; 0: in that from j to v
            new = other == 1 if symbol else other == 0
            found[which, i] = n + k if new else j
        return found

    def positions(self, split: list, arcs: list, rings: list) -> list[list[int]]:
        work = []
        for v, arc, ring in zip(split, arcs, rings, strict=True):
            at = self.points
            s = len(arc) + 2
            mean = [(2 * sum(at[r][k] for r in ring) + s) // (2 * s) for k in range(3)]
            normal = [0] * 3
            for c in arc:
                a, b = ([(at[e][k] - at[v][k]) >> self.shift for k in range(3)] for e in (self.p(c), self.q(c)))
                for k in range(3):
                    i, j = (k + 1) % 3, (k + 2) % 3
                    normal[k] += a[i] * b[j] - a[j] * b[i]
            excess = max(max(map(abs, normal)).bit_length() - 12, 0)
            normal = [x >> excess for x in normal]
            spread = sum(abs(at[r][k] - mean[k]) for r in ring for k in range(3)) // s
            axis = max(range(3), key=lambda k: (abs(normal[k]), -k))
            work.append([v, mean, normal, spread, axis, spread, [0] * 3, [0] * 3])
        for step, model in enumerate(self.axes):
            ask = []
            for v, mean, normal, _, axis, scale, _, u in work:
                a, here = (axis + 1 + step) % 3, self.points[v]
                expected = mean[a]
                if step == 2:
                    lean = sum(normal[(axis + 1 + k) % 3] * (u[(axis + 1 + k) % 3] - here[(axis + 1 + k) % 3])
                               for k in range(2))
                    expected = here[a] - lean // (normal[a] or 1)
                base, context = expected, min(class_of(scale), 71)
                if self.kind == 2:
                    base = place_of(expected / self.scale)
                    context = min(max(class_of(scale) + 2 * (24 - (abs(expected) + scale).bit_length()), 0), 71)
                ask.append((a, base, context))
            rests = self.coder.numbers(model, [context for _, _, context in ask])
            for item, (a, base, _), rest in zip(work, ask, rests, strict=True):
                item[6][a] = base + rest
                item[7][a] = self.point([base + rest])[0]
                item[5] = (item[3] + 3 * abs(item[7][a] - item[1][a]) + 1) >> 1
        return [item[6] for item in work]

    def result(self) -> tuple[list, list, list, dict]:
        """Return positions by vertex, faces as vertices, loose edges, and attributes: rows as bytes."""
        place = {w: p for p, wedges in enumerate(self.wedges) for w in wedges}
        vertices: dict[int, tuple] = {}
        for w, vertex in enumerate(self.wedge_vertex):
            vertices.setdefault(vertex, self.position(self.numbers[place[w]]))
        corners, extra = [], len(self.extra)
        for f, (face, wedge) in enumerate(zip(self.extra + self.faces, self.extra_wedge + self.corner_wedge,
                                              strict=True)):
            rows = (0, 2, 1) if f >= extra and self.turned[f - extra] else (0, 1, 2)
            corners.append([(self.wedges[face[row]][wedge[row]], row) for row in rows])
        attributes = {}
        for domain, name, dtype, _ in self.header["attributes"]:
            rows = [packed(row, dtype) for row in self.values[domain, name]]
            if domain == "corner":
                rows = [b"".join(rows[w] for w, _ in face) for face in corners]
            elif domain == "side":
                size = len(rows[0]) // 3 if rows else 0
                rows = [b"".join(row[k * size : (k + 1) * size] for _, k in face)
                        for row, face in zip(rows, corners, strict=True)]
            attributes[domain, name] = b"".join(rows)
        faces = [[self.wedge_vertex[w] for w, _ in face] for face in corners]
        return [vertices[v] for v in range(len(vertices))], faces, self.edges, attributes


def packed(words: list[int], dtype: str) -> bytes:
    if dtype == "<f4":
        words = [w & 0x7FFFFFFF if w >> 31 else 0xFFFFFFFF - w for w in words]
    width = min(int(dtype[2:]), 4)
    return b"".join(word.to_bytes(width, "little") for word in words)


def read(data: bytes) -> list[Mesh]:
    """Return the meshes of a file, at their finest."""
    magic, version, flags, h, t, checksum = struct.unpack_from("<8sHHIII", data)
    assert (magic, version, flags) == (b"\x89ESOPM\r\n", 1, 0)
    assert zlib.crc32(data[24 : 24 + h + t]) == checksum
    header = json.loads(zlib.decompress(data[24 : 24 + h], -15))
    table = data[24 + h : 24 + h + t]
    (count,) = struct.unpack_from("<I", table)
    planes = zlib.decompress(table[4:], -15)
    rows = [struct.unpack("<IIIIfI", bytes(planes[k * count + r] for k in range(24))) for r in range(count)]
    at, meshes = 24 + h + t, []
    for number, (length, crc, places, faces, _, mesh) in enumerate(rows):
        block = data[at : at + length]
        assert zlib.crc32(block) == crc
        at += length
        if number < len(header["meshes"]):
            meshes.append(Mesh({**header["meshes"][number], "base": (places, faces)}, block))
        else:
            meshes[mesh].batch(block)
        assert (len(meshes[mesh].parents), len(meshes[mesh].faces)) == (places, faces)
    return meshes
