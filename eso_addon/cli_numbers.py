# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers as the command line's words take them; a bad one is wrong usage."""

import argparse
from collections.abc import Callable

Read = Callable[[str], float]


def ratio(word: str) -> float:
    """Read a share of triangles."""
    return _number(word, lambda number: 0 < number <= 1, "a ratio above 0 and at most 1")


def length(word: str) -> float:
    """Read a length."""
    return _number(word, lambda number: 0 <= number < float("inf"), "a length, 0 or more")


def epsilon(word: str) -> float:
    """Read a weight of the method feature."""
    return _number(word, lambda number: -1 <= number <= 1, "a number from -1 to 1")


def count(word: str) -> int:
    """Read a number of things."""
    return int(_number(word, lambda number: number >= 1 and number == int(number), "a whole number, 1 or more"))


def bits(word: str) -> int:
    """Read the bits of a coordinate."""
    return int(_number(word, lambda number: number in range(4, 25), "a whole number, from 4 to 24"))


def seconds(word: str) -> float:
    """Read a time."""
    return _number(word, lambda number: 0 < number < 1e9, "a time: give seconds, more than 0")


def list_of(read: Read) -> Callable[[str], list[float]]:
    """Give what reads several of a kind, with commas between."""
    return lambda words: [read(word) for word in words.split(",")]


def _number(word: str, is_valid: Callable[[float], bool], wanted: str) -> float:
    try:
        number = float(word)
        if is_valid(number):
            return number
    except (ValueError, OverflowError):
        pass
    raise argparse.ArgumentTypeError(f"{word} is not {wanted}")
