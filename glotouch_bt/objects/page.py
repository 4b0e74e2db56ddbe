"""The page of a folder of objects: one self-contained HTML file."""

from __future__ import annotations

import base64
from collections.abc import Sequence

from glotouch_bt.escaped_text import html_text
from glotouch_bt.objects.alike import LookAlike
from glotouch_bt.objects.picture import jaw_map
from glotouch_bt.objects.prepare import DENSITY_KG_M3, Prepared, RefusedFile

_STYLE = """
:root { color-scheme: light dark; --line: #8884; --bad: #b3261e; }
body { font: 15px/1.45 system-ui, sans-serif; max-width: 66rem; margin: 1.5rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.1rem; margin: 1.2rem 0 .4rem; overflow-wrap: anywhere; }
section { display: flex; flex-wrap: wrap; gap: 1rem; border-top: 1px solid var(--line); padding: 1rem 0; }
section h2 { margin-top: 0; } section > div { flex: 1; min-width: 18rem; }
img.object { width: 240px; height: 240px; border-radius: 6px; background: #fff; }
figure { margin: 0; } figcaption { font-size: .8rem; opacity: .75; max-width: 180px; }
.sides { display: flex; flex-wrap: wrap; gap: .5rem; } .chosen figcaption { font-weight: bold; opacity: 1; }
.sides img { border-radius: 4px; background: #fff; }
img.map { image-rendering: pixelated; max-width: 100%; }
dl { display: grid; grid-template-columns: 6rem 1fr; gap: .15rem .6rem; margin: 0; }
dt { opacity: .7; } dd { margin: 0; } .bad { color: var(--bad); }
table { border-collapse: collapse; } td, th { text-align: left; padding: .2rem .8rem .2rem 0; vertical-align: top; }
@media (prefers-color-scheme: dark) { :root { --bad: #ff8a80; } }
"""


def page(title: str, results: Sequence[Prepared | RefusedFile], alike: Sequence[LookAlike]) -> str:
    """Return the page: every object with its picture, the look-alikes, and the files that were refused."""
    good = [r for r in results if isinstance(r, Prepared)]
    refused = [r for r in results if isinstance(r, RefusedFile)]
    body = [f"<h1>{html_text(title)}</h1>", f"<p>{_counts(len(good), len(refused))}</p>"]
    body += [_card(made) for made in good]
    if alike:
        rows = "".join(
            f"<tr><td>{html_text(a.first)}, {html_text(a.second)}</td><td>{closures_in_words(a)}</td></tr>"
            for a in alike
        )
        body.append(
            f"<h2>Look-alikes</h2><p>Outline and height confuse these pairs.</p><table><tr><th>objects</th>"
            f"<th>to tell them apart (estimate)</th></tr>{rows}</table>"
        )
    if refused:
        rows = "".join(f"<tr><td>{html_text(r.source.name)}</td><td>{html_text(r.reason)}</td></tr>" for r in refused)
        body.append(f"<h2>RefusedFile</h2><table>{rows}</table>")
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{html_text(title)}</title>'
    head += f"<style>{_STYLE}</style>"
    return f'<!doctype html><html lang="en"><head>{head}</head><body>{"".join(body)}</body></html>\n'


def size_in_words(made: Prepared) -> str:
    """Return the size of the bounding box, in millimetres."""
    return " x ".join(f"{s * 1e3:.0f}" for s in made.mesh.extents_m) + " mm"


def side_in_words(made: Prepared) -> str:
    """Return the side on which an object stands, and how probable that is."""
    if made.side is None:
        return "no firm side"
    return f"side {made.side + 1} of {len(made.sides)} ({made.sides[made.side].share:.0%})"


def closures_in_words(pair: LookAlike) -> str:
    """Return how many closures tell a pair apart."""
    if pair.closures is None:
        return "touch hardly tells them apart"
    return f"about {pair.closures} closure{'s' * (pair.closures != 1)}"


def _counts(good: int, refused: int) -> str:
    words = f"{good} object{'s' * (good != 1)}"
    return words + (f", {refused} file{'s' * (refused != 1)} refused" if refused else "")


def _card(made: Prepared) -> str:
    facts = {
        "size": size_in_words(made),
        "weight": f"{made.mass_kg * 1e3:.0f} g ({made.volume_m3 * 1e6:.0f} cm³ of solid PLA, {DENSITY_KG_M3:g} kg/m³)",
        "stands on": side_in_words(made),
        "jaws": made.fit.in_words() if made.fit is not None else "not judged",
        "file": f"{made.source.name}, {len(made.mesh.faces)} triangles",
        "changed": "; ".join(made.notes) or "nothing",
    }
    rows = "".join(f"<dt>{html_text(k)}</dt><dd>{html_text(v)}</dd>" for k, v in facts.items())
    faults = "".join(f'<p class="bad">Not a target: {html_text(fault)}</p>' for fault in made.faults)
    image = f'<img class="object" alt="{html_text(made.name)}" src="{_inline(made.png)}">' if made.png else ""
    chart = ""
    if made.fit is not None and made.fit.fits.any() and not made.fit.fits.all():
        low, high = (f"{z * 1e3:.0f}" for z in made.fit.z_m[[0, -1]])
        caption = f"Jaws' yaw 0 to 180° to the right, height of the pads {low} to {high} mm upwards. "
        caption += "Green: fits. Red: too wide. Grey: the pads meet nothing."
        shown = f'<img class="map" alt="where the jaws fit" src="{_inline(jaw_map(made.fit))}">'
        chart = f"<figure>{shown}<figcaption>{caption}</figcaption></figure>"
    sides = ""
    if len(made.side_pngs) > 1:
        how = f"<code>glotouch objects ... --side {html_text(made.name)}=N</code>"
        shown = "".join(_side(i, made) for i in range(len(made.side_pngs)))
        sides = f'<p>Its stable sides; {how} chooses another:</p><div class="sides">{shown}</div>'
    return f"<section>{image}<div><h2>{html_text(made.name)}</h2><dl>{rows}</dl>{faults}{sides}</div>{chart}</section>"


def _side(index: int, made: Prepared) -> str:
    chosen = ' class="chosen"' if index == made.side else ""
    text = f"{index + 1} ({made.sides[index].share:.0%})"
    image = f'<img alt="side {index + 1}" src="{_inline(made.side_pngs[index])}">'
    return f"<figure{chosen}>{image}<figcaption>{text}</figcaption></figure>"


def _inline(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"
