#!/usr/bin/env python3
"""Topics are published at most as often as `publish_rate` says, and the last scan is shown."""
import os
import sys
import time

import rospy
import rostest
from bki_mapping.msg import OccupancyUpdate

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import MapperTest, wait_until  # noqa: E402
from map_clients import MapClient  # noqa: E402


class Rates(MapperTest):
    def test_rates_are_limited(self):
        self.reconfigure(publish_rate=2.0)
        times = []
        client = MapClient()
        self.addCleanup(client.listener.close)
        wait_until(lambda: client.update() or client.wholes == 1, 'the whole map for a new client')
        clock = rospy.Subscriber('occupancy_updates', OccupancyUpdate, lambda m: times.append(time.monotonic()))
        self.addCleanup(clock.unregister)
        end = time.monotonic() + 3.0
        scans = 0
        while time.monotonic() < end:
            stamp = self.drive(range(scans, scans + 1))
            scans += 1
        self.expect_same(client, stamp)  # the last scan is shown although it arrived between two publications
        self.assertGreater(scans, 3 * len(times))
        self.assertGreaterEqual(len(times), 4)
        # On average: unpacking a message in Python may delay its callback by more than pauses may vary.
        self.assertGreater((times[-1] - times[0]) / (len(times) - 1), 0.4)


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'rates', Rates)
