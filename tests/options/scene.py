# SPDX-License-Identifier: Apache-2.0
"""Small inputs for every node, made by nodes. Each is made when it is first asked for."""
import functools

import numpy
from harness.package import SCRATCH, SOURCE, marrow

SHORT_SEARCH = {"candidates": 1, "scan_rotation_deg": 3, "scan_translation_mm": 3}
MADE = {
    "bone": lambda s: marrow.simulate.femur(resolution_mm=3),
    "phantom": lambda s: marrow.simulate.fracture(bone=s.bone, rotation_deg=[3, -4, 5], translation_mm=[4, -3, 5]),
    "cluttered": lambda s: marrow.simulate.clutter(phantom=s.phantom).phantom,
    "cameras": lambda s: marrow.camera.carm(width_px=160, height_px=160, pixel_mm=1.9),
    "volume": lambda s: marrow.simulate.ct(phantom=s.phantom, spacing_mm=[1.6, 1.6, 2], range_mm=[0, 250]),
    "views": lambda s: marrow.simulate.fluoroscopy(phantom=s.phantom, cameras=s.cameras),
    "parts": lambda s: marrow.simulate.truth(phantom=s.phantom),
    "truth": lambda s: s.parts.truths["distal"].matrix,
    # Near the truth, with the fragment's axes.
    "start": lambda s: marrow.initial.manual(
        model=s.mesh, start=s.parts.starts["distal"], rotation_deg=[1, -1, 2], translation_mm=[1, 1, -1]
    ),
    "mesh": lambda s: s.parts.models["distal"],
    "field": lambda s: s.fields["distal"],
    # Another bone in the same place.
    "other_field": lambda s: marrow.segment.threshold(volume=s.volume, seeds=s.case.seeds, threshold_hu=300)["distal"],
    "fields": lambda s: marrow.segment.threshold(volume=s.volume, seeds=s.case.seeds),
    "coarse_mesh": lambda s: marrow.mesh.simplify(mesh=s.mesh, triangles=600),
    "edges": lambda s: marrow.edges.canny(s.views),
    "lines": lambda s: marrow.shaft.hough_pairs(edges=s.edges, view=s.views),
    "outline": lambda s: marrow.project.silhouette(model=s.coarse_mesh),
    "drr": lambda s: marrow.project.joseph(volume=s.volume, field=s.field),
    "contour": lambda s: marrow.similarity.contour_distance(projector=s.outline, views=s.views, edges=s.edges),
    "grey": lambda s: marrow.similarity.gradient_correlation(projector=s.drr, views=s.views),
    "optimizer": lambda s: marrow.optimizer.bobyqa(),
    # A pose with a covariance, and the stages to it.
    "found": lambda s: marrow.register.multiresolution(
        cost=s.contour, optimizer=s.optimizer, start=s.start, **SHORT_SEARCH
    ),
    "sequence": lambda s: marrow.register.sequence(
        cost=s.contour, finer_cost=s.grey, optimizer=s.optimizer, start=s.start, **SHORT_SEARCH
    ),
    "both_outlines": lambda s: {name: marrow.project.silhouette(model=mesh) for name, mesh in s.parts.models.items()},
    "both_drrs": lambda s: {
        name: marrow.project.joseph(volume=s.volume, field=field) for name, field in s.fields.items()
    },
    "closed_mesh": lambda s: marrow.mesh.marching_cubes(field=s.two_parts),
    # A pose known from elsewhere, with its covariance.
    "known": lambda s: marrow.initial.skin_markers(model=s.mesh, landmarks=s.skin),
    "landmarks": lambda s: marrow.simulate.landmarks(phantom=s.phantom, cameras=s.cameras)["distal"],
    "skin": lambda s: marrow.simulate.skin_markers(phantom=s.phantom)["distal"],
    "nail": lambda s: marrow.simulate.nail(resolution_mm=2),
    "nailed": lambda s: marrow.simulate.nailing(phantom=s.reduced, implant=s.nail.implant),
    "plated": lambda s: marrow.simulate.clutter(phantom=s.phantom, plate="mild", fat="mild").phantom,
    "arm": lambda s: marrow.simulate.camera_arm(),
    "boards": lambda s: marrow.simulate.chessboard(arm=s.arm, photographs=5),
    "photographed": lambda s: marrow.camera.chessboard(boards=s.boards.boards, placed=s.boards.placed),
    "sweep": lambda s: marrow.simulate.sweeps(axes=["x"], max_rotation_deg=4, turn_step_deg=4),
    "held": lambda s: marrow.simulate.hexapod(phantom=s.phantom, commands=s.sweep),
    "photographs": lambda s: marrow.simulate.photograph(
        arm=s.arm, phantom=s.phantom, fragment=s.held.fragment["neutral"], platform=s.held.platform["neutral"]
    ),
    "board": lambda s: SOURCE / "pipelines" / "calibration" / "board.yaml",
    "beads": lambda s: marrow.simulate.bead_board(
        board=str(s.board), width_px=512, height_px=512, pixel_mm=0.6, views=4
    ),
    # A robot holds two fragments that do not touch.
    "apart": lambda s: marrow.simulate.fracture(bone=s.bone, rotation_deg=[3, -4, 5], translation_mm=[8, -6, -25]),
    "robot": lambda s: marrow.robot.hexapod(phantom=s.apart),
    "guide": lambda s: marrow.guide.begin(),
    "stations": lambda s: marrow.robot.stations(
        state=s.robot.state, camera=s.fine_cameras["frontal"], board=str(s.board), stations=4
    ),
    "fine_cameras": lambda s: marrow.camera.carm(width_px=512, height_px=512, pixel_mm=0.6),
    "targets": lambda s: marrow.guide.target(view=s.stations.views, board=str(s.board)),
    "later_states": lambda s: dict(zip(s.states, reversed(list(s.states.values())))),
    "first_predicted": lambda s: marrow.track.predict(state=marrow.track.begin(start=s.start)).state,
    "keyframes": lambda s: marrow.track.autoscoper(states=s.states),
    "predicted": lambda s: marrow.track.predict(state=s.track).state,
    "plan": lambda s: marrow.plan.locking(implant=s.nail.implant, pose=s.nailed.start, views=s.views, from_=[1, 0, 0]),
    "pipelines": lambda s: SOURCE / "pipelines",
}


