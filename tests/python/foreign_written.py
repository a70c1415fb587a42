# SPDX-License-Identifier: Apache-2.0
"""Files that other programs write now: GDCM, plastimatch (by ITK), pydicom, nibabel, tifffile, Pillow and VTK."""
import pathlib
import shutil
import subprocess

import numpy
from foreign_found import PIL, Sample, dicom_pixels, nibabel, nibabel_volume, pydicom, tifffile, vtk

SPACING_MM, ORIGIN_MM = (0.5, 0.75, 2), (-5, 20, -7.5)


def image_data(values):
    from vtkmodules.util.numpy_support import numpy_to_vtk

    data = vtk.vtkImageData()
    data.SetDimensions(values.shape[::-1])
    data.SetSpacing(SPACING_MM)
    data.SetOrigin(ORIGIN_MM)
    data.GetPointData().SetScalars(numpy_to_vtk(values.ravel(), deep=True))
    return data


def write(writer, data, path, **settings):
    writer.SetInputData(data)
    writer.SetFileName(str(path))
    for name, value in settings.items():
        getattr(writer, "Set" + name)(*([] if value is None else [value]))
    writer.Write()


def volumes(scratch):
    values = numpy.random.default_rng(5).integers(-1000, 3000, (5, 6, 7)).astype("i2")
    affine = numpy.diag([*SPACING_MM, 1.0])
    affine[:3, 3] = ORIGIN_MM
    data, samples = image_data(values), []
    (scratch / "mhd").mkdir()
    for name, writer, settings in (
        ("a.mha", vtk.vtkMetaImageWriter(), {"Compression": False}),
        ("packed.mha", vtk.vtkMetaImageWriter(), {"Compression": True}),
        ("mhd/a.mhd", vtk.vtkMetaImageWriter(), {}),
        ("a.nii", vtk.vtkNIFTIImageWriter(), {}),
        ("a.nii.gz", vtk.vtkNIFTIImageWriter(), {}),
        ("a.vti", vtk.vtkXMLImageDataWriter(), {}),
    ):
        path = scratch / name
        write(writer, data, path, **settings)
        place = path.parent if name.endswith(".mhd") else path
        samples.append(Sample("VTK", place, lambda: (values, affine), "volume"))
        if ".nii" in name:  # VTK takes its own coordinates for those of NIfTI, which are RAS
            samples[-1].right = lambda: (values, numpy.diag([-1, -1, 1, 1]) @ affine)
    return samples


def pictures(scratch):
    samples = []
    for name, writer, pixels in (
        ("a.png", vtk.vtkPNGWriter(), DEEP),
        ("a.tif", vtk.vtkTIFFWriter(), DEEP),
        ("8.tiff", vtk.vtkTIFFWriter(), GREY),
        ("a.bmp", vtk.vtkBMPWriter(), GREY),
        ("a.jpg", vtk.vtkJPEGWriter(), GREY),
        ("a.pnm", vtk.vtkPNMWriter(), GREY),
    ):
        path = scratch / name
        write(writer, image_data(pixels[::-1].copy()[None]), path)  # VTK's rows run upwards
        samples.append(Sample("VTK", path, lambda pixels=pixels: pixels))
    samples[-2].right = lambda: jpeg_pixels(scratch / "a.jpg")
    return samples


def jpeg_pixels(path):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkJPEGReader()
    reader.SetFileName(str(path))
    reader.Update()
    return vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).reshape(GREY.shape)[::-1]


