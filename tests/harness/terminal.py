# SPDX-License-Identifier: Apache-2.0
"""A terminal of a given size, in which a program runs, and which types for it."""
import fcntl
import os
import pty
import select
import struct
import subprocess
import termios
import time


class Terminal:
    """`columns` x 50 characters. `with` ends the program."""

    def __init__(self, command, columns=80, cwd=None, environment=None):
        self.ours, theirs = pty.openpty()
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
        self.process = subprocess.Popen(
            [str(word) for word in command],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            cwd=cwd,
            env=environment,
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )
        os.close(theirs)
        self.text = ""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        os.close(self.ours)

    def type(self, text):
        os.write(self.ours, text.encode())

    def _read(self, seconds):
        if not select.select([self.ours], [], [], seconds)[0]:
            return False
        try:
            block = os.read(self.ours, 1 << 16)
        except OSError:  # the program has ended
            return False
        self.text += block.decode(errors="replace")
        return bool(block)

    def until(self, condition, seconds=120):
        """Reads until condition(all that was printed), whose result is returned."""
        end = time.monotonic() + seconds
        while True:
            found = condition(self.text)
            if found:
                return found
            assert time.monotonic() < end and self.process.poll() is None, "it did not print that: " + self.text[-2000:]
            self._read(0.2)

    def to_the_end(self):
        """All that is printed until the program ends."""
        while self._read(120):
            pass
        self.process.wait()
        return self.text.replace("\r\n", "\n")
