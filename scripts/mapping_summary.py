#!/usr/bin/env python3
"""Waits until a running mapper has processed a number of scans, saves the map and writes a summary."""
import argparse
import os
import sys
import threading
import time

import rosgraph
import rospy
from bki_mapping.msg import MappingStatus
from bki_mapping.srv import SaveMap


class Follower:
    """Collects the status after each scan."""

    def __init__(self, scans):
        self.scans = scans
        self.times = []
        self.last = None
        self.done = threading.Event()

    def on_status(self, status):
        if status.integrated_last:
            self.times.append(status.integration_ms)
        self.last = status
        if status.received >= self.scans and status.waiting == 0:
            self.done.set()


def quantile(values, p):
    values = sorted(values)
    return values[min(len(values) - 1, int(p * len(values)))]


def summary(follower):
    status = follower.last
    dropped = {name[len('dropped_'):]: getattr(status, name) for name in status.__slots__
               if name.startswith('dropped_')}
    return '\n'.join([
        f'clouds: {status.received} received, {status.integrated} mapped, dropped: {dropped}',
        f'time per scan: median {quantile(follower.times, 0.5):.1f} ms, 99th percentile '
        f'{quantile(follower.times, 0.99):.1f} ms ({os.cpu_count()} cores)',
        f'map: {status.blocks} blocks, {status.map_bytes / 1e6:.1f} MB',
    ]) + '\n'


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--scans', type=int, required=True, help='number of clouds to wait for')
    parser.add_argument('--map', required=True, action='append', help='file for the map, .bkm, .ply or .pcd; repeatable')
    parser.add_argument('--summary', required=True, help='text file for the summary')
    parser.add_argument('--timeout', type=float, default=600.0, help='maximum time to wait [s]')
    arguments = parser.parse_args()

    follower = Follower(arguments.scans)
    end = time.monotonic() + arguments.timeout
    while not rosgraph.is_master_online() and time.monotonic() < end:  # rospy would wait as well, but with a warning
        time.sleep(0.1)
    rospy.init_node('mapping_summary', disable_signals=True)
    rospy.Subscriber('mapping/status', MappingStatus, follower.on_status, queue_size=1000)
    if not follower.done.wait(end - time.monotonic()):
        received = follower.last.received if follower.last else 0
        sys.exit(f'only {received} of {arguments.scans} clouds came within {arguments.timeout:.0f} s; see ros.log')
    for path in arguments.map:
        saved = rospy.ServiceProxy('mapping/save_map', SaveMap)(os.path.abspath(path), '')
        if not saved.success:
            sys.exit(saved.message)
    with open(arguments.summary, 'w') as file:
        file.write(summary(follower))


if __name__ == '__main__':
    main()
