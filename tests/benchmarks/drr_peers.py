#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""drr_peers.py BUILD [PICTURES]: radiographs by marrow and by plastimatch (Debian package plastimatch), same volume,
view, threads and run.

plastimatch is timed by its own clock, which counts neither its start nor the reading of the volume. Errors are against
marrow's ray casting at 0.05 mm, after the factor that plastimatch's units need. In the folder PICTURES, for thigh and
bone: that reference, each projector's image and plastimatch's, and below them the differences from the reference, grey
= 0, black and white = -5 and 5 mm of water.
"""
import os
import pathlib
import re
import shlex
import shutil
import statistics
import subprocess
import sys
import tempfile

import numpy

BUILD = pathlib.Path(sys.argv[1])
THREADS = "2"
ROUNDS = 1 if "MARROW_SHORT_BENCHMARK" in os.environ else 9


def plastimatch(volume, out, pixels):
    """Milliseconds, and the image along the same rays as marrow's, but for turns and mirrors."""
    view = shlex.split("-i exact -z '230 230' --sad 600 --sid 1000 -o '0 0 0' -n '0 1 0' --vup '0 0 1' -t raw")
    done = subprocess.run(
        ["plastimatch", "drr", *view, "-r", "%d %d" % (pixels, pixels), "-O", str(out), str(volume)],
        check=True,
        capture_output=True,
        text=True,
        env=dict(os.environ, OMP_NUM_THREADS=THREADS),
    )
    total, writing = (float(re.search(what + r" time: ([0-9.e-]+)", done.stdout).group(1)) for what in ("Total", "I/O"))
    return 1000 * (total - writing), numpy.fromfile(str(out) + "0000.raw", dtype="<f4").reshape(pixels, pixels)


def root_mean_square(difference):
    return float(numpy.sqrt(numpy.mean(difference**2)))


def like(image, reference):
    """The image turned, mirrored and scaled as the reference is."""
    candidates = [numpy.rot90(flipped, turn) for flipped in (image, image[:, ::-1]) for turn in range(4)]
    return min(
        (one * (reference.sum() / one.sum()) for one in candidates), key=lambda one: root_mean_square(one - reference)
    )


def picture(path, reference, images):
    import PIL.Image  # python3-pil; only pictures need it

    def grey(image, low, high):
        return (255 * numpy.clip((image - low) / (high - low), 0, 1)).astype(numpy.uint8)

    tops = [grey(-image, -reference.max(), 0) for image in [reference] + images]
    bottoms = [grey(image - reference, -5, 5) for image in [reference] + images]
    PIL.Image.fromarray(numpy.vstack([numpy.hstack(tops), numpy.hstack(bottoms)])).save(path)


def main():
    if not shutil.which("plastimatch") or not (BUILD / "bin" / "drr_benchmark").exists():
        print("plastimatch or drr_benchmark is missing: apt-get install plastimatch")
        sys.exit(77)
    version = subprocess.run(["plastimatch", "--version"], capture_output=True, text=True).stdout.strip()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        ours = subprocess.run(
            [str(BUILD / "bin" / "drr_benchmark"), str(folder)], check=True, capture_output=True, text=True
        ).stdout
        print(ours, end="")
        for what in ("thigh", "bone"):
            read = lambda name: numpy.fromfile(folder / ("%s_%s_256.f32" % (what, name)), dtype="<f4").reshape(256, 256)
            reference = read("reference")
            for pixels in (512, 256):
                runs = [plastimatch(folder / (what + ".mha"), folder / "peer_", pixels) for _ in range(ROUNDS)]
                theirs = statistics.median(time for time, _ in runs)
                mine = float(re.search(r"%s +joseph +%d x %d: +([0-9.]+) ms" % (what, pixels, pixels), ours).group(1))
                error = ""
                if pixels == 256:
                    peer = like(runs[0][1], reference)
                    error = ", root mean square error %.4f mm" % root_mean_square(peer - reference)
                    if len(sys.argv) > 2:
                        pathlib.Path(sys.argv[2]).mkdir(parents=True, exist_ok=True)
                        picture(
                            pathlib.Path(sys.argv[2]) / (what + ".png"),
                            reference,
                            [read(name) for name in ("joseph", "ray_casting", "siddon_jacobs", "lightfield")] + [peer],
                        )
                print(
                    "%s, %d x %d: %s exact %.1f ms%s; project.joseph %.2f ms: %.1f times faster"
                    % (what, pixels, pixels, version, theirs, error, mine, theirs / mine)
                )


main()
