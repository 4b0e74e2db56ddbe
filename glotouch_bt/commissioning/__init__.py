"""Before the first mission: keys, the doctor, the registration of the container, and the timing of the link."""

from glotouch_bt.commissioning.doctor import DoctorFinding, nearly_empty, run_doctor
from glotouch_bt.commissioning.keys import write_keys
from glotouch_bt.commissioning.link import LinkStudy, run_study
