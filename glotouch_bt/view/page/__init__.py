"""The page in the browser: it draws states of a mission, in 3D and in panels, and sends requests. It reads no file."""

from glotouch_bt.view.page.mission_page import AT_END, AT_START, MissionControls, Page
