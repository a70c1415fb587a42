# SPDX-License-Identifier: Apache-2.0
"""Two runs that differ only in names, and nodes that one of the runs did not need."""
from diff_cases import Runs
from harness.program import main

READ = """marrow: 1
inputs: {data: {type: path}}
nodes:
  read: {uses: test.constant, with: {path: $data}}
  sum: {uses: test.add, in: {a: read}}
outputs: {sum: sum}
"""
CHOICE = """marrow: 1
nodes:
  one: {uses: test.constant, with: {value: 3}}
  other: {uses: test.constant, with: {value: 4}}
  sum: {uses: test.add, in: {a: one}}
outputs: {sum: sum}
"""
SAME = "identical: all 2 nodes came out the same\n"


class Names(Runs):
    def run_on(self, run, name, content):
        self.write(name, content)
        self.run_into(run, READ, "data=" + name.split("/")[0])

    def also_changed(self, was, now, how):
        paths = self.scratch / now, self.scratch / was
        changed = "Also changed: node 'read': option 'path' is %s, was %s, %s (with the same result)\n"
        return SAME + changed % (*paths, how)

    def test_a_file_under_another_name(self):
        self.run_on("a", "f.txt", "content")
        self.run_on("b", "g.txt", "content")
        self.expect_diff(0, self.also_changed("f.txt", "g.txt", "another name for the same content"))
        self.write("g.txt", "changed since")  # what the second run read is no longer known
        self.expect_diff(0, self.also_changed("f.txt", "g.txt", "and the contents differ, or the names"))
        (self.scratch / "g.txt").unlink()
        self.expect_diff(0, self.also_changed("f.txt", "g.txt", "and the contents differ, or the names"))
        self.run_on("c", "other.txt", "another")
        self.assertIn(", and the contents differ (with the same result)\n", self.diff(0, "a", "c"))

    def test_a_file_of_a_folder_under_another_name(self):
        for name in ("x/f.txt", "y/f.txt", "z/g.txt"):
            self.run_on("of-" + name[0], name, "content")
        self.assertTrue(self.diff(0, "of-x", "of-y").endswith("\n\n" + SAME), "a folder counts by what is in it")
        said = self.also_changed("x", "z", "another name for the same content")
        self.assertTrue(self.diff(0, "of-x", "of-z").endswith(said))

    def test_a_node_that_is_there_without_need(self):
        said = (
            "First difference: node 'sum' (test.add)\n"
            "  why: input 'a' is wired to other (node 'other' was not needed), was wired to one (node 'one' is not"
            " needed)\n"
            "  sum  value                    4, was 3 (+1)\n"
            "The same in both runs: 0 nodes\n"
            "Not needed in the second run: one\n"
            "Not needed in the first run: other\n\n"
            "Outputs that differ\n"
            "  sum  as above\n"
        )
        self.expect_diff_of(1, said, CHOICE, CHOICE, "--set", "sum.in.a=other")

    def test_a_node_under_another_name(self):
        said = (
            "What took part in both runs came out the same: 1 node\n"
            "Only in the first run: one\n"
            "Only in the second run: first\n"
            "Also changed: node 'sum': input 'a' is wired to first (there was no node 'first'), was wired to one"
            " (there is no node 'one') (with the same result)\n\n"
            "Outputs that are the same: sum\n"
        )
        self.expect_diff_of(1, said, CHOICE, CHOICE.replace("one", "first"))


if __name__ == "__main__":
    main()
