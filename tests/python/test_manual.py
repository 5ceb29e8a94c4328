"""Pages for man: test_manual.py PATH_OF_KSCHUR FOLDER, which has them."""
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from checks import check, run_tests
from program import kschur

PAGES = Path(sys.argv[2]).resolve()
COMMANDS = list(dict.fromkeys(re.findall(r"^  kschur (?!help)(\w+) ", kschur("help").stdout, re.M)))


def shown(page):
    """A page as a reader sees it, in one line and without the hyphens of broken words."""
    run = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", page], capture_output=True, text=True, env={**os.environ, "MANWIDTH": "500"})
    check(f"man {page.name}: without warnings", run.returncode == 0 and not run.stderr, run.stderr)
    return re.sub(r"\s+", " ", re.sub("\N{HYPHEN}\n *", "", run.stdout))


def test_pages(_):
    check("a page of the program, and of each command", all((PAGES / f"{name}.1").exists() for name in ["kschur", *(f"kschur-{c}" for c in COMMANDS)]))
    check("kschur.1: name and version", f'"{kschur("--version").stdout.splitlines()[0]}"' in (PAGES / "kschur.1").read_text())
    if not shutil.which("man"):
        print("        man is not installed: the pages are not read")
        return
    for command in ["", *COMMANDS]:
        page = PAGES / f"kschur-{command}.1" if command else PAGES / "kschur.1"
        text = shown(page)
        check(f"{page.name}: sections", all(f" {title} " in text for title in ("NAME", "SYNOPSIS", "DESCRIPTION")), text[:300])
        missing = [word for word in kschur("help", *[command] * bool(command)).stdout.split() if word not in text]
        # A scene has its name as a heading, without the colon.
        missing = [word for word in missing if command != "scene" or word.rstrip(":") not in text]
        check(f"{page.name}: every word of the help", not missing, missing)


run_tests(test_pages)
