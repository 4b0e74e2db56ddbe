"""Read YAML into nodes, parameters, worlds and conditions. Faults become findings with places; nothing is run."""

from glotouch_bt.mission.read.fields import limits_of, needed_by, unit_of, validate
from glotouch_bt.mission.read.library import (
    RESUME_CHECK_GROUP,
    SkillRegistry,
    find_shipped,
    shipped,
    shipped_root,
    shown,
)
from glotouch_bt.mission.read.parameters import (
    Declaration,
    Parameter,
    Value,
    check_used,
    from_command_line,
    read_parameters,
    resolved,
    substitute,
)
from glotouch_bt.mission.read.parse import parse_tree
from glotouch_bt.mission.read.scope import Reading, Scope
from glotouch_bt.mission.read.subtrees import entries_of
from glotouch_bt.mission.read.worlds import (
    WorldFile,
    conditions_name,
    conditions_of,
    load_conditions,
    load_world,
    read_world,
    split_conditions,
)
from glotouch_bt.mission.read.yaml_source import MAX_BYTES, Unreadable, parse_yaml, read_named_yaml, read_yaml
