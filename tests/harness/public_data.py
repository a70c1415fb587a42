# SPDX-License-Identifier: Apache-2.0
"""Files in the layouts of public data sets (docs/public-data.md), made of simulated cases."""
import re
import zlib

import numpy as np
import yaml

SPECIMENS = ("17-1882", "18-1109", "18-0725")
FLIP = np.diag([-1.0, 1, -1, 1])  # to a camera that sees the image from the detector and looks along -z


def values_of(path):
    """The values of a compressed MetaImage, [z, y, x], and its spacing and origin."""
    data = path.read_bytes()
    head = re.match(rb"(?s)(.*?ElementDataFile = LOCAL\n)", data).group(1).decode()
    told = dict(line.split(" = ") for line in head.splitlines())
    numbers = lambda name: np.array(told[name].split(), float)
    kind = {"MET_SHORT": "<i2", "MET_FLOAT": "<f4"}[told["ElementType"]]
    values = np.frombuffer(zlib.decompress(data[len(head) :]), kind)
    return values.reshape(numbers("DimSize").astype(int)[::-1]), numbers("ElementSpacing"), numbers("Offset")


def moved(pose, points):
    return points @ pose[:3, :3].T + pose[:3, 3]


def label_of(ct, seeds, least_hu=250):
    """The bone that holds the seeds: bright voxels, with what they enclose in slices."""
    from scipy import ndimage

    parts, _ = ndimage.label(ct >= least_hu)
    wanted = {parts[z, y, x] for x, y, z in np.rint(seeds).astype(int)} - {0}
    inside = np.isin(parts, list(wanted))
    return np.array([ndimage.binary_fill_holes(part) for part in inside])


def spread_points(inside, count=14):
    """Voxels of a region that are far from each other, [x, y, z]."""
    places = np.argwhere(inside)[:, ::-1].astype(float)
    chosen = [places[0]]
    for _ in range(count - 1):
        distance = np.min([np.linalg.norm(places - one, axis=1) for one in chosen], axis=0)
        chosen.append(places[np.argmax(distance)])
    return np.array(chosen)


# What may be wrong with such a file, each alone. The first group changes matrices, the second the marks in the images.
MATRICES = {
    "extrinsic": lambda extrinsic, pose, k: (np.linalg.inv(extrinsic), pose, k),
    "pose": lambda extrinsic, pose, k: (extrinsic, np.linalg.inv(pose), k),
    "reflected": lambda extrinsic, pose, k: (np.diag([1.0, 1, -1, 1]) @ extrinsic, pose, k),
    "forward": lambda extrinsic, pose, k: (np.diag([1.0, -1, -1, 1]) @ extrinsic, pose, k),
    "focal_length": lambda extrinsic, pose, k: (extrinsic, pose, k * [[-1, 1, 1], [1, 1, 1], [1, 1, 1]]),
}
MARKS = {
    "columns": lambda pixel, size: (size[0] - 1 - pixel[0], pixel[1]),
    "rows": lambda pixel, size: (pixel[0], size[1] - 1 - pixel[1]),
    "exchanged": lambda pixel, size: (pixel[1], pixel[0]),
}
POINTS = {"ras": np.array([-1.0, -1, 1]), "z": np.array([1.0, 1, -1]), "metres": np.array([1e-3] * 3)}


def deepfluoro_file(cases, path, bone="pelvis", wrong=None):
    """Simulated cases as the specimens of a DeepFluoro file: images are seen from the detector, the camera looks along
    -z, and poses map from the camera's world, which is turned, to the bone's CT. `wrong`: one of MATRICES, MARKS and
    POINTS."""
    import h5py
    from PIL import Image

    label_name = {"pelvis": "Left-hemipelvis", "left-femur": "Left Femur", "right-femur": "Right Femur"}[bone]
    extrinsic = np.array([[0, -1, 0, 3], [1, 0, 0, -5], [0, 0, 1, 7], [0, 0, 0, 1]], float)
    with h5py.File(path, "w") as file:
        for name, case in zip(SPECIMENS, cases):
            told = yaml.safe_load((case / "case.yaml").read_text())
            (fragment,) = told["fragments"].values()
            ct, spacing, origin = values_of(case / "ct.mha")
            inside = label_of(ct, (np.array(fragment["seeds"]) - origin) / spacing)
            specimen = file.create_group(name)
            for key, value in (
                ("pixels", ct),
                ("spacing", spacing[:, None]),
                ("origin", origin),
                ("dir-mat", np.eye(3)),
            ):
                specimen["vol/" + key] = value
            specimen["vol-seg/image/pixels"] = np.where(inside, 5, 0).astype("u1")
            specimen["vol-seg/labels-def/5"], specimen["vol-seg/labels-def/9"] = label_name, "something else"
            landmarks = {"L%02d" % i: origin + spacing * at for i, at in enumerate(spread_points(inside))}
            for key, point in landmarks.items():
                specimen["vol-landmarks/" + key] = (point * POINTS.get(wrong, 1))[:, None]
            for number, view in enumerate(told["views"]):
                camera = yaml.safe_load((case / view["camera"]).read_text())
                k = np.array(camera["intrinsics"])
                truth = np.array(fragment["truth"]["matrix"])
                seen = FLIP @ np.array(camera["camera_from_world"]["matrix"]) @ truth
                pixels = np.asarray(Image.open(case / view["image"])).astype("f4")[:, ::-1]
                rows, columns = pixels.shape
                k_file = np.array([[-k[0, 0], 0, columns - 1 - k[0, 2]], [0, -k[1, 1], k[1, 2]], [0, 0, 1]])
                group = specimen.create_group("projections/%03d" % number)
                group["image/pixels"] = pixels
                written = extrinsic, np.linalg.inv(seen) @ extrinsic, k_file
                written = MATRICES.get(wrong, lambda *matrices: matrices)(*written)
                group["gt-poses/cam-to-%s-vol" % bone] = written[1]
                group["gt-poses/%s-good-fov" % bone] = 1
                for key, point in landmarks.items():
                    pixel = k_file @ moved(seen, point)
                    pixel = MARKS.get(wrong, lambda pixel, size: pixel)(pixel[:2] / pixel[2], (columns, rows))
                    group["gt-landmarks/" + key] = np.array(pixel)[:, None]
        for key, value in (("extrinsic", written[0]), ("intrinsic", written[2])):
            file["proj-params/" + key] = value
        file["proj-params/num-cols"], file["proj-params/num-rows"] = columns, rows
        file["proj-params/pixel-col-spacing"] = file["proj-params/pixel-row-spacing"] = 0.5
    return path


