"""SVG elements: scales, ticks, axes, polylines. Colours are CSS variables of the page."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class AxisScale:
    """A linear map of values `low`..`high` to pixels `start`..`end`."""

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Return the pixels of values of any shape."""
        span = self.high - self.low or 1.0
        return self.start + (np.asarray(value, dtype=np.float64) - self.low) / span * (self.end - self.start)

    def at(self, value: float) -> float:
        """Return the pixel of one value."""
        return float(self(value))

    def ticks(self, about: int = 6) -> list[float]:
        """Return about `about` round values inside the range."""
        span = self.high - self.low
        if not (span > 0 and math.isfinite(span)):
            return [self.low]
        raw = span / about
        power = 10.0 ** math.floor(math.log10(raw))
        step = next(m * power for m in (1, 2, 5, 10) if m * power >= raw * 0.999)
        first = math.ceil(self.low / step - 1e-9)
        last = math.floor(self.high / step + 1e-9)
        return [k * step for k in range(first, last + 1)]


def points(x: npt.ArrayLike, y: npt.ArrayLike) -> str:
    """Return the `points` attribute of pixel coordinates, to a tenth of a pixel."""
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(np.ravel(x).tolist(), np.ravel(y).tolist(), strict=True))


def polyline(x: npt.ArrayLike, y: npt.ArrayLike, style: str, closed: bool = False) -> str:
    """Return a line through pixel coordinates."""
    name = "polygon" if closed else "polyline"
    return f'<{name} points="{points(x, y)}" style="{style}"/>'


def label(x: float, y: float, text: str, css: str = "") -> str:
    """Return a label at a pixel; `text` is escaped already."""
    return f'<text x="{x:.1f}" y="{y:.1f}"' + (f' class="{css}"' if css else "") + f">{text}</text>"


def tick_text(value: float) -> str:
    """Format a tick without rounding noise."""
    return f"{value:.10g}".replace("-", "−")


def x_axis(scale: AxisScale, top: float, bottom: float, title: str, about: int = 9) -> str:
    """Return grid lines, tick labels and the title below a chart."""
    out = []
    for t in scale.ticks(about):
        x = scale.at(t)
        out.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{top:.1f}" y2="{bottom:.1f}" class="grid"/>')
        out.append(label(x, bottom + 16, tick_text(t), "m"))
    if title:
        out.append(label(scale.end, bottom + 32, title, "e"))
    return "".join(out)


def y_axis(scale: AxisScale, left: float, right: float, title: str, about: int = 5) -> str:
    """Return grid lines, tick labels and the title above a chart."""
    out = []
    for t in scale.ticks(about):
        y = scale.at(t)
        out.append(f'<line x1="{left:.1f}" x2="{right:.1f}" y1="{y:.1f}" y2="{y:.1f}" class="grid"/>')
        out.append(label(left - 8, y + 4, tick_text(t), "e"))
    if title:
        out.append(label(left, min(scale.start, scale.end) - 10, title))
    return "".join(out)


def picture(width: float, height: float, body: str, title: str) -> str:
    """Return a picture as wide as its column; a narrow page scrolls it.

    `title` (escaped already) is for screen readers.
    """
    drawn = f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{title}">{body}</svg>'
    return f'<div class="wide">{drawn}</div>'
