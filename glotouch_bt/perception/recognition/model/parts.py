"""Conversion of a TargetModel to plain numbers and arrays, and back, for caches."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from glotouch_bt.perception.recognition.model.outline import KindFit, Outline
from glotouch_bt.perception.recognition.model.pads import Array32, PadSpec
from glotouch_bt.perception.recognition.model.section import LEVELS_M, TargetSection
from glotouch_bt.perception.recognition.model.target import TargetModel
from glotouch_bt.robot import ParamError

VERSION = 6
"""Version of the tables; increase it when a table's meaning or computation changes."""
_NUMBERS = ("height_m", "rho", "rho_sd", "normal_dispersion", "anisotropy")


def to_parts(model: TargetModel) -> tuple[dict[str, Any], dict[str, Array32]]:
    """Return the JSON-compatible facts and the tables by name; build missing image tables."""
    facts = {
        "version": VERSION,
        "digest": model.digest,
        "pad": asdict(model.pad),
        "phi_rad": model.phi_rad.tolist(),
        "l_m": model.l_m.tolist(),
        "z_m": model.z_m.tolist(),
        "centre_m": model.centre_m.tolist(),
        "tops_m": model.tops_m.tolist(),
        "outlines": [_outline_facts(o) for o in (model.outline, *model.components)],
        **{name: getattr(model, name) for name in _NUMBERS},
    }
    arrays = {
        "reach_m": model.reach_m,
        "fine_m": model.fine_m,
        "images": model.images_by_place,
    }
    if model.section is not None:
        arrays["section"] = model.section.table
    return facts, arrays


def from_parts(name: str, facts: Mapping[str, Any], arrays: Mapping[str, Array32]) -> TargetModel:
    """Rebuild the model.

    Raises:
        ParamError: Another version, or inconsistent facts or tables.
    """
    if facts.get("version") != VERSION:
        raise ParamError("model version", facts.get("version"), f"{VERSION}")
    try:
        given: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in facts["pad"].items()}
        pad = PadSpec(**given)
        phi, l, z = (np.array(facts[k], dtype=np.float64) for k in ("phi_rad", "l_m", "z_m"))
        shape = (len(phi), len(l), len(z))
        expected = {"reach_m": shape, "images": (len(z), len(l), 35, len(phi))}
        for key, s in expected.items():
            if arrays[key].shape != s:
                raise ParamError(f"table {key}", arrays[key].shape, f"{s}")
        section = arrays.get("section")
        if section is not None and (section.ndim != 4 or section.shape[::3] != (len(LEVELS_M), 3)):
            raise ParamError("table section", section.shape, f"({len(LEVELS_M)}, n, n, 3)")
        outline, *components = (
            Outline(_fit(o["as_round"]), _fit(o["as_box"]), float(o["p_box"])) for o in facts["outlines"]
        )
        numbers = {k: float(facts[k]) for k in _NUMBERS}
        return TargetModel(
            name=name, digest=str(facts["digest"]), pad=pad, phi_rad=phi, l_m=l, z_m=z, reach_m=arrays["reach_m"],
            fine_m=arrays["fine_m"], outline=outline, components=tuple(components),
            centre_m=np.array(facts["centre_m"], dtype=np.float64), tops_m=np.array(facts["tops_m"], dtype=np.float64),
            section=None if section is None else TargetSection(section),
            sides=(), certainty=None, mesh=None, **numbers, _lazy={"images": arrays["images"]},
        )  # fmt: skip
    except (KeyError, TypeError, ValueError) as e:
        raise ParamError("model parts", type(e).__name__, "complete") from e


def _outline_facts(outline: Outline) -> dict[str, Any]:
    return {"as_round": _fit_facts(outline.as_round), "as_box": _fit_facts(outline.as_box), "p_box": outline.p_box}


def _fit_facts(fit: KindFit) -> dict[str, Any]:
    return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in asdict(fit).items()}


def _fit(facts: Mapping[str, Any]) -> KindFit:
    return KindFit(
        np.array(facts["centre_m"], dtype=np.float64), float(facts["centre_sd_m"]),
        (float(facts["size_m"][0]), float(facts["size_m"][1])),
        (float(facts["size_sd_m"][0]), float(facts["size_sd_m"][1])),
        (float(facts["fit_sd_m"][0]), float(facts["fit_sd_m"][1])), int(facts["contacts"]),
        float(facts["yaw_rad"]), float(facts["yaw_sd_rad"]),
    )  # fmt: skip