def surfaces(scratch):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    ball = vtk.vtkSphereSource()
    ball.SetRadius(20)
    ball.SetCenter(1, 2, 3)
    ball.Update()
    data = ball.GetOutput()
    data.GetPointData().Initialize()  # its normals are no part of the surface
    triangles = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    corners = vtk_to_numpy(data.GetPoints().GetData())[triangles]
    samples = []
    for name, writer, settings in (
        ("binary.stl", vtk.vtkSTLWriter(), {"FileTypeToBinary": None}),
        ("text.stl", vtk.vtkSTLWriter(), {"FileTypeToASCII": None}),
        ("binary.ply", vtk.vtkPLYWriter(), {"FileTypeToBinary": None}),
        ("text.ply", vtk.vtkPLYWriter(), {"FileTypeToASCII": None}),
        ("a.obj", vtk.vtkOBJWriter(), {}),
        ("appended.vtp", vtk.vtkXMLPolyDataWriter(), {"DataModeToAppended": None}),
        ("binary.vtp", vtk.vtkXMLPolyDataWriter(), {"DataModeToBinary": None}),
        ("text.vtp", vtk.vtkXMLPolyDataWriter(), {"DataModeToAscii": None}),
        ("legacy.vtk", vtk.vtkPolyDataWriter(), {}),
    ):
        path = scratch / name
        write(writer, data, path, **settings)
        samples.append(Sample("VTK", path, lambda: corners, "mesh", rounding=1e-4))
    return samples


def by_vtk(scratch):
    if not vtk:
        return "python3-vtk9"
    return volumes(scratch) + pictures(scratch) + surfaces(scratch)


RANDOM = numpy.random.default_rng(47)
GREY = (numpy.add.outer(3 * numpy.arange(24), 2 * numpy.arange(32)) + RANDOM.integers(0, 9, (24, 32))).astype("u1")
DEEP = (GREY.astype("u2") * 301 + RANDOM.integers(0, 300, (24, 32))).astype("u2")


