"""Tables of the experiments."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from glotouch_bt.commands.terminal.console import EscapingConsole, print_table


def _mean(m: dict[str, Any] | None) -> str:
    return f"{m['mean']:.2f} [{m['lo']:.2f}, {m['hi']:.2f}]" if m else "-"


def print_retrieve(summary: dict[str, Any], folder: Path) -> None:
    """Print a retrieval campaign: rates with Wilson 95 % intervals, causes of failure."""

    def rate(r: dict[str, Any]) -> str:
        return f"{r['rate'] * r['n']:.0f}/{r['n']}  {100 * r['rate']:.0f} % [{100 * r['lo']:.0f}, {100 * r['hi']:.0f}]"

    rows = [(target, rate(r)) for target, r in summary["by_target"].items()]
    rows += [(name, rate(summary[key])) for name, key in (
        ("all targets", "success"), ("wrong object lifted", "wrong_object"),
        ("another object ever lifted", "other_ever_lifted"), ("safety stops", "safety_stops"),
        ("tracebacks", "tracebacks"))]  # fmt: skip
    seeds = summary["seeds"]
    world = f" in {summary['world']}" if "world" in summary else ""
    title = f"retrieve{world}, {summary['conditions']}, seeds {seeds[0]}-{seeds[-1]}"
    print_table(title, ("", "rate [Wilson 95 %]"), rows)
    if summary["causes"]:
        print_table("causes of failure", ("cause", "trials"), [(c, str(n)) for c, n in summary["causes"].items()])
    if times := summary["skill_time_s"]:
        shown = [(skill, f"{time_s:.1f}") for skill, time_s in times.items() if time_s >= 1.0]
        print_table("robot time by skill, mean", ("skill", "s"), shown)
    EscapingConsole().print(
        f"robot time {summary['median_sim_s']:.0f} s, wall time {summary['median_wall_s']:.0f} s in the median; "
        f"largest peak force {summary['largest_peak_force_N']:.1f} N, "
        f"at most {summary['max_samples_over_limit']} samples in a row beyond the limit\n{folder / 'summary.json'}",
        markup=False,
    )


def print_growth(summary: dict[str, Any], folder: Path) -> None:
    """Print travel and planning of explorations by objects and area."""
    rows = [
        (
            str(p["objects"]),
            f"{p['area']:g}",
            f"{100 * p['complete']:.0f} %",
            f"{p['travel_m']['mean']:.2f} [{p['travel_m']['lo']:.2f}, {p['travel_m']['hi']:.2f}]",
            f"{p['contacts']['mean']:.0f}",
            f"{p['planning_s']['mean']:.1f}",
            f"{1e3 * p['plan_s']:.0f} ({1e3 * p['longest_plan_s']:.0f})",
        )
        for p in summary["points"]
    ]
    columns = ("objects", "areas", "all found", "travel, m [95 %]", "contacts", "planning, s", "a plan, ms (longest)")
    print_table(f"{summary['policy']}, {len(summary['seeds'])} layouts a point", columns, rows)
    words = (
        f"{k.rsplit('_', 1)[0]}: objects^{s['objects']:.2f} area^{s['area']:.2f}" for k, s in summary["slopes"].items()
    )
    text = f"growth of {'; '.join(words)}\n{folder / 'summary.json'}"
    EscapingConsole().plain(text)


def print_robustness(summary: dict[str, Any], folder: Path) -> None:
    """Print a sweep of the axes: rates of decisions or of missions, for each level."""
    from glotouch_bt.bench.robustness import AXES, rates_of

    rates = rates_of(summary)

    def share(r: dict[str, Any]) -> str:
        middle = r["mean"] if "mean" in r else r["rate"]
        return f"{100 * middle:.0f} % [{100 * r['lo']:.0f}, {100 * r['hi']:.0f}]"

    rows = [
        (
            f"{AXES[name].label}: {p['level'] * AXES[name].shown:g}" if name in AXES else summary["conditions"],
            *(share(p[key]) for key in rates),
        )
        for name, points in summary["axes"].items()
        for p in points
    ]
    n = len(summary["seeds"])
    print_table(
        f"{summary['mission']} with one axis varied, {summary['conditions']} otherwise, {n} boxes a point",
        ("axis and level", *(f"{label} [95 %]" for label in rates.values())),
        rows,
    )
    where = f"{folder / 'robustness.png'}\n{folder / 'summary.json'}"
    EscapingConsole().plain(where)


def print_speed(summary: dict[str, Any], folder: Path) -> None:
    """Print a speed study: factors with their range, cycle times, breakdown of the wall time."""

    def span(key: str, of: dict[str, Any] = summary) -> str:
        r = of[key]
        return f"{r['median']:.2f} [{r['min']:.2f}, {r['max']:.2f}]"

    def verdict(key: str) -> str:
        goal = summary["targets"][key]
        bound = f">= {goal['least']:g}" if "least" in goal else f"<= {goal['most']:g}"
        return f"{bound}: {'met' if goal['met'] else 'NOT met'}"

    seeds = summary["seeds"]
    rows = [
        ("simulated time / wall time", span("realtime_factor"), verdict("realtime_factor")),
        ("wall time / bare steps", span("over_physics"), verdict("over_physics")),
        ("wall time of a mission, s", span("mission_wall_s"), ""),
        ("simulated time / bare steps", span("bare_factor"), ""),
        ("simulated time / processor time", span("realtime_factor", summary["by_cpu"]), "differs from the"),
        (
            "processor time / that of the bare steps",
            span("over_physics", summary["by_cpu"]),
            "values above on a shared core",
        ),
    ]
    title = f"speed of {summary['mission']}, {summary['conditions']}, seeds {seeds[0]}-{seeds[-1]}"
    print_table(title, ("", "median [min, max]", "target"), rows)
    cycles = [
        (name, *(f"{summary[key][p]:.0f}" for p in ("p50", "p99", "max")))
        for name, key in (
            ("whole control cycle", "control_cycle_us"),
            ("Robot.cycle", "robot_cycle_us"),
            ("tick of the tree", "tick_us"),
            ("record", "record_us"),
        )
    ]
    print_table("one control cycle, us", ("", "p50", "p99", "max"), cycles)
    names = {
        "physics": "bare solver steps",
        "robot": "rest of Robot.cycle",
        "tree": "tree: skills, motion, touch, matching",
        "record": "record",
        "rest": "rest of the loop",
    }
    wall = summary["wall_s"]
    parts = [(names[k], f"{s:.2f}", f"{100 * s / wall:.0f} %") for k, s in summary["breakdown_s"].items()]
    parts += [(f"  tree: {k}", f"{s:.2f}", f"{100 * s / wall:.0f} %") for k, s in summary["leaves_s"].items()]
    print_table(f"a mission's {wall:.1f} s, mean", ("", "s", "share"), parts)
    same = "every replay ended in the same state" if summary["same_end_state"] else "a REPLAY ENDED IN ANOTHER STATE"
    EscapingConsole().print(
        f"not counted as wall time: opening {summary['open_s']:.1f} s, report {summary['report_s']:.1f} s\n"
        f"{same}; {summary['succeeded']} of {len(seeds)} missions succeeded\n{folder / 'summary.json'}",
        highlight=False,
        soft_wrap=True,
    )


def print_search(summary: dict[str, Any], folder: Path) -> None:
    """Print a search campaign: objects found at each budget, the paper's figures, errors of the candidates."""

    def rate(r: dict[str, Any]) -> str:
        return f"{100 * r['rate']:.0f} % [{100 * r['lo']:.0f}, {100 * r['hi']:.0f}]"

    def row(name: str, f: dict[str, Any]) -> tuple[str, ...]:
        n = f["mean_discovered"]["1"]["n"]
        means = [_mean(f["mean_discovered"][d]) for d in ("1", "3", "5")]
        return (name, str(n), *means, rate(f["complete"]["3"]), rate(f["complete"]["5"]))

    rows = [row(name, f) for name, f in summary["policies"].items()]
    rows += [row(f"{name}, planar", f) for name, f in summary.get("planar", {}).items()]
    rows += [
        (f"paper, {name}", "100", *(f"{f['mean_discovered'][d]:.2f}" for d in ("1", "3", "5")), "",
         f"{100 * f['complete']['5']:.0f} %")
        for name, f in summary["paper"].items()
    ]  # fmt: skip
    print_table(
        f"objects found of {summary['objects']} after 1, 3, 5 m of travel on n layouts, {summary['conditions']}",
        ("policy", "n", "at 1 m", "at 3 m", "at 5 m", "all at 3 m", "all at 5 m"),
        rows,
    )
    if summary["candidates"]:
        errors = [
            (key, f"{q['median']['value']:.2f}", f"{q['p95']['value']:.2f}", str(q["n"]))
            for key, q in summary["candidates"].items()
            if q["n"]
        ]
        print_table("candidates of the first policy", ("error", "median", "95 %", "n"), errors)
    EscapingConsole().plain(f"{folder / 'summary.json'}")


