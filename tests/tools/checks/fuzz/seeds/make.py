#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the inputs that the fuzz targets begin with, and their dictionaries: make.py FOLDER. Each input is small,
whole and made here. If a target reads several formats, the first byte names the format."""
import pathlib
import re
import sys

import dicom
import exchange
import images
import records
import sequences
import surfaces
import texts
import volumes

SEEDS = {
    "volume": volumes.seeds,
    "image": images.seeds,
    "dicom": dicom.seeds,
    "mesh": surfaces.seeds,
    "exchange": exchange.seeds,
    "sequence": sequences.seeds,
    "case": texts.case_seeds,
    "pipeline": texts.pipeline_seeds,
    "experiment": texts.experiment_seeds,
    "store": records.store_seeds,
    "manifest": records.manifest_seeds,
    "run_record": records.run_seeds,
    "worker": records.worker_seeds,
    "names": records.name_seeds,
}


def main():
    folder = pathlib.Path(sys.argv[1])
    for target, seeds in SEEDS.items():
        (folder / target).mkdir(parents=True, exist_ok=True)
        for name, content in seeds().items():
            (folder / target / name).write_bytes(content)
    text = (pathlib.Path(__file__).parents[1] / "dictionaries.txt").read_text()
    for target, words in re.findall(r"^\[(\w+)\]\n((?:\".*\n)+)", text, re.M):
        (folder / (target + ".dict")).write_text("\n".join(re.findall(r'"(?:\\.|[^"\\])*"', words)) + "\n")
    (folder / "made").write_text("")


if __name__ == "__main__":
    main()