class Scene:
    """A femur in two parts, its CT in coarse voxels, two small X-ray images, and what is made of them."""

    def __getattr__(self, name):
        if name not in MADE:
            raise AttributeError(name)
        setattr(self, name, MADE[name](self))
        return getattr(self, name)

    @functools.cached_property
    def case(self):
        made = marrow.simulate.case(volume=self.volume, views=self.views, phantom=self.phantom, start="exact")
        return marrow.simulate.case_parts(case=made)

    @functools.cached_property
    def two_parts(self):
        """A field with a large part and a small one."""
        z, y, x = numpy.mgrid[0:24, 0:24, 0:30].astype("float32")
        large = numpy.hypot(numpy.hypot(x - 11, y - 11), z - 12) - 8.3
        small = numpy.hypot(numpy.hypot(x - 25, y - 19), z - 19) - 2.6
        return marrow.SignedField(numpy.minimum(large, small).astype("float32"), spacing_mm=(1, 1, 1))

    @functools.cached_property
    def placed(self):
        """The bone's surface where it is."""
        mesh = self.mesh
        points = mesh.vertices_mm @ self.truth[:3, :3].T + self.truth[:3, 3]
        return marrow.Mesh(points, mesh.triangles, frame="world")

    @functools.cached_property
    def track(self):
        state = marrow.track.begin(start=self.start)
        state = marrow.track.predict(state=state).state
        return marrow.track.filter(state=state, pose=self.found.pose).state

    @functools.cached_property
    def reduced(self):
        """A nail goes only into a femur whose parts are in place."""
        fracture = marrow.simulate.fracture(
            bone=self.bone, rotation_deg=[0.3, -0.3, 1], translation_mm=[0.4, -0.4, 0.5]
        )
        return marrow.simulate.clutter(phantom=fracture).phantom

    @functools.cached_property
    def metal(self):
        """A CT with a screw, and its streaks."""
        samples = numpy.array(self.volume.array)
        samples[55:60, 28:34, 30:52] = 9000
        samples[55:60, 28:34, 44:47] = 2800
        return marrow.Volume(samples, spacing_mm=(1.6, 1.6, 2))

    @functools.cached_property
    def knee(self):
        whole = marrow.simulate.whole(bone=self.bone)
        return marrow.simulate.clutter(phantom=whole, knee="mild").phantom

    @functools.cached_property
    def earlier(self):
        made = marrow.simulate.clutter(phantom=self.phantom, lag="mild")
        return marrow.simulate.cluttered_fluoroscopy(phantom=made.earlier, cameras=self.cameras)

    @functools.cached_property
    def seen_points(self):
        """Six points, and where they are seen, some pixels off."""
        path = SCRATCH / "seen.yaml"
        lines = ["marrow-points: 1", "points:"]
        for i, point in enumerate(self.mesh.vertices_mm[:: len(self.mesh.vertices_mm) // 6][:6]):
            seen = []
            for name, camera in self.cameras.items():
                at = camera.intrinsics @ (camera.camera_from_world @ [*point, 1])[:3]
                seen.append("%s: [%.3f, %.3f]" % (name, at[0] / at[2] + 3 * (i % 2), at[1] / at[2] - i))
            lines.append("  - {at_mm: [%.4f, %.4f, %.4f], seen_px: {%s}}" % (*point, ", ".join(seen)))
        path.write_text("\n".join(lines) + "\n")
        return path

    @functools.cached_property
    def poses(self):
        """The pose in five frames."""
        poses = {}
        for i in range(5):
            poses[str(i + 1)] = marrow.initial.manual(
                model=self.mesh, start=self.start, rotation_deg=[i, 0.5 * i, -i], translation_mm=[0.2 * i, 0, i]
            )
        return poses

    @functools.cached_property
    def states(self):
        state, states = marrow.track.begin(start=self.start), {}
        for name, pose in self.poses.items():
            state = marrow.track.filter(state=marrow.track.predict(state=state).state, pose=pose).state
            states[name] = state
        return states

    @functools.cached_property
    def frames_metrics(self):
        truth = self.parts.truths["distal"]
        return {
            name: marrow.evaluate.pose_error(pose=pose, truth=truth, model=self.mesh)
            for name, pose in self.poses.items()
        }
