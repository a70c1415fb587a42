#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Joins the scripts and styles of the workbench, and those that it shares with the report, for `marrow open`.

    tools/workbench/page/assemble.py FOLDER     # writes index.html, workbench.js and workbench.css

The page loads these files from the server, because its policy allows no script or style in the page itself.
"""
import pathlib
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
REPORT = FOLDER.parent.parent / "report" / "page"
THREE = pathlib.Path("/usr/share/javascript/three/three.min.js")  # Debian's libjs-three
# In this order. Scripts of pages come before main.js, which starts them.
FILES = """
    server geometry shell home draft case
    slice_geometry ct_state slice_input slice_picture slice_view ct_panel point_list fragments_panel
    surface_view segmentation_panel ct_landmarks save_panel
    viewport sight xray_images xray_frame xray_landmarks xray_table xray_masks xray_export xray_exchange xrays
    xray_camera_file xray_add xray_views
    place_motion place_paint place_view place_steps place_between place_frames
    place_sequence place_timeline place_controls place_case place
    pipeline_text pipeline_node pipeline_runs node_output pipeline results
    main
"""
SCRIPTS = [REPORT / (name + ".js") for name in ("dom", "orbit", "graph")]
SCRIPTS += [FOLDER / (name + ".js") for name in FILES.split()]
STYLES = [REPORT / "report.css"]
STYLES += [FOLDER / (name + ".css") for name in "workbench ct xray place pipeline".split()]


def main():
    target = pathlib.Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    scripts = [THREE] * THREE.exists() + SCRIPTS
    (target / "workbench.js").write_text("\n".join(path.read_text() for path in scripts))
    (target / "workbench.css").write_text("\n".join(path.read_text() for path in STYLES))
    (target / "index.html").write_text((FOLDER / "index.html").read_text())


if __name__ == "__main__":
    main()
