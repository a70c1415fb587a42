# SPDX-License-Identifier: Apache-2.0
"""Leaves out what attenuates far more than most of the patient: metal."""
from typing import Annotated

import marrow
import numpy as np

DARKEST = 0.005  # of the brightest pixel: what is darker holds noise alone
AIR = 0.5  # line integrals below are air, and clothes


@marrow.node("mask.new_node", summary="Leaves out the pixels whose line integral is far above the patient's median")
def new_node(
    view: marrow.View,
    *,
    above: Annotated[float, marrow.at_least(0), "line integral of metal, above the patient's median"] = 1.2,
) -> marrow.View:
    grey = view.image.array.astype(float)
    if grey.size == 0 or not np.isfinite(grey).all() or np.ptp(grey) == 0:
        raise marrow.Error("expected an image of finite pixels that are not all the same; give another one")
    line_integral = -np.log(np.maximum(grey / grey.max(), DARKEST))
    patient = line_integral[line_integral > AIR]
    usual = np.median(patient) if patient.size else 0
    mask = np.where(line_integral > usual + above, 0, 255).astype(np.uint8)
    if view.mask is not None:
        mask[view.mask == 0] = 0
    return marrow.View(view.image, view.camera, name=view.name, mask=mask)
