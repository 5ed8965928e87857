"""Runs vg programs through pipes, in a thread, so that Blender goes on meanwhile. Knows nothing of Blender.

    job = Job(lambda job: job.pipe(["vg-deform", "--onto", path], ["vg-solve"], feed=body))
    job.start(); ...; job.running; job.cancel(); job.result or job.error

SPDX-License-Identifier: GPL-3.0-or-later
"""
import os
import shutil
import subprocess
import tempfile
import threading

import numpy

from . import vgstream


class Trouble(Exception):
    """What the panel says when something cannot be done."""


class Cancelled(Exception):
    """The person at the screen has cancelled the job."""


class Body:
    """A sequence of poses of one mesh. points, reference: (n, 3), y up, in metres. names, times in seconds (or None): one a pose."""

    def __init__(self, reference, faces, points=(), names=(), times=None):
        self.reference, self.faces = numpy.asarray(reference, float), faces
        self.points, self.names, self.times = list(points), list(names), times

    @property
    def count(self):
        return len(self.points)

    def same_mesh(self, other):
        return len(self.reference) == len(other.reference) and self.faces == other.faces

    def write(self, file, job=None, precision=8):
        """As a stream of vertices, to a path or a binary file."""
        with vgstream.Writer(file, vgstream.mesh(self.reference, self.faces, precision)) as out:
            for i, points in enumerate(self.points):
                if job:
                    job.check()
                out.put_pose(self.names[i], numpy.ascontiguousarray(points, float), self.times[i] if self.times else None)


class Programs:
    """Where the programs are: a folder that the preferences name, else the search path."""
    folder = ""

    @classmethod
    def find(cls, name):
        if cls.folder:
            path = os.path.join(cls.folder, name)
            if os.access(path, os.X_OK):
                return path
            raise Trouble(f"'{cls.folder}' has no {name}: see the preferences of this add-on")
        path = shutil.which(name)
        if path is None:
            raise Trouble(f"{name} is not installed, or not in the search path: see the preferences of this add-on")
        return path

    @classmethod
    def has(cls, name):
        try:
            return bool(cls.find(name))
        except Trouble:
            return False


def said(stream, keep, name):
    """Keep what a program says on standard error, line by line."""
    with stream:
        for line in stream:
            text = line.decode("utf-8", "replace").rstrip()
            if text:
                keep.append((name, text))


class Job:
    """work(job) runs in a thread; what it returns is the result, what it raises the error. A pipe that it has running is ended by cancel()."""

    def __init__(self, work):
        self.work, self.result, self.error = work, None, None
        self.lines, self.done, self.total, self.step = [], 0, 0, ""
        self.folder, self.processes, self.listeners, self.lock, self.stopped = None, [], [], threading.Lock(), False
        self.thread = threading.Thread(target=self._run, daemon=True)

    # ---- from outside ----

    def start(self):
        self.thread.start()

    @property
    def running(self):
        return self.thread.is_alive()

    def wait(self):
        self.thread.join()

    def cancel(self):
        with self.lock:
            self.stopped = True
            for p in self.processes:
                if p.poll() is None:
                    p.terminate()

    def text(self):
        """What the programs have said, and when the job has failed, why."""
        lines = [line for _, line in self.lines]
        if self.error is not None and not isinstance(self.error, Cancelled) and str(self.error) not in lines:
            lines.append(str(self.error))
        return lines

    # ---- from the work ----

    def check(self):
        if self.stopped:
            raise Cancelled

    def path(self, name):
        """A file of this name in a folder that goes when the job has ended."""
        if self.folder is None:
            self.folder = tempfile.mkdtemp(prefix="vg-tools-")
        return os.path.join(self.folder, name)

    def write(self, name, body):
        path = self.path(name)
        body.write(path, self)
        return path

    def pipe(self, *commands, feed=None, expect=0, step=""):
        """Run programs one behind the other; return the head and the frames of the stream that the last one writes. feed: a Body."""
        self.done, self.total, self.step = 0, expect, step or commands[-1][0]
        processes, feeder = self._begin(commands, feed, last=subprocess.PIPE)
        frames, trouble, reader = [], None, None
        try:
            reader = vgstream.Reader(processes[-1].stdout)
            for frame in reader:
                frames.append(frame)
                self.done = len(frames)
        except (vgstream.StreamError, OSError) as error:
            trouble = error
        self._end(processes, feeder, trouble)
        return reader, frames

    def call(self, *commands, feed=None, step=""):
        """The same for programs of which the last one writes a file, or text, which is returned."""
        self.done, self.total, self.step = 0, 0, step or commands[-1][0]
        processes, feeder = self._begin(commands, feed, last=subprocess.PIPE)
        text = processes[-1].stdout.read()
        self._end(processes, feeder, None)
        return text.decode("utf-8", "replace")

    # ---- inside ----

    def _run(self):
        try:
            self.result = self.work(self)
        except BaseException as error:  # whatever it is, the panel has to say it
            self.error = Cancelled() if self.stopped else error
        finally:
            if self.folder is not None:
                shutil.rmtree(self.folder, ignore_errors=True)

    def _begin(self, commands, feed, last):
        self.check()
        processes, self.listeners, before = [], [], subprocess.PIPE if feed is not None else subprocess.DEVNULL
        try:
            for i, command in enumerate(commands):
                p = subprocess.Popen([Programs.find(command[0]), *command[1:]], stdin=before, stderr=subprocess.PIPE,
                                     stdout=last if i + 1 == len(commands) else subprocess.PIPE)
                if processes:
                    before.close()
                processes.append(p)
                before = p.stdout
                self.listeners.append(threading.Thread(target=said, args=(p.stderr, self.lines, command[0]), daemon=True))
                self.listeners[-1].start()
        except BaseException:
            for p in processes:
                p.kill()
            raise
        with self.lock:
            self.processes = processes
        self.check()
        feeder = threading.Thread(target=self._feed, args=(processes[0].stdin, feed), daemon=True) if feed is not None else None
        if feeder:
            feeder.start()
        return processes, feeder

    def _feed(self, file, body):
        try:
            body.write(file, self)
        except (BrokenPipeError, Cancelled):
            pass  # the program has ended before its input: it says why
        finally:
            try:
                file.close()
            except BrokenPipeError:
                pass

    def _end(self, processes, feeder, trouble):
        processes[-1].stdout.close()
        for p in processes:
            p.wait()
        for thread in self.listeners + ([feeder] if feeder else []):
            thread.join()
        self.check()
        failed = [p for p in processes if p.returncode > 0] or [p for p in processes if p.returncode]
        if failed:
            name = os.path.basename(failed[0].args[0])
            lines = [line for who, line in self.lines if who == name]
            raise Trouble(lines[-1] if lines else f"{name} ended with status {failed[0].returncode}")
        if trouble:
            raise Trouble(str(trouble))
