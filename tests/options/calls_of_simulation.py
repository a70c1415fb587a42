# SPDX-License-Identifier: Apache-2.0
"""How the nodes are called that simulate, guide, follow, draw and measure: inputs and options by the node's name."""
from harness.package import marrow


def calls(s):
    def judged(**more):
        return {"pose": s.found.pose, "truth": s.parts.truths["distal"], "model": s.mesh, **more}

    return {
        "camera.carm": lambda: dict(),
        "camera.pinhole": lambda: dict(),
        "camera.photographs": lambda: dict(
            photographs=s.photographs, cameras=s.photographed.camera, calibration=s.photographed.calibration
        ),
        "camera.check": lambda: dict(views=s.views, mesh=s.coarse_mesh, known_points=str(s.seen_points)),
        "camera.chessboard": lambda: dict(boards=s.boards.boards, placed=s.boards.placed),
        "camera.bead_board": lambda: dict(images=s.beads.images, board=str(s.board)),
        "evaluate.edges": lambda: dict(edges=s.edges["frontal"], truth=s.edges["lateral"]),
        "evaluate.frames": lambda: dict(metrics=s.frames_metrics),
        "evaluate.landscape": lambda: dict(cost=s.contour, pose=s.found.pose, profile_points=7),
        "evaluate.locking": lambda: dict(plan=s.plan.plan, implant=s.nail.implant, truth=s.nailed.truth),
        "evaluate.mtre": lambda: judged(),
        "evaluate.outline_distance": lambda: dict(pose=s.found.pose, projector=s.outline, views=s.views, edges=s.edges),
        "evaluate.pose_difference": lambda: dict(pose=s.found.pose, reference=s.start, model=s.mesh),
        "evaluate.pose_error": lambda: judged(),
        "evaluate.projection_distance": lambda: judged(views=s.views),
        "evaluate.reprojection_distance": lambda: judged(views=s.views),
        "evaluate.reduced": lambda: dict(truths=s.parts.truths, models=s.parts.models),
        "evaluate.reduction_gap": lambda: dict(poses=s.parts.starts, truths=s.parts.truths, models=s.parts.models),
        "evaluate.shaft_lines": lambda: dict(
            lines=s.lines["frontal"], view=s.views["frontal"], models=s.parts.models, truths=s.parts.truths
        ),
        "evaluate.shaft_width": lambda: dict(lines=s.lines, views=s.views, width_mm=[28], width_deviation_mm=[2]),
        "evaluate.surface_distance": lambda: dict(mesh=s.coarse_mesh, reference=s.mesh, points=500),
        "fracture.misalignment": lambda: dict(poses=s.parts.starts, models=s.parts.models),
        "fracture.reduction": lambda: dict(poses=s.parts.starts, models=s.parts.models),
        "plan.locking": lambda: {
            "implant": s.nail.implant,
            "pose": s.nailed.start,
            "views": s.views,
            "from": [1, 0, 0],
        },
        "render.curves": lambda: dict(metrics=s.frames_metrics),
        "render.interactive": lambda: dict(models=s.parts.models, poses=s.parts.starts, views=s.views),
        "render.overlay": lambda: dict(pose=s.found.pose, projector=s.outline, view=s.views["frontal"], size_px=300),
        "render.scene": lambda: dict(models=s.parts.models, poses=s.parts.starts, view=s.views["frontal"], size_px=200),
        "render.shaft": lambda: dict(lines=s.lines["frontal"], view=s.views["frontal"], size_px=300),
        "simulate.bead_board": lambda: dict(board=str(s.board), width_px=256, height_px=256, pixel_mm=1.2, views=3),
        "simulate.bone_motion": lambda: dict(phantom=s.phantom, frames=6),
        "simulate.bones": lambda: dict(phantom=s.cluttered, bodies=["proximal", "distal"]),
        "simulate.camera_arm": lambda: dict(),
        "simulate.camera_faults": lambda: dict(views=s.views),
        "simulate.case": lambda: dict(volume=s.volume, views=s.views, phantom=s.phantom),
        "simulate.case_folder": lambda: dict(
            case=marrow.simulate.case(volume=s.volume, views=s.views, phantom=s.phantom),
            models={name: s.closed_mesh for name in ("proximal", "distal")},
        ),
        "simulate.chessboard": lambda: dict(arm=s.arm, photographs=3),
        "simulate.clutter": lambda: dict(phantom=s.phantom, fat="mild", plate="mild"),
        "simulate.cluttered_ct": lambda: dict(phantom=s.plated, spacing_mm=[3, 3, 4], range_mm=[60, 260]),
        "simulate.cluttered_fluoroscopy": lambda: dict(phantom=s.plated, cameras=s.cameras),
        "simulate.ct": lambda: dict(phantom=s.phantom, spacing_mm=[3, 3, 4], range_mm=[0, 200]),
        "simulate.export": lambda: dict(views=s.views, earlier_views=s.earlier, collimator="mild", lag="mild"),
        "simulate.femur": lambda: dict(resolution_mm=3, variation=0.5),
        "simulate.fluoroscopy": lambda: dict(phantom=s.phantom, cameras=s.cameras),
        "simulate.fracture": lambda: dict(bone=s.bone),
        "simulate.labels": lambda: dict(phantom=s.plated, cameras=s.cameras, collimator="mild"),
        "simulate.hexapod": lambda: dict(phantom=s.phantom, commands=s.sweep),
        "simulate.knee_motion": lambda: dict(phantom=s.knee, frames=6),
        "simulate.landmarks": lambda: dict(phantom=s.phantom, cameras=s.cameras),
        "simulate.mistake": lambda: dict(
            volume=s.volume, seeds=s.case.seeds, views=s.views, truth=s.parts.truths, mistake="wrong_camera"
        ),
        "simulate.nail": lambda: dict(resolution_mm=2),
        "simulate.nailing": lambda: dict(phantom=s.reduced, implant=s.nail.implant),
        "simulate.photograph": lambda: dict(
            arm=s.arm, phantom=s.phantom, fragment=s.held.fragment["neutral"], platform=s.held.platform["neutral"]
        ),
        "simulate.skin_markers": lambda: dict(phantom=s.phantom, false_rotation_deg=1),
        "simulate.sweeps": lambda: dict(),
        "simulate.pelvis": lambda: dict(resolution_mm=6, variation=0.5),
        "simulate.vertebra": lambda: dict(resolution_mm=3, variation=0.5),
        "simulate.whole": lambda: dict(bone=s.bone),
        "robot.hexapod": lambda: dict(phantom=s.apart),
        "robot.stations": lambda: dict(
            state=s.robot.state, camera=s.cameras["frontal"], board=str(s.board), stations=3
        ),
        "guide.closed_loop": lambda: dict(
            poses=s.parts.starts, state=s.guide, report=s.robot.report, fields=s.fields, models=s.parts.models
        ),
        "guide.open_loop": lambda: dict(
            poses=s.parts.starts, hands=s.stations.hands, targets=s.targets, models=s.parts.models
        ),
        "guide.target": lambda: dict(view=s.stations.views["1"], board=str(s.board)),
        "track.begin": lambda: dict(start=s.start),
        "track.filter": lambda: dict(state=s.predicted, pose=s.found.pose),
        "track.joint": lambda: dict(proximal=s.states, distal=s.later_states),
        "track.predict": lambda: dict(state=s.track),
        "write.plastimatch": lambda: dict(camera=s.cameras["frontal"], pixel_mm=[1.9]),
        "write.rtk": lambda: dict(cameras=s.cameras, pixel_mm=[1.9]),
        "write.tfm": lambda: dict(pose=s.found.pose),
        "write.xreg": lambda: dict(cameras=s.cameras, pixel_mm=[1.9]),
    }
