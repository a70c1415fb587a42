# SPDX-License-Identifier: Apache-2.0
"""How values and results look in a notebook: tables, pictures, curves, and surfaces that can be turned. Nothing is
loaded from elsewhere."""
import base64
import html
import json
import pathlib
import struct
import uuid
import zlib
from typing import Any, Dict, Iterator, List, Tuple

from . import _core
from .items import Items
from .tables import Table

MOST_TRIANGLES = 20000  # more are slow to turn
MOST_PICTURES = 4  # of a result


def png(pixels: Any) -> bytes:
    """An array [row, column] or [row, column, 3] of uint8 as a PNG file."""
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    height, width = pixels.shape[:2]

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2 if pixels.ndim == 3 else 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def grey(array: Any) -> Any:
    """An image as uint8, from its darkest pixel to its brightest."""
    import numpy

    low, high = float(numpy.nanmin(array)), float(numpy.nanmax(array))
    scaled = (array.astype("float32") - low) * (255 / (high - low) if high > low else 0)
    return numpy.nan_to_num(scaled).astype("uint8")


def picture_html(pixels: Any, title: str = "") -> str:
    """An array of uint8 as a picture with a title."""
    data = base64.b64encode(png(pixels)).decode()
    return (
        '<figure style="display:inline-block;margin:4px"><img style="max-width:480px" src="data:image/png;base64,%s"/>'
        "<figcaption>%s</figcaption></figure>" % (data, html.escape(title))
    )


def coarser(vertices: Any, triangles: Any) -> Tuple[Any, Any]:
    """A surface of at most MOST_TRIANGLES triangles: vertices that are close to each other become one."""
    import numpy

    cell = float(numpy.ptp(vertices, axis=0).max()) / 200
    while len(triangles) > MOST_TRIANGLES and cell > 0:
        _, first, of_each = numpy.unique(
            numpy.floor(vertices / cell).astype("int64"), axis=0, return_index=True, return_inverse=True
        )
        corners = of_each.reshape(-1)[triangles]
        flat = (corners == numpy.roll(corners, 1, axis=1)).any(axis=1)
        vertices, triangles = vertices[first], corners[~flat]
        cell *= 1.4
    return vertices, triangles


def surfaces_html(surfaces: List[Tuple[Any, Any]]) -> str:
    """Surfaces, each as its vertices and triangles, that can be turned with the mouse."""
    shown = []
    for number, (vertices, triangles) in enumerate(surfaces):
        vertices, triangles = coarser(vertices, triangles)
        corners, hue = triangles.ravel().tolist(), (40 + 137 * number) % 360
        shown.append({"vertices": vertices.ravel().round(2).tolist(), "triangles": corners, "hue": hue})
    name = "marrow-" + uuid.uuid4().hex
    script = pathlib.Path(__file__).with_name("surface_view.js").read_text(encoding="utf-8")
    return (
        '<canvas id="%s" width="480" height="480" style="touch-action:none"></canvas><script>(() => {%s\n'
        'marrowSurfaceView(document.getElementById("%s"), %s);})();</script>' % (name, script, name, json.dumps(shown))
    )


def scene_surfaces(scene: Any) -> List[Tuple[Any, Any]]:
    """The models of a scene in the poses that were found."""
    surfaces, models = [], scene.models
    for model, name, matrix in scene.placements:
        if name == "result":
            mesh = models[model]
            surfaces.append((mesh.vertices_mm @ matrix[:3, :3].T + matrix[:3, 3], mesh.triangles))
    return surfaces or [(mesh.vertices_mm, mesh.triangles) for mesh in models.values()]


def landscape_html(landscape: Any) -> str:
    """One curve for each axis; a dashed line at the exact pose, where it is known."""
    return "".join(_curve(profile) for profile in landscape.profiles)


