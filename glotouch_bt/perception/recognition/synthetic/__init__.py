"""Simulated pad images and patch statistics of a mesh's side images."""

from glotouch_bt.perception.recognition.synthetic.touches import pooled_images, simulated_statistics, touch_windows
