"""A map that plays while somebody turns its bones, or moves a slider: one running vg-play --live. Motions go in, the newest vertices come out.
Knows nothing of Blender.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import subprocess
import threading

import numpy

from . import vgstream
from .programs import Programs, Trouble, said


class Live:
    """send(motions) returns at once; a motion that comes while one is waiting takes its place. newest() is what has come out last, or None.
    motions: (count, 7): quaternion w x y z, then x y z, of each bone or patch."""

    def __init__(self, path, count):
        self.lines, self.count, self.sent, self.got, self.closed = [], count, 0, 0, False
        self.waiting, self.latest, self.error, self.gate = None, None, None, threading.Condition()
        self.process = subprocess.Popen([Programs.find("vg-play"), "--live", "--no-provenance", path], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.threads = [threading.Thread(target=f, daemon=True) for f in (self._write, self._read)]
        self.threads.append(threading.Thread(target=said, args=(self.process.stderr, self.lines, "vg-play"), daemon=True))
        for t in self.threads:
            t.start()

    def send(self, motions):
        with self.gate:
            if self.error:
                raise Trouble(self.error)
            self.waiting = numpy.ascontiguousarray(motions, "<f4")
            self.gate.notify_all()

    @property
    def idle(self):
        return self.waiting is None and self.got == self.sent

    def newest(self):
        """Vertices (n, 3) that have not been asked for, or None."""
        with self.gate:
            points, self.latest = self.latest, None
            if self.error:
                raise Trouble(self.error)
            return points

    def wait(self, seconds=10.0):
        """The vertices of the motion that was sent last."""
        with self.gate:
            self.gate.wait_for(lambda: self.error or (self.waiting is None and self.got == self.sent), seconds)
        return self.newest()

    def close(self):
        with self.gate:
            self.closed = True
            self.gate.notify_all()
        self.threads[0].join(5)
        try:
            self.process.wait(5)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    # ---- threads ----

    def _next(self):
        """The next motion to write, when the one before has come out: what waits in a pipe is late. None at the end."""
        with self.gate:
            self.gate.wait_for(lambda: self.closed or self.error or (self.waiting is not None and self.got == self.sent))
            if self.closed or self.error:
                return None
            motions, self.waiting, self.sent = self.waiting, None, self.sent + 1
            return motions

    def _write(self):
        try:
            out = vgstream.Writer(self.process.stdin, vgstream.Head([], "transforms", "transform", 7, self.count, 4))
            self.process.stdin.flush()
            while (motions := self._next()) is not None:
                out.put(vgstream.Frame("live", motions))
                self.process.stdin.flush()
            out.close()
        except OSError:
            pass  # vg-play has ended: the reader says why
        except ValueError as error:
            self._stop(str(error))
        finally:
            try:
                self.process.stdin.close()
            except OSError:
                pass

    def _read(self):
        try:
            for frame in vgstream.Reader(self.process.stdout):
                with self.gate:
                    self.latest, self.got = frame.values, self.got + 1
                    self.gate.notify_all()
        except (vgstream.StreamError, OSError) as error:
            if not self.closed:
                self.process.wait()
                self.threads[2].join(2)
                self._stop(self.lines[-1][1] if self.lines else str(error))
        finally:
            self.process.stdout.close()

    def _stop(self, why):
        with self.gate:
            self.error = self.error or why
            self.gate.notify_all()
