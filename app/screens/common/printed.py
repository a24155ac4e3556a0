"""A page to print on A4, as one HTML file without scripts or other files, in the language of the app. Pure.

Everything that comes from people, robots or files goes through ``html.escape``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape

from app.i18n import translator

STYLE = """
@page { size: A4; margin: 12mm }
* { box-sizing: border-box }
body { margin: 0 auto; max-width: 190mm; padding: 8mm; font: 10pt/1.3 system-ui, "Segoe UI", Roboto, sans-serif; color: #101c25;
  background: #fff }
h1 { font-size: 18pt; line-height: 1.1; margin: 0 }
h2 { font-size: 11pt; margin: 4mm 0 1mm; border-bottom: 1px solid #76838f; break-after: avoid }
p { margin: 1mm 0 }
.quiet { color: #44525f }
.head { display: flex; flex-wrap: wrap; align-items: end; justify-content: space-between; gap: 0 8mm }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(31mm, 1fr)); gap: 2mm; margin: 3mm .3mm 0 }
.figure { display: grid; grid-row: span 3; grid-template-rows: subgrid; row-gap: 0; border: 1px solid #76838f; border-radius: 2mm;
  padding: 1.5mm 2mm }
.figure b { font-size: 14pt; line-height: 1.2; white-space: nowrap }
.figure small, .figure span { font-size: 8pt; line-height: 1.2 }
.figure small { align-self: end }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(75mm, 1fr)); gap: 0 8mm }
table { width: 100%; border-collapse: collapse; font-size: 9pt }
thead { display: table-header-group }
tr { break-inside: avoid }
th, td { text-align: left; vertical-align: top; padding: .5mm 3mm .5mm 0; border-bottom: 1px solid #c3cad1 }
th:last-child, td:last-child { padding-right: 0 }
th { font-weight: 600; color: #44525f; vertical-align: bottom }
td.number, th.number { text-align: right; white-space: nowrap }
td.short { white-space: nowrap }
td.some { min-width: 42mm }
tr.more td { border-top-style: hidden }
tr.with-more td { border-bottom-style: none }
.bar { display: block; width: 16mm; height: 2.6mm; margin-top: .8mm; border: 1px solid #101c25 }
.bar i { display: block; height: 100%; background: #101c25 }
.ends { margin-top: 4mm; font-size: 8pt; line-height: 1.25 }
@media screen and (max-width: 170mm) { section { overflow-x: auto } td.some { min-width: 24mm } }
@media print { body { padding: 0; max-width: none; font-size: 9pt } * { -webkit-print-color-adjust: exact; print-color-adjust: exact } }
"""
NO_BREAK, JOIN = "\N{NO-BREAK SPACE}", "\N{WORD JOINER}"

_UNIT = re.compile(r"(?<=\d) (?=\D)| (?=…)")  # between a number and its unit, and before "…"
_RANGE = re.compile(r"(?<=\d)–(?=\d)")


def document(title: str, parts: Iterable[str]) -> str:
    """The whole document; ``parts`` are HTML already."""
    return (
        f'<!DOCTYPE html>\n<html lang="{escape(translator.language)}">\n<head>\n<meta charset="utf-8">\n'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n"
        + "\n".join(part for part in parts if part)
        + "\n</body>\n</html>\n"
    )


def unbroken(text: str) -> str:
    """Numbers stay on one line with their units and ranges."""
    return _RANGE.sub(JOIN + "–" + JOIN, _UNIT.sub(NO_BREAK, text))


def table(
    title: str,
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    numbers: Sequence[int] = (),
    note: str = "",
    short: Sequence[int] = (),
    some: Sequence[int] = (),
    more: Sequence[str] = (),
) -> str:
    """A section. ``rows`` are HTML already; ``numbers`` are the columns aligned right, ``short`` those that never wrap,
    ``some`` those with a least width; ``more`` has for each row another line below it over the whole width."""

    def kind(n: int) -> str:
        name = "number" if n in numbers else "short" if n in short else "some" if n in some else ""
        return f' class="{name}"' if name else ""

    def line(n: int, row: Sequence[str]) -> str:
        cells = "".join(f"<td{kind(n)}>{cell}</td>" for n, cell in enumerate(row))
        if not any(more[n : n + 1]):
            return f"<tr>{cells}</tr>"
        return f'<tr class="with-more">{cells}</tr>\n<tr class="more"><td></td><td colspan="{len(row) - 1}">{more[n]}</td></tr>'

    top = (
        f"<thead><tr>{''.join(f'<th{kind(n)}>{escape(text)}</th>' for n, text in enumerate(head))}</tr></thead>\n"
        if head
        else ""
    )
    body = "\n".join(line(n, row) for n, row in enumerate(rows))
    whole = f"<table>\n{top}{body}\n</table>\n" if body else ""
    foot = f'<p class="quiet">{escape(note)}</p>\n' if note else ""
    return f"<section>\n<h2>{escape(title)}</h2>\n{whole}{foot}</section>"
