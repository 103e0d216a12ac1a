# SPDX-License-Identifier: GPL-3.0-or-later
"""The one error that users see; apart from arrays, so that what only draws and asks needs no numpy."""


class MeshError(ValueError):
    """A mesh or a request that cannot be worked on; the message says in one line what to do."""