def runs(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    return done.returncode == 0


def by_gdcm(scratch):
    if not shutil.which("gdcmconv") or not pydicom:
        return "libgdcm-tools"
    folder, samples = pathlib.Path(pydicom.__file__).parent / "data" / "test_files", []
    ways = ("raw", "jpeg", "jpegls", "rle", "j2k", "deflated", "implicit", "explicit", "generate-icon")
    ways = [["--" + way] for way in ways] + [
        ["--jpeg", "--split", "1000"],
        ["--rle", "--generate-icon", "--compress-icon"],
    ]
    for name in ("CT_small", "MR_small"):
        for way in ways:
            path = scratch / ("%s %s.dcm" % (name, " ".join(way)))
            if runs("gdcmconv", *way, folder / (name + ".dcm"), path) and path.exists():
                samples.append(Sample("gdcmconv", path, lambda name=name: dicom_pixels(folder / (name + ".dcm"))))
    for name, pixels, most in (("8", GREY, 255), ("16", DEEP, 65535)):
        pgm, path = scratch / (name + ".pgm"), scratch / ("gdcmimg %s bit" % name)
        pgm.write_bytes(b"P5\n32 24\n%d\n" % most + pixels.astype(">u2" if most > 255 else "u1").tobytes())
        if runs("gdcmimg", "-i", pgm, "-o", path):
            samples.append(Sample("gdcmimg", path, lambda pixels=pixels: pixels))
    return samples


def by_pydicom(scratch):
    if not pydicom:
        return "python3-pydicom"
    source = pathlib.Path(pydicom.__file__).parent / "data" / "test_files" / "CT_small.dcm"

    def changed(name, values, **how):
        data = pydicom.dcmread(source)
        for key, value in values.items():
            setattr(data, key, value)
        data.save_as(scratch / name, **how)
        return Sample("pydicom writes", scratch / name, lambda: dicom_pixels(scratch / name))

    grey = {
        "SamplesPerPixel": 3, "PhotometricInterpretation": "RGB", "PlanarConfiguration": 0, "Rows": 24, "Columns": 32,
        "BitsAllocated": 8, "BitsStored": 8, "HighBit": 7, "PixelRepresentation": 0, "RescaleIntercept": "0",
        "RescaleSlope": "1", "PixelData": numpy.repeat(GREY, 3).tobytes(),
    }  # fmt: skip
    equal = changed("equal RGB.dcm", grey)
    planes = changed("equal RGB planes.dcm", {**grey, "PlanarConfiguration": 1, "PixelData": GREY.tobytes() * 3})
    equal.right = planes.right = lambda: GREY
    return [
        changed("IM0001", {}),
        changed("CT.IMA", {}),
        changed("negative slope", {"RescaleSlope": "-2"}),
        equal,
        planes,
    ]


def by_plastimatch(scratch):
    """One volume, converted to each format. Its values are taken from the plain bytes of the MetaImage, and its grid is
    what plastimatch was told to make."""
    if not shutil.which("plastimatch") or not nibabel:
        return "plastimatch"
    made, samples = scratch / "synth.mha", []
    grid = ["--dim", "12 10 8", "--origin", "-5 20 -7.5", "--spacing", "0.5 0.75 2"]
    if not runs("plastimatch", "synth", "--pattern", "gauss", "--output-type", "short", "--output", made, *grid):
        return "plastimatch synth"
    header, body = made.read_bytes().split(b"ElementDataFile = LOCAL\n")
    assert b"ElementType = MET_SHORT" in header, header
    right = numpy.frombuffer(body, "<i2").reshape(8, 10, 12), numpy.array(
        [[0.5, 0, 0, -5], [0, 0.75, 0, 20], [0, 0, 2, -7.5], [0, 0, 0, 1]]
    )
    for name in ("synth.mha", "a.nrrd", "a.nii", "a.nii.gz", "a.tif"):
        path = scratch / name
        if name == "synth.mha" or runs("plastimatch", "convert", "--input", made, "--output-img", path):
            samples.append(Sample("plastimatch", path, lambda: right, "volume"))
    samples[-1].options = {"voxel_size_mm": [0.5, 0.75, 2]}  # a TIFF says neither this nor where it lies
    samples[-1].right = lambda: (right[0], numpy.diag([0.5, 0.75, 2, 1]))
    for name, option in (("mhd/a.mhd", "--output-img"), ("dicom", "--output-dicom")):
        path = scratch / name
        path.parent.mkdir(exist_ok=True)
        if runs("plastimatch", "convert", "--input", made, option, path):
            samples.append(Sample("plastimatch", path.parent if path.is_file() else path, lambda: right, "volume"))
    return samples


def by_nibabel(scratch):
    if not nibabel:
        return "python3-nibabel"
    values, samples = RANDOM.integers(0, 3000, (7, 6, 5)), []
    affine = numpy.eye(4)
    affine[:3, 3] = 3, 4, 5
    affine[:3, :3] = numpy.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]]) @ numpy.diag([0.5, 0.75, 2])

    def add(name, image):
        nibabel.save(image, scratch / name)
        samples.append(
            Sample("nibabel writes", scratch / name, lambda: nibabel_volume(scratch / name), "volume", rounding=1e-3)
        )

    for kind in ("u1", "i1", "i2", "u2", "i4", "u4", "f4", "f8"):
        add(kind + ".nii", nibabel.Nifti1Image((values % 120).astype(kind), affine))
    big = nibabel.Nifti1Image(values.astype(">i2"), affine, nibabel.Nifti1Header(endianness=">"))
    scaled = nibabel.Nifti1Image(values.astype("i2"), affine)
    scaled.header.set_slope_inter(2.5, -1024)
    add("big endian.nii.gz", big)
    add("scaled.nii", scaled)
    add("second.nii", nibabel.Nifti2Image(values.astype("i2"), affine))
    add("second.nii.gz", nibabel.Nifti2Image(values.astype("f4"), affine))
    add("left-handed.nii", nibabel.Nifti1Image(values.astype("i2"), affine @ numpy.diag([-1, 1, 1, 1])))
    add("pair.img", nibabel.Nifti1Pair(values.astype("i2"), affine))
    add("axes.nii", nibabel.Nifti1Image(values.astype("i2")[..., None], affine))
    samples[-1].right = lambda: (values.T, numpy.diag([-1, -1, 1, 1]) @ affine)
    flat = nibabel.Nifti1Image(DEEP.T, numpy.diag([-1, -1, 1, 1.0]))
    nibabel.save(flat, scratch / "X-ray.nii")
    samples.append(Sample("nibabel writes", scratch / "X-ray.nii", lambda: DEEP))
    return samples


