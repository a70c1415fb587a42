#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""drr_peers.py BUILD [PICTURES]: radiographs by marrow and by plastimatch (Debian package plastimatch), same volume, geometry, threads and run.

plastimatch is timed by the difference of a run with one image and one with eleven, so neither its start nor the reading of the volume counts. Errors
are against marrow's ray casting at 0.05 mm, after the factor that plastimatch's units need. In the folder PICTURES, for thigh and bone: that reference, each
program's and projector's image, and below them the differences from the reference, grey = 0, black and white = -5 and 5 mm of water.
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy

BUILD = pathlib.Path(sys.argv[1])
THREADS = "2"


def plastimatch(volume, out, pixels, images):
    start = time.perf_counter()
    subprocess.run(["plastimatch", "drr", "-i", "exact", "-r", "%d %d" % (pixels, pixels), "-z", "230 230", "--sad", "600", "--sid", "1000", "-o", "0 0 0", "-a", str(images), "-N", "0.01",
                    "-y", "0", "-t", "raw", "-O", str(out), str(volume)], check=True, capture_output=True, env=dict(os.environ, OMP_NUM_THREADS=THREADS))
    return time.perf_counter() - start


def picture(path, reference, images):
    import PIL.Image  # python3-pil; only pictures need it

    def grey(image, low, high):
        return (255 * numpy.clip((image - low) / (high - low), 0, 1)).astype(numpy.uint8)
    tops = [grey(-image, -reference.max(), 0) for image in [reference] + images]
    bottoms = [grey(image - reference, -5, 5) for image in [reference] + images]
    PIL.Image.fromarray(numpy.vstack([numpy.hstack(tops), numpy.hstack(bottoms)])).save(path)


def peer_image(volume, out):
    """256 x 256 pixels along the same rays as marrow's, but for turns and mirrors."""
    subprocess.run(["plastimatch", "drr", "-i", "exact", "-r", "256 256", "-z", "230 230", "--sad", "600", "--sid", "1000", "-o", "0 0 0", "-n", "0 1 0", "--vup", "0 0 1", "-t", "raw", "-O", str(out),
                    str(volume)], check=True, capture_output=True)
    return numpy.fromfile(str(out) + "0000.raw", dtype="<f4").reshape(256, 256)


def main():
    version = subprocess.run(["plastimatch", "--version"], capture_output=True, text=True).stdout.strip()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        ours = subprocess.run([str(BUILD / "bin" / "drr_benchmark"), str(folder)], check=True, capture_output=True, text=True).stdout
        print(ours, end="")
        for what in ("thigh", "bone"):
            for pixels in (512, 256):
                times = []
                for _ in range(3):
                    one = plastimatch(folder / (what + ".mha"), folder / "peer_", pixels, 1)
                    times.append((plastimatch(folder / (what + ".mha"), folder / "peer_", pixels, 11) - one) / 10)
                seconds = sorted(times)[1]
                mine = float(next(line for line in ours.splitlines() if line.startswith(what) and "joseph" in line and "%d x %d" % (pixels, pixels) in line).split(":")[1].split()[0])
                error = ""
                if pixels == 256:
                    image = peer_image(folder / (what + ".mha"), folder / "view_")
                    reference = numpy.fromfile(folder / (what + "_reference_256.f32"), dtype="<f4").reshape(256, 256)
                    candidates = [numpy.rot90(flipped, turn) for flipped in (image, image[:, ::-1]) for turn in range(4)]
                    root_mean_square = lambda one: float(numpy.sqrt(numpy.mean((one - reference) ** 2)))
                    peer = min((one * (reference.sum() / one.sum()) for one in candidates), key=root_mean_square)
                    error = ", root mean square error %.4f mm" % root_mean_square(peer)
                    if len(sys.argv) > 2:
                        pathlib.Path(sys.argv[2]).mkdir(parents=True, exist_ok=True)
                        names = ["joseph", "ray_casting", "siddon_jacobs", "lightfield"]
                        own = [numpy.fromfile(folder / ("%s_%s_256.f32" % (what, name)), dtype="<f4").reshape(256, 256) for name in names if (folder / ("%s_%s_256.f32" % (what, name))).exists()]
                        picture(pathlib.Path(sys.argv[2]) / (what + ".png"), reference, own + [peer])
                print("%s, %d x %d: %s exact %.0f ms%s; project.joseph %.2f ms: %.1f times faster" % (what, pixels, pixels, version, 1000 * seconds, error, mine, 1000 * seconds / mine))


main()
