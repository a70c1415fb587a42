# SPDX-License-Identifier: Apache-2.0
"""The way from PyTorch to a run on the page docs/networks.md works as it is written, where PyTorch is installed."""
import subprocess

from documents import MARROW, SOURCE, Documents, blocks, main

AROUND = """marrow: 1
extends: %s
%s
outputs: {edges: edges}
"""


class Networks(Documents):
    def test_from_pytorch_to_a_run(self):
        if subprocess.run(["/usr/bin/python3", "-c", "import torch, onnx"], capture_output=True).returncode:
            self.skipTest("PyTorch is not installed (python3-torch, python3-onnx)")
        python, description, nodes = (
            block.text for block in blocks.blocks_of(self.documents["docs/networks"]) if block.language != "shell"
        )
        ran = self.run_here("/usr/bin/python3", "-c", python)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        (self.folder / "mine.yaml").write_text(description)
        pipeline = AROUND % (SOURCE / "pipelines/femur/simulated-femur.yaml", nodes)
        (self.folder / "pipeline.yaml").write_text(pipeline)
        for words in (["check", "pipeline.yaml"], ["run", "pipeline.yaml", "--only", "edges", "--out", "out"]):
            ran = self.run_here(MARROW, *words)
            self.assertEqual(ran.returncode, 0, ran.stderr)


if __name__ == "__main__":
    main()
