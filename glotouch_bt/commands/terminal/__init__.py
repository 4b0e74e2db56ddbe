"""Terminal output of the commands: progress, findings, tables, the end of a run. Import it when something is printed.

Nothing here computes; the module of a table takes the summary that an experiment wrote.
"""

from glotouch_bt.commands.terminal.bench_tables import (
    print_contact,
    print_counts,
    print_growth,
    print_match,
    print_retrieve,
    print_robustness,
    print_search,
    print_speed,
)
from glotouch_bt.commands.terminal.campaign_progress import CampaignProgress
from glotouch_bt.commands.terminal.claim_tables import minutes, print_claims
from glotouch_bt.commands.terminal.comparison_tables import print_comparison
from glotouch_bt.commands.terminal.console import (
    EscapingConsole,
    print_error,
    print_settings,
    print_skill,
    print_skills,
    print_table,
)
from glotouch_bt.commands.terminal.fault_tables import print_exhaustive, print_faults
from glotouch_bt.commands.terminal.findings import print_findings, texts_of
from glotouch_bt.commands.terminal.force_tables import print_forces
from glotouch_bt.commands.terminal.object_tables import print_objects
from glotouch_bt.commands.terminal.progress import RunProgress
from glotouch_bt.commands.terminal.run_end import print_end
from glotouch_bt.commands.terminal.space_tables import print_space
