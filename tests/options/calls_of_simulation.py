# SPDX-License-Identifier: Apache-2.0
"""How the nodes are called that simulate, guide, follow, draw and measure: (inputs, options) by the node's name."""
from harness.package import marrow


def calls(s):
    def judged(**more):
        return {"pose": s.found.pose, "truth": s.parts.truths["distal"], "model": s.mesh, **more}

    return {
        "camera.carm": lambda: ({}, {}),
        "camera.pinhole": lambda: ({}, {}),
        "camera.photographs": lambda: (
            {"photographs": s.photographs, "cameras": s.photographed.camera, "calibration": s.photographed.calibration},
            {},
        ),
        "camera.check": lambda: ({"views": s.views, "mesh": s.coarse_mesh}, {"known_points": str(s.seen_points)}),
        "camera.chessboard": lambda: ({"boards": s.boards.boards, "placed": s.boards.placed}, {}),
        "camera.bead_board": lambda: ({"images": s.beads.images}, {"board": str(s.board)}),
        "evaluate.edges": lambda: ({"edges": s.edges["frontal"], "truth": s.edges["lateral"]}, {}),
        "evaluate.frames": lambda: ({"metrics": s.frames_metrics}, {}),
        "evaluate.landscape": lambda: ({"cost": s.contour, "pose": s.found.pose}, {"profile_points": 7}),
        "evaluate.locking": lambda: ({"plan": s.plan.plan, "implant": s.nail.implant, "truth": s.nailed.truth}, {}),
        "evaluate.mtre": lambda: (judged(), {}),
        "evaluate.outline_distance": lambda: (
            {"pose": s.found.pose, "projector": s.outline, "views": s.views, "edges": s.edges},
            {},
        ),
        "evaluate.pose_difference": lambda: ({"pose": s.found.pose, "reference": s.start, "model": s.mesh}, {}),
        "evaluate.pose_error": lambda: (judged(), {}),
        "evaluate.projection_distance": lambda: (judged(views=s.views), {}),
        "evaluate.reprojection_distance": lambda: (judged(views=s.views), {}),
        "evaluate.reduced": lambda: ({"truths": s.parts.truths, "models": s.parts.models}, {}),
        "evaluate.reduction_gap": lambda: (
            {"poses": s.parts.starts, "truths": s.parts.truths, "models": s.parts.models},
            {},
        ),
        "evaluate.shaft_lines": lambda: (
            {
                "lines": s.lines["frontal"],
                "view": s.views["frontal"],
                "models": s.parts.models,
                "truths": s.parts.truths,
            },
            {},
        ),
        "evaluate.shaft_width": lambda: (
            {"lines": s.lines, "views": s.views},
            {"width_mm": [28], "width_deviation_mm": [2]},
        ),
        "evaluate.surface_distance": lambda: ({"mesh": s.coarse_mesh, "reference": s.mesh}, {"points": 500}),
        "fracture.misalignment": lambda: ({"poses": s.parts.starts, "models": s.parts.models}, {}),
        "fracture.reduction": lambda: ({"poses": s.parts.starts, "models": s.parts.models}, {}),
        "plan.locking": lambda: (
            {"implant": s.nail.implant, "pose": s.nailed.start, "views": s.views},
            {"from": [1, 0, 0]},
        ),
        "render.curves": lambda: ({"metrics": s.frames_metrics}, {}),
        "render.interactive": lambda: ({"models": s.parts.models, "poses": s.parts.starts, "views": s.views}, {}),
        "render.overlay": lambda: (
            {"pose": s.found.pose, "projector": s.outline, "view": s.views["frontal"]},
            {"size_px": 300},
        ),
        "render.scene": lambda: (
            {"models": s.parts.models, "poses": s.parts.starts, "view": s.views["frontal"]},
            {"size_px": 200},
        ),
        "render.shaft": lambda: ({"lines": s.lines["frontal"], "view": s.views["frontal"]}, {"size_px": 300}),
        "simulate.bead_board": lambda: (
            {},
            {"board": str(s.board), "width_px": 256, "height_px": 256, "pixel_mm": 1.2, "views": 3},
        ),
        "simulate.bone_motion": lambda: ({"phantom": s.phantom}, {"frames": 6}),
        "simulate.bones": lambda: ({"phantom": s.cluttered}, {"bodies": ["proximal", "distal"]}),
        "simulate.camera_arm": lambda: ({}, {}),
        "simulate.camera_faults": lambda: ({"views": s.views}, {}),
        "simulate.case": lambda: ({"volume": s.volume, "views": s.views, "phantom": s.phantom}, {}),
        "simulate.case_folder": lambda: (
            {
                "case": marrow.simulate.case(volume=s.volume, views=s.views, phantom=s.phantom),
                "models": {name: s.closed_mesh for name in ("proximal", "distal")},
            },
            {},
        ),
        "simulate.chessboard": lambda: ({"arm": s.arm}, {"photographs": 3}),
        "simulate.clutter": lambda: ({"phantom": s.phantom}, {"fat": "mild", "plate": "mild"}),
        "simulate.cluttered_ct": lambda: ({"phantom": s.plated}, {"spacing_mm": [3, 3, 4], "range_mm": [60, 260]}),
        "simulate.cluttered_fluoroscopy": lambda: ({"phantom": s.plated, "cameras": s.cameras}, {}),
        "simulate.ct": lambda: ({"phantom": s.phantom}, {"spacing_mm": [3, 3, 4], "range_mm": [0, 200]}),
        "simulate.export": lambda: (
            {"views": s.views, "earlier_views": s.earlier},
            {"collimator": "mild", "lag": "mild"},
        ),
        "simulate.femur": lambda: ({}, {"resolution_mm": 3, "variation": 0.5}),
        "simulate.fluoroscopy": lambda: ({"phantom": s.phantom, "cameras": s.cameras}, {}),
        "simulate.fracture": lambda: ({"bone": s.bone}, {}),
        "simulate.labels": lambda: ({"phantom": s.plated, "cameras": s.cameras}, {"collimator": "mild"}),
        "simulate.hexapod": lambda: ({"phantom": s.phantom, "commands": s.sweep}, {}),
        "simulate.knee_motion": lambda: ({"phantom": s.knee}, {"frames": 6}),
        "simulate.landmarks": lambda: ({"phantom": s.phantom, "cameras": s.cameras}, {}),
        "simulate.mistake": lambda: (
            {"volume": s.volume, "seeds": s.case.seeds, "views": s.views, "truth": s.parts.truths},
            {"mistake": "wrong_camera"},
        ),
        "simulate.nail": lambda: ({}, {"resolution_mm": 2}),
        "simulate.nailing": lambda: ({"phantom": s.reduced, "implant": s.nail.implant}, {}),
        "simulate.photograph": lambda: (
            {
                "arm": s.arm,
                "phantom": s.phantom,
                "fragment": s.held.fragment["neutral"],
                "platform": s.held.platform["neutral"],
            },
            {},
        ),
        "simulate.skin_markers": lambda: ({"phantom": s.phantom}, {"false_rotation_deg": 1}),
        "simulate.sweeps": lambda: ({}, {}),
        "simulate.pelvis": lambda: ({}, {"resolution_mm": 6, "variation": 0.5}),
        "simulate.vertebra": lambda: ({}, {"resolution_mm": 3, "variation": 0.5}),
        "simulate.whole": lambda: ({"bone": s.bone}, {}),
        "robot.hexapod": lambda: ({"phantom": s.apart}, {}),
        "robot.stations": lambda: (
            {"state": s.robot.state, "camera": s.cameras["frontal"]},
            {"board": str(s.board), "stations": 3},
        ),
        "guide.closed_loop": lambda: (
            {
                "poses": s.parts.starts,
                "state": s.guide,
                "report": s.robot.report,
                "fields": s.fields,
                "models": s.parts.models,
            },
            {},
        ),
        "guide.open_loop": lambda: (
            {"poses": s.parts.starts, "hands": s.stations.hands, "targets": s.targets, "models": s.parts.models},
            {},
        ),
        "guide.target": lambda: ({"view": s.stations.views["1"]}, {"board": str(s.board)}),
        "track.begin": lambda: ({"start": s.start}, {}),
        "track.filter": lambda: ({"state": s.predicted, "pose": s.found.pose}, {}),
        "track.joint": lambda: ({"proximal": s.states, "distal": s.later_states}, {}),
        "track.predict": lambda: ({"state": s.track}, {}),
        "write.plastimatch": lambda: ({"camera": s.cameras["frontal"]}, {"pixel_mm": [1.9]}),
        "write.rtk": lambda: ({"cameras": s.cameras}, {"pixel_mm": [1.9]}),
        "write.tfm": lambda: ({"pose": s.found.pose}, {}),
        "write.xreg": lambda: ({"cameras": s.cameras}, {"pixel_mm": [1.9]}),
    }
