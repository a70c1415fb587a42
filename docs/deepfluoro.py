#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes a case of the DeepFluoro data set (Grupp et al., IPCAI 2020): the CT of a specimen, some of its X-ray images
with their cameras, and points inside a bone. The world is the bone's place in the CT, so its true pose is the identity.

    python3 docs/deepfluoro.py FILE SPECIMEN IMAGE... --bone left-femur --out CASE

FILE is the HDF5 file of full resolution. Which way its matrices map, and whether an image is mirrored, is decided by
the landmarks that the file has in the CT and in each image: they must meet. Needs python3-h5py.
"""
import argparse
import itertools
import pathlib
import zlib

import h5py
import numpy as np
import yaml

MOST_PX = 30  # median distance of the landmarks; a wrong convention is off by hundreds


def write_mha(path, values, spacing, origin, direction):
    """A MetaImage of an array whose last axis is x."""
    kind = {"i2": "MET_SHORT", "f4": "MET_FLOAT"}[values.dtype.str[1:]]
    data = zlib.compress(np.ascontiguousarray(values).tobytes(), 1)
    texts = [" ".join("%.17g" % x for x in np.ravel(what)) for what in (direction, origin, spacing)]
    head = "ObjectType = Image\nNDims = %d\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = True\n"
    head += "CompressedDataSize = %d\nTransformMatrix = %s\nOffset = %s\nElementSpacing = %s\nDimSize = %s\n"
    head += "ElementType = %s\nElementDataFile = LOCAL\n"
    size = " ".join(str(n) for n in reversed(values.shape))
    path.write_bytes((head % (values.ndim, len(data), *texts, size, kind)).encode() + data)


def vector(dataset):
    return np.asarray(dataset[()], float).ravel()


def pixels_of(projection, points):
    seen = np.column_stack([points, np.ones(len(points))]) @ projection.T
    return seen[:, :2] / seen[:, 2:]


def projection_of(params, bone_pose, points, marks):
    """The matrix from the CT to pixels, by that reading of the file under which the landmarks meet best, and how far
    they are apart."""
    intrinsic, extrinsic = np.asarray(params["intrinsic"]), np.asarray(params["extrinsic"])
    found = []
    for outer, inner in itertools.product((extrinsic, np.linalg.inv(extrinsic)), (np.linalg.inv(bone_pose), bone_pose)):
        matrix = intrinsic @ (outer @ inner)[:3]
        found.append((np.median(np.linalg.norm(pixels_of(matrix, points) - marks, axis=1)), matrix))
    return min(found, key=lambda one: one[0])


def decomposed(matrix, point):
    """Intrinsics with a positive diagonal, rotation and translation of a projection. The point lies in front of it."""
    matrix = matrix / np.linalg.norm(matrix[2, :3])
    if matrix[2] @ np.append(point, 1) < 0:
        matrix = -matrix
    flip = np.eye(3)[::-1]
    q, r = np.linalg.qr((flip @ matrix[:, :3]).T)
    intrinsics, rotation = flip @ r.T @ flip, flip @ q.T
    signs = np.diag(np.sign(np.diag(intrinsics)))
    intrinsics, rotation = intrinsics @ signs, signs @ rotation
    return intrinsics / intrinsics[2, 2], rotation, np.linalg.solve(intrinsics, matrix[:, 3])


def view_of(image, params, bone, landmarks, folder, name):
    """Writes the image, and returns its entry in case.yaml."""
    names = [one for one in image["gt-landmarks"] if one in landmarks]
    points = np.array([vector(landmarks[one]) for one in names])
    marks = np.array([vector(image["gt-landmarks"][one])[:2] for one in names])
    pose = np.asarray(image["gt-poses/cam-to-%s-vol" % bone], float)
    away_px, matrix = projection_of(params, pose, points, marks)
    if not away_px < MOST_PX:
        raise SystemExit("image %s: the landmarks lie %.0f px from where the file shows them" % (name, away_px))
    values = np.asarray(image["image/pixels"], "f4")
    intrinsics, rotation, translation = decomposed(matrix, points.mean(axis=0))
    if np.linalg.det(rotation) < 0:  # the image is seen from the detector
        values = values[:, ::-1]
        matrix = np.array([[-1, 0, values.shape[1] - 1], [0, 1, 0], [0, 0, 1]]) @ matrix
        intrinsics, rotation, translation = decomposed(matrix, points.mean(axis=0))
    write_mha(folder / (name + ".mha"), values, [1, 1], [0, 0], np.eye(2))
    print("%s: the landmarks meet within %.1f px (median)" % (name, away_px))
    camera = {
        "width_px": values.shape[1],
        "height_px": values.shape[0],
        "intrinsics": intrinsics.tolist(),
        "camera_from_world": {
            "target": "camera",
            "source": "world",
            "rotation": rotation.tolist(),
            "translation_mm": translation.tolist(),
        },
    }
    return {"name": name, "image": name + ".mha", "camera": camera}


def seeds_of(specimen, bone, ct, to_mm, count=8):
    """Points in the brightest voxels of the bone's labels."""
    words = bone.replace("-", " ").split()
    definitions = specimen["vol-seg/labels-def"]
    text = lambda name: np.bytes_(definitions[name][()]).decode()
    labels = [int(name) for name in definitions if all(word in text(name).lower() for word in words)]
    if not labels:
        raise SystemExit("no label is called %s: there are %s" % (bone, ", ".join(map(text, definitions))))
    places = np.argwhere(np.isin(np.asarray(specimen["vol-seg/image/pixels"]), labels))
    bright = places[np.argsort(ct[tuple(places.T)])[-100 * count :: 100]]
    return [[round(float(x), 3) for x in to_mm(place[::-1])] for place in bright]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", type=pathlib.Path)
    parser.add_argument("specimen", help="such as 17-1882")
    parser.add_argument("image", nargs="+", help="such as 000")
    parser.add_argument("--bone", default="pelvis", help="pelvis, left-femur or right-femur")
    parser.add_argument("--out", type=pathlib.Path, required=True, help="folder of the case; must be new")
    given = parser.parse_args()
    with h5py.File(given.file) as file:
        specimen = file[given.specimen]
        volume = specimen["vol"]
        ct = np.asarray(volume["pixels"]).astype("i2")
        spacing, origin = vector(volume["spacing"]), vector(volume["origin"])
        direction = np.asarray(volume["dir-mat"], float)
        given.out.mkdir()
        write_mha(given.out / "ct.mha", ct, spacing, origin, direction.T)
        views = [
            view_of(
                specimen["projections"][name],
                file["proj-params"],
                given.bone,
                specimen["vol-landmarks"],
                given.out,
                name,
            )
            for name in given.image
        ]
        seeds = seeds_of(specimen, given.bone, ct, lambda index: origin + direction @ (spacing * index))
    truth = {"target": "world", "source": "ct", "matrix": np.eye(4).tolist()}
    case = {
        "marrow-case": 1,
        "ct": "ct.mha",
        "views": views,
        "fragments": {given.bone: {"seeds": seeds, "truth": truth}},
    }
    (given.out / "case.yaml").write_text(yaml.safe_dump(case, sort_keys=False))


if __name__ == "__main__":
    main()
