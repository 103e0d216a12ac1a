# SPDX-License-Identifier: GPL-3.0-or-later
"""What is wrong with a stream."""


class StreamError(ValueError):
    """A stream that cannot be read; the message says in one line what is wrong and what to do."""
