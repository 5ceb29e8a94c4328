"""Writes the page, its figures, their data, and the most of its tables in short as Markdown."""

import csv
import html
import io
import re

from . import advice
from .figures import blocks_and_threads, conditions, constraint_scaling, dampers, phases, residuals, scaling, solids, stability, work_precision
from .figures.picture import plt
from .plan import ACCURACY
from .summary import summary_tables, versions
from .tables import headline_table, tables

DRAWERS = (
    work_precision.draw,
    scaling.draw,
    solids.draw,
    dampers.draw,
    blocks_and_threads.draw,
    phases.draw,
    conditions.draw,
    residuals.draw,
    constraint_scaling.draw,
    stability.draw,
)
STYLE = """
body { font: 16px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; color: #222; background: #fff; margin: 2rem auto;
       max-width: 72rem; padding: 0 1rem; }
h1 { font-size: 1.7rem; } h2 { font-size: 1.2rem; margin-top: 2.5rem; }
.advice { background: #eef5fa; border-left: 4px solid #0072B2; padding: 0.2rem 1rem; }
figure { margin: 0; } figure svg { width: 100%; height: auto; }
figcaption { color: #444; font-size: 0.9rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.8rem; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 0.2rem 0.3rem; border-bottom: 1px solid #ddd; vertical-align: top; }
th { border-bottom: 2px solid #888; vertical-align: bottom; }
.short { white-space: nowrap; }
nav a { margin-right: 1rem; }
"""


def draw_all(campaign):
    """Every picture that the campaign has data for."""
    return [picture for draw in DRAWERS for picture in draw(campaign)]


def svg_of(picture):
    """The figure as SVG text; names inside are made from the picture's, so that figures can share a page."""
    with plt.rc_context({"svg.hashsalt": picture.name}):
        buffer = io.StringIO()
        picture.figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None, "Title": picture.title})
    plt.close(picture.figure)
    return buffer.getvalue()


def inline(svg, picture):
    """The SVG without its XML head and fixed size, with a name for screen readers, its ids made unique on the page."""
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    body = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", body, count=1)
    body = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", body, count=1)
    body = re.sub(r'\bid="', f'id="{picture.name}-', body)
    body = re.sub(r'(xlink:href="|url\()#', rf"\1#{picture.name}-", body)
    return body.replace("<svg", f'<svg role="img" aria-label="{html.escape(picture.title)}"', 1)


def write_report(folder, campaign):
    """index.html, results.md, and beside them an SVG and a CSV a figure; returns the path of the page."""
    folder.mkdir(parents=True, exist_ok=True)
    sections = []
    for picture in draw_all(campaign):
        svg = svg_of(picture)
        (folder / f"{picture.name}.svg").write_text(svg)
        with open(folder / f"{picture.name}.csv", "w", newline="") as file:
            csv.writer(file).writerows([picture.header, *picture.rows])
        sections.append((picture, inline(svg, picture)))
    (folder / "results.md").write_text(markdown(campaign))
    page = folder / "index.html"
    page.write_text(html_page(campaign, sections))
    return page


def html_page(campaign, sections):
    say = html.escape
    links = "".join(f'<a href="#{picture.name}">{say(picture.title)}</a>' for picture, _ in sections)
    parts = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{say(campaign.title)}</title><style>{STYLE}</style></head><body>",
        f"<h1>{say(campaign.title)}</h1>",
        '<div class="advice">',
        *(f"<p>{unbroken(say(words))}</p>" for words in [advice.summary(campaign), *advice.paragraphs(campaign)] if words),
        "</div>",
        f"<p>{say(how_measured(campaign))}</p>",
        f"<nav>{links}</nav>",
    ]
    for picture, svg in sections:
        parts.append(
            f'<h2 id="{picture.name}">{say(picture.title)}</h2><figure>{svg}<figcaption>{say(picture.caption)} '
            f'<a href="{picture.name}.csv">data</a>, <a href="{picture.name}.svg">figure</a></figcaption></figure>'
        )
    for table in [headline_table(campaign), *tables(campaign)] if campaign.study(ACCURACY) else tables(campaign):
        head = "".join(f"<th>{say(cell)}</th>" for cell in table.header)
        body = "".join("<tr>" + "".join(cell_of(cell) for cell in row) + "</tr>" for row in table.rows)
        parts.append(
            f'<h2>{say(table.title)}</h2><p>{say(table.note)}</p><div class="wide"><table><thead><tr>{head}</tr></thead>'
            f"<tbody>{body}</tbody></table></div>"
        )
    return "\n".join(parts + ["</body></html>\n"])


def unbroken(words):
    """No line break inside a number like 1e-12."""
    return re.sub(r"\d\S*e-\d+", r'<span class="short">\g<0></span>', words)


def cell_of(words):
    """Short cells stay on one line."""
    start = '<td class="short">' if len(words) < 40 else "<td>"
    return f"{start}{html.escape(words)}</td>"


def how_measured(campaign):
    """The conditions of all runs, with what falls short of them."""
    counts = [len(run.seconds) for run in campaign.runs if run.is_good and run.study != "constraint-scaling"]
    fewer = sum(count < 5 for count in counts)
    words = (
        "Every run is a process of its own, on one thread unless threads are compared; the methods take turns, and a time is the median of "
        "its repetitions. "
    )
    if fewer:
        words += (
            f"Of {len(counts)} combinations {fewer} were repeated fewer than five times. "
        )
    again = campaign.settings.get("again")
    return words + (
        f"Measured on {campaign.machine['date']}{f' ({again})' if again else ''} on {campaign.machine['processor']}, "
        f"preset {campaign.preset}."
    )


def markdown(campaign):
    """The chart and what it says in half a page, then the advice and the tables in short."""
    lines = [f"# {campaign.title}", "", *paragraph(advice.summary(campaign))]
    if campaign.study(ACCURACY):
        lines += [f"![{work_precision.TITLE}]({work_precision.NAME}.svg)", "", *markdown_table(headline_table(campaign))]
    lines += [
        how_measured(campaign),
        "",
        "Made by",
        "",
        *(f"    {line}" for line in campaign.settings["command"].splitlines()),
        "",
        "which writes results.md, index.html with every run and its pictures, and data.h5 with all numbers.",
        "",
    ]
    # Of several problems the tables say which to use.
    advised = advice.paragraphs(campaign) if len(advice.runs_by_problem(campaign)) < 2 else []
    if advised:
        lines += ["## Which to use", "", *(line for words in advised for line in paragraph(words))]
    for table in summary_tables(campaign):
        lines += [f"## {table.title}", "", *paragraph(table.note), *markdown_table(table)]
    return "\n".join([*lines, "## Machine and versions", "", versions(campaign), ""])


def paragraph(words):
    """The words and an empty line; nothing of none."""
    return [words, ""] if words else []


def markdown_table(table):
    """A list where there is one column only."""
    if len(table.header) == 1:
        return [*(f"- {row[0]}" for row in table.rows), ""]
    return [
        "| " + " | ".join(table.header) + " |",
        "|" + "---|" * len(table.header),
        *("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in table.rows),
        "",
    ]
