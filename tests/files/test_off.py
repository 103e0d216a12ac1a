# SPDX-License-Identifier: GPL-3.0-or-later
"""The .off reader and writer: the identity on random meshes, every kind of header, and clear words on bad files."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from eso_addon.files.off import FileFormatError, read_off, write_off

SQUARE = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"


def read_text(text: str | bytes, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    path = folder / "mesh.off"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_off(path)


@given(st.data())
def test_what_is_written_reads_back_bit_for_bit(data: st.DataObject) -> None:
    count = data.draw(st.integers(1, 20))
    vertices = data.draw(arrays(np.float64, (count, 3), elements=st.floats(width=64, allow_nan=False)))
    faces = data.draw(arrays(np.int32, (data.draw(st.integers(0, 20)), 3), elements=st.integers(0, count - 1)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.off"
        write_off(path, vertices, faces)
        again, faces_again = read_off(path)
    assert again.tobytes() == vertices.tobytes()
    assert np.array_equal(faces_again, faces)


@pytest.mark.parametrize(
    "text",
    [
        f"OFF\n4 1 0\n{SQUARE}4 0 1 2 3\n",
        f"off 4 1 4\n{SQUARE}4 0 1 2 3",
        f"4 1 0\n{SQUARE}4 0 1 2 3\n",
        f"OFF # a comment\n# another\n\n4 1 0\n\n{SQUARE}\n# faces\n4 0 1 2 3\n",
        f"\ufeffOFF\n4 1 0\n{SQUARE}4 0 1 2 3\n",
        f"OFF\r\n4 1 0\r\n{SQUARE}4 0 1 2 3 255 0 0\r\n".replace("\n", "\r\n").replace("\r\r", "\r"),
        f"OFF\n4 1\n{SQUARE}4 0 1 2 3 0.5 0.5 0.5 1.0\n",
        "OFF\n4 1 0\n0 0 0 1 0 0\n1 1 0 0 1 0\n4 0 1 2 3\n",
        "NOFF\n4 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n1 1 0 0 0 1\n0 1 0 0 0 1\n4 0 1 2 3\n",
        "COFF\n4 1 0\n0 0 0 9 9 9 255\n1 0 0 9 9 9 255\n1 1 0 9 9 9 255\n0 1 0 9 9 9 255\n4 0 1 2 3\n",
        "STOFF\n4 1 0\n0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3\n",
    ],
)
def test_every_layout_of_a_square(text: str, tmp_path: Path) -> None:
    vertices, faces = read_text(text, tmp_path)
    assert vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_polygons_of_all_sizes_keep_their_order(tmp_path: Path) -> None:
    points = "".join(f"{x} {x * x} 0\n" for x in range(6))
    _, faces = read_text(f"OFF\n6 5 0\n{points}3 5 4 3\n6 0 1 2 3 4 5\n2 0 1\n1 3\n4 3 2 1 0\n", tmp_path)
    assert faces.tolist() == [[5, 4, 3], [0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5], [3, 2, 1], [3, 1, 0]]


def test_no_elements(tmp_path: Path) -> None:
    vertices, faces = read_text("OFF\n0 0 0\n", tmp_path)
    assert vertices.shape == (0, 3)
    assert faces.shape == (0, 3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no .off file"),
        ("solid cube\n", "no .off file"),
        ("OFF BINARY\n", "binary"),
        ("4OFF\n1 0 0\n0 0 0 1\n", "three dimensions"),
        (f"OFF\n4 2 0\n{SQUARE}4 0 1 2 3\n", "cut short"),
        (f"OFF\n4 1 0\n{SQUARE}4 0 1 2\n", "cut short"),
        (f"OFF\n4 1 0\n{SQUARE}", "cut short"),
        (f"OFF\n999999999999 999999999999 0\n{SQUARE}", "cut short"),
        (f"OFF\n4 1 0\n{SQUARE}4 0 1 2 4\n", "names a vertex"),
        (f"OFF\n4 1 0\n{SQUARE}4 0 1 2 -1\n", "names a vertex"),
        (f"OFF\n4 1 0\n{SQUARE}4 0 1 2 nan\n", "names a vertex"),
        (f"OFF\n4 1 0\n{SQUARE}4 0 1 x 3\n", "no number"),
        ("OFF\n2 0 0\n0 0 0 1\n1 1 1\n", "same number of coordinates"),
        (b"OFF\n1 0 0\n\xff\xfe\x00", "no number"),
    ],
)
def test_bad_files_are_refused_in_one_line(text: str | bytes, words: str, tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=words) as error:
        read_text(text, tmp_path)
    assert "\n" not in str(error.value)


@given(st.binary(max_size=200))
def test_noise_is_refused_or_read(noise: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        try:
            vertices, faces = read_text(b"OFF\n3 1 0\n" + noise, Path(folder))
        except FileFormatError:
            return
    assert vertices.shape == (3, 3)
    assert faces.shape[1] == 3
