# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours that stand for figures."""

import numpy as np
from numpy.typing import NDArray

# Dark blue, teal, green, yellow: told apart by lightness alone too.
_RAMP = np.array([(0.27, 0.00, 0.33), (0.23, 0.32, 0.55), (0.13, 0.57, 0.55), (0.37, 0.79, 0.38), (0.99, 0.91, 0.15)])


def ramp(values: NDArray[np.float64], low: float, high: float) -> NDArray[np.float32]:
    """Give the colours of values between two ends, (n, 4) float32; what is outside has the end's."""
    place = ((values - low) / max(high - low, 1e-300)).clip(0, 1)
    stops = np.linspace(0, 1, len(_RAMP))
    channels = [np.interp(place, stops, channel) for channel in _RAMP.T]
    return np.stack([*channels, np.ones(len(values))], axis=1).astype(np.float32)
