# SPDX-License-Identifier: GPL-3.0-or-later
"""Batches of files on Dask, the ledger of what is done, and meshes larger than memory."""
