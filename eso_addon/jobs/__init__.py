# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine in a worker thread that touches arrays only, polled by a modal timer."""
