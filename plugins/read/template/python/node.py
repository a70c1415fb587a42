# SPDX-License-Identifier: Apache-2.0
"""A pose whose file may give its shift in another unit, such as metres. It shows how a node in Python uses one in C++,
which reads the file and says what is wrong with it."""
import pathlib
from typing import Annotated

import marrow
import numpy as np


@marrow.node("read.new_node", summary="A pose from a file whose shift may be in another unit than mm")
def new_node(
    *,
    path: Annotated[pathlib.Path, "pose file of marrow, or a transform of ITK and 3D Slicer"],
    unit_mm: Annotated[float, marrow.at_least(1e-6), "how many mm the unit of the shift has; 1000 for metres"] = 1,
) -> Annotated[marrow.Pose, marrow.named("pose")]:
    read = marrow.read.pose(path=path)
    matrix = np.array(read.matrix)
    matrix[:3, 3] *= unit_mm
    return marrow.Pose(matrix, target=read.target, source=read.source, axes_of=read)
