"""`glotouch bench all`: every figure that the documentation claims."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from glotouch_bt.commands import shared

if TYPE_CHECKING:
    from collections.abc import Mapping

    from glotouch_bt.claims import Claim, ClaimEnd


@shared.guarded
def all_(
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="folder of the figures; the same command continues it")
    ] = None,
    only: Annotated[str, typer.Option(metavar="NAME,...", help="only these figures (default: all)")] = "",
    scale: Annotated[
        float, typer.Option(help="factor of the numbers of trials, at most 1; a small one tries the commands")
    ] = 1.0,
    workers: Annotated[int | None, typer.Option(min=1, help="worker processes of each command")] = None,
    cluster: shared.Cluster = None,
    list_: Annotated[
        bool, typer.Option("--list", help="run nothing; list the figures in their order, with the expected wall time")
    ] = False,
    collect: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="run nothing; copy the summaries of --out into docs/results of a clone"),
    ] = None,
    table: Annotated[Path | None, typer.Option(metavar="FILE", help="another table of figures (YAML)")] = None,
    json_: shared.Json = False,
) -> int:
    """Every figure of the documentation, on the present code, one command after another.

    Ctrl-C keeps what is done. Exit code 1: a command had no result.
    """
    from glotouch_bt.campaign import commit_of_source
    from glotouch_bt.claims import chosen, read_claims, run_claims
    from glotouch_bt.claims import collect as copy_summaries
    from glotouch_bt.commands.terminal import minutes
    from glotouch_bt.robot import BadInput

    claims = read_claims(table)
    if collect is not None:
        if out is None:
            raise BadInput("--collect: give the folder of the figures with --out DIR")
        copied, missing = copy_summaries(claims, out, collect)
        sys.stdout.write(f"copied to {collect}: {', '.join(copied)}\n")
        sys.stdout.write(f"not measured yet: {', '.join(missing)}\n" if missing else "")
        return 0
    wanted = chosen(claims, [name.strip() for name in only.split(",") if name.strip()])
    if list_:
        _list(wanted, out, scale, json_)
        return 0
    if out is None:
        raise BadInput("give the folder of the figures with --out DIR (--list shows them); the same folder continues")
    words = [
        w for option, v in (("--workers", workers), ("--cluster", cluster)) if v is not None for w in (option, str(v))
    ]
    expected = sum(c.minutes for c in wanted.values())
    sys.stderr.write(f"{len(wanted)} figures of {commit_of_source()}; ")
    sys.stderr.write(f"about {minutes(expected * scale)} on two cores\n")
    numbers = {name: n for n, name in enumerate(wanted, 1)}

    def on_start(name: str, line: str) -> None:
        sys.stderr.write(f"[{numbers[name]}/{len(wanted)}] {name}: {line}\n")

    def on_end(end: ClaimEnd) -> None:
        how = f"FAILED: {end.failed}" if end.failed else "was done before" if end.before else "done"
        sys.stderr.write(f"[{numbers[end.name]}/{len(wanted)}] {end.name}: {how} ({minutes(end.wall_s / 60)})\n")

    outcomes = run_claims(wanted, out, scale=scale, more=_options(), words=words, on_start=on_start, on_end=on_end)
    if json_:
        shared.print_json({o.name: {"failed": o.failed, "wall_s": round(o.wall_s, 1)} for o in outcomes})
    failed = [o.name for o in outcomes if o.failed]
    if failed:
        sys.stderr.write(f"without a result: {', '.join(failed)}; the same command tries them again\n")
    return int(bool(failed))


def _options() -> dict[str, set[str]]:
    """Return the options of each bench."""
    from glotouch_bt.commands.bench import bench

    group = typer.main.get_command(bench)
    return {name: {o for p in c.params for o in p.opts} for name, c in vars(group)["commands"].items()}


def _list(claims: Mapping[str, Claim], out: Path | None, scale: float, json_: bool) -> None:
    from glotouch_bt.claims import finished
    from glotouch_bt.commands.terminal import print_claims

    rows = [
        {
            "name": name,
            "title": claim.title,
            "minutes": round(claim.minutes * scale, 1),
            "done": out is not None and finished(out, name) is not None,
            "parts": list(claim.parts),
            "commands": list(claim.lines(scale)),
        }
        for name, claim in claims.items()
    ]
    if json_:
        shared.print_json(rows)
    else:
        print_claims(rows)
