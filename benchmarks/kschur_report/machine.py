"""Where the numbers come from: machine and versions."""

import os
import platform
import shutil
import subprocess
from datetime import datetime, timezone

import h5py
import matplotlib
import numpy
import scipy

PACKAGES = (
    "gfortran",
    "libmumps-seq-dev",
    "libmetis-dev",
    "libsuitesparse-dev",
    "libopenblas-dev",
    "libarpack2-dev",
    "libhdf5-dev",
    "python3-slepc4py-real",
    "python3-slepc4py-complex",
)


def describe(kschur):
    """Names and values, for the foot of the page."""
    facts = {
        "date": now(),
        "processor": processor(),
        "cores": str(os.cpu_count()),
        "memory": memory(),
        "system": distribution(),
        "load": f"{os.getloadavg()[0]:.1f} processes at the start",
        "kschur": output_of([str(kschur), "--version"]).splitlines()[0],
        "Python": platform.python_version(),
        "NumPy": numpy.__version__,
        "SciPy": scipy.__version__,
        "h5py": h5py.__version__,
        "Matplotlib": matplotlib.__version__,
    }
    if shutil.which("dpkg-query"):
        for package in PACKAGES:
            version = output_of(["dpkg-query", "-W", "-f=${Version}", package])
            if version:
                facts[package] = version
    return facts


def now():
    return datetime.now(timezone.utc).strftime("%Y-%m-%d %H:%M UTC")


def output_of(words):
    return subprocess.run(words, capture_output=True, text=True).stdout.strip()


def field_of(path, name):
    """The first value of a line `name : value` of a file."""
    try:
        with open(path) as lines:
            return next((line.split(":", 1)[1].strip() for line in lines if line.startswith(name)), "unknown")
    except OSError:
        return "unknown"


def processor():
    return field_of("/proc/cpuinfo", "model name")


def memory():
    words = field_of("/proc/meminfo", "MemTotal").split()
    return f"{int(words[0]) / 2**20:.0f} GiB" if len(words) == 2 else "unknown"


def distribution():
    try:
        return platform.freedesktop_os_release()["PRETTY_NAME"]
    except OSError:
        return platform.system()