def _curve(profile: Any, width: int = 230, height: int = 130) -> str:
    offsets, costs = profile.offsets, profile.costs
    low, high = float(costs.min()), float(costs.max())
    span, rise = float(offsets[-1] - offsets[0]) or 1, (high - low) or 1

    def across(offset: float) -> float:
        return width * (offset - float(offsets[0])) / span

    points = " ".join("%.1f,%.1f" % (across(x), height - height * (y - low) / rise) for x, y in zip(offsets, costs))
    truth = ""
    if profile.truth is not None:
        truth = '<line x1="%.1f" x2="%.1f" y1="0" y2="%d" stroke="grey" stroke-dasharray="4"/>' % (
            (across(profile.truth),) * 2 + (height,)
        )
    caption = "%s, %g to %g %s" % (profile.axis, offsets[0], offsets[-1], profile.unit)
    return (
        '<figure style="display:inline-block;margin:4px"><svg width="%d" height="%d" style="border:1px solid #ccc">'
        '%s<polyline points="%s" fill="none" stroke="#1f5fa8" stroke-width="2"/></svg>'
        '<figcaption style="font-size:80%%">%s</figcaption></figure>'
        % (width, height, truth, points, html.escape(caption))
    )


def pose_table(pose: Any) -> Table:
    """A pose, and how sure it is."""
    columns = ("x", "y", "z", "mm")
    return Table({name: float(value) for name, value in zip(columns, row)} for row in pose.matrix[:3])


def figures_table(metrics: Dict[str, Dict[str, float]]) -> Table:
    """One row for each figure, one column for each item that has it."""
    figures = dict.fromkeys(name for values in metrics.values() for name in values)
    table = Table()
    for figure in figures:
        row: Dict[str, Any] = {"figure": figure}
        row.update({item: values.get(figure) for item, values in metrics.items()})
        table.append(row)
    return table


def leaves(value: Any, name: str) -> Iterator[Tuple[str, Any]]:
    """The items of a value with their names, as "pose distal"."""
    if isinstance(value, Items):
        for item, inner in value.items():
            yield from leaves(inner, name + " " + item)
    elif value is not None:
        yield name, value


def result_html(result: Any) -> str:
    """Verdicts, figures, poses, pictures, and the surfaces of a result."""
    parts, pictures, surfaces = [], [], []
    metrics: Dict[str, Dict[str, float]] = {}
    for name, value in (leaf for output in result for leaf in leaves(result[output], output)):
        if isinstance(value, _core.Verdict):
            said = [html.escape(text) for text in (name, value.judgement, "; ".join(value.reasons))]
            parts.append("<p><b>%s: %s</b> %s</p>" % (said[0], said[1], said[2]))
        elif isinstance(value, _core.Metrics):
            metrics[name] = value.values
        elif isinstance(value, _core.Pose):
            parts.append("<p>%s</p>%s" % (html.escape(name), pose_table(value)._repr_html_()))
        elif isinstance(value, _core.Picture):
            pictures.append((name, value))
        elif isinstance(value, _core.Scene):
            surfaces = scene_surfaces(value)
        elif isinstance(value, _core.Mesh) and not surfaces:
            surfaces = [(value.vertices_mm, value.triangles)]
    if metrics:
        parts.append(figures_table(metrics)._repr_html_())
    pictures.sort(key=lambda one: not one[0].startswith("overlay"))
    parts += [picture_html(picture.array, name) for name, picture in pictures[:MOST_PICTURES]]
    if surfaces:
        parts.append(surfaces_html(surfaces))
    return "".join(parts) or html.escape(repr(result))


_core.Picture._repr_html_ = lambda self: picture_html(self.array)  # type: ignore[attr-defined]
_core.Image._repr_html_ = lambda self: picture_html(grey(self.array))  # type: ignore[attr-defined]
_core.View._repr_html_ = lambda self: picture_html(grey(self.image.array), self.name)  # type: ignore[attr-defined]
_core.Mesh._repr_html_ = lambda self: surfaces_html([(self.vertices_mm, self.triangles)])  # type: ignore[attr-defined]
_core.Scene._repr_html_ = lambda self: surfaces_html(scene_surfaces(self))  # type: ignore[attr-defined]
_core.Landscape._repr_html_ = landscape_html  # type: ignore[attr-defined]
_core.Pose._repr_html_ = lambda self: pose_table(self)._repr_html_()  # type: ignore[attr-defined]
