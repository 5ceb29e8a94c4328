#!/bin/sh
# Installs the Python package as docs/python.md says, and runs its tests there: install.sh PYTHON SOURCE_DIR WORK_DIR
set -eu
rm -rf "$3"
"$1" -m venv --system-site-packages "$3"
"$3/bin/pip" install --disable-pip-version-check "$2/python"
cd "$3"
unset KSCHUR_LIBRARY PYTHONPATH || true
exec bin/python -m pytest "$2/python"
