"""offline.py PAGES BOOTSTRAP: pages of FORD that load nothing from the net.

Their styles come from the folder of Bootstrap 5 (libjs-bootstrap5 of Debian), which is copied; MathJax is left out, as no
comment has formulas in TeX. Fails where a page still loads something.
"""
import re
import shutil
import sys
from pathlib import Path

if len(sys.argv) != 3:
    print(__doc__, end="", file=sys.stdout if sys.argv[1:] in (["-h"], ["--help"]) else sys.stderr)
    sys.exit(sys.argv[1:] not in (["-h"], ["--help"]))
pages, bootstrap = map(Path, sys.argv[1:])
FILES = {"css": "bootstrap.min.css", "js": "bootstrap.bundle.min.js"}
ELEMENT = r'<{0} (?:href|src)="https://[^"]*/{1}"[^>]*>'
MATHJAX = re.compile(r"<!-- MathJax -->.*?(?=<!-- )", re.DOTALL)
LOADED = re.compile(r'<(?:script|link|img)[^>]*(?:src|href)="(?:https?:)?//[^"]*')

if not all((bootstrap / kind / name).is_file() for kind, name in FILES.items()):
    sys.exit(f"{bootstrap}: Bootstrap 5 is not there; Debian's package libjs-bootstrap5 has it")
for kind, name in FILES.items():
    shutil.copy(bootstrap / kind / name, pages / kind / name)
for page in pages.rglob("*.html"):
    up = "../" * (len(page.relative_to(pages).parts) - 1)
    text = MATHJAX.sub("", page.read_text())
    text = re.sub(ELEMENT.format("link", FILES["css"]), f'<link href="{up}css/{FILES["css"]}" rel="stylesheet">', text)
    text = re.sub(ELEMENT.format("script", FILES["js"]), f'<script src="{up}js/{FILES["js"]}">', text)
    if LOADED.search(text):
        sys.exit(f"{page}: it loads {LOADED.search(text)[0]}")
    page.write_text(text)
