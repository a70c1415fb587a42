# SPDX-License-Identifier: Apache-2.0
"""How the nodes are called that make models, features and poses: inputs and options by the node's name."""

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

    def segment(**more):
        return {"volume": s.volume, "seeds": s.case.seeds, **more}

    def lines():
        return dict(edges=s.edges["frontal"], view=s.views["frontal"], width_mm=[28], width_deviation_mm=[2])

    def drawn():
        return dict(volume=s.volume, field=s.field)

    alike = (
        (
            "edges",
            "adaptive_relaxation canny gradient_mask laplacian_of_gaussian",
            lambda: dict(view=s.views["frontal"]),
        ),
        ("mesh", "delaunay flying_edges marching_cubes poisson surface_nets", lambda: dict(field=s.two_parts)),
        ("optimizer", "bobyqa cma_es direct grid lbfgs levenberg_marquardt nelder_mead powell sbplx", dict),
        ("project", "joseph opencl ray_casting siddon_jacobs", drawn),
        ("segment", "distance_regularised level_set region_growing sparse_field threshold", segment),
        ("shaft", "hough_pairs line_segments ransac", lines),
        ("similarity", " ".join(GREY_VALUES), lambda: views_and(projector=s.drr, **others(False))),
    )
    search = dict(scan_rotation_deg=6, scan_translation_mm=6, candidates=2, max_evaluations=60)
    return {
        **{"%s.%s" % (kind, name): call for kind, names, call in alike for name in names.split()},
        "mesh.simplify": lambda: dict(mesh=s.mesh, triangles=900),
        "mesh.smooth": lambda: dict(mesh=s.closed_mesh),
        "segment.network": lambda: segment(network=slices_network()),
        "segment.given": lambda: dict(volume=s.volume, surface={"bone": s.closed_mesh}),
        "segment.atlas": lambda: segment(template=s.mesh, iterations=4),
        "project.lightfield": lambda: dict(
            volume=s.volume,
            field=s.field,
            views=s.views,
            ray_spacing_mm=12,
            direction_spacing_deg=6,
            max_rotation_deg=6,
        ),
        "project.silhouette": lambda: dict(model=s.mesh, volume=s.volume),
        "project.silhouette_edges": lambda: dict(model=s.mesh, volume=s.volume),
        "similarity.contour_distance": lambda: views_and(projector=s.outline, edges=s.edges, **others(True)),
        "similarity.drr_edges": lambda: views_and(projector=s.drr, edges=s.edges, outline=s.outline, **others(True)),
        "similarity.gradient_projection": lambda: views_and(model=s.mesh, volume=s.volume),
        "similarity.ray_to_surface": lambda: views_and(
            field=s.field, edges=s.edges, projector=s.outline, **others(True)
        ),
        "similarity.with_prior": lambda: dict(cost=s.grey, prior=s.known, found=s.found.pose),
        "similarity.with_contact": lambda: dict(
            cost=s.grey,
            found=s.found.pose,
            model=s.mesh,
            field=s.field,
            poses={"distal": s.start, "other": s.start},
            other_bones={"distal": s.field, "other": s.other_field},
        ),
        "register.together": lambda: dict(
            costs={"distal": s.contour, "other": s.contour},
            optimizer=s.optimizer,
            starts={"distal": s.start, "other": s.found.pose},
        ),
        "register.icp": lambda: dict(start=s.start, model=s.mesh, target=s.placed, points=300),
        "register.multiresolution": lambda: dict(cost=s.contour, optimizer=s.optimizer, start=s.start, **search),
        "register.sequence": lambda: dict(
            cost=s.contour, finer_cost=s.grey, optimizer=s.optimizer, start=s.start, **search
        ),
        "register.tracked": lambda: dict(
            cost=s.contour,
            finer_cost=s.grey,
            optimizer=s.optimizer,
            start=s.found.pose,
            state=s.track,
            wide_poses=20,
            gate=0.01,
        ),
        "initial.best_of": lambda: dict(
            first=s.start, second=s.parts.starts["distal"], cost=s.contour, optimizer=s.optimizer
        ),
        "initial.fiducials": lambda: dict(model=s.mesh, landmarks=s.skin),
        "initial.global_search": lambda: dict(
            model=s.mesh,
            cost=s.contour,
            optimizer=s.optimizer,
            start=s.start,
            poses=60,
            candidates=6,
            finalists=2,
            max_evaluations=60,
        ),
        "initial.landmarks": lambda: dict(model=s.mesh, landmarks=s.landmarks, views=s.views),
        "landmarks.network": lambda: dict(
            points=s.landmarks, views=s.views, network=points_network("points", sorted(s.landmarks.points_mm))
        ),
        "landmarks.template_matching": lambda: dict(points=s.landmarks, views=s.views, projector=s.drr, start=s.start),
        "points.extremes": lambda: dict(
            model=s.mesh,
            names=["medial", "lateral"],
            outward=[-1, 1],
            back=[0, 0.5],
            up=[0, -0.5],
            level=["medial", "lateral"],
        ),
        "initial.manual": lambda: dict(model=s.mesh, start=s.start, rotation_deg=[3, 1, 2]),
        "initial.shaft_axis": lambda: dict(model=s.mesh, lines=s.lines, views=s.views),
        "initial.skin_markers": lambda: dict(model=s.mesh, landmarks=s.skin),
        "deviations.calibrated": lambda: dict(stages=s.sequence.stages, model=s.mesh),
        "refine.cameras": lambda: dict(
            views=s.views, costs={"distal": s.contour}, poses={"distal": s.found.pose}, max_iterations=3
        ),
        "verdict.evidence": lambda: dict(
            pose=s.found.pose,
            cost=s.grey,
            contour_cost=s.contour,
            optimizer=s.optimizer,
            views=s.views,
            edges=s.edges,
            projector=s.outline,
            model=s.mesh,
            others={"other": s.start},
            other_bones={"other": s.field},
            failure_model=str(s.pipelines / "verdict" / "femora-contour.yaml"),
        ),
        "verdict.predicted": lambda: dict(pose=s.found.pose, model=s.mesh, prior=s.known),
        "mask.body": lambda: dict(view=s.views["frontal"], projector=s.drr, pose=s.start),
        "mask.metal": lambda: dict(view=s.views["frontal"], contrast_low=0.2, contrast_high=0.3),
        "mask.threshold": lambda: dict(view=s.views["frontal"], times=1, opening_px=1, at_border=True),
        "mask.network": lambda: dict(
            view=s.views["frontal"], network=network(classes=("metal", "outside")), leave_out=["metal"]
        ),
        "edges.network": lambda: dict(view=s.views["frontal"], network=network(), threshold=4),
        "mask.near_holes": lambda: dict(view=s.views["frontal"], implant=s.nail.implant, pose=s.nailed.start),
        "volume.bridge_metal": lambda: dict(volume=s.metal),
        "volume.filled_surface": lambda: dict(mesh=s.closed_mesh, spacing_mm=3),
    }
