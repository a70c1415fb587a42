# SPDX-License-Identifier: Apache-2.0
"""How the nodes are called that make models, features and poses: (inputs, options) by the node's name."""

from files_of_scene import network, points_network, slices_network

GREY_VALUES = (  # costs that compare a radiograph with the image
    "entropy_of_difference",
    "gradient_correlation",
    "gradient_difference",
    "gradient_orientation",
    "metal_gradient_correlation",
    "mutual_information",
    "normalised_cross_correlation",
    "patch_correlation",
    "patch_gradient_correlation",
    "pattern_intensity",
)


def calls(s):
    def views_and(**more):
        return {"views": s.views, **more}

    def others(of_outlines):
        drawn = {"other_projectors": s.both_outlines if of_outlines else s.both_drrs}
        return {"others": s.parts.starts, **drawn, **({} if of_outlines else {"other_outlines": s.both_outlines})}

    search = dict(scan_rotation_deg=6, scan_translation_mm=6, candidates=2, max_evaluations=60)
    made = {
        "edges.%s" % name: lambda: ({"view": s.views["frontal"]}, {})
        for name in ("adaptive_relaxation", "canny", "gradient_mask", "laplacian_of_gaussian")
    }
    made.update(
        {
            "mesh.%s" % name: lambda: ({"field": s.two_parts}, {})
            for name in ("flying_edges", "marching_cubes", "surface_nets")
        }
    )
    made.update({"mesh.%s" % name: lambda: ({"field": s.two_parts}, {}) for name in ("delaunay", "poisson")})
    made.update(
        {
            "project.%s" % n: lambda: ({"volume": s.volume, "field": s.field}, {})
            for n in ("joseph", "opencl", "ray_casting")
        }
    )
    made.update(
        {
            "shaft.%s"
            % n: lambda: (
                {"edges": s.edges["frontal"], "view": s.views["frontal"]},
                {"width_mm": [28], "width_deviation_mm": [2]},
            )
            for n in ("hough_pairs", "line_segments", "ransac")
        }
    )
    made.update(
        {"similarity.%s" % name: lambda: (views_and(projector=s.drr, **others(False)), {}) for name in GREY_VALUES}
    )

    def segment(**more):
        return {"volume": s.volume, "seeds": s.case.seeds, **more}

    made.update(
        {
            "segment.%s" % name: lambda: (segment(), {})
            for name in ("distance_regularised", "level_set", "region_growing", "sparse_field", "threshold")
        }
    )
    made.update(
        {
            "mesh.simplify": lambda: ({"mesh": s.mesh}, {"triangles": 900}),
            "mesh.smooth": lambda: ({"mesh": s.closed_mesh}, {}),
            "segment.network": lambda: (segment(), {"network": slices_network()}),
            "segment.given": lambda: ({"volume": s.volume, "surface": {"bone": s.closed_mesh}}, {}),
            "segment.atlas": lambda: (segment(template=s.mesh), {"iterations": 4}),
            "project.siddon_jacobs": lambda: ({"volume": s.volume, "field": s.field}, {}),
            "project.lightfield": lambda: (
                {"volume": s.volume, "field": s.field, "views": s.views},
                {"ray_spacing_mm": 12, "direction_spacing_deg": 6, "max_rotation_deg": 6},
            ),
            "project.silhouette": lambda: ({"model": s.mesh, "volume": s.volume}, {}),
            "project.silhouette_edges": lambda: ({"model": s.mesh, "volume": s.volume}, {}),
            "similarity.contour_distance": lambda: (
                views_and(
                    projector=s.outline, edges=s.edges, **others(True), **s.with_model("similarity.contour_distance")
                ),
                {},
            ),
            "similarity.drr_edges": lambda: (
                views_and(
                    projector=s.drr,
                    edges=s.edges,
                    outline=s.outline,
                    **others(True),
                    **s.with_model("similarity.drr_edges")
                ),
                {},
            ),
            "similarity.gradient_projection": lambda: (views_and(model=s.mesh, volume=s.volume), {}),
            "similarity.ray_to_surface": lambda: (
                views_and(
                    field=s.field,
                    edges=s.edges,
                    projector=s.outline,
                    **others(True),
                    **s.with_model("similarity.ray_to_surface")
                ),
                {},
            ),
            "similarity.with_prior": lambda: ({"cost": s.grey, "prior": s.known, "found": s.found.pose}, {}),
            "similarity.with_contact": lambda: (
                {
                    "cost": s.grey,
                    "found": s.found.pose,
                    "model": s.mesh,
                    "field": s.field,
                    "poses": {"distal": s.start, "other": s.start},
                    "other_bones": {"distal": s.field, "other": s.other_field},
                },
                {},
            ),
            "register.together": lambda: (
                {
                    "costs": {"distal": s.contour, "other": s.contour},
                    "optimizer": s.optimizer,
                    "starts": {"distal": s.start, "other": s.found.pose},
                },
                {},
            ),
            "register.icp": lambda: ({"start": s.start, "model": s.mesh, "target": s.placed}, {"points": 300}),
            "register.multiresolution": lambda: (
                {"cost": s.contour, "optimizer": s.optimizer, "start": s.start},
                search,
            ),
            "register.sequence": lambda: (
                {"cost": s.contour, "finer_cost": s.grey, "optimizer": s.optimizer, "start": s.start},
                search,
            ),
            "register.tracked": lambda: (
                {
                    "cost": s.contour,
                    "finer_cost": s.grey,
                    "optimizer": s.optimizer,
                    "start": s.found.pose,
                    "state": s.track,
                },
                {"wide_poses": 20, "gate": 0.01},
            ),
            "initial.best_of": lambda: (
                {"first": s.start, "second": s.parts.starts["distal"], "cost": s.contour, "optimizer": s.optimizer},
                {},
            ),
            "initial.fiducials": lambda: ({"model": s.mesh, "landmarks": s.skin}, {}),
            "initial.global_search": lambda: (
                {"model": s.mesh, "cost": s.contour, "optimizer": s.optimizer, "start": s.start},
                {"poses": 60, "candidates": 6, "finalists": 2, "max_evaluations": 60},
            ),
            "initial.landmarks": lambda: ({"model": s.mesh, "landmarks": s.landmarks, "views": s.views}, {}),
            "landmarks.network": lambda: (
                {"points": s.landmarks, "views": s.views},
                {"network": points_network("points", sorted(s.landmarks.points_mm))},
            ),
            "landmarks.template_matching": lambda: (
                {"points": s.landmarks, "views": s.views, "projector": s.drr, "start": s.start},
                {},
            ),
            "points.extremes": lambda: (
                {"model": s.mesh},
                {
                    "names": ["medial", "lateral"],
                    "outward": [-1, 1],
                    "back": [0, 0.5],
                    "up": [0, -0.5],
                    "level": ["medial", "lateral"],
                },
            ),
            "initial.manual": lambda: ({"model": s.mesh, "start": s.start}, {"rotation_deg": [3, 1, 2]}),
            "initial.shaft_axis": lambda: ({"model": s.mesh, "lines": s.lines, "views": s.views}, {}),
            "initial.skin_markers": lambda: ({"model": s.mesh, "landmarks": s.skin}, {}),
            "deviations.calibrated": lambda: ({"stages": s.sequence.stages, "model": s.mesh}, {}),
            "refine.cameras": lambda: (
                {"views": s.views, "costs": {"distal": s.contour}, "poses": {"distal": s.found.pose}},
                {"max_iterations": 3},
            ),
            "verdict.evidence": lambda: (
                {
                    "pose": s.found.pose,
                    "cost": s.grey,
                    "contour_cost": s.contour,
                    "optimizer": s.optimizer,
                    "views": s.views,
                    "edges": s.edges,
                    "projector": s.outline,
                    "model": s.mesh,
                    "others": {"other": s.start},
                    "other_bones": {"other": s.field},
                },
                {"failure_model": str(s.pipelines / "verdict" / "femora-contour.yaml")},
            ),
            "verdict.predicted": lambda: ({"pose": s.found.pose, "model": s.mesh, "prior": s.known}, {}),
            "mask.body": lambda: ({"view": s.views["frontal"], "projector": s.drr, "pose": s.start}, {}),
            "mask.metal": lambda: ({"view": s.views["frontal"]}, {"contrast_low": 0.2, "contrast_high": 0.3}),
            "mask.threshold": lambda: ({"view": s.views["frontal"]}, {"times": 1, "opening_px": 1, "at_border": True}),
            "mask.network": lambda: (
                {"view": s.views["frontal"]},
                {"network": network(classes=("metal", "outside")), "leave_out": ["metal"]},
            ),
            "edges.network": lambda: ({"view": s.views["frontal"]}, {"network": network(), "threshold": 4}),
            "mask.near_holes": lambda: (
                {"view": s.views["frontal"], "implant": s.nail.implant, "pose": s.nailed.start},
                {},
            ),
            "volume.bridge_metal": lambda: ({"volume": s.metal}, {}),
            "volume.filled_surface": lambda: ({"mesh": s.closed_mesh}, {"spacing_mm": 3}),
        }
    )
    made.update(
        {"optimizer.%s" % n: lambda: ({}, {}) for n in ("bobyqa", "cma_es", "direct", "grid", "lbfgs", "nelder_mead")}
    )
    made.update({"optimizer.%s" % n: lambda: ({}, {}) for n in ("levenberg_marquardt", "powell", "sbplx")})
    return made
