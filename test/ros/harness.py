"""Common parts of the rostests: clouds, poses, and waiting for messages with a timeout."""
import random
import struct
import subprocess
import tempfile
import threading
import time
import unittest

import rosgraph
import roslib.packages
import rospy
from bki_mapping.msg import MappingStatus, OccupancyMap
from dynamic_reconfigure.client import Client
from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import PointCloud2, PointField
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

TIMEOUT = 30.0  # maximum wall time to wait for an event [s]
CAR, ROAD = 10, 40  # raw labels of config/classes/semantic_kitti.yaml
FORMATS = {PointField.INT8: 'b', PointField.UINT8: 'B', PointField.INT16: 'h', PointField.UINT16: 'H',
           PointField.INT32: 'i', PointField.UINT32: 'I', PointField.FLOAT32: 'f', PointField.FLOAT64: 'd'}


def wait_until(condition, what, timeout=TIMEOUT):
    """Returns the value of the condition as soon as it is true; fails after the timeout."""
    end = time.monotonic() + timeout
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.01)
    raise AssertionError(f'{what} did not happen within {timeout} s')


def program(name, package='bki_mapping'):
    """The path of a program, found as roslaunch finds it (rosrun does not look into a build folder in the package)."""
    return roslib.packages.find_node(package, name)[0]


def publishers_of(topic):
    """The nodes that publish a topic, according to the master: rospy of Debian 11 keeps connections that are gone."""
    return dict(rosgraph.Master(rospy.get_name()).getSystemState()[0]).get(topic, [])


def adds_up(status):
    """Whether a MappingStatus accounts for every cloud."""
    dropped = sum(getattr(status, name) for name in status.__slots__ if name.startswith('dropped_'))
    return status.received == status.integrated + status.waiting + dropped


class Listener:
    """Keeps the messages of one topic."""

    def __init__(self, topic, kind):
        self.messages = []
        self.lock = threading.Lock()
        self.subscriber = rospy.Subscriber(topic, kind, self.add, queue_size=1000)

    def close(self):
        """Closes the connection, so that the next listener opens a new one."""
        self.subscriber.unregister()

    def add(self, message):
        with self.lock:
            self.messages.append(message)

    def find(self, condition):
        with self.lock:
            return next((m for m in reversed(self.messages) if condition(m)), None)

    def wait_for(self, condition, what):
        return wait_until(lambda: self.find(condition), what)


def make_cloud(points, labels, stamp, frame='sensor', label_type=PointField.UINT32, label_name='label', padding=0,
               big_endian=False):
    """A cloud whose points have `padding` bytes, then the fields label (of any type), x, y and z."""
    cloud = PointCloud2()
    cloud.header.stamp = stamp
    cloud.header.frame_id = frame
    size = struct.calcsize(FORMATS[label_type])
    cloud.fields = [PointField(label_name, padding, label_type, 1)]
    for place, name in enumerate('xyz'):
        cloud.fields.append(PointField(name, padding + size + 4 * place, PointField.FLOAT32, 1))
    order = '>' if big_endian else '<'
    cloud.data = b''.join(b'\xff' * padding + struct.pack(order + FORMATS[label_type] + 'fff', label, *point)
                          for point, label in zip(points, labels))
    cloud.is_bigendian = big_endian
    cloud.height = 1
    cloud.width = len(points)
    cloud.point_step = padding + size + 12
    cloud.row_step = cloud.point_step * cloud.width
    return cloud


class Robot:
    """Publishes the clouds and poses of a sensor."""

    def __init__(self, cloud_topic='cloud_in', frame='sensor'):
        self.clouds = rospy.Publisher(cloud_topic, PointCloud2, queue_size=100)
        self.poses = rospy.Publisher('/tf', TFMessage, queue_size=100)
        self.seconds = 100
        self.frame = frame

    def connect(self):
        wait_until(lambda: self.clouds.get_num_connections() > 0, 'the mapper subscribing to clouds')
        wait_until(lambda: self.poses.get_num_connections() > 0, 'the mapper subscribing to tf')

    def next_stamp(self):
        self.seconds += 1
        return rospy.Time(self.seconds)

    def publish_pose(self, stamp, position=(0.0, 0.0, 0.0), yaw_quarter_turns=0):
        transform = TransformStamped()
        transform.header.stamp = stamp
        transform.header.frame_id = 'map'
        transform.child_frame_id = self.frame
        t = transform.transform.translation
        t.x, t.y, t.z = position
        half = 0.5 ** 0.5
        transform.transform.rotation.w = {0: 1.0, 1: half, 2: 0.0}[yaw_quarter_turns]
        transform.transform.rotation.z = {0: 0.0, 1: half, 2: 1.0}[yaw_quarter_turns]
        self.poses.publish(TFMessage([transform]))

    def scan(self, points, labels, position=(0.0, 0.0, 0.0), yaw_quarter_turns=0, **options):
        """Publishes a pose and a cloud; returns the stamp."""
        stamp = self.next_stamp()
        self.publish_pose(stamp, position, yaw_quarter_turns)
        self.clouds.publish(make_cloud(points, labels, stamp, **{'frame': self.frame, **options}))
        return stamp


