"""A wheel that needs nothing but NumPy and SciPy and what every Linux has: make_wheel.py BUILD_FOLDER FOLDER_OF_WHEELS

Takes libraries and program out of a build of CMake, bundles what they load (auditwheel, patchelf) and three.js with their licences,
which dpkg names, and writes kschur-VERSION-py3-none-manylinux_GLIBC_MACHINE.whl. The working folder is that of the sources.
"""
import base64
import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

if len(sys.argv) != 3 or sys.argv[1] in ("-h", "--help"):
    print(__doc__, end="", file=sys.stdout if len(sys.argv) == 2 else sys.stderr)
    sys.exit(len(sys.argv) != 2)

from scikit_build_core.build import prepare_metadata_for_build_wheel

HERE = Path(__file__).resolve().parent
# The packages of libraries that every system has, as manylinux says.
OF_EVERY_SYSTEM = ("libc6", "libgcc-s1", "zlib1g")
# What pages are drawn with.
THREE = Path("/usr/share/javascript/three/build/three.min.js")
NO_NET = {"libcurl.so.4": ("LIBCURL", "CURL_OPENSSL_4"), "libcrypto.so.3": ("LIBCRYPTO", "OPENSSL_3.0.0")}


def run(*command, **more):
    return subprocess.run([str(word) for word in command], check=True, stdout=subprocess.PIPE, text=True, **more).stdout


def build_stand_ins(folder):
    """Libraries of the name and the symbol versions of those that HDF5 reads the net with."""
    folder.mkdir()
    for name, (which, version) in NO_NET.items():
        script = folder / f"{which}.map"
        script.write_text(f"{version} {{ global: *; }};\n")
        run("cc", "-O2", "-shared", "-fPIC", f"-D{which}", f"-Wl,-soname,{name}", f"-Wl,--version-script={script}", "-s",
            HERE / "no_net.c", "-o", folder / name)


def loaded_by(files, environment):
    """The libraries that these load, by name."""
    found = {}
    for file in files:
        for name, path in re.findall(r"^\s*(\S+) => (/\S+) \(", run("ldd", file, env=environment), re.M):
            found[name] = Path(path)
    return found


def package_of(path):
    """(name, version) of the Debian package that a file is of."""
    for candidate in (path.resolve(), path, Path("/usr") / str(path).lstrip("/")):
        done = subprocess.run(["dpkg", "-S", candidate], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        if done.returncode == 0:
            name = done.stdout.split(": ")[0]
            return name.split(":")[0], run("dpkg-query", "-W", "-f=${Version}", name)
    sys.exit(f"make_wheel.py: {path} is of no Debian package, so that its licence is not known")


def add_licences(libraries, folder):
    """Of each bundled library, those of C and Fortran and that of pages, the licence, the general ones that it names, and a table of what comes from where."""
    folder.mkdir(parents=True)
    lines = ["Libraries in this wheel, unmodified from these Debian packages; `apt-get source PACKAGE=VERSION` brings the sources.", ""]
    general = set()
    for name, path in sorted(libraries.items()):
        package, version = package_of(path)
        if package in OF_EVERY_SYSTEM:
            continue
        licence = Path("/usr/share/doc", package, "copyright")
        shutil.copyfile(licence, folder / package)
        general.update(re.findall(r"/usr/share/common-licenses/([\w.-]*[\w-])", licence.read_text(errors="replace")))
        lines.append(f"{path.resolve().name} {package} {version}")
    for name in sorted(general):
        source = Path("/usr/share/common-licenses", name)
        if source.is_file():
            shutil.copyfile(source, folder / name)
    lines += ["", *[f"{name} kschur: answers HDF5 that the net is not there" for name in NO_NET]]
    (folder / "bundled.txt").write_text("\n".join(lines) + "\n")


def pack(folder, wheel):
    """RECORD, and all files, with the mode that they have."""
    info = next(folder.glob("*.dist-info"))
    record = info / "RECORD"
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path != record)
    lines = []
    for path in files:
        digest = base64.urlsafe_b64encode(hashlib.sha256(path.read_bytes()).digest()).decode().rstrip("=")
        lines.append(f"{path.relative_to(folder)},sha256={digest},{path.stat().st_size}\n")
    record.write_text("".join(lines) + f"{record.relative_to(folder)},,\n")
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_STORED) as archive:
        for path in [*files, record]:
            archive.write(path, path.relative_to(folder))


def main():
    build, wheels = (Path(word).resolve() for word in sys.argv[1:])
    tools = Path(sys.executable).parent
    with tempfile.TemporaryDirectory() as work:
        stage, stand_ins = Path(work, "stage"), Path(work, "stand_ins")
        run("cmake", "--install", build, "--component", "python", "--prefix", stage, "--strip")
        shutil.copytree("python/kschur", stage / "kschur", dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copyfile(THREE, stage / "kschur/web" / THREE.name)
        info = stage / prepare_metadata_for_build_wheel(str(stage))
        data = stage / info.name.replace(".dist-info", ".data")
        data.mkdir()
        (stage / "scripts").rename(data / "scripts")
        machine = platform.machine()
        (info / "WHEEL").write_text("Wheel-Version: 1.0\nGenerator: kschur\nRoot-Is-Purelib: false\n"
                                    f"Tag: py3-none-linux_{machine}\n")

        ours = [*(stage / "kschur").glob("*.so*"), stage / "kschur/bin/kschur"]
        for file in ours:
            run(tools / "patchelf", "--set-rpath", "$ORIGIN/.." if file.parent.name == "bin" else "$ORIGIN", file)
        build_stand_ins(stand_ins)
        environment = dict(os.environ, LD_LIBRARY_PATH=str(stand_ins), PATH=f"{tools}:{os.environ['PATH']}")
        libraries = {name: path for name, path in loaded_by(ours, environment).items()
                     if stage not in path.parents and stand_ins not in path.parents}
        add_licences({**libraries, THREE.name: THREE}, info / "licenses" / "bundled")

        wheel = Path(work, f"{info.name.removesuffix('.dist-info')}-py3-none-linux_{machine}.whl")
        pack(stage, wheel)
        glibc = platform.libc_ver()[1].replace(".", "_")
        shutil.rmtree(wheels, ignore_errors=True)
        run(tools / "auditwheel", "repair", "--plat", f"manylinux_{glibc}_{machine}", "--only-plat", "-w", wheels, wheel,
            env=environment)
    print(*wheels.glob("*.whl"))


main()
