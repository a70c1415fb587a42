# SPDX-License-Identifier: Apache-2.0
"""What the studies of real implants share: poses, surfaces, and how far one pose is from another."""
import numpy as np
import yaml
from scipy.spatial.transform import Rotation


def read(file):
    """The matrix of a pose, and its file."""
    document = yaml.safe_load(file.read_text())
    return np.array(document["matrix"]), document


def middle_of(surface):
    """The mean of the corners of an STL's triangles, in mm."""
    data = surface.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    if len(data) != 84 + 50 * count:
        corners = [line.split()[1:] for line in data.decode().splitlines() if line.strip().startswith("vertex")]
        return np.array(corners, float).mean(axis=0)
    layout = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    return np.frombuffer(data[84:], layout, count)["corners"].reshape(-1, 3).mean(axis=0)


def difference(found, reference, middle):
    """The rotation vector in degrees and the shift of the surface's middle in mm, both in the world."""
    turn = Rotation.from_matrix(found[:3, :3] @ reference[:3, :3].T).as_rotvec(degrees=True)
    return turn, (found[:3] - reference[:3]) @ np.append(middle, 1)
