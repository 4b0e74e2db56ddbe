"""Machine code for small numerical loops."""

from glotouch_bt.compiled.functions import compiled
