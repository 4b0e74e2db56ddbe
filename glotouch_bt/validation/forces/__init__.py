"""`bench forces`: the true peak force, false successes and lost results when several faults come together."""

from glotouch_bt.validation.forces.campaign import ForceCampaign, run_campaign
from glotouch_bt.validation.forces.following import chosen_joints, chosen_moments, matrix, scene_of
from glotouch_bt.validation.forces.scenes import PLACE_PARAMETERS, block_scene