class Mapping:
    """A running launch file with the mapper `mapping`, and a robot."""
    points = [(0.2 * i - 10.0, 8.0, 0.1 * (i % 20) - 1.0) for i in range(100)]

    def __init__(self, *arguments, launch=('bki_mapping', 'mapping.launch'), cwd=None):
        self.output = tempfile.TemporaryFile('w+')
        self.status = Listener('/mapping/status', MappingStatus)
        self.robot = Robot('/velodyne_points')
        self.launch = subprocess.Popen(['roslaunch', '--wait', *launch, *arguments], cwd=cwd,
                                       stdout=self.output, stderr=subprocess.STDOUT)
        try:
            self.robot.connect()
        except AssertionError as fault:
            self.__exit__()
            raise AssertionError(f'{fault}; {launch} printed:\n{self.printed()}') from fault

    def __enter__(self):
        return self

    def scan(self, points=None, labels=None, **options):
        """Publishes a scan; returns the status after its integration."""
        points = points or self.points
        stamp = self.robot.scan(points, labels or [CAR] * len(points), **options)
        return self.status.wait_for(lambda m: m.header.stamp == stamp, 'dealing with the cloud')

    def __exit__(self, *_):
        self.launch.terminate()
        self.launch.wait(30)
        wait_until(lambda: self.status.subscriber.get_num_connections() == 0, 'the launch ending')
        self.status.close()
        self.robot.clouds.unregister()
        self.robot.poses.unregister()

    def printed(self):
        self.output.seek(0)
        return self.output.read()


def random_scan(seed, points=60, reach=30.0):
    """Random points in a cube around the sensor, with labels."""
    rand = random.Random(seed)
    cloud = [tuple(rand.uniform(-reach, reach) for _ in range(3)) for _ in range(points)]
    return cloud, [rand.choice((CAR, ROAD)) for _ in cloud]


def whole_map(stamp):
    """The map after a scan, from the topic with whole maps."""
    listener = Listener('occupancy', OccupancyMap)
    try:
        return listener.wait_for(lambda m: m.header.stamp == stamp, 'the whole map')
    finally:
        listener.close()


def voxels_of(blocks):
    return {(b.x, b.y, b.z): (bytes(b.state), bytes(b.label), b.probability) for b in blocks if any(bytes(b.state))}


class MapperTest(unittest.TestCase):
    """Base of tests with the mapper `mapping` and one robot; each test starts with an empty map."""
    cloud_topic = 'cloud_in'

    @classmethod
    def setUpClass(cls):
        rospy.init_node(cls.__name__.lower() + '_rostest')
        cls.robot = Robot(cls.cloud_topic)
        cls.robot.connect()
        cls.status = Listener('mapping/status', MappingStatus)
        cls.status.wait_for(lambda m: True, 'a first status')
        rospy.wait_for_service('mapping/reset', TIMEOUT)

    def setUp(self):
        self.call('reset')

    def call(self, service, kind=Empty):
        return rospy.ServiceProxy(f'mapping/{service}', kind)()

    def reconfigure(self, **settings):
        """Changes settings while mapping, and restores them at the end of the test."""
        client = Client('/mapping/reconfigure', timeout=TIMEOUT)
        self.addCleanup(client.close)
        before = client.get_configuration(TIMEOUT)
        self.addCleanup(client.update_configuration, {name: before[name] for name in settings})
        return client.update_configuration(settings)

    def deal_with(self, stamp):
        return self.status.wait_for(lambda m: m.header.stamp == stamp, f'dealing with the cloud of {stamp.to_sec()}')

    def integrate(self, points, labels, **options):
        status = self.deal_with(self.robot.scan(points, labels, **options))
        self.assertTrue(status.integrated_last, status)
        return status.header.stamp

    def drive(self, seeds):
        """Publishes random scans, 20 m apart; returns the stamp of the last one."""
        for seed in seeds:
            stamp = self.integrate(*random_scan(seed), position=(20.0 * seed, 0.0, 0.0))
        return stamp

    def map_of_server(self, stamp):
        """The blocks of the map after a scan: states, labels, probabilities."""
        return voxels_of(whole_map(stamp).blocks)

    def expect_same(self, client, stamp):
        """Waits until a client of map_clients.py has the map of the server after a scan; returns that map."""
        truth = self.map_of_server(stamp)

        def arrived():
            client.update()
            return client.stamp == stamp and client.blocks == truth
        wait_until(arrived, 'the client having the same map')
        return truth
