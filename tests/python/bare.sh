#!/bin/sh
# Installs the wheel in a system that has Python and nothing else, neither compiler nor libraries nor a net, and runs the
# tests of the package and the tutorial there: bare.sh FOLDER_OF_WHEEL WORK_DIR
#
# As root. The working folder is that of the sources. The system, by debootstrap, is made once.
set -eu
wheel=$(echo "$1"/kschur-*.whl)
root=$2/root
mkdir -p "$2"

. /etc/os-release
if [ ! -e "$2/made" ]; then
   rm -rf "$root"
   mirror=$(apt-get indextargets --format '$(SITE)' 'Identifier: Packages' "Codename: $VERSION_CODENAME" | head -n 1)
   debootstrap --variant=minbase --include=python3,python3-venv "$VERSION_CODENAME" "$root" "$mirror" >"$2/debootstrap.log" 2>&1 ||
      { tail "$2/debootstrap.log"; exit 1; }
   touch "$2/made"
fi

# What pip would get: for the Python there.
version=$(chroot "$root" python3 -c 'import sys; print("%d.%d" % sys.version_info[:2])')
rm -rf "$root/kschur"
mkdir -p "$root/kschur/wheels"
build/tools/bin/pip download -q --disable-pip-version-check --only-binary :all: --python-version "$version" -d "$root/kschur/wheels" \
   "$wheel[plot,test]" h5py meshio
# The sources, but for the package, so that it is the installed one that runs.
tar -c --exclude=./build --exclude=./.git --exclude=./python/kschur . | tar -x -C "$root/kschur"

cat >"$root/kschur/run.sh" <<'END'
set -eu
if [ -n "$(find / -xdev -path /kschur -prune -o ! -type d \( -name 'lib*blas*' -o -name 'libgfortran*' -o -name 'libgomp*' -o -name 'libhdf5*' \
           -o -name 'libmumps*' -o -name gcc -o -name cc \) -print)" ]; then
   echo "this system is not bare"
   exit 1
fi
cd /kschur
python3 -m venv env
env/bin/pip install -q --no-index --find-links wheels kschur h5py meshio 'kschur[plot,test]'
env/bin/kschur --version
env/bin/kschur scene turbine --output turbine.h5
env/bin/kschur solve turbine.h5 --modes 3 --quiet --output modes.h5 >solve.log
# The HDF5 of h5py and that of the wheel are two, in one process.
for order in 'h5py, kschur' 'kschur, h5py'; do
   env/bin/python -c "import $order
kschur.load('modes.h5').save('again.h5')
assert (h5py.File('again.h5')['eigenvalues'][:] == h5py.File('modes.h5')['eigenvalues'][:]).all()"
done
env/bin/kschur view modes.h5 --html modes.html
env/bin/python -m pytest -q python/tests
env/bin/python tests/python/test_docs.py env/bin . README.md docs/tutorial.md docs/python.md
env/bin/python tests/python/test_view.py env/bin/kschur
# What the program loads from outside of the environment is of glibc and the compiler's own.
outside=$(LD_DEBUG=libs env/bin/kschur --version 2>&1 | sed -n 's/.*calling init: //p' | grep -v '^/kschur/env/' | sort -u |
   grep -Ev '/(ld-linux-x86-64|lib(c|m|mvec|gcc_s|z|expat))\.so[.0-9]*$' || true)
[ -z "$outside" ] || { echo "loaded from outside of the wheel: $outside"; exit 1; }
END
exec unshare --mount --net sh -c 'mount -t proc proc "$1/proc" && exec chroot "$1" env -i PATH=/usr/bin:/bin LANG=C.UTF-8 HOME=/root \
   OMP_NUM_THREADS="${OMP_NUM_THREADS-2}" sh /kschur/run.sh' sh "$root"
