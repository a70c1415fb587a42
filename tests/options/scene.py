# SPDX-License-Identifier: Apache-2.0
"""Small inputs for every node, made by nodes. Each is made when it is first asked for."""
import functools

import numpy
from harness.package import SCRATCH, SOURCE, marrow


SHORT_SEARCH = {"candidates": 1, "scan_rotation_deg": 3, "scan_translation_mm": 3}


class Scene:
    """A femur in two parts, its CT in coarse voxels, two small X-ray images, and what is made of them."""

    folder = SCRATCH / "options"

    @functools.cached_property
    def bone(self):
        return marrow.simulate.femur(resolution_mm=3)

    @functools.cached_property
    def phantom(self):
        return marrow.simulate.fracture(bone=self.bone, rotation_deg=[3, -4, 5], translation_mm=[4, -3, 5])

    @functools.cached_property
    def cluttered(self):
        return marrow.simulate.clutter(phantom=self.phantom).phantom

    @functools.cached_property
    def cameras(self):
        return marrow.camera.carm(width_px=160, height_px=160, pixel_mm=1.9)

    @functools.cached_property
    def volume(self):
        return marrow.simulate.ct(phantom=self.phantom, spacing_mm=[1.6, 1.6, 2], range_mm=[0, 250])

    @functools.cached_property
    def views(self):
        return marrow.simulate.fluoroscopy(phantom=self.phantom, cameras=self.cameras)

    @functools.cached_property
    def parts(self):
        return marrow.simulate.truth(phantom=self.phantom)

    @functools.cached_property
    def case(self):
        made = marrow.simulate.case(volume=self.volume, views=self.views, phantom=self.phantom, start="exact")
        return marrow.simulate.case_parts(case=made)

    @property
    def truth(self):
        return self.parts.truths["distal"].matrix

    @functools.cached_property
    def start(self):
        """Near the truth, with the fragment's axes."""
        return marrow.initial.manual(
            model=self.mesh, start=self.parts.starts["distal"], rotation_deg=[1, -1, 2], translation_mm=[1, 1, -1]
        )

    @property
    def mesh(self):
        return self.parts.models["distal"]

    @property
    def field(self):
        return self.fields["distal"]

    @functools.cached_property
    def other_field(self):
        """Another bone in the same place."""
        return marrow.segment.threshold(volume=self.volume, seeds=self.case.seeds, threshold_hu=300)["distal"]

    @functools.cached_property
    def fields(self):
        return marrow.segment.threshold(volume=self.volume, seeds=self.case.seeds)

    @functools.cached_property
    def coarse_mesh(self):
        return marrow.mesh.simplify(mesh=self.mesh, triangles=600)

    @functools.cached_property
    def edges(self):
        return marrow.edges.canny(self.views)

    @functools.cached_property
    def lines(self):
        return marrow.shaft.hough_pairs(edges=self.edges, view=self.views)

    @functools.cached_property
    def outline(self):
        return marrow.project.silhouette(model=self.coarse_mesh)

    @functools.cached_property
    def drr(self):
        return marrow.project.joseph(volume=self.volume, field=self.field)

    @functools.cached_property
    def contour(self):
        return marrow.similarity.contour_distance(
            projector=self.outline, views=self.views, edges=self.edges, **self.with_model("similarity.contour_distance")
        )

    @functools.cached_property
    def grey(self):
        return marrow.similarity.gradient_correlation(projector=self.drr, views=self.views)

    @functools.cached_property
    def optimizer(self):
        return marrow.optimizer.bobyqa()

    @functools.cached_property
    def found(self):
        """A pose with a covariance, and the stages to it."""
        return marrow.register.multiresolution(
            cost=self.contour, optimizer=self.optimizer, start=self.start, **SHORT_SEARCH
        )

    @functools.cached_property
    def sequence(self):
        return marrow.register.sequence(
            cost=self.contour, finer_cost=self.grey, optimizer=self.optimizer, start=self.start, **SHORT_SEARCH
        )

    @functools.cached_property
    def both_outlines(self):
        return {name: marrow.project.silhouette(model=mesh) for name, mesh in self.parts.models.items()}

    @functools.cached_property
    def both_drrs(self):
        return {name: marrow.project.joseph(volume=self.volume, field=field) for name, field in self.fields.items()}

    @functools.cached_property
    def two_parts(self):
        """A field with a large part and a small one."""
        z, y, x = numpy.mgrid[0:24, 0:24, 0:30].astype("float32")
        large = numpy.hypot(numpy.hypot(x - 11, y - 11), z - 12) - 8.3
        small = numpy.hypot(numpy.hypot(x - 25, y - 19), z - 19) - 2.6
        return marrow.SignedField(numpy.minimum(large, small).astype("float32"), spacing_mm=(1, 1, 1))

    @functools.cached_property
    def closed_mesh(self):
        return marrow.mesh.marching_cubes(field=self.two_parts)

    @functools.cached_property
    def placed(self):
        """The bone's surface where it is."""
        mesh = self.mesh
        points = mesh.vertices_mm @ self.truth[:3, :3].T + self.truth[:3, 3]
        return marrow.Mesh(points, mesh.triangles, frame="world")

    @functools.cached_property
    def known(self):
        """A pose known from elsewhere, with its covariance."""
        return marrow.initial.skin_markers(model=self.mesh, landmarks=self.skin)

    @functools.cached_property
    def landmarks(self):
        return marrow.simulate.landmarks(phantom=self.phantom, cameras=self.cameras)["distal"]

    @functools.cached_property
    def track(self):
        state = marrow.track.begin(start=self.start)
        state = marrow.track.predict(state=state).state
        return marrow.track.filter(state=state, pose=self.found.pose).state

    @functools.cached_property
    def skin(self):
        return marrow.simulate.skin_markers(phantom=self.phantom)["distal"]

    @functools.cached_property
    def reduced(self):
        """A nail goes only into a femur whose parts are in place."""
        fracture = marrow.simulate.fracture(
            bone=self.bone, rotation_deg=[0.3, -0.3, 1], translation_mm=[0.4, -0.4, 0.5]
        )
        return marrow.simulate.clutter(phantom=fracture).phantom

    @functools.cached_property
    def nail(self):
        return marrow.simulate.nail(resolution_mm=2)

    @functools.cached_property
    def nailed(self):
        return marrow.simulate.nailing(phantom=self.reduced, implant=self.nail.implant)

    @functools.cached_property
    def metal(self):
        """A CT with a screw, and its streaks."""
        samples = numpy.array(self.volume.array)
        samples[55:60, 28:34, 30:52] = 9000
        samples[55:60, 28:34, 44:47] = 2800
        return marrow.Volume(samples, spacing_mm=(1.6, 1.6, 2))

    @functools.cached_property
    def plated(self):
        return marrow.simulate.clutter(phantom=self.phantom, plate="mild", fat="mild").phantom

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
    def arm(self):
        return marrow.simulate.camera_arm()

    @functools.cached_property
    def boards(self):
        return marrow.simulate.chessboard(arm=self.arm, photographs=5)

    @functools.cached_property
    def photographed(self):
        return marrow.camera.chessboard(boards=self.boards.boards, placed=self.boards.placed)

    @functools.cached_property
    def sweep(self):
        return marrow.simulate.sweeps(axes=["x"], max_rotation_deg=4, turn_step_deg=4)

    @functools.cached_property
    def held(self):
        return marrow.simulate.hexapod(phantom=self.phantom, commands=self.sweep)

    @functools.cached_property
    def photographs(self):
        return marrow.simulate.photograph(
            arm=self.arm,
            phantom=self.phantom,
            fragment=self.held.fragment["neutral"],
            platform=self.held.platform["neutral"],
        )

    @property
    def board(self):
        return SOURCE / "pipelines" / "calibration" / "board.yaml"

    @functools.cached_property
    def beads(self):
        return marrow.simulate.bead_board(board=str(self.board), width_px=512, height_px=512, pixel_mm=0.6, views=4)

    @functools.cached_property
    def apart(self):
        """A robot holds two fragments that do not touch."""
        return marrow.simulate.fracture(bone=self.bone, rotation_deg=[3, -4, 5], translation_mm=[8, -6, -25])

    @functools.cached_property
    def robot(self):
        return marrow.robot.hexapod(phantom=self.apart)

    @functools.cached_property
    def guide(self):
        return marrow.guide.begin()

    @functools.cached_property
    def stations(self):
        return marrow.robot.stations(
            state=self.robot.state, camera=self.fine_cameras["frontal"], board=str(self.board), stations=4
        )

    @functools.cached_property
    def fine_cameras(self):
        return marrow.camera.carm(width_px=512, height_px=512, pixel_mm=0.6)

    @functools.cached_property
    def targets(self):
        return marrow.guide.target(view=self.stations.views, board=str(self.board))

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
    def later_states(self):
        return dict(zip(self.states, reversed(list(self.states.values()))))

    @functools.cached_property
    def first_predicted(self):
        return marrow.track.predict(state=marrow.track.begin(start=self.start)).state

    @functools.cached_property
    def keyframes(self):
        return marrow.track.autoscoper(states=self.states)

    @functools.cached_property
    def predicted(self):
        return marrow.track.predict(state=self.track).state

    @functools.cached_property
    def frames_metrics(self):
        truth = self.parts.truths["distal"]
        return {
            name: marrow.evaluate.pose_error(pose=pose, truth=truth, model=self.mesh)
            for name, pose in self.poses.items()
        }

    @functools.cached_property
    def plan(self):
        return marrow.plan.locking(implant=self.nail.implant, pose=self.nailed.start, views=self.views, from_=[1, 0, 0])

    @property
    def pipelines(self):
        return SOURCE / "pipelines"

    @staticmethod
    def ports_of(name):
        return {port["name"] for port in marrow._core.node_info(name)["inputs"]}

    def with_model(self, name):
        return {"model": self.mesh} if "model" in self.ports_of(name) else {}
