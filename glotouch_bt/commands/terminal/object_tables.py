"""The table of a folder of objects, its look-alikes and its refused files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.text import Text

from glotouch_bt.commands.terminal.console import EscapingConsole, print_table

if TYPE_CHECKING:
    from glotouch_bt.objects import LookAlike, Prepared, RefusedFile


def print_objects(
    folder: Path, results: Sequence[Prepared | RefusedFile], alike: Sequence[LookAlike], out: Path | None
) -> None:
    """Print the objects, what was changed, the look-alikes, the refused files, and what to type next."""
    from glotouch_bt.objects import Prepared, RefusedFile, closures_in_words, side_in_words, size_in_words

    console = EscapingConsole(soft_wrap=True, highlight=False)
    good = [r for r in results if isinstance(r, Prepared)]
    rows = [
        (
            made.name,
            size_in_words(made),
            f"{made.mass_kg * 1e3:.0f} g",
            side_in_words(made),
            "not a target" if made.faults else made.fit.in_words() if made.fit is not None else "not judged",
        )
        for made in good
    ]
    if rows:
        print_table("objects", ("name", "size", "weight", "stands on", "jaws"), rows)
        console.print(
            Text(
                "weight: in solid PLA. stands on: of its stable sides, with the probability after a random drop.",
                style="dim",
            )
        )
    for made in good:
        for fault in made.faults:
            console.print(Text(f"{made.name}: not a target: {fault}", style="yellow"))
        notes = [note for note in made.notes if not note.startswith("converted from")]  # as the user asked
        if notes:
            console.print(Text(f"{made.name}: {'; '.join(notes)}"))
    for pair in alike:
        said = closures_in_words(pair)
        console.print(
            Text(f"look-alikes: {pair.first}, {pair.second}: {said}", style="" if pair.closures else "yellow")
        )
    for refused in results:
        if isinstance(refused, RefusedFile):
            console.print(Text(f"refused: {refused.source.name}: {refused.reason}", style="red"))
    units = sorted({r.unit for r in results if isinstance(r, RefusedFile) and r.unit})
    if len(units) == 1 and not good:
        console.print(f"next: glotouch objects {folder} --units {units[0]}", markup=False)
    elif units:
        others = " and that of the others" if good else ""
        console.print(f"next: sort the files by their unit ({', '.join(units)}{others}) into folders", markup=False)
    if out is not None:
        target = next((m.name for m in good if not m.faults), None)
        console.print(f"written: {out} ({len(good)} objects); pictures: {out / 'objects.html'}", markup=False)
        if target is None:
            console.print(
                "none of them can be a target: none is found by touch and fits between the jaws", markup=False
            )
        else:
            console.print(f"next: glotouch run retrieve --objects {out} --set target={target}", markup=False)
    elif good and not units:
        console.print("next: add --out DIR to write them as clean objects, with pictures", markup=False)
