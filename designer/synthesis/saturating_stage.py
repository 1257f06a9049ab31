"""The saturating dead zone (Fig. 5, Eq. (17)-(20)), two-sided or one-sided: its formulas.

    fv = -R210 (v11/R208 + v12/R209),  v12 = -A- v1,  A- = R207/R206,  A+ = R201 R203/(R200 R202)
    v11/R208 = clip(A+ v1 + c, ± Esat)/Rt,  Rt = R204 + R208 + R204 R208/R205 (the loaded divider)

One-sided, c = A+ (R200/R211) supply makes U3C reach its limit at the stop alone, and R212 takes
c/Rt out again. The errors count as docs/definitions.md says: the stop slope as a logarithm, the
null and the bias in units of K1.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from designer.base.arrays import Array
from designer.synthesis.dead_zone_target import DeadZoneTarget, outside


def errors(target: DeadZoneTarget, values: Mapping[str, float]) -> dict[str, float]:
    """The errors of finished values, from the formulas above."""
    v = {name: np.asarray(value) for name, value in values.items()}
    per_ohm = v["R207"] / v["R206"] / v["R209"]
    total = float(per_ohm * v["R210"] / v["R50"])
    out = {
        "stop slope": outside(total, target.slope),
        "dead-zone null": float(target.mu * np.log(steep(v) / through(v) / per_ohm)),
    }
    if target.sides != "both":
        out["dead-zone bias"] = float(bias(target, v, per_ohm))
    return out


def threshold(target: DeadZoneTarget, values: Mapping[str, float]) -> float:
    """v1 at the stop [V]: (Esat - c)/A+."""
    v = {name: np.asarray(value) for name, value in values.items()}
    shift = np.asarray(0.0)
    if target.sides != "both":
        shift = steep(v) * target.supply * v["R200"] / v["R211"]
    return float((target.saturation - shift) / steep(v))


def steep(v: Mapping[str, Array]) -> Array:
    """A+."""
    return v["R201"] * v["R203"] / (v["R200"] * v["R202"])


def through(v: Mapping[str, Array]) -> Array:
    """Rt [ohm]."""
    return v["R204"] + v["R208"] + v["R204"] * v["R208"] / v["R205"]


def bias(target: DeadZoneTarget, v: Mapping[str, Array], per_ohm: Array) -> Array:
    """mu (leftover current)/(A-/R209 · threshold): the constant force in units of K1 times b."""
    shift = steep(v) * target.supply * v["R200"] / v["R211"]
    threshold = (target.saturation - shift) / steep(v)
    left = shift / through(v) - target.supply / v["R212"]
    # A shift as large as the range leaves no threshold: such rows are no choice, whatever is left.
    return np.asarray(target.mu * left / (per_ohm * np.maximum(threshold, 1e-12)))


def quiet(v: Mapping[str, Array]) -> Array:
    """What R208 and the divider behind it are from U3D's summing node to ground [ohm]."""
    return np.asarray(v["R208"] + v["R204"] * v["R205"] / (v["R204"] + v["R205"]))
