"""TODO door of glotouch_bt/perception/recognition/synthetic."""

from glotouch_bt.perception.recognition.synthetic.touches import pooled_images, simulated_statistics, touch_windows

__all__ = ["pooled_images", "simulated_statistics", "touch_windows"]
