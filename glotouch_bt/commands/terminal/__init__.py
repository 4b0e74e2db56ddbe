"""What commands share on the terminal: errors and exit codes, findings, the operator's keys, the end of a run."""

from typing import TYPE_CHECKING

from glotouch_bt.commands.terminal.errors import guarded, set_debug
from glotouch_bt.lazy import lazy_door

if TYPE_CHECKING:
    from glotouch_bt.commands.terminal.findings import print_findings, texts_of
    from glotouch_bt.commands.terminal.operator import Operator, operated
    from glotouch_bt.commands.terminal.run_end import tell_end

__getattr__ = lazy_door(
    __name__,
    print_findings="findings",
    texts_of="findings",
    Operator="operator",
    operated="operator",
    tell_end="run_end",
)

__all__ = ["Operator", "guarded", "operated", "print_findings", "set_debug", "tell_end", "texts_of"]
