"""Temporary stand-in for touch.believe_outline: periodic GP of the polar distance of the offset outline."""

from __future__ import annotations

import numpy as np

from glotouch_bt.robot import Array
from glotouch_bt.touch import Contour, fit_contour


class OutlineBelief:
    def __init__(self, tips: Array, radius: float, approach_K: Array, reaction_K: Array) -> None:
        self._tips, self._r = tips, radius
        u = approach_K[0] / np.linalg.norm(approach_K[0])
        c = tips[0] + 0.030 * u if len(tips) < 3 else tips.mean(axis=0)
        if len(tips) == 2:
            c = tips.mean(axis=0) + 0.02 * (u + approach_K[1]) / 2
        self.contour = (
            fit_contour(tips, radius)
            if len(tips) >= 3
            else Contour("round", c, (0.055, 0.055), 0.0, 0.0, np.zeros(len(tips)))
        )
        if len(tips) >= 3:
            c = self.contour.centre_K_m
        self.centre_K_m = c
        d = tips - c
        self._a, self._y = np.arctan2(d[:, 1], d[:, 0]), np.hypot(d[:, 0], d[:, 1])
        self._m = float(self._y.mean()) if len(tips) > 2 else 0.034
        K = self._k(self._a, self._a) + np.eye(len(tips)) * 0.0005**2
        self._L = np.linalg.inv(K)
        self._w = self._L @ (self._y - self._m)
        b = np.linspace(-np.pi, np.pi, 36, endpoint=False)
        sd = self.predict(b)[1]
        self.centre_sd_m = float(np.sqrt(np.mean(sd**2) / 6))

    def _k(self, a: Array, b: Array) -> Array:
        d = a[:, None] - b[None]
        return np.asarray(0.010**2 * (0.25 + 0.75 * np.exp(-2 * np.sin(d / 2) ** 2 / 0.8**2)))

    def predict(self, bearing_rad: Array) -> tuple[Array, Array]:
        k = self._k(np.asarray(bearing_rad), self._a)
        mean = self._m + k @ self._w
        var = 0.010**2 - np.einsum("ij,jk,ik->i", k, self._L, k)
        return np.maximum(mean, 0.012), np.sqrt(np.maximum(var, 1e-8))

    def belongs(self, tip: Array) -> bool:
        d = tip - self.centre_K_m
        m, s = self.predict(np.array([np.arctan2(d[1], d[0])]))
        return bool(abs(np.hypot(*d) - m[0]) < 3.5 * s[0] + 0.006)


def believe_outline(
    tips: Array, radius: float, *, approach_K: Array, reaction_K: Array, free_K_m: Array
) -> OutlineBelief:
    return OutlineBelief(tips, radius, approach_K, reaction_K)
