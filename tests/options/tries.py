# SPDX-License-Identifier: Apache-2.0
"""Values for options that cannot be guessed, or that count only together with others: by node.option, a function of the
scene that gives sets of options. A key "in.NAME" is an input."""
from calls_of_bones import GREY_VALUES
from calls_of_files import FORMATS
from files_of_scene import labels_of, network, points_network, slices_network, surface_of, written


def files(*names):
    """One try for each file."""

    def tries(s, option):
        return [{option: str(written() / name)} for name in names]

    return tries


def one(**options):
    """These options in the call before and after the change; `to` is the other value of the option."""

    def tries(s, option):
        changed = {key.replace("__", "."): value(s) if callable(value) else value for key, value in options.items()}
        return [{**{key: value for key, value in changed.items() if key != "to"}, option: changed["to"]}]

    return tries


TRIES = {
    # By grey values, a level has pixels and not points.
    "initial.best_of.pixel_step": one(in__cost=lambda s: s.grey, to=4),
    "initial.global_search.pixel_step": one(in__cost=lambda s: s.grey, to=[8, 4, 2]),
    "initial.global_search.needs_start": one(in__start=None, to=True),
    "initial.manual.needs_start": one(in__start=None, to=True),
    "register.multiresolution.pixel_step": one(in__cost=lambda s: s.grey, to=[8, 4, 2]),
    "register.sequence.pixel_step": one(in__cost=lambda s: s.grey, to=[8, 4, 2]),
    "register.multiresolution.scan_side_deg": one(scan_poses=30, to=6),
    "register.multiresolution.scan_side_mm": one(scan_poses=30, to=6),
    "register.sequence.scan_side_deg": one(scan_poses=30, to=6),
    "register.sequence.scan_side_mm": one(scan_poses=30, to=6),
    "register.together.pixel_step": one(
        in__costs=lambda s: {"distal": s.grey}, in__starts=lambda s: {"distal": s.start}, to=[8, 4, 2]
    ),
    "register.together.reach_px": one(to=[4, 2, 1]),
    "landmarks.network.network": one(to=lambda s: points_network("other", sorted(s.landmarks.points_mm), (0, 0, 0.6))),
    "points.extremes.names": one(to=["inner", "outer"], level=[]),
    "points.extremes.level": one(to=[]),
    # The gap of a joint
    "similarity.with_contact.joint": one(to=["distal", "other"]),
    "similarity.with_contact.joint_width_mm": one(joint=["distal", "other"], to=2),
    "similarity.with_contact.joint_deviation_mm": one(joint=["distal", "other"], to=2),
    # Files
    "camera.bead_board.board": one(to=lambda s: str(written() / "nothing.yaml")),
    "camera.check.known_points": one(to=""),
    "edges.network.network": one(to=lambda s: network(0.8)),
    "mask.metal.leave_out": one(to=["outside"]),
    "mask.network.network": one(to=lambda s: network(0.8, ("metal", "outside"))),
    "mask.network.leave_out": one(to=["outside"]),
    "segment.network.network": one(to=lambda s: slices_network(500)),
    "segment.network.bone": one(to=["cortex"]),
    "read.camera.path": files("rtk.xml", "xreg.h5"),
    "read.camera.projection": one(path=lambda s: str(written() / "rtk.xml"), to=1),
    "read.cameras.path": files("xreg.h5"),
    "read.cameras.names": one(to=["left", "right"]),
    "read.cameras.projections": one(to=[1, 0]),
    "read.case.path": files("nothing"),
    "read.image.path": files("case/lateral.png"),
    "read.images.paths": one(to=lambda s: [str(written() / "case" / "lateral.png")]),
    "read.images.names": one(to=["left", "right"]),
    "read.implant.holes": files("nothing.yaml"),
    "read.implant.surface": files("model.ply"),
    "read.labels.path": one(to=lambda s: labels_of(1, 3)),
    "read.labels.labels": one(to=["2"]),
    "read.labels.fragments": one(labels=["1"], to=["bone"]),
    "read.landmarks.path": files("points.fcsv"),
    "read.landmarks.fragment": one(path=lambda s: str(written() / "points.fcsv"), to="other"),
    "read.landmarks.seen": one(
        to=lambda s: str(written() / "xreg.h5"),
        path=lambda s: str(written() / "points.fcsv"),
        names=["frontal", "lateral"],
    ),
    "read.landmarks.names": one(
        to=["left", "right"], path=lambda s: str(written() / "points.fcsv"), seen=lambda s: str(written() / "xreg.h5")
    ),
    "read.landmarks.mirror": one(
        to="left_right",
        path=lambda s: str(written() / "points.fcsv"),
        seen=lambda s: str(written() / "xreg.h5"),
        names=["frontal", "lateral"],
    ),
    "read.mesh.path": one(to=lambda s: str(surface_of(s.coarse_mesh, "other"))),
    "read.pose.path": files("start.yaml"),
    "read.seeds.path": files("points.fcsv"),
    "read.seeds.fragment": one(path=lambda s: str(written() / "points.fcsv"), to="other"),
    "read.view.name": one(to="left"),
    "read.view.image": files("case/lateral.png"),
    "read.view.camera": files("case/frontal.camera.yaml", "rtk.xml"),
    "read.view.projection": one(camera=lambda s: str(written() / "rtk.xml"), to=1),
    "read.view.corner_mm": one(to=[-100, -90]),
    "read.view.calibration": files("calibration.yaml"),
    "read.views.names": one(to=["left", "right"]),
    "read.views.images": one(to=lambda s: [str(written() / "case" / "lateral.png")] * 2),
    "read.views.cameras": one(to=lambda s: [str(written() / "rtk.xml")] * 2),
    "read.views.projections": one(cameras=lambda s: [str(written() / "rtk.xml")] * 2, to=[0, 1]),
    "read.views.corner_mm": one(to=[-100, -90]),
    "read.views.calibration": files("calibration.yaml"),
    "read.volume.path": files("nothing.mha"),
    "read.volume.flip": one(to=["x"]),
    "read.camera.corner_mm": one(to=[-100, -90]),
    "read.camera.image_size_px": one(to=[90, 96]),
    "read.camera.pixel_mm": one(to=[2.5]),
    "read.cameras.corner_mm": one(to=[-100, -90]),
    "read.cameras.image_size_px": one(to=[90, 96]),
    "read.cameras.pixel_mm": one(to=[2.5]),
    "read.view.pixel_mm": one(to=[2.5]),
    "read.views.pixel_mm": one(to=[2.5]),
    "robot.stations.board": one(to=lambda s: str(written() / "nothing.yaml")),
    "guide.target.board": one(to=lambda s: str(written() / "nothing.yaml")),
    "simulate.bead_board.board": one(to=lambda s: str(written() / "nothing.yaml")),
    "simulate.surface.outer": one(to=lambda s: str(surface_of(s.mesh, "finer"))),
    "simulate.surface.inner": one(cortex_mm=[], to=lambda s: str(surface_of(s.coarse_mesh, "inner", 0.6))),
    "verdict.evidence.failure_model": one(to=""),
    # What a device has is compared with what follows from the camera: 1000 mm and 1.9 mm.
    "camera.check.source_to_detector_mm": one(pixel_mm=1.9, to=500),
    "camera.check.pixel_mm": one(source_to_detector_mm=1000, to=1),
    "camera.check.detector_mm": one(pixel_mm=1.9, to=100),
    # Voxels that are softer than this within the bone's margin.
    **{
        "project.%s.below_hu" % name: one(to=300)
        for name in ("joseph", "lightfield", "opencl", "ray_casting", "siddon_jacobs")
    },
    "project.opencl.device": one(to="no such device"),
    "project.lightfield.max_memory_mb": one(ray_spacing_mm=5, direction_spacing_deg=3, to=1),
    "evaluate.projection_distance.source_to_detector_mm": one(to=[1000]),
    "fracture.misalignment.fracture_mm": one(to=[0, 0, 40]),
    "plan.locking.from": one(to=[0, -1, 0]),
    "track.filter.first_scale": one(in__state=lambda s: s.first_predicted, to=20),
    **{
        "track.predict.keyframe_%s" % name: one(in__keyframes=lambda s: s.keyframes, to=0.5)
        for name in ("deg", "mm", "speed_deg_s", "speed_mm_s")
    },
    "simulate.knee_motion.blank": one(to=[2, 3]),
    "verdict.predicted.doubtful_above": one(in__pose=lambda s: s.known, to=0.45),
    "verdict.predicted.wrong_above": one(in__pose=lambda s: s.known, to=0.06),
    "read.volume.voxel_size_mm": one(to=[1, 1, 1]),
    "register.multiresolution.reach_px": one(to=[2, 1, 0.5]),
    # Names
    "camera.carm.names": one(to=["a", "b"]),
    "evaluate.frames.figures": one(to=["mtre_mm"]),
    "render.curves.figures": one(to=["mtre_mm"]),
    "refine.cameras.reference_view": one(to="frontal"),
    "simulate.bones.bodies": one(to=["distal"]),
    "simulate.camera_arm.names": one(to=["a", "b"]),
    "simulate.camera_faults.only": one(to=["frontal"]),
    "simulate.case.register": one(to=["proximal"]),
    "simulate.case_folder.label_voxel_mm": one(given_by="labels", to=[4, 4, 4]),
    "simulate.sweeps.axes": one(to=["x"]),
}
for _node, _format in FORMATS.items():
    TRIES.update(
        {
            "run.program_%s.command" % _node: one(to=["false", "{output.%s}" % _format]),
            "run.program_%s.version_command" % _node: one(to=["true"]),
            "run.program_%s.files" % _node: one(to=[]),
            "run.program_%s.output_file" % _node: one(to="other"),
            "run.program_%s.max_time_s" % _node: one(to=0.01),
            "run.program_%s.max_memory_mb" % _node: one(to=1),
        }
    )
TRIES["run.program_field.labels"] = one(to=[12345])
for _node in (
    "evaluate.reduced",
    "evaluate.reduction_gap",
    "fracture.misalignment",
    "fracture.reduction",
    "guide.closed_loop",
    "guide.open_loop",
):
    TRIES[_node + ".moved"] = one(reference="distal", to="proximal")
    TRIES[_node + ".reference"] = one(to="nobody")
for _node in ("simulate.hexapod", "simulate.photograph"):
    TRIES[_node + ".fragment"] = one(to="proximal")
TRIES["robot.hexapod.moved"] = one(reference="distal", to="proximal")
TRIES["robot.hexapod.reference"] = one(to="nobody")
for _node in (*GREY_VALUES, "contour_distance", "drr_edges", "gradient_projection", "ray_to_surface"):
    TRIES["similarity.%s.weights" % _node] = one(to=[1, 3])
for _node in ("hough_pairs", "line_segments", "ransac"):
    TRIES["shaft.%s.width_mm" % _node] = one(to=[20])
    TRIES["shaft.%s.width_deviation_mm" % _node] = one(to=[0.1])
    TRIES["shaft.%s.magnification_tolerance" % _node] = one(width_deviation_mm=[0.1], to=0.5)
