#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Print the first Python that the project can use: $PYTHON if set, else python3.11, python3.13, python3.

# A name on the path may be a shim of a version manager that does not run, so each one is tried.
usable() { "$1" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info[:2] not in ((3, 11), (3, 13)))' 2>/dev/null; }

for candidate in ${PYTHON:-python3.11 python3.13 python3}; do
    if usable "$candidate"; then
        echo "$candidate"
        exit 0
    fi
done
echo "No Python 3.11 or 3.13 with venv among: ${PYTHON:-python3.11, python3.13, python3}." \
    "Install one (Debian: apt-get install python3.11 python3.11-venv) or name one: make PYTHON=/path/to/python3.11" >&2
exit 1
