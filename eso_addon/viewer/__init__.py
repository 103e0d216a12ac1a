# SPDX-License-Identifier: GPL-3.0-or-later
"""The web client that shows a stream, the little server that gives it out, and pages that hold both."""
