"""Compare two campaign folders: what differs between them, the paired figures, and the trials without a partner."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from glotouch_bt.bench.compare.folders import Measured, Recorded, read_campaign
from glotouch_bt.bench.compare.paired import paired_mean, paired_rate
from glotouch_bt.campaign import changes
from glotouch_bt.robot import BadInput

Pair = tuple[str, Measured, Measured]


def compare_folders(a: Path, b: Path) -> dict[str, Any]:
    """Return the comparison of two campaigns as JSON data; differences are B minus A.

    Returns:
        `differs`: [{what, a, b}], code, settings and objects; `groups`: by label {rates, numbers}, by column; `turned`:
        names of the trials that succeed in one campaign only; `unpaired`: names in one campaign only; `missing`: by
        column, pairs without a value on one side.

    Raises:
        BadInput: A folder is no campaign, both are the same, they are of different benches, or no trial has a partner.
    """
    if a.resolve() == b.resolve():
        raise BadInput(f"{a}: is compared with itself; give the folders of two campaigns")
    one, two = read_campaign(a), read_campaign(b)
    kinds = one.identity.get("campaign"), two.identity.get("campaign")
    if kinds[0] != kinds[1]:
        raise BadInput(f"{a} is a {kinds[0]} and {b} a {kinds[1]}: compare campaigns of the same bench")
    names = [name for name in one.trials if name in two.trials]
    unpaired = {"a": sorted(one.trials.keys() - names), "b": sorted(two.trials.keys() - names)}
    if not names:
        raise BadInput(
            f"no trial of {a} (such as {unpaired['a'][0]}) has a partner in {b} (such as {unpaired['b'][0]}); "
            "run both with the same seeds and targets"
        )
    groups: dict[str, list[Pair]] = {}
    for name in names:
        label = dict.fromkeys((one.trials[name].group, two.trials[name].group))
        groups.setdefault(" -> ".join(label), []).append((name, one.trials[name], two.trials[name]))
    missing: dict[str, int] = {}
    return {
        "a": _described(one),
        "b": _described(two),
        "differs": [{"what": ": ".join(path), "a": x, "b": y} for path, x, y in changes(one.identity, two.identity)],
        "pairs": len(names),
        "groups": {label: _figures(pairs, missing) for label, pairs in groups.items()},
        "turned": {
            "only_a": [n for n in names if _succeeds(one.trials[n]) > _succeeds(two.trials[n])],
            "only_b": [n for n in names if _succeeds(two.trials[n]) > _succeeds(one.trials[n])],
        },
        "unpaired": unpaired,
        "missing": missing,
    }


def _described(campaign: Recorded) -> dict[str, Any]:
    return {"folder": str(campaign.folder), "commit": campaign.commit, "trials": len(campaign.trials)}


def _succeeds(trial: Measured) -> bool:
    return trial.rates.get("success", False)


def _figures(pairs: list[Pair], missing: dict[str, int]) -> dict[str, Any]:
    """Return the paired figures of one group; columns of which a pair has only one value are counted in `missing`."""
    found: dict[str, Any] = {"pairs": len(pairs), "rates": {}, "numbers": {}}
    for key, statistic in (("rates", paired_rate), ("numbers", paired_mean)):
        sides = [(_columns(x, key), _columns(y, key), x.world) for _, x, y in pairs]
        for column in dict.fromkeys(c for x, y, _ in sides for c in (*x, *y)):
            both = [(x[column], y[column], world) for x, y, world in sides if column in x and column in y]
            lone = sum((column in x) != (column in y) for x, y, _ in sides)
            if lone:
                missing[column] = missing.get(column, 0) + lone
            if both:
                first, second, worlds = zip(*both, strict=True)
                found[key][column] = statistic(first, second, worlds)
    return found


def _columns(trial: Measured, key: str) -> Mapping[str, float]:
    return trial.rates if key == "rates" else trial.numbers