def print_counts(summary: dict[str, Any], folder: Path) -> None:
    """Print searches with a known and an unknown number of objects, and whether the stated chances are right."""

    def percent(r: dict[str, Any], key: str = "rate") -> str:
        return f"{100 * r[key]:.1f} % [{100 * r['lo']:.1f}, {100 * r['hi']:.1f}]"

    rows = [
        (f"{c} number", percent(summary[c]["success"]), _mean(summary[c]["travel_m"])) for c in ("known", "unknown")
    ]
    print_table(f"searches of {summary['layouts']} random planar layouts", ("", "all found", "travel, m"), rows)
    left, stated = summary["left"], summary["stated"]
    figures = [
        ("ended with something left", percent(left["share"])),
        ("mean stated chance then", percent(left["stated"], "mean")),
        ("calibration error of all stated chances", percent(stated["calibration"], "value")),
        ("Brier score of all stated chances", "{mean:.3f} [{lo:.3f}, {hi:.3f}]".format_map(stated["brier"])),
    ]
    print_table("chance that something is left", ("", "value"), figures)
    EscapingConsole().plain(f"{folder / 'summary.json'}")


def print_contact(summary: dict[str, Any], folder: Path) -> None:
    """Print a contact campaign: errors of probe and bare gripper, the paper's figures, squares not traced."""
    from glotouch_bt.bench.contact import METRICS, TOOLS

    def traced(r: dict[str, Any]) -> str:
        return f"{r['rate'] * r['n']:.0f}/{r['n']}" if r["n"] else "0/0"

    head: list[str] = ["mean [95 %]"]
    columns = []
    for tool in TOOLS:
        head += [tool, "paper", "free"]
        columns.append((summary[tool], summary["paper"][tool], summary["free"][tool]))
    rows = [
        (metric, *(c for fixed, paper, free in columns
                   for c in (_mean(fixed.get(metric)), f"{paper[metric]:.2f}", _mean(free.get(metric)))))
        for metric in METRICS
    ]  # fmt: skip
    rows.append(
        ("traced", *(c for fixed, _, free in columns for c in (traced(fixed["traced"]), "", traced(free["traced"]))))
    )
    seeds = summary["seeds"]
    title = f"calibration square, {summary['conditions']}, seeds {seeds[0]}-{seeds[-1]}, "
    print_table(title + f"{summary['contacts_per_side']} contacts per side", head, rows)
    if summary["not_traced"]:
        print_table("not traced", ("trial and cause",), [(c,) for c in summary["not_traced"]])
    EscapingConsole().plain(f"{folder / 'summary.json'}")


