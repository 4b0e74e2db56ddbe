"""Decisions of `bench match` at other priors of an absent target: `python tests/support/prior_of_absent.py FOLDER...`.

A FOLDER is one that `bench match` wrote, or one above several. The losses in pairs.csv give the probabilities at any
prior; nothing is matched again. A target counts as absent if its candidate is left out.
"""

from __future__ import annotations

import csv
import math
import sys
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from glotouch_bt.perception.recognition.likelihood.params import LikelihoodParams
from glotouch_bt.perception.recognition.likelihood.posterior import probabilities

Row = dict[str, str]
PRIORS = (0.1, 0.15, 0.2)


def accepted(rows: list[Row], p: LikelihoodParams) -> Row | None:
    """Return the accepted candidate, or None."""
    ratios = [-math.log(max(math.expm1(float(r["loss"])), 1e-300)) for r in rows]
    shares, _ = probabilities(ratios, p)
    best = int(shares.argmax())
    return rows[best] if shares[best] >= p.accept and float(rows[best]["evidence"]) > 0 else None


def main() -> None:
    """Print accepted, wrongly accepted and taken though absent for each prior."""
    decisions: defaultdict[tuple[str, str, str], list[Row]] = defaultdict(list)
    for path in sorted(p for folder in sys.argv[1:] for p in Path(folder).rglob("pairs.csv")):
        with path.open() as f:
            for row in csv.DictReader(f):
                if row["method"] == "likelihood" and row["stranger"] != "True":
                    decisions[str(path), row["seed"], row["target"]].append(row)
    if not decisions:
        sys.exit("no pairs.csv of `glotouch bench match --method likelihood` in these folders")
    for prior in PRIORS:
        p = replace(LikelihoodParams(), prior_absent=prior)
        right = wrong = taken = 0
        for (_, _, target), rows in decisions.items():
            found = accepted(rows, p)
            right += found is not None and found["object"] == target
            wrong += found is not None and found["object"] != target
            others = [r for r in rows if r["object"] != target]
            taken += bool(others) and accepted(others, p) is not None
        sys.stdout.write(
            f"prior {prior}: accepted {right}, wrongly {wrong}, absent taken {taken}, of {len(decisions)}\n"
        )


if __name__ == "__main__":
    main()