def by_tifffile(scratch):
    if not tifffile:
        return "python3-tifffile"
    samples = []
    colours = numpy.stack([DEEP] * 3, axis=-1)
    for name, pixels, options in (
        ("plain", DEEP, {}),
        ("motorola", DEEP, {"byteorder": ">"}),
        ("big", DEEP, {"bigtiff": True}),
        ("strips", DEEP, {"rowsperstrip": 5}),
        ("zlib", DEEP, {"compression": "zlib"}),
        ("predictor", DEEP, {"compression": "zlib", "predictor": True}),
        ("signed", DEEP.astype("i2"), {}),
        ("32 bits", DEEP.astype("u4"), {}),
        ("float", DEEP.astype("f4"), {}),
        ("grey RGB", colours, {"photometric": "rgb"}),
        ("grey RGB zlib", colours, {"photometric": "rgb", "compression": "zlib", "predictor": True}),
        ("grey planes", colours.transpose(2, 0, 1).copy(), {"photometric": "rgb", "planarconfig": "separate"}),
        ("tiles", DEEP, {"tile": (16, 16)}),
        ("half", DEEP.astype("f2"), {}),
        ("double", DEEP.astype("f8"), {}),
    ):
        path = scratch / ("%s.tif" % name)
        tifffile.imwrite(path, pixels, **{"photometric": "minisblack", "metadata": None, **options})
        samples.append(Sample("tifffile", path, lambda pixels=pixels: DEEP.astype(pixels.dtype) + 0))
    return samples


def by_pillow(scratch):
    if not PIL:
        return "python3-pil"
    samples = []
    grey = PIL.fromarray(GREY)
    palette = grey.convert("P")
    for name, image, options in (
        ("L.png", grey, {}),
        ("16.png", PIL.fromarray(DEEP), {}),
        ("RGB.png", grey.convert("RGB"), {}),
        ("RGBA.png", grey.convert("RGBA"), {}),
        ("LA.png", grey.convert("LA"), {}),
        ("P.png", palette, {}),
        ("1.png", grey.point(lambda v: 255 * (v > 60)).convert("1", dither=0), {}),
        ("lzw.tif", grey, {"compression": "tiff_lzw"}),
        ("deflate.tif", PIL.fromarray(DEEP), {"compression": "tiff_adobe_deflate"}),
        ("packbits.tif", grey, {"compression": "packbits"}),
        ("RGB lzw.tif", grey.convert("RGB"), {"compression": "tiff_lzw"}),
        ("P.tif", palette, {}),
        ("jpeg.tif", grey, {"compression": "jpeg"}),
        ("L.bmp", grey, {}),
        ("RGB.bmp", grey.convert("RGB"), {}),
        ("RGBA.bmp", grey.convert("RGBA"), {}),
        ("1.bmp", grey.point(lambda v: 255 * (v > 60)).convert("1", dither=0), {}),
        ("L.jpg", grey, {"quality": 95}),
        ("RGB.jpg", grey.convert("RGB"), {"quality": 95}),
        ("progressive.jpeg", grey, {"progressive": True}),
        ("L.gif", grey, {}),
        ("L.jp2", grey, {}),
        ("L.webp", grey, {}),
        ("L.pgm", grey, {}),
    ):
        image.save(scratch / name, **options)
        right = lambda name=name: numpy.array(PIL.open(scratch / name).convert("I"))
        samples.append(Sample("Pillow", scratch / name, right))
        if name.endswith((".jpg", ".jpeg")):  # Pillow and marrow may have other versions of libjpeg
            samples[-1].rounding = 2
    return samples
