"""A gymnasium environment over the robot interface; it needs the extra `gym`: see docs/guides/gymnasium.md."""

try:
    import gymnasium
except ImportError as e:
    raise ImportError("glotouch_bt.environment needs gymnasium: in a checkout, pip install -e '.[gym]'") from e

from glotouch_bt.environment.spaces import ACTION_KEYS, OBSERVATION_KEYS
from glotouch_bt.environment.touch_env import TouchEnv, Transition

gymnasium.register(id="glotouch/Touch-v0", entry_point=TouchEnv)
