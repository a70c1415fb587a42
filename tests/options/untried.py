# SPDX-License-Identifier: Apache-2.0
"""Nodes, and options of others, for which no call shows an effect yet. These lists must become shorter."""
_NODES = {
    "camera": "dicom distortion_between distortion_plate distortion_points points",
    "deviations": "systematic",
    "evaluate": "common_offset deepfluoro distortion locking mirror_pose outline_offset utrecht",
    "guide": "closed_loop open_loop target",
    "initial": "silhouette",
    "read": "autoscoper deepfluoro jointtrack sequence tra utrecht xmalab_grid",
    "register": "sequence",
    "robot": "hexapod stations",
    "segment": "atlas",
    "similarity": "silhouette_overlap",
    "simulate": "bones chessboard clutter cluttered_ct cluttered_fluoroscopy distortion_plate femur hexapod "
    "implant knee_implant photograph surface vertebra",
    "track": "keyframes",
    "write": "jointtrack",
}
_OPTIONS = {
    "evaluate.shaft_width": "width_deviation_mm width_mm",
    "mask.threshold": "times",
    "plan.locking": "max_angle_deg max_cost max_offset_mm side",
    "project.lightfield": "below_hu max_memory_mb",
    "read.case": "starts",
    "read.view": "distortion",
    "read.views": "distortions",
    "read.volume": "series_uid voxel_size_mm",
    "refine.cameras": "max_iterations pixel_step reference_view",
    "register.multiresolution": "candidates finalists reach_px",
    "register.tracked": "covariance_every gate max_wide_deg max_wide_mm reach_px wide_poses",
    "segment.region_growing": "floor_hu",
    "segment.threshold": "floor_hu",
    "shaft.hough_pairs": "outline",
    "shaft.line_segments": "outline",
    "similarity.entropy_of_difference": "margin_px",
    "simulate.knee_motion": "blank",
    "track.joint": "centre_mm",
    "track.predict": "keyframe_deg keyframe_mm keyframe_speed_deg_s keyframe_speed_mm_s",
    "verdict.evidence": "contour_failure_model max_intersection_mm",
    "verdict.predicted": "beside_px clear_times doubtful_above wrong_above",
    "volume.bridge_metal": "metal_hu times_median",
}
UNTRIED = ["%s.%s" % (of, name) for of, names in (*_NODES.items(), *_OPTIONS.items()) for name in names.split()]
