"""Runs of evaluate_map whose reports tables are made of."""
import os
import threading

from .programs import ROOT

MOST_OTHERS = 13  # maps beside another in one run, for the sake of memory


class Runs:
    """The reports of evaluate_map; none is measured twice. Several threads may ask at the same time."""

    def __init__(self, programs, presets=f'{ROOT}/config/presets', preset='robot', classes='semantic_kitti', threads=1):
        self._programs, self._presets, self._preset, self._classes = programs, presets, preset, classes
        self._threads, self._reports, self._stopped = ['--threads', str(threads)], {}, False
        self._guard, self._locks = threading.Lock(), {}

    def report(self, sequence, settings=(), more=(), preset=None, classes=None):
        """settings: text such as 'resolution=0.1'."""
        key = sequence, tuple(settings), tuple(more), preset or self._preset, classes or self._classes
        with self._guard:
            lock = self._locks.setdefault(key, threading.Lock())
        with lock:
            if self._stopped:
                raise SystemExit('stopped')
            if key not in self._reports:
                words = ['--config', os.path.join(self._presets, key[3] + '.yaml'), '--classes', key[4], *self._threads, *more]
                self._reports[key] = self._programs.evaluate(sequence, dict(each.split('=') for each in settings), words)
            return self._reports[key]

    def with_others(self, sequence, others, settings=(), more=()):
        """The reports of one map, and of further ones of the same scans. others: as --also of evaluate_map takes them."""
        reports = []
        for first in range(0, len(others), MOST_OTHERS):
            also = [word for each in others[first:first + MOST_OTHERS] for word in ('--also', each)]
            report = self.report(sequence, settings, [*more, *also])
            reports += ([] if reports else [report]) + report['also']
        return reports

    def stop(self):
        """Makes all threads that ask fail."""
        self._stopped = True
