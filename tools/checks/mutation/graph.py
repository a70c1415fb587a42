# SPDX-License-Identifier: Apache-2.0
"""What ninja makes from a source file, read from build.ninja and from the headers that the compiler listed."""
import os
import re
import subprocess


class Graph:
    def __init__(self, build):
        self.build = os.path.abspath(build)
        self.users = {}  # file -> what is made from it
        self.read_rules(os.path.join(self.build, "build.ninja"))
        self.read_headers()

    def read_rules(self, path):
        with open(path) as stream:
            text = stream.read().replace("$\n", "")
        for line in re.findall(r"^build (.*)$", text, re.M):
            outputs, _, inputs = line.replace("$:", "\0").partition(": ")
            inputs = inputs.partition(" || ")[0]  # order-only inputs do not count
            names = [
                [
                    name.replace("\0", ":").replace("$ ", " ")
                    for name in re.split(r"(?<!\$) +", part)
                    if name and name != "|"
                ]
                for part in (outputs, inputs)
            ]
            if names[1][0] == "phony":
                continue
            for source in names[1][1:]:
                self.users.setdefault(self.full(source), set()).update(map(self.full, names[0]))

    def read_headers(self):
        made = None
        for line in subprocess.run(
            ["ninja", "-C", self.build, "-t", "deps"], capture_output=True, text=True, check=True
        ).stdout.splitlines():
            if line.startswith(" "):
                self.users.setdefault(self.full(line.strip()), set()).add(made)
            elif line:
                made = self.full(line.partition(": #deps")[0])

    def full(self, name):
        return os.path.normpath(os.path.join(self.build, name))

    def made_from(self, source):
        """Everything that is made from a file, in any number of steps. Files that are only linked against the
        framework's shared library are left out."""
        made, left = set(), [os.path.abspath(source)]
        while left:
            for user in self.users.get(left.pop(), ()):
                if user not in made and "$" not in user:
                    made.add(user)
                    if "/lib/libmarrow.so" not in user:
                        left.append(user)
        return made
