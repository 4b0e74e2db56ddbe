"""TODO door of glotouch_bt/commands/terminal."""

from glotouch_bt.commands.terminal.errors import guarded, set_debug
from glotouch_bt.commands.terminal.findings import print_findings, texts_of
from glotouch_bt.commands.terminal.operator import Operator, operated
from glotouch_bt.commands.terminal.run_end import tell_end

__all__ = ["Operator", "guarded", "operated", "print_findings", "set_debug", "tell_end", "texts_of"]
