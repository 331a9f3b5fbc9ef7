"""Drives a mapping node in real time with the scans of a sequence: odometry and clouds at the rate of the lidar, and the path of
a SLAM system that closes loops."""
import os
import pathlib
import socket
import subprocess
import sys
import threading
import time

import numpy as np

TIMEOUT = 60.0  # for events that need no computing [s]
NAME = 'live_drive_mapper'  # of the node


def free_port():
    with socket.socket() as listener:
        listener.bind(('127.0.0.1', 0))
        return listener.getsockname()[1]


def wait_until(condition, what, seconds=TIMEOUT):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise SystemExit(f'{what} did not happen within {seconds:.0f} s')
        time.sleep(0.02)


def quaternion(rotation):
    """x, y, z, w of a rotation matrix."""
    w, x, y, z = np.linalg.eigh(np.array([  # Bar-Itzhack 2000, Equation 8
        [rotation[0, 0] + rotation[1, 1] + rotation[2, 2], rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0],
         rotation[1, 0] - rotation[0, 1]],
        [rotation[2, 1] - rotation[1, 2], rotation[0, 0] - rotation[1, 1] - rotation[2, 2], rotation[0, 1] + rotation[1, 0],
         rotation[0, 2] + rotation[2, 0]],
        [rotation[0, 2] - rotation[2, 0], rotation[0, 1] + rotation[1, 0], rotation[1, 1] - rotation[0, 0] - rotation[2, 2],
         rotation[1, 2] + rotation[2, 1]],
        [rotation[1, 0] - rotation[0, 1], rotation[0, 2] + rotation[2, 0], rotation[1, 2] + rotation[2, 1],
         rotation[2, 2] - rotation[0, 0] - rotation[1, 1]]]))[1][:, -1]
    return x, y, z, w


class LiveDrive:
    """A node, and what drives it. With a ROS master in the environment, it uses that one."""

    def __init__(self, programs, map_file, parameters):
        devel = pathlib.Path(programs).resolve().parent.parent
        sys.path.insert(0, str(devel / 'lib/python3/dist-packages'))
        self.processes, self.node = [], None
        try:
            self.start(programs, map_file, parameters)
        except BaseException:
            self.close()
            raise

    def start(self, programs, map_file, parameters):
        if 'ROS_MASTER_URI' not in os.environ:
            port = free_port()
            os.environ.update(ROS_MASTER_URI=f'http://localhost:{port}', ROS_HOSTNAME='localhost')
            self.processes.append(subprocess.Popen(['roscore', '-p', str(port)], stdout=subprocess.DEVNULL))
        global rospy, PointCloud2, PointField, Path, PoseStamped, TransformStamped, TFMessage, rosgraph
        import rosgraph
        import rospy
        from bki_mapping.msg import MappingStatus
        from geometry_msgs.msg import PoseStamped, TransformStamped
        from nav_msgs.msg import Path
        from sensor_msgs.msg import PointCloud2, PointField
        from tf2_msgs.msg import TFMessage
        wait_until(rosgraph.is_master_online, 'the start of roscore')
        for name, value in {'config': 'robot', 'journal': True, 'odometry_frame_id': 'odom', 'correction/tolerance': 0.0,
                            'journal_limit': 0.0, 'map_file': str(map_file), 'tf_timeout': 10.0, **parameters}.items():
            rospy.set_param(f'/{NAME}/{name}', value)
        self.node = subprocess.Popen([str(pathlib.Path(programs) / 'mapping_node'), f'__name:={NAME}',
                                      'cloud_in:=/live_drive/cloud', 'corrected_path:=/live_drive/path', '/tf:=/live_drive/tf'],
                                     start_new_session=True)  # where the scheduler groups sessions, as roslaunch does
        rospy.init_node('live_drive', disable_signals=True)
        self.statuses, self.changed = [], threading.Condition()
        self.status_subscriber = rospy.Subscriber(f'/{NAME}/status', MappingStatus, self.on_status, queue_size=10000)
        self.clouds = rospy.Publisher('/live_drive/cloud', PointCloud2, queue_size=1000)
        self.paths = rospy.Publisher('/live_drive/path', Path, queue_size=10)
        self.transforms = rospy.Publisher('/live_drive/tf', TFMessage, queue_size=1000)
        for topic in (self.clouds, self.paths, self.transforms, self.status_subscriber):
            wait_until(lambda: topic.get_num_connections() > 0, f'the connection of {topic.name} to the node')

    def on_status(self, status):
        with self.changed:
            self.statuses.append((time.monotonic(), status))
            self.changed.notify_all()

    def wait_for(self, condition, seconds, what):
        """The time and the content of the first status that fulfils the condition."""
        end, seen = time.monotonic() + seconds, 0
        with self.changed:
            while True:
                for received, status in self.statuses[seen:]:
                    if condition(status):
                        return received, status
                seen = len(self.statuses)
                if time.monotonic() > end or self.node.poll() is not None:
                    raise SystemExit(f'{what} did not happen within {seconds:.0f} s; the last statuses say:\n{self.statuses[-1:]}')
                self.changed.wait(1.0)

    def transform(self, stamp, parent, child, pose):
        message = TransformStamped()
        message.header.stamp, message.header.frame_id, message.child_frame_id = stamp, parent, child
        to = message.transform
        to.translation.x, to.translation.y, to.translation.z = pose[:3, 3]
        to.rotation.x, to.rotation.y, to.rotation.z, to.rotation.w = quaternion(pose[:3, :3])
        return message

    def scan(self, frame, T_odom_sensor, T_map_odom):
        stamp = rospy.Time(*divmod(frame.stamp, 10 ** 9))
        self.transforms.publish(TFMessage([self.transform(stamp, 'map', 'odom', T_map_odom),
                                           self.transform(stamp, 'odom', 'sensor', T_odom_sensor)]))
        points = np.empty(len(frame.points), dtype=[('xyz', '<f4', 3), ('label', '<u4')])
        points['xyz'], points['label'] = frame.points, frame.labels
        cloud = PointCloud2(height=1, width=len(points), point_step=16, row_step=16 * len(points), data=points.tobytes())
        cloud.header.stamp, cloud.header.frame_id = stamp, 'sensor'
        cloud.fields = [PointField(name, 4 * n, PointField.FLOAT32, 1) for n, name in enumerate('xyz')]
        cloud.fields.append(PointField('label', 12, PointField.UINT32, 1))
        self.clouds.publish(cloud)

    def correct(self, stamps, poses):
        path = Path()
        path.header.frame_id = 'map'
        for stamp, pose in zip(stamps, poses):
            keyframe = PoseStamped()
            keyframe.header.stamp = rospy.Time(*divmod(int(stamp), 10 ** 9))
            place, turn = keyframe.pose.position, keyframe.pose.orientation
            place.x, place.y, place.z = pose[:3, 3]
            turn.x, turn.y, turn.z, turn.w = quaternion(pose[:3, :3])
            path.poses.append(keyframe)
        self.paths.publish(path)

    def save(self, path):
        from bki_mapping.srv import SaveMap
        answer = rospy.ServiceProxy(f'/{NAME}/save_map', SaveMap)(str(path), '')
        if not answer.success:
            raise SystemExit(answer.message)

    def stop(self):
        """Ends the node, which writes its map file."""
        self.node.send_signal(2)
        if self.node.wait(600) != 0:
            raise SystemExit(f'the node ended with {self.node.returncode}')
        self.close()

    def close(self):
        if self.node and self.node.poll() is None:
            self.node.kill()
            self.node.wait()
        for process in self.processes:  # roscore, which ends its own processes
            process.terminate()
            process.wait()