# What may be wrong with a description of Utrecht's data, each alone: the file's map is changed.
def _inverse_pose(told):
    told["volume"]["world_from_volume"] = np.linalg.inv(told["volume"]["world_from_volume"]).tolist()


def _columns(told):
    for one in told["projections"].values():
        one["columns"] = [-x for x in one["columns"]]


def _rows(told):
    for one in told["projections"].values():
        one["rows"] = [-x for x in one["rows"]]


DESCRIPTIONS = {"inverse_pose": _inverse_pose, "columns": _columns, "rows": _rows}


def utrecht_folder(case, folder, wrong=None, starts=((0, 0, 0, 0, 0, 0),)):
    """A simulated case as data of Utrecht's gold standard: its description, raw files, masks and starts."""
    from PIL import Image
    from scipy import ndimage

    folder.mkdir(exist_ok=True)
    told = yaml.safe_load((case / "case.yaml").read_text())
    (fragment,) = told["fragments"].values()
    ct, spacing, origin = values_of(case / "ct.mha")
    inside = label_of(ct, (np.array(fragment["seeds"]) - origin) / spacing)
    ct.astype("<i2").tofile(folder / "ct.raw")
    inside.astype("u1").tofile(folder / "object.raw")
    pose = np.array(fragment["truth"]["matrix"])
    world_from_volume = pose.copy()
    world_from_volume[:3, 3] = moved(pose, origin)
    places = np.argwhere(inside)[:, ::-1] * spacing
    description = {
        "marrow-utrecht": 1,
        "volume": {
            "file": "ct.raw",
            "type": "int16",
            "size": list(ct.shape[::-1]),
            "voxel_mm": spacing.tolist(),
            "world_from_volume": world_from_volume.tolist(),
        },
        "projections": {},
        "objects": {
            "L3": {
                "centre_mm": moved(world_from_volume, places.mean(axis=0)).tolist(),
                "mask": "object.raw",
                "masks": {},
            }
        },
        "starts": "starts.txt",
    }
    (folder / "starts.txt").write_text("# tx ty tz rx ry rz\n" + "".join("%g %g %g %g %g %g\n" % one for one in starts))
    for view in told["views"]:
        camera = yaml.safe_load((case / view["camera"]).read_text())
        k, seen = np.array(camera["intrinsics"]), np.array(camera["camera_from_world"]["matrix"])
        turn, pixel_mm = seen[:3, :3], 0.5
        source = -turn.T @ seen[:3, 3]
        pixels = np.asarray(Image.open(case / view["image"])).astype("<f4")
        pixels.tofile(folder / (view["name"] + ".raw"))
        # The detector lies where its pixels have this size. Its middle is on the ray of the middle pixel.
        middle = [0.5 * (pixels.shape[1] - 1), 0.5 * (pixels.shape[0] - 1), 1]
        centre = source + turn.T @ (np.linalg.inv(k) @ middle) * k[0, 0] * pixel_mm
        mask = np.zeros(pixels.shape, bool)
        shown = moved(seen @ world_from_volume, places) @ k.T
        columns, rows = np.rint(shown[:, :2] / shown[:, 2:]).astype(int).T
        good = (columns >= 0) & (rows >= 0) & (columns < mask.shape[1]) & (rows < mask.shape[0])
        mask[rows[good], columns[good]] = True
        ndimage.binary_closing(mask, iterations=3).astype("u1").tofile(folder / (view["name"] + "-mask.raw"))
        description["projections"][view["name"]] = {
            "file": view["name"] + ".raw",
            "type": "float32",
            "size_px": list(pixels.shape[::-1]),
            "pixel_mm": [pixel_mm, float(pixel_mm * k[0, 0] / k[1, 1])],
            "source_mm": source.tolist(),
            "centre_mm": centre.tolist(),
            "columns": turn[0].tolist(),
            "rows": turn[1].tolist(),
        }
        description["objects"]["L3"]["masks"][view["name"]] = view["name"] + "-mask.raw"
    if wrong:
        DESCRIPTIONS[wrong](description)
    (folder / "data.yaml").write_text(yaml.safe_dump(description, sort_keys=False))
    return folder / "data.yaml"
