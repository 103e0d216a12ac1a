# SPDX-License-Identifier: GPL-3.0-or-later
"""The papers again: their tables and figures from one run, beside what they print. Not shipped in the add-on."""
