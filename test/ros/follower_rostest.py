#!/usr/bin/env python3
"""A follower of the topics holds the mapper's map, to the value, also after it has missed updates."""
import io
import os
import re
import subprocess
import sys
import tempfile
from unittest import mock

import bki_mapping
import numpy as np
import roslib.packages
import rospy
import rostest
from bki_mapping.msg import OccupancyMap, OccupancyUpdate
from bki_mapping.ros import OccupancyFollower, decode
from bki_mapping.srv import SaveMap

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import CAR, Listener, MapperTest, wait_until  # noqa: E402

KNOWN = 'occupied,free,occluded'


class Follower(MapperTest):
    def follower(self, *arguments, **options):
        follower = OccupancyFollower()
        follower.subscribe(*arguments, **options)
        self.addCleanup(follower.unsubscribe)
        return follower

    def wait_for_scan(self, follower, stamp):
        wait_until(lambda: follower.stamp == stamp.to_nsec() and (follower.in_sync or follower.sequence is None), 'following the last scan')

    def whole_map(self, stamp):
        """The same map from the topic with whole maps."""
        whole = OccupancyFollower()
        whole.subscribe('occupancy')
        try:
            self.assertTrue(whole.wait(30.0))
            self.wait_for_scan(whole, stamp)
        finally:
            whole.unsubscribe()
        return whole

    def expect_same(self, one, other):
        self.assertEqual((one.frame, one.resolution, one.classes), (other.frame, other.resolution, other.classes))
        voxels = one.voxels(KNOWN)
        self.assertGreater(len(voxels), 1000)
        np.testing.assert_array_equal(voxels, other.voxels(KNOWN))

    def test_the_map_is_that_of_save_map(self):
        follower = self.follower()
        self.assertTrue(follower.wait(30.0))
        self.drive(range(3))
        stamp = self.drive(range(3, 6))
        self.wait_for_scan(follower, stamp)
        self.assertEqual((follower.missed, follower.frame, follower.resolution), (0, 'map', 0.3))
        self.expect_same(follower, self.whole_map(stamp))
        with tempfile.TemporaryDirectory() as folder:
            saved = rospy.ServiceProxy('mapping/save_map', SaveMap)(os.path.join(folder, 'map.bkm'), '')
            self.assertTrue(saved.success, saved.message)
            map_ = bki_mapping.load(os.path.join(folder, 'map.bkm'))
        own, expected = follower.voxels(KNOWN), map_.voxels(KNOWN)
        self.assertEqual(set(own['state']), {1, 2, 3})
        for name in own.dtype.names:
            np.testing.assert_array_equal(own[name], expected[name], name)
        points = np.stack([expected[axis] for axis in 'xyz'], axis=1).astype(float) + np.random.default_rng(1).uniform(-0.1, 0.1, (len(expected), 3))
        said, values = follower.query(points), map_.query(points)
        np.testing.assert_array_equal(said['state'], expected['state'])
        for name in ('label', 'occupancy', 'class_probability', 'probability'):
            np.testing.assert_allclose(said[name], values[name], rtol=2e-6)
        self.assertEqual({c.name: c.id for c in follower.classes}, {c.name: c.id for c in map_.classes})
        self.call('reset')
        wait_until(lambda: len(follower.voxels(KNOWN)) == 0, 'following a reset')

    def test_missed_updates_are_noticed_and_recovered(self):
        for options in ({}, {'publish_map': 'mapping/publish_map'}):
            self.call('reset')
            follower = self.follower('occupancy_updates', patience=0.1, **options)
            self.assertTrue(follower.wait(30.0))
            self.wait_for_scan(follower, self.drive(range(2)))
            take, lost = follower.update, []

            def lose_one(content):
                if content.whole or lost:
                    return take(content)
                lost.append(content.sequence)
                return False
            with mock.patch.object(follower, 'update', lose_one):
                self.drive(range(2, 3))
                wait_until(lambda: lost, 'losing an update')
                stamp = self.drive(range(3, 4))  # its update shows that one is missing
                self.wait_for_scan(follower, stamp)
            self.assertEqual((len(lost), follower.missed), (1, 1), options)
            self.assertGreater(follower.sequence, lost[0])
            self.expect_same(follower, self.whole_map(stamp))
            stamp = self.drive(range(6, 7))  # and it goes on
            self.wait_for_scan(follower, stamp)
            self.assertEqual(follower.missed, 1)
            self.expect_same(follower, self.whole_map(stamp))
            follower.unsubscribe()

    def test_a_second_follower_of_the_process_asks_for_the_map(self):
        self.wait_for_scan(self.follower(), self.drive(range(2)))
        second = self.follower('occupancy_updates', 'mapping/publish_map', 0.1)  # ROS sends it no whole map
        self.assertTrue(second.wait(30.0))
        stamp = self.drive(range(2, 3))
        self.wait_for_scan(second, stamp)
        self.assertEqual(second.missed, 0)
        self.expect_same(second, self.whole_map(stamp))

    def test_messages_as_rospy_makes_them_and_their_bytes(self):
        """Without subscribe(): messages that a node has already."""
        updates, wholes = Listener('occupancy_updates', OccupancyUpdate), Listener('occupancy', OccupancyMap)
        self.addCleanup(updates.close)
        self.addCleanup(wholes.close)
        updates.wait_for(lambda m: m.whole, 'the whole map')
        stamp = self.drive(range(3))
        for listener in (updates, wholes):
            listener.wait_for(lambda m: m.header.stamp == stamp, 'the last message')
        bytes_of = {}
        for message in (*updates.messages, *wholes.messages):
            data = io.BytesIO()
            message.serialize(data)
            bytes_of[id(message)] = data.getvalue()
        followers = []
        for listener, is_update in ((updates, True), (wholes, False)):
            for read in (lambda m: m, lambda m: decode(bytes_of[id(m)], is_update)):
                followers.append(OccupancyFollower())
                for message in listener.messages:
                    followers[-1].update(read(message))
                self.assertEqual((followers[-1].in_sync, followers[-1].stamp), (is_update, stamp.to_nsec()))
        for follower in followers[1:]:
            self.expect_same(followers[0], follower)

    def test_the_example_of_the_documents(self):
        self.drive(range(2))
        with open(os.path.join(roslib.packages.get_pkg_dir('bki_mapping'), 'docs', 'ros.md')) as file:
            examples = re.findall(r'^```python\n(.*?)^```$', file.read(), re.MULTILINE | re.DOTALL)
        example, = [each for each in examples if 'OccupancyFollower' in each]
        said = subprocess.run([sys.executable, '-c', example], capture_output=True, text=True, timeout=60, check=True).stdout
        self.assertRegex(said, r'^[1-9]\d* occupied voxels, and a voxel in state [0-3]\n$')

    def test_wrong_topics(self):
        for topic in ('cloud_in', 'mapping/status'):
            self.integrate([(3.5, 0.5, 0.5)], [CAR])
            with self.assertRaisesRegex(ValueError, f"topic '{topic}' is of type .*; follow occupancy_updates or occupancy of a mapper"):
                OccupancyFollower().subscribe(topic)


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'follower', Follower)
