#!/bin/sh
# Makes an sdist, installs the Python package from it as pip does from a folder, and runs its tests and the program there:
# install.sh PYTHON SOURCE_DIR WORK_DIR
set -eu
rm -rf "$3"
"$1" -m venv --system-site-packages "$3"
cd "$2"
"$3/bin/pip" install -q --disable-pip-version-check scikit-build-core
"$3/bin/python" -c 'import sys; from scikit_build_core.build import build_sdist; build_sdist(sys.argv[1])' "$3"
cd "$3"
bin/pip install --disable-pip-version-check kschur-*.tar.gz
unset KSCHUR_LIBRARY PYTHONPATH || true
bin/kschur --version
bin/python -m pytest "$2/python"
