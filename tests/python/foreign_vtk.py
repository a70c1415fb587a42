# SPDX-License-Identifier: Apache-2.0
"""Files that VTK writes: images, volumes and surfaces."""
import numpy
from foreign_files import Sample, vtk
from foreign_written import DEEP, GREY

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
        samples.append(
            Sample("VTK", path.parent if name.endswith(".mhd") else path, lambda: (values, affine), "volume")
        )
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
    corners = vtk_to_numpy(data.GetPoints().GetData())[
        vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    ]
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
