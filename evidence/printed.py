# SPDX-License-Identifier: GPL-3.0-or-later
"""What the papers print: the only figures here that do not come from a run.

Tseng and Lin, Tables 1 to 10; Chen and Nishita, Table 1 and section 5.
"""

PERCENT = (40, 30, 20, 10, 5)

# Tables 1 to 4: vertices that moved 0, 1, 2, 3 and more than 3 times, at each percentage
MOVES: dict[str, dict[int, tuple[int, ...]]] = {
    "cow": {40: (1162, 1315, 387, 38, 2), 30: (873, 1359, 566, 102, 4), 20: (583, 1272, 810, 218, 21),
            10: (293, 971, 1025, 490, 125), 5: (148, 651, 1021, 726, 358)},
    "dragon": {40: (10160, 12906, 2036, 92, 224), 30: (7622, 13320, 4026, 226, 224), 20: (5084, 12308, 6862, 922, 242),
               10: (2546, 9147, 9617, 3501, 607), 5: (1277, 6095, 9691, 6327, 2028)},
    "femur": {40: (30748, 36496, 9025, 519, 6), 30: (23074, 37525, 14739, 1421, 35),
              20: (15397, 34774, 22278, 4108, 237), 10: (7715, 26040, 29082, 12088, 1869),
              5: (3873, 17366, 28309, 20201, 7045)},
    "isis": {40: (40002, 51925, 7990, 85, 0), 30: (30002, 52994, 16393, 612, 1), 20: (20002, 48645, 27985, 3322, 48),
             10: (10002, 35670, 38757, 14100, 1473), 5: (5002, 23494, 38204, 25715, 7587)},
}
AVERAGE_MOVES: dict[str, dict[int, float]] = {
    "cow": {40: 0.76, 30: 0.97, 20: 1.25, 10: 1.72, 5: 2.19},
    "dragon": {40: 0.75, 30: 0.94, 20: 1.21, 10: 1.66, 5: 2.11},
    "femur": {40: 0.73, 30: 0.93, 20: 1.21, 10: 1.67, 5: 2.13},
    "isis": {40: 0.68, 30: 0.88, 20: 1.15, 10: 1.61, 5: 2.08},
}
AT_MOST_THREE: dict[str, dict[int, float]] = {  # Table 5, in percent
    "cow": {40: 99.93, 30: 99.86, 20: 99.28, 10: 95.70, 5: 87.67},
    "dragon": {40: 99.12, 30: 99.12, 20: 99.05, 10: 97.61, 5: 92.02},
    "femur": {40: 99.99, 30: 99.95, 20: 99.69, 10: 97.57, 5: 90.83},
    "isis": {40: 100.0, 30: 100.0, 20: 99.95, 10: 98.53, 5: 92.41},
}

# Tables 7 to 10: triangles, and the Hausdorff distance of CF and of ESO over the diagonal
DISTANCES: dict[str, dict[int, tuple[int, float, float]]] = {
    "cow": {40: (2321, 2.146e-2, 0.415e-2), 30: (1741, 2.552e-2, 0.497e-2), 20: (1160, 2.985e-2, 0.636e-2),
            10: (580, 2.948e-2, 1.126e-2), 5: (290, 4.829e-2, 1.813e-2)},
    "dragon": {40: (20304, 2.622e-3, 0.496e-3), 30: (15228, 3.517e-3, 0.651e-3), 20: (10152, 4.055e-3, 1.002e-3),
               10: (5076, 5.272e-3, 1.369e-3), 5: (2538, 5.384e-3, 2.910e-3)},
    "femur": {40: (61328, 17.206e-3, 0.231e-3), 30: (45996, 17.210e-3, 0.414e-3), 20: (30664, 17.264e-3, 0.649e-3),
              10: (15332, 17.258e-3, 0.648e-3), 5: (7666, 17.202e-3, 2.015e-3)},
    "isis": {40: (80000, 1.583e-3, 0.252e-3), 30: (60000, 1.986e-3, 0.408e-3), 20: (40000, 2.583e-3, 0.369e-3),
             10: (20000, 2.830e-3, 0.683e-3), 5: (10000, 3.540e-3, 0.993e-3)},
}

# Chen and Nishita, Table 1: bytes of the original and the simplified model, bytes of a patch, milliseconds
STREAMS: dict[str, tuple[int, int, float, int]] = {
    "bunny_2503": (75142, 5746, 34.424, 1141), "dragon": (65586, 18137, 35.939, 961),
    "hand": (53519, 3991, 35.684, 951),
    "cessna": (553685, 148320, 30.379, 6219), "fandisk": (295092, 35765, 29.083, 15102),
    "tiger": (347587, 9099, 34.925, 15852),
}
FEATURE_SECONDS, QEM_SECONDS = 1.2, 4.5  # section 5, on the bunny
QEM_FACES = 161  # to which QEM took the bunny


def improvement(other: float, ours: float) -> float:
    """Return the improvement rate of Tables 7 to 10: how much less than the other, in percent."""
    return 100 * (other - ours) / other
