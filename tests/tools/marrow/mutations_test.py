# SPDX-License-Identifier: Apache-2.0
"""200 random mutations of the shipped pipelines: each is either still good or diagnosed, and none crashes the
program."""
import json
import random
import shutil

from harness.program import Case, main, marrow
from harness.sample import sample
from harness.shipped import PIPELINES, shipped


def mutated(text, chance):
    """The text with one change, and the line it was made on."""
    lines = text.splitlines()
    candidates = [i for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")]
    at = chance.choice(candidates)
    line = lines[at]
    column = chance.randrange(len(line))
    kind = chance.randrange(5)
    other = chance.choice("abcxyz019.:{}[],\"'$&*!%@ ") if kind in (0, 2) else ""
    if kind == 4:
        lines.insert(at, line)
    else:
        head, tail = line[:column], line[column:]
        line = head + (other + tail, tail[1:], other + tail[1:], tail[::-1])[kind]
    lines[at] = line
    return "\n".join(lines) + "\n", at + 1


class Mutations(Case):
    def test_each_is_good_or_diagnosed(self):
        chance = random.Random(20261121)
        files = shipped()
        self.assertGreater(len(files), 2)
        folder = shutil.copytree(PIPELINES, self.scratch / "pipelines")  # with the files that they name
        good = at_line = elsewhere = 0
        paths = [files[number % len(files)] for number in range(200)]
        trials = [(path, *mutated(path.read_text(), chance)) for path in paths]
        chosen = sample(trials, 60, key=lambda trial: trial[0])
        for path, text, line in chosen:
            copy = folder / path.relative_to(PIPELINES)
            copy.write_text(text)
            result = marrow("check", copy, "--json")
            copy.write_text(path.read_text())
            self.assertIn(result.returncode, (0, 2), "%s\n%s" % (text, result.stderr))
            faults = json.loads(result.stdout)
            self.assertEqual(bool(faults), result.returncode == 2)
            if not faults:
                good += 1
            elif any(abs(fault["line"] - line) <= 1 for fault in faults):
                at_line += 1
            else:
                # A change of YAML's structure, such as of an indentation, may show later in the file.
                elsewhere += 1
                print("line %d changed, diagnosed at %s" % (line, sorted({fault["line"] for fault in faults})))
                print("   ", text.splitlines()[line - 1])
        print("%d still good, %d diagnosed at the line, %d where the change is missed" % (good, at_line, elsewhere))
        self.assertEqual(good + at_line + elsewhere, len(chosen))
        self.assertLess(elsewhere, 4)


if __name__ == "__main__":
    main()
