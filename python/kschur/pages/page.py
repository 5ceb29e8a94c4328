"""What all pages are made of: parts of the folder web, facts as JSON, numbers in blocks, and where they show a model three.js."""
from __future__ import annotations

import html
import json
import math
import os
import tempfile
from pathlib import Path
from typing import Any

from ..errors import Error

WEB = Path(__file__).parent.with_name("web")
SPACE_SCRIPTS = ("camera.js", "model.js", "overlay.js", "stage.js")


class Page:
    """A page. `save` writes it; a notebook shows it."""

    def __init__(self, name: str, scripts: tuple[str, ...], facts: dict[str, Any], blocks: dict[str, str]) -> None:
        """The body is web/NAME.html, in which @STAGE@ is the place of the model, where there are blocks for one."""
        stage = _part("stage.html") if blocks else ""
        scripts = ("data.js", *(SPACE_SCRIPTS if blocks else ()), *scripts)
        parts = {"STYLE": _part("style.css"), "BODY": _part(f"{name}.html"), "STAGE": stage, "THREE": _three() if blocks else "",
                 "SCRIPTS": "\n".join(map(_part, scripts)),
                 "DATA": "\n".join(f'<script type="text/plain" id="{place}">{block}</script>' for place, block in blocks.items()),
                 "FACTS": json.dumps(_finite(facts), allow_nan=False).replace("<", "\\u003c")}
        page = _part("page.html")
        for mark, text in parts.items():
            page = page.replace(f"@{mark}@", text)
        self.html = page

    def save(self, path: Any) -> None:
        """Writes the page; it appears under its name when it is whole."""
        place = Path(path).absolute()
        with tempfile.TemporaryDirectory(dir=place.parent, prefix=f"{place.name}.partial-") as staging:
            whole = Path(staging, place.name)
            whole.write_text(self.html, encoding="utf-8")
            whole.replace(place)

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self.html)}" style="width:100%;height:640px;border:1px solid #ccc"></iframe>'


def rounded(values: Any) -> list[Any]:
    """As JSON has them, nested as the array is: nine digits, which no screen shows; None where there is no number."""
    return [rounded(value) if getattr(value, "ndim", 0) else float(f"{value:.9g}") for value in values]


def _part(name: str) -> str:
    return WEB.joinpath(name).read_text(encoding="utf-8")


def _three() -> str:
    """three.js with its licence, as KSCHUR_THREE names it, as a wheel has it, or as Debian's libjs-three."""
    bundled = WEB / "three.min.js"
    place = Path(os.environ.get("KSCHUR_THREE", bundled if bundled.exists() else "/usr/share/javascript/three/three.min.js"))
    try:
        script = place.read_text(encoding="utf-8").replace("</script", "<\\/script")
    except OSError:
        raise Error(f"there is no {place}: a page takes three.js, Debian's package libjs-three, or a three.min.js that "
                    "KSCHUR_THREE names") from None
    return f"{_part('three.html')}<script>{script}</script>"


def _finite(facts: Any) -> Any:
    """The same with None for what is not a finite number, which JSON does not know."""
    if isinstance(facts, dict):
        return {name: _finite(value) for name, value in facts.items()}
    if isinstance(facts, list):
        return [_finite(value) for value in facts]
    return None if isinstance(facts, float) and not math.isfinite(facts) else facts
