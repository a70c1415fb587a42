# SPDX-License-Identifier: Apache-2.0
"""Names in the documents: where marrow has no such node, option, command or key, the site is not built."""
import re
import subprocess
import sys

from harness import MARROW, SOURCE
from harness.program import Case, main

sys.path.insert(0, str(SOURCE / "tools" / "site"))
import catalogue  # noqa: E402
import document_pages  # noqa: E402
import mentions  # noqa: E402

# Nodes whose figures stand in reports.
EXPLAINED = """evaluate.pose_error evaluate.mtre evaluate.outline_distance evaluate.pose_difference evaluate.reduced
evaluate.reduction_gap evaluate.surface_distance evaluate.projection_distance evaluate.reprojection_distance
fracture.misalignment""".split()
# A marrow in which one option has another name.
RENAMED = """#!/bin/sh
"%s" "$@" | sed 's/"name": "pixel_step"/"name": "pixel_stride"/'
"""


class Names(Case):
    @classmethod
    def setUpClass(cls):
        cls.names = mentions.Names(catalogue.Catalogue(MARROW), SOURCE)

    def faults(self, text):
        return [fault for _, fault in mentions.faults_of(text, self.names)]

    def test_the_documents_have_no_fault(self):
        documents = document_pages.documents(SOURCE)
        self.assertGreater(len(documents), 12)
        self.assertEqual(mentions.faults(documents, self.names), [])

    def test_every_node_is_named_where_it_belongs(self):
        text = "\n".join(document_pages.documents(SOURCE).values())
        told = [name for name in self.names.catalogue.nodes if re.search(r"\b%s\b" % re.escape(name), text)]
        self.assertGreater(len(told), 100)
        self.assertEqual(sorted(set(self.names.catalogue.nodes) - set(told)), [])

    def test_figures_that_people_read_are_in_the_glossary(self):
        """Those of a view, such as frontal_median_px, have the name of the view in front and are not looked up."""
        entries = re.findall(r"\*\*([^*]+)\*\*", document_pages.documents(SOURCE)["docs/glossary"])
        known = {" ".join(entry.lower().split()) for entry in entries}
        count = 0
        for name in EXPLAINED:
            for output in self.names.catalogue.nodes[name]["outputs"]:
                for figure in output.get("figures", []):
                    words = figure.replace("_", " ")
                    if "*" not in words:
                        count += 1
                        self.assertTrue(
                            {words, re.sub(" (mm|deg|px|percent)$", "", words)} & known, name + ": " + figure
                        )
        self.assertGreater(count, 50)

    def test_what_is_not_there_is_named(self):
        for text, fault in (
            ("The node `edges.cany` finds.", "there is no node 'edges.cany'; did you mean 'edges.canny'?"),
            ("The option `sigma_pix` is.", "no node has the option 'sigma_pix'; did you mean 'sigma_px'?"),
            ("`window_px` of `edges.gradient_mask`", None),
            ("`board` of `edges.gradient_mask`", "edges.gradient_mask has no option 'board'"),
            ("Give `widnow_px`.", "nothing is named 'widnow_px': no option, port, key or function"),
            ("See `marrow rnu FILE`.", "there is no command 'marrow rnu'; did you mean 'run'?"),
            ("    marrow run a.yaml --sed 2", "marrow run has no option '--sed'; did you mean '--seed'?"),
            ("    marrow run a.yaml --set edges.hihg=2", "no node has the option 'hihg'; did you mean 'high'?"),
            ("    marrow cache cg", None),
            ("```yaml\na: {uses: edges.canny, with: {hihg: 1}}\n```", "edges.canny has no option 'hihg'"),
            ("```yaml\na: {uses: edges.cany}\n```", "there is no node 'edges.cany'; did you mean 'edges.canny'?"),
        ):
            found = self.faults(text)
            if fault is None:
                self.assertEqual([one for one in found if "window_px" in one], [], text)
            else:
                self.assertTrue(any(fault in one for one in found), (text, found))
        self.assertEqual(self.faults("`edges.canny`, `low`, `marrow run FILE --seed 2`, `Cost::value`"), [])

    def test_an_option_that_is_renamed_stops_the_site(self):
        self.write("bin/marrow", RENAMED % MARROW).chmod(0o755)
        command = [SOURCE / "tools" / "docs", "--build", self.scratch, "--out", self.scratch / "site"]
        made = subprocess.run(command, capture_output=True, text=True)
        self.assertEqual(made.returncode, 1)
        self.assertRegex(made.stderr, r"docs/method\.md:\d+: nothing is named 'pixel_step'")
        self.assertTrue(made.stderr.endswith("tools/docs: mend these names; marrow does not know them\n"), made.stderr)
        self.assertFalse((self.scratch / "site").exists())


if __name__ == "__main__":
    main()
