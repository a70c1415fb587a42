#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Sends random signals at random moments to runs and comparisons: to the program, to its group, or to one of its
workers. None may leave a process behind, half a file under a final name, or wrong bytes for the next that is
started."""
import collections
import concurrent.futures
import os
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
import uuid

from starting import ALL, arguments_parser, conclude, program_of
from subjects import SENTENCE, Compare, Run

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
DEADLY = (signal.SIGKILL, signal.SIGQUIT)
Trial = collections.namedtuple("Trial", "number subject what target seconds")
CLOSED = "closed terminal"  # nobody reads the output any more
KINDS = [*STOPPING, *DEADLY, signal.SIGPIPE, signal.SIGSTOP, CLOSED]


def processes_with(mark):
    """Who has this in its environment: the program and all that it started."""
    found = []
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            if mark.encode() in (folder / "environ").read_bytes():
                found.append(int(folder.name))
        except OSError:  # it has ended
            pass
    return found


class Signals:
    def __init__(self, program, seed):
        self.program, self.chance = program, random.Random(seed)
        self.subjects = {"run": Run(program, "slow.yaml"), "compare": Compare(program)}
        self.seconds = {}
        for name, subject in self.subjects.items():
            start = time.monotonic()
            subject.reference()
            self.seconds[name] = time.monotonic() - start

    def trials(self, count):
        for number in range(count):
            subject, what = self.chance.choice(list(self.subjects)), self.chance.choice(KINDS)
            targets = ["program", "group", "worker"] if what != CLOSED else ["stdout", "stderr", "both"]
            target = self.chance.choice(targets)
            yield Trial(number, subject, what, target, self.chance.uniform(0, 1.1 * self.seconds[subject]))

    def disturb(self, process, trial, mark, ends):
        if trial.what == CLOSED:
            for end, name in zip(ends, ("stdout", "stderr")):
                if trial.target in (name, "both"):
                    end.close()
            return True
        workers = [one for one in processes_with(mark) if one != process.pid]
        if trial.target == "worker" and not workers:
            return False
        one = random.Random(trial.number).choice(sorted(workers)) if trial.target == "worker" else process.pid
        send = os.killpg if trial.target == "group" else os.kill
        try:
            send(one, trial.what)
            if trial.what == signal.SIGSTOP:
                time.sleep(0.3)
                send(one, signal.SIGCONT)
        except ProcessLookupError:
            return False
        return True

    def try_signal(self, trial):
        subject, mark = self.subjects[trial.subject], "MARROW_TRIAL=%s" % uuid.uuid4()
        folder = self.program.scratch / ("signal-%d" % trial.number)
        folder.mkdir()
        subject.prepare(folder)
        environment = self.program.environment_of(folder, MARROW_TRIAL=mark.partition("=")[2])
        how = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        command = [str(self.program.marrow), *map(str, subject.command(folder))]
        process = subprocess.Popen(command, env=environment, cwd=folder, start_new_session=True, **how)
        with concurrent.futures.ThreadPoolExecutor(2) as readers:
            time.sleep(trial.seconds)
            came = process.poll() is None and self.disturb(process, trial, mark, (process.stdout, process.stderr))
            streams = (process.stdout, process.stderr)
            texts = [readers.submit(stream.read) if not stream.closed else None for stream in streams]
            try:
                process.wait(400)
                complaints = []
            except subprocess.TimeoutExpired:
                complaints = ["it did not end within 400 s"]
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            errors = texts[1].result().decode(errors="replace") if texts[1] else None
        for stream in (process.stdout, process.stderr):
            stream.close()
        complaints += self.orphans(mark)
        complaints += self.wrong_end(trial, process.returncode, errors, came, folder)
        complaints += subject.complaints(folder, process.returncode)
        second = self.program.run(subject.second_command(folder), folder)
        if second.returncode != 0:
            complaints.append("the second try ends with code %d: %s" % (second.returncode, second.stderr[-300:]))
        else:
            complaints += ["the second try: " + complaint for complaint in subject.second_complaints(folder)]
        shutil.rmtree(folder)
        return process.returncode, complaints, (errors or "")[-300:]

    @staticmethod
    def orphans(mark):
        for _ in range(600):
            left = processes_with(mark)
            if not left:
                return []
            time.sleep(0.1)
        names = []
        for one in left:
            try:
                names.append(pathlib.Path("/proc/%d/cmdline" % one).read_bytes().replace(b"\0", b" ").decode())
                os.kill(one, signal.SIGKILL)
            except OSError:  # it has just ended
                pass
        return ["left behind: " + "; ".join(names)]

    @staticmethod
    def wrong_end(trial, code, errors, came, folder):
        """Codes that a signal may lead to; 0 always, since it may come too late to stop anything."""
        allowed = {0}
        if came and trial.target == "worker":
            allowed |= {1} if trial.subject == "run" else set()
        elif came and trial.what in DEADLY:
            allowed.add(-trial.what)
        elif came and trial.what in STOPPING:
            allowed.add(130)
        begun = (folder / "out").exists()
        if came and isinstance(trial.what, signal.Signals) and trial.target != "worker" and not begun:
            allowed.add(-trial.what)  # it came before main()
        if code not in allowed:
            return ["it ended with code %d" % code if code >= 0 else "it was ended by " + signal.Signals(-code).name]
        if code > 0 and errors is not None and not SENTENCE.search(errors):
            return ["exit code %d without a sentence" % code]
        return []


def main():
    parser = arguments_parser(__doc__)
    parser.add_argument("--trials", type=int, help="how many signals (default: 15, with --all 1000)")
    parser.add_argument("--only", type=int, help="only the trial of this number")
    options = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for one in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTERM):
        signal.signal(one, signal.SIG_DFL)  # what a caller ignores, the program would inherit
    failures, ends = [], collections.Counter()
    with program_of(options) as program:
        signals = Signals(program, options.seed)
        trials = list(signals.trials(options.trials or (1000 if options.all else 40 if ALL else 15)))
        trials = [trial for trial in trials if options.only in (None, trial.number)]
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
            for trial, (code, complaints, errors) in zip(trials, pool.map(signals.try_signal, trials)):
                name = trial.what if trial.what == CLOSED else trial.what.name
                ends[(name, trial.target, code)] += 1
                if complaints:
                    what = (trial.number, name, trial.target, trial.subject, trial.seconds, "; ".join(complaints))
                    failures.append("%d: %s to the %s of a %s after %.3f s: %s" % what)
                    print(failures[-1], "|", errors.strip()[-200:], flush=True)
    for (name, target, code), count in sorted(ends.items()):
        print("%5d  %-15s %-8s code %d" % (count, name, target, code))
    return conclude("%d signals" % len(trials), failures)


if __name__ == "__main__":
    sys.exit(main())