def print_match(summary: dict[str, Any], folder: Path) -> None:
    """Print a matching campaign: Top-1 and the paper's figures, acceptance, losses, calibration, closures."""

    def rate(r: dict[str, Any]) -> str:
        return f"{100 * r['rate']:.1f} [{100 * r['lo']:.0f}, {100 * r['hi']:.0f}]" if r["n"] else "-"

    def both(r: dict[str, Any]) -> str:
        b = r["by_layout"]
        return f"{rate(r)} ({100 * b['lo']:.0f}, {100 * b['hi']:.0f})" if r["n"] else "-"

    def value(x: float | None, digits: int = 3) -> str:
        return "-" if x is None else f"{x:.{digits}f}"

    found, paper = summary["methods"], summary["paper"]
    top1 = [
        (n, both(f["row_top1"]), f"{100 * paper[n]['row_top1']:.1f}" if n in paper else "", both(f["col_top1"]))
        for n, f in found.items()
    ]
    title = f"{summary['layouts']} layouts, {summary['conditions']}: Top-1 % [Wilson 95 %] (95 % over layouts)"
    print_table(title, ("", "row", "paper's row", "column"), top1)
    print_table(
        "accepted, % [Wilson 95 %]",
        ("", "present, right", "present, wrong", "absent", "stranger"),
        [
            (n, *(rate(f[k]) for k in ("right_and_accepted", "wrong_and_accepted", "absent_lifted", "stranger_lifted")))
            for n, f in found.items()
        ],
    )
    for name, title in (("no_twin", "without a twin"), ("twin", "with a twin")):
        if any(f["apart"]["twin"]["right_and_accepted"]["n"] for f in found.values()):
            print_table(
                f"of these, targets {title} in the box",
                ("", "present, right", "present, wrong", "absent"),
                [(n, *(rate(r) for r in f["apart"][name].values())) for n, f in found.items()],
            )
    apart = [
        (n, value(f["margin"]["mean"], 2), value(f["ece"]["value"]),
         *(value(f[against].get(by, {}).get("value")) for against in ("auroc", "auroc_absent")
           for by in ("probability", "loss")))
        for n, f in found.items()
    ]  # fmt: skip
    against = f"strangers {', '.join(summary['strangers'])}" if summary["strangers"] else "absent targets"
    print_table(
        f"margin, calibration, AUROC (by p, by loss) against {against}, and against absent targets",
        ("", "margin", "ECE", "AUROC p", "loss", "absent p", "loss"),
        apart,
    )
    timing = summary["timing"]
    cost = [
        (n, *(value(f[k][q]["value"], 1) for k in ("position_error_mm", "yaw_error_deg") for q in ("median", "p95")),
         value(timing.get("pair_ms", {}).get(n), 1), value(timing.get("pair_cpu_ms", {}).get(n), 1))
        for n, f in found.items()
    ]  # fmt: skip
    print_table(
        "fitted pose of the right candidate, cost",
        ("", "mm median", "95 %", "deg median", "95 %", "ms per pair", "of processor"),
        cost,
    )
    names = summary["loss_matrix"]["objects"]
    matrix = summary["loss_matrix"][summary["head"]]
    losses = [(n, *(value(v, 2) for v in line)) for n, line in zip(names, matrix, strict=True)]
    print_table(f"mean loss of {summary['head']}: rows target STL, columns touched object", ("", *names), losses)
    if summary["closures_to_confidence"]:
        counts = [
            (order, f"{c['closures']['mean']:.1f} [{c['closures']['lo']:.1f}, {c['closures']['hi']:.1f}]",
             value(c["median"], 0), value(c["share_of_recorded"]["mean"], 2), rate(c["right"]),
             rate(c["confident_and_wrong"]), rate(c["absent_taken"]))
            for order, c in summary["closures_to_confidence"].items()
        ]  # fmt: skip
        print_table(
            "closures in the whole box until a match with P > 0.95",
            ("order", "closures", "median", "share", "right %", "confident and wrong %", "absent target taken %"),
            counts,
        )
    cost_of_stl = (
        f"a new STL takes {value(timing.get('new_stl_s'), 2)} s ({value(timing.get('new_stl_cpu_s'), 2)} s cpu), "
        f"a cached one {value(timing.get('load_stl_ms'), 0)} ms"
    )
    felt = f"{summary['touched']} of {summary['objects']} objects touched, {summary['nameless']} false candidates"
    EscapingConsole().plain(f"{cost_of_stl}\n{felt}\n{folder / 'summary.json'}")
