#!/usr/bin/python3
"""What is in a wheel: test_wheel.py WHEEL

Tags, program and scripts that may be run, three.js, a licence of each bundled library, no executable stack, no library that is neither
bundled nor of every Linux, no folder of the machine that built it; code of libraries is that of this system, so that it is as fast.
"""
import re
import struct
import sys
import zipfile
from pathlib import Path

# PEP 600: what every manylinux has. mvec is a part of glibc.
OF_EVERY_SYSTEM = re.compile(r"(ld-linux-x86-64|lib(c|m|mvec|dl|pthread|rt|gcc_s|z))\.so\.\d+")
PT_LOAD, PT_DYNAMIC, PT_GNU_STACK, PF_X = 1, 2, 0x6474e551, 1
DT_NEEDED, DT_STRTAB, DT_RPATH, DT_RUNPATH = 1, 5, 15, 29
failures = []


def check(what, passed):
    if not passed:
        failures.append(what)
        print("FAILS", what)


def code_of(data):
    """What a processor executes of an ELF file of 64 bits."""
    start, = struct.unpack_from("<Q", data, 32)
    size, count = struct.unpack_from("<HH", data, 54)
    headers = [struct.unpack_from("<IIQQQQQQ", data, start + k*size) for k in range(count)]
    return b"".join(data[offset:offset + filled] for kind, flags, offset, _, _, filled, _, _ in headers if kind == PT_LOAD and flags & PF_X)


def read_elf(data):
    """(executable stack, needed libraries, folders to look in) of an ELF file of 64 bits."""
    start, = struct.unpack_from("<Q", data, 32)
    size, count = struct.unpack_from("<HH", data, 54)
    headers = [struct.unpack_from("<IIQQQQQQ", data, start + k*size) for k in range(count)]
    stack = [flags for kind, flags, *_ in headers if kind == PT_GNU_STACK]
    _, _, place, _, _, length, _, _ = next(header for header in headers if header[0] == PT_DYNAMIC)
    entries = [struct.unpack_from("<QQ", data, place + k) for k in range(0, length, 16)]
    address = dict(entries)[DT_STRTAB]
    strings = next(offset + address - virtual for kind, _, offset, virtual, _, filled, _, _ in headers
                   if kind == PT_LOAD and virtual <= address < virtual + filled)

    def text(at):
        return data[strings + at:data.index(b"\0", strings + at)].decode()
    return (not stack or bool(stack[0] & PF_X), [text(value) for tag, value in entries if tag == DT_NEEDED],
            [text(value) for tag, value in entries if tag in (DT_RPATH, DT_RUNPATH)])


def main():
    wheel = Path(sys.argv[1])
    check("the name says which Linux", re.fullmatch(r"kschur-[\d.]+-py3-none-manylinux_2_\d+_\w+\.whl", wheel.name))
    with zipfile.ZipFile(wheel) as archive:
        files = {info.filename: info for info in archive.infolist() if not info.is_dir()}
        contents = {name: archive.read(name) for name in files}
    info = next(name for name in files if name.endswith(".dist-info/WHEEL")).removesuffix("WHEEL")
    tag = wheel.stem.split("-", 2)[2]
    check("the tag is that of the name", f"Tag: {tag}\n" in contents[info + "WHEEL"].decode().replace("\r", ""))
    data = info.replace(".dist-info", ".data")
    for name in (f"{data}scripts/kschur", f"{data}scripts/kschur-campbell", "kschur/bin/kschur", "kschur/bin/kschur-picture",
                 "kschur/bin/kschur-campbell", "kschur/bin/kschur-convert"):
        check(f"{name} may be run", name in files and files[name].external_attr >> 16 & 0o111 == 0o111)
    check("the package is typed", "kschur/py.typed" in files)

    binaries = {name: read_elf(content) for name, content in contents.items() if content[:4] == b"\x7fELF"}
    check("libraries and a program", {"kschur/libkschur_capi.so", "kschur/bin/kschur"} < set(binaries))
    known = {Path(name).name for name in binaries}
    licences = info + "licenses/"
    table = [line.split() for line in contents[licences + "bundled/bundled.txt"].decode().splitlines()]
    package_of = {words[0]: words[1] for words in table if len(words) == 3}
    check("kschur's own licence", b"Redistribution" in contents[licences + "LICENSE"])
    check("three.js, which pages are drawn with", b"WebGLRenderer" in contents.get("kschur/web/three.min.js", b""))
    check("and its licence", b"Permission is hereby granted" in contents.get(f"{licences}bundled/{package_of.get('three.min.js', '')}", b""))
    for name, (executable, needed, folders) in binaries.items():
        check(f"{name}: no executable stack", not executable)
        check(f"{name}: all it needs is there", all(other in known or OF_EVERY_SYSTEM.fullmatch(other) for other in needed))
        check(f"{name}: looks in the wheel only", all(folder.startswith("$ORIGIN") for line in folders for folder in line.split(":")))
        if name.startswith("kschur.libs/") and not re.match(r"lib(curl|crypto)-", Path(name).name):
            # auditwheel puts eight digits of a checksum into the name of the file.
            file = re.sub(r"-[0-9a-f]{8}\.", ".", Path(name).name, count=1)
            package = package_of.get(file, "")
            check(f"{name}: its licence", len(contents.get(f"{licences}bundled/{package}", b"")) > 500)
            there = [*Path("/usr/lib").glob(f"*-linux-*/{file}"), *Path("/usr/lib").glob(f"*-linux-*/*/{file}")]
            check(f"{name}: code of this system", not there or code_of(contents[name]) in [code_of(path.read_bytes()) for path in there])
    check("no library of the net", not any(re.search(r"lib(ssl|gnutls|krb5|ldap)", name) for name in files))
    small = sum(files[name].file_size for name in files if re.search(r"/lib(curl|crypto)-", name))
    check("nor what asks for it", small < 100000)
    print(f"{len(files)} files, {wheel.stat().st_size/1e6:.1f} MB, {len(failures)} failures")
    sys.exit(bool(failures))


main()
