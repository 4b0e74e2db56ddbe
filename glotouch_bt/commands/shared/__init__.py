"""Shared by several commands: options, error messages and exit codes, JSON output, parts of experiments."""

from glotouch_bt.commands.shared.errors import guarded, set_debug, showing_tracebacks
from glotouch_bt.commands.shared.experiments import Executors, print_summary, progress, put_few_in_box, run_in_pool
from glotouch_bt.commands.shared.live import live_page, live_tree, shown_on, wait_for_viewers
from glotouch_bt.commands.shared.options import (
    TRIAL_LIMIT_S,
    AllowPaths,
    Backend,
    BackendSettings,
    BenchFolder,
    Cluster,
    Conditions,
    FewObjects,
    FirstSeed,
    Groot2,
    Json,
    KeepTrials,
    Live,
    MissionName,
    MissionSettings,
    NoBrowser,
    Objects,
    Port,
    RunFolderArgument,
    SetConditions,
    Settings,
    ShardName,
    SummaryJson,
    TrialLimit,
    Trials,
    Workers,
    WorldName,
    bench_folder,
    changed_conditions,
    check_names,
    check_parameters,
    check_run,
    read_settings,
    read_shard,
    with_bare_values,
)
from glotouch_bt.commands.shared.output import print_json, styled_streams
