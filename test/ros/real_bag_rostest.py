#!/usr/bin/env python3
"""A real bag without labels and tf, through the launch file that users start."""
import os
import subprocess
import sys
import unittest

import rospy
import rostest
from bki_mapping.msg import MappingStatus
from geometry_msgs.msg import TransformStamped
from tf2_msgs.msg import TFMessage

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import Listener, wait_until  # noqa: E402


class RealBag(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('real_bag_rostest')

    def luminar(self, bag, *launch, transform=True):
        """Plays a real bag without labels and tf; returns the last status."""
        status = Listener('/mapping/status', MappingStatus)
        if transform:
            pose = TransformStamped()
            pose.header.frame_id, pose.child_frame_id = 'map', 'luminar_lidar'
            pose.transform.translation.z = 2.0
            pose.transform.rotation.w = 1.0
            publisher = rospy.Publisher('/tf_static', TFMessage, queue_size=1, latch=True)
            publisher.publish(TFMessage([pose]))
            self.addCleanup(publisher.unregister)
        server = subprocess.Popen(['roslaunch', '--wait', 'bki_mapping', 'replay.launch', f'bag:={bag}', 'rviz:=false',
                                   'cloud_topic:=/luminar_pointcloud', *launch])
        try:
            return status.wait_for(lambda m: m.received == 5 and m.waiting == 0, 'dealing with five clouds')
        finally:
            server.terminate()
            server.wait(30)
            wait_until(lambda: status.subscriber.get_num_connections() == 0, 'the launch ending')

    def test_a_real_bag_without_labels_and_tf(self):
        bag = os.path.join(os.environ['BKI_MAPPING_TEST_DATA'], 'bags', 'luminar_no_label_no_tf.bag')
        self.assertEqual(self.luminar(bag, transform=False).dropped_unknown_frame, 5)
        self.assertEqual(self.luminar(bag).dropped_bad_cloud, 5)
        status = self.luminar(bag, 'labelled:=false', 'classes:=occupancy')
        self.assertEqual((status.integrated, status.labels_not_in_table), (5, 0))
        self.assertGreater(status.blocks, 100)


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'real_bag', RealBag)
