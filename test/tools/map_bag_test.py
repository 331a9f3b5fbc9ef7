#!/usr/bin/env python3
"""map_bag: the map of a bag is that of the sequence in it, and what cannot be read or mapped is said in a sentence. There is no
master."""
import json
import os
import re
import shutil
import signal
import sys
import unittest

from programs import ProgramTest, call, read_bytes, read_json, rows, tiles_of
from signals_test import Program

try:
    import rosbag
    import rospy
    from geometry_msgs.msg import TransformStamped
    from sensor_msgs.msg import PointCloud2
    from tf2_msgs.msg import TFMessage
except ImportError as error:
    print(f'SKIPPED: needs ROS: {error}', file=sys.stderr)
    sys.exit(77)

SCANS = 6
TOPIC = '/velodyne_points'
ENVIRONMENT = {name: value for name, value in os.environ.items() if name not in ('ROS_MASTER_URI', 'ROS_IP', 'ROS_HOSTNAME')}


def transform(stamp, x=0.0, parent='map', child='velodyne'):
    made = TransformStamped()
    made.header.frame_id, made.child_frame_id, made.header.stamp = parent, child, rospy.Time.from_sec(stamp)
    made.transform.translation.x, made.transform.rotation.w = x, 1.0
    return TFMessage([made])


class MapBag(ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.drive, cls.bag = cls.path('drive'), cls.path('drive.bag')
        cls.call('simulate_drive', '--output', cls.drive, '--scans', SCANS, '--beams', 16, '--columns', 300)
        cls.call('sequence_to_bag', '--sequence', cls.drive, '--output', cls.bag)
        cls.call('map_sequence', '--sequence', cls.drive, '--output', cls.path('expected.bkm'))
        cls.expected = cls.tiles('expected.bkm')
        with rosbag.Bag(cls.bag) as bag:
            cls.clouds = [cloud for _, cloud, _ in bag.read_messages([TOPIC])]

    @classmethod
    def call(cls, program, *arguments, status=0):
        result = call(program, *arguments, env=ENVIRONMENT)
        assert result.returncode == status, (result.returncode, result.stdout, result.stderr)
        return result

    @classmethod
    def tiles(cls, name):
        found = tiles_of(cls.path(name))
        assert found
        return found

    def map(self, *arguments, status=0, topic=TOPIC):
        """Maps bags to map.bkm."""
        if os.path.exists(self.path('map.bkm')):
            os.unlink(self.path('map.bkm'))
        return self.call('map_bag', *arguments, *(('--cloud-topic', topic) if topic else ()), '--output', self.path('map.bkm'),
                         status=status)

    def refused(self, words, *arguments, topic=TOPIC):
        """One sentence, the last on standard error, and no map."""
        result = self.map(*arguments, status=1, topic=topic)
        self.assertIn(words, result.stderr.splitlines()[-1])
        self.assertFalse(os.path.exists(self.path('map.bkm')))
        return result

    def write(self, name, *messages):
        """Writes a bag of messages: topic, message, time of recording."""
        with rosbag.Bag(self.path(name), 'w') as bag:
            for topic, message, time in messages:
                bag.write(topic, message, rospy.Time.from_sec(time))
        return self.path(name)

    def cloud(self, stamp, number=0, frame='velodyne'):
        made = PointCloud2(height=1, width=self.clouds[number].width, fields=self.clouds[number].fields,
                           point_step=self.clouds[number].point_step, row_step=self.clouds[number].row_step,
                           data=self.clouds[number].data)
        made.header.frame_id, made.header.stamp = frame, rospy.Time.from_sec(stamp)
        return made

    def test_the_map_is_that_of_the_sequence(self):
        result = self.map(self.bag)
        self.assertEqual(self.tiles('map.bkm'), self.expected)
        self.assertIn(f'Mapped {SCANS} of {SCANS} clouds; dropped none; used ', result.stdout)
        self.assertEqual(rows(self.path('map.bkm'), 'SELECT id, scans FROM drive'),
                         [(f'drive.bag/000000-{SCANS - 1:06d}', SCANS)])
        for name in ('map.ply', 'map.pcd'):
            include = ('--include', 'occupied,free', '--output')
            self.call('map_bag', self.bag, '--cloud-topic', TOPIC[1:], *include, self.path(name))
            self.call('map_sequence', '--sequence', self.drive, *include, self.path('of_' + name))
            self.assertTrue(read_bytes(self.path(name)) == read_bytes(self.path('of_' + name)), name)

    def test_a_journal_lets_correct_map_move_its_clouds(self):
        trajectory, moved = self.path('trajectory.txt'), self.path('moved.txt')
        said = self.map(self.bag, '--config', 'robot', '--journal', '0.01', '--trajectory', trajectory)
        self.assertRegex(said.stdout, rf'\n{SCANS} scans kept in \d+ kB\n')
        before, map_file = self.tiles('map.bkm'), self.path('map.bkm')
        self.assertEqual(rows(map_file, 'SELECT number, drive, sensor, stamp, jump FROM scan'),
                         [(n, f'drive.bag/000000-{SCANS - 1:06d}', 'velodyne', cloud.header.stamp.to_nsec(), 0)
                          for n, cloud in enumerate(self.clouds)])
        with open(trajectory) as poses, open(moved, 'w') as file:
            for line in poses:
                seconds, x, y, *rest = line.split()
                file.write(' '.join([seconds, x, str(float(y) + 0.5), *rest]) + '\n')
        self.assertIn(f'{SCANS} of {SCANS} scans', self.call('correct_map', map_file, '--poses', moved).stdout)
        self.assertNotEqual(self.tiles('map.bkm'), before)
        self.call('correct_map', map_file, '--poses', trajectory)
        self.assertTrue(self.tiles('map.bkm') == before, 'to and fro')
        # The same by the parameters of a node.
        with open(self.path('node.yaml'), 'w') as file:
            file.write('journal: true\njournal_quantum: 0.01\n')
        self.map(self.bag, '--config', self.path('node.yaml'))
        default = self.tiles('map.bkm')
        self.map(self.bag, '--journal', '0.01')
        self.assertTrue(self.tiles('map.bkm') == default, 'by parameters')
        self.refused('must be from 0.0001 to 1', self.bag, '--journal', '2')
        self.refused('depend on the order', self.bag, '--journal', '0.01', '--set', 'free_space/extent=mapped')

    def test_a_jump_of_tf_is_in_the_journal(self):
        """Of two clouds; the second one comes after the map has moved below the odometry."""
        bag = self.write('jump.bag', *(
            message for n, shift in enumerate((0.0, 3.0), 1)
            for message in (('/tf', transform(n - 0.2, shift, 'map', 'odom'), n - 0.2),
                            ('/tf', transform(n - 0.2, 0.0, 'odom', 'velodyne'), n - 0.2),
                            (TOPIC, self.cloud(n), n),
                            ('/tf', transform(n + 0.1, shift, 'map', 'odom'), n + 0.1),
                            ('/tf', transform(n + 0.1, 0.0, 'odom', 'velodyne'), n + 0.1))))
        said = self.map(bag, '--journal', '0.01', '--config', 'robot').stderr
        self.assertIn('; correct the map file with correct_map', said)
        self.assertEqual([jump for _, jump in rows(self.path('map.bkm'), 'SELECT number, jump FROM scan')], [0, 1])
        # In a frame that does not jump, nothing does.
        self.map(bag, '--journal', '0.01', '--config', 'robot', '--set', 'odometry_frame_id=odom')
        found = rows(self.path('map.bkm'), 'SELECT number, jump, hex(pose), hex(odometry) FROM scan')
        (_, _, first_pose, first), (_, jump, second_pose, second) = found
        self.assertEqual(jump, 0)
        self.assertNotEqual(first_pose, second_pose)
        self.assertEqual(first, second)
        said = self.map(bag, '--journal', '0.01', '--config', 'robot', '--set', 'odometry_frame_id=wheels').stderr
        self.assertIn("odometry_frame_id 'wheels': tf has no pose of 'velodyne' in it at time 1", said)

    def test_what_else_it_writes(self):
        report, trajectory = self.path('report.json'), self.path('trajectory.txt')
        late = self.cloud(self.clouds[-1].header.stamp.to_sec() + 1.0)
        bag = self.path('late_cloud.bag')
        shutil.copy(self.bag, bag)
        with rosbag.Bag(bag, 'a') as file:
            file.write(TOPIC, late, late.header.stamp)
        self.map(bag, '--report', report, '--trajectory', trajectory)
        written = read_json(report)
        self.assertEqual(written['clouds'], {'read': SCANS + 1, 'mapped': SCANS, 'dropped': {'transform late': 1}})
        self.assertEqual([scan['name'] for scan in written['scans']],
                         [str(cloud.header.stamp.to_nsec()) for cloud in self.clouds])
        with open(trajectory) as file:
            poses = [[float(word) for word in line.split()] for line in file]
        with rosbag.Bag(self.bag) as file:
            transforms = [message.transforms[0] for _, message, _ in file.read_messages(['/tf'])]
        for pose, each in zip(poses, transforms):
            t, q = each.transform.translation, each.transform.rotation
            for found, expected in zip(pose, (each.header.stamp.to_sec(), t.x, t.y, t.z, q.x, q.y, q.z, q.w)):
                self.assertAlmostEqual(found, expected, 6)
        self.assertEqual(len(poses), SCANS)
        self.assertEqual(self.call('map_bag', bag, '--print-topics').stdout, f'{TOPIC} {SCANS + 1}\n')
        # A part without transforms.
        self.map(bag, '--first', SCANS, '--allow-empty')
        self.assertEqual(rows(self.path('map.bkm'), 'SELECT id FROM drive'), [])
        self.refused('no cloud was mapped, and nothing was written: the latest of the transforms', bag, '--first', SCANS)

    def test_all_options_are_documented(self):
        with open(os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'docs', 'files.md')) as file:
            row = next(line for line in file if line.startswith('| `map_bag` |'))
        printed = self.call('map_bag', '--help').stdout
        options = set(re.findall(r'^ +(--[a-z-]+)', printed, re.MULTILINE)) - {'--help', '--version'}
        self.assertGreater(len(options), 10)
        for option in options:
            self.assertIn(option, row)

    def test_settings_are_those_of_the_node(self):
        with open(self.path('node.yaml'), 'w') as file:
            file.write('resolution: 0.5\nclasses: occupancy\nlabel_field: ""\nqueue_size: 3\n'
                       f'inputs: {{lidar: {{topic: {TOPIC}, max_range: 20}}}}\n')
        self.map(self.bag, '--config', self.path('node.yaml'), topic=None)
        by_file = self.tiles('map.bkm')
        self.map(self.bag, '--resolution', '0.5', '--classes', 'occupancy', '--label-field', '', '--set',
                 'sensor_model/max_range=20')
        self.assertEqual(self.tiles('map.bkm'), by_file)
        self.call('map_sequence', '--sequence', self.drive, '--labels', 'none', '--classes', 'occupancy', '--set',
                  'resolution=0.5', '--set', 'sensor_model/max_range=20', '--output', self.path('of_sequence.bkm'))
        self.assertEqual(self.tiles('of_sequence.bkm'), by_file)
        self.refused('--cloud-topic is given, but the parameters below inputs/ name topics', self.bag, '--config',
                     self.path('node.yaml'))
        self.refused('parameter resolution is given by --resolution and by --set; keep one', self.bag, '--resolution', '1',
                     '--set', 'resolution=1')
        self.refused("parameter 'resolutoin' is unknown; did you mean 'resolution'?", self.bag, '--set', 'resolutoin=1')

    def test_several_bags_are_one_recording(self):
        first, second = self.path('a.bag'), self.path('b.bag')
        self.call('sequence_to_bag', '--sequence', self.drive, '--scans', 2, '--output', first)
        self.call('sequence_to_bag', '--sequence', self.drive, '--first', 2, '--compression', 'lz4', '--output', second)
        for bags in ((first, second), (second, first)):
            self.assertIn(f'Mapped {SCANS} of {SCANS} clouds', self.map(*bags).stdout)
            self.assertEqual(self.tiles('map.bkm'), self.expected, bags)
        self.refused(f"bag '{first}' is named twice", first, second, first)
        # The clouds may be in one bag, and their tf in another.
        with rosbag.Bag(self.bag) as both:
            messages = list(both.read_messages())
        for name, is_tf in (('tf.bag', True), ('only.bag', False)):
            self.write(name, *((topic, message, time.to_sec()) for topic, message, time in messages if (topic == '/tf') == is_tf))
        self.map(self.path('only.bag'), self.path('tf.bag'))
        self.assertEqual(self.tiles('map.bkm'), self.expected)

    def test_parts_add_up_to_the_whole(self):
        """Also where static transforms were recorded once, long before, and the pose is interpolated."""
        messages = [('/tf_static', transform(0.0, 0.5, 'base', 'velodyne'), 100.0)]
        for n in range(SCANS):
            stamp = 150.0 + 10.0 * n
            messages += [('/tf', transform(stamp - 0.3, n - 0.3, child='base'), stamp - 0.2),
                         (TOPIC, self.cloud(stamp, n), stamp + 0.1),
                         ('/tf', transform(stamp + 0.4, n + 0.4, child='base'), stamp + 0.5)]
        bag = self.write('long.bag', *messages)
        self.assertIn(f'Mapped {SCANS} of {SCANS} clouds', self.map(bag).stdout)
        whole = self.tiles('map.bkm')
        parts = []
        for options in (('--scans', 2), ('--first', 2, '--scans', 3), ('--first', 5)):
            parts.append(self.path(f'part{len(parts)}.bkm'))
            self.map(bag, *options)
            os.rename(self.path('map.bkm'), parts[-1])
        self.assertEqual([rows(part, 'SELECT id, scans FROM drive')[0] for part in parts],
                         [('long.bag/000000-000001', 2), ('long.bag/000002-000004', 3), ('long.bag/000005-000005', 1)])
        self.call('merge_maps', *parts, '--output', self.path('sum.bkm'))
        self.assertEqual(self.tiles('sum.bkm'), whole)
        self.map(bag, '--start', '19.5', '--duration', '25')
        self.assertEqual(self.tiles('map.bkm'), self.tiles('part1.bkm'))
        self.refused('the bags have 6 clouds on these topics, so none is left', bag, '--first', '6')
        self.refused('--first and --start say the same', bag, '--first', '1', '--start', '1')
        self.refused('these options select no cloud', bag, '--duration', '0')

    def test_clouds_recorded_at_one_time_are_of_one_part(self):
        """Two lidars; rosbag gives such clouds in any order."""
        lidars = ('/left', '/right')
        messages = [message for n in range(SCANS) for message in (
            ('/tf', transform(100.0 + n, n), 100.0 + n), *((topic, self.cloud(100.0 + n, n), 100.0 + n) for topic in lidars))]
        bag = self.write('lidars.bag', *messages)
        topics = ('--cloud-topic', lidars[0], '--cloud-topic', lidars[1])
        self.assertIn(f'Mapped {2 * SCANS} of {2 * SCANS} clouds', self.map(bag, *topics, topic=None).stdout)
        whole = self.tiles('map.bkm')
        parts = []
        for options in (('--scans', 5), ('--first', 5)):
            parts.append(self.path(f'of_lidars{len(parts)}.bkm'))
            self.map(bag, *topics, *options, topic=None)
            os.rename(self.path('map.bkm'), parts[-1])
        self.assertEqual([rows(part, 'SELECT scans FROM drive') for part in parts], [[(4,)], [(8,)]])
        self.call('merge_maps', *parts, '--output', self.path('sum.bkm'))
        self.assertEqual(self.tiles('sum.bkm'), whole)
        self.refused('topic /left is named twice', bag, '--cloud-topic', 'left', topic='/left')

    def test_clouds_wait_for_tf_by_the_time_of_the_recording(self):
        def bag_with_tf_after(seconds):
            return self.write('late.bag', ('/tf', transform(99.0), 99.0), (TOPIC, self.cloud(100.0), 100.0),
                              (TOPIC, self.cloud(100.5), 100.5), ('/tf', transform(101.0, 1.0), 100.0 + seconds),
                              (TOPIC, self.cloud(101.0, 1), 100.0 + seconds))
        self.assertIn('Mapped 3 of 3 clouds; dropped none', self.map(bag_with_tf_after(9.9)).stdout)
        waited = self.tiles('map.bkm')
        self.map(bag_with_tf_after(1.0))
        self.assertEqual(self.tiles('map.bkm'), waited)
        result = self.map(bag_with_tf_after(10.2))
        self.assertIn('Mapped 2 of 3 clouds; dropped: 1 transform late; used', result.stdout)
        self.assertRegex(result.stderr, r'warning: dropped the cloud of /velodyne_points of time 100.000: the latest of the '
                                        r'transforms from .* than the cloud; make the localisation publish sooner \(waited 10 s '
                                        r'of the recording')

    def test_without_tf_every_cloud_is_counted_and_nothing_is_written(self):
        bare = self.write('bare.bag', *((TOPIC, self.cloud(100.0 + n, n), 100.0 + n) for n in range(SCANS)))
        self.refused("tf has never heard of frame 'velodyne'", bare)
        self.refused(f'(Mapped 0 of {SCANS} clouds; dropped: {SCANS} unknown frame;', bare)
        self.refused('tf has never heard of frame', self.bag, '--frame', 'earth')
        # In the frame of the clouds, no tf is needed.
        self.assertIn(f'Mapped {SCANS} of {SCANS} clouds', self.map(bare, '--frame', 'velodyne').stdout)

    def test_bad_clouds_are_counted_under_their_reasons(self):
        nothing, not_finite, cut = self.cloud(101.0), self.cloud(102.0), self.cloud(103.0)
        nothing.width = nothing.row_step = 0
        nothing.data = b''
        not_finite.data = b'\0\0\xc0\x7f' * (len(not_finite.data) // 4)  # NaN
        cut.data = cut.data[:1000]
        poses = [('/tf', transform(stamp), 100.0) for stamp in (99.0, 105.0)]
        good = self.write('good.bag', *poses, (TOPIC, self.cloud(100.0), 100.0))
        self.map(good)
        expected = self.tiles('map.bkm')
        bad = self.write('bad.bag', *poses, *((TOPIC, cloud, 100.0) for cloud in (self.cloud(100.0), nothing, not_finite, cut)))
        result = self.map(bad, status=1)
        self.assertIn('Mapped 2 of 4 clouds; dropped: 1 bad cloud, 1 empty; used', result.stdout)
        self.assertIn(f'{not_finite.width} not finite', result.stdout)
        self.assertIn('it has no points; check the sensor', result.stderr)
        self.assertEqual(self.tiles('map.bkm'), expected)

    def test_stamps_that_go_back_are_a_time_jump(self):
        def lap(recorded):
            return [each for n in range(3) for each in (('/tf', transform(100.0 + 0.1 * n, n), recorded + 0.1 * n),
                                                        (TOPIC, self.cloud(100.0 + 0.1 * n, n), recorded + 0.1 * n))]
        later = [each for n in range(3) for each in (('/tf', transform(150.0 + 0.1 * n, n), 150.0 + 0.1 * n),
                                                     (TOPIC, self.cloud(150.0 + 0.1 * n, n), 150.0 + 0.1 * n))]
        bag = self.write('twice.bag', *later, *lap(155.0))
        result = self.map(bag)
        self.assertIn('Mapped 6 of 6 clouds', result.stdout)
        self.assertIn('the stamps of clouds went back to time 100.100', result.stderr)
        both = self.tiles('map.bkm')
        parts = []
        for first in (0, 3):
            self.assertIn('Mapped 3 of 3 clouds', self.map(bag, '--first', first, '--scans', 3).stdout)
            parts.append(self.path(f'lap{first}.bkm'))
            os.rename(self.path('map.bkm'), parts[-1])
        self.call('merge_maps', *parts, '--output', self.path('laps.bkm'))
        self.assertEqual(self.tiles('laps.bkm'), both)
        self.map(bag, '--set', 'on_time_jump=reset', '--trajectory', self.path('poses.txt'), '--report', self.path('report.json'))
        self.assertNotEqual(self.tiles('map.bkm'), both)
        for name, count in (('poses.txt', lambda text: len(text.splitlines())),
                            ('report.json', lambda text: len(json.loads(text)['scans']))):
            with open(self.path(name)) as file:
                self.assertEqual(count(file.read()), rows(self.path('map.bkm'), 'SELECT scans FROM drive')[0][0], name)

    def test_tf_may_be_recorded_without_a_slash(self):
        poses = [('tf_static', transform(0.0, 1.0, 'base', 'velodyne'), 99.0), ('tf', transform(100.0, child='base'), 99.0)]
        self.assertIn('Mapped 1 of 1 clouds', self.map(self.write('bare.bag', *poses, (TOPIC, self.cloud(100.0), 100.0))).stdout)

    def test_no_file_replaces_a_bag(self):
        before = read_bytes(self.bag)
        for option in ('--report', '--trajectory'):
            self.refused(f'{option} {self.bag} would replace the bag', self.bag, option, self.bag)
        with open(self.bag, 'rb') as file:
            self.assertEqual(file.read(), before)

    def test_what_cannot_be_read_is_said_with_the_remedy(self):
        self.refused(f"bag '{self.path('none.bag')}' cannot be read (No such file or directory)", self.path('none.bag'))
        self.refused(f"bag '{self.drive}' cannot be read (Is a directory)", self.drive)
        self.refused('name one or more bags')
        self.refused(f"bag '{self.bag}' has no clouds on /points; there are some on: {TOPIC}; choose with --cloud-topic TOPIC",
                     self.bag, topic='/points')
        self.refused('has no clouds on cloud_in; there are some on', self.bag, topic=None)
        self.refused('has no clouds (sensor_msgs/PointCloud2); record some', self.write('empty.bag'))
        content = read_bytes(self.bag)
        cut = self.path('cut.bag')
        for length in (0, 5, 5000, len(content) // 2, len(content) - 10):
            with open(cut, 'wb') as file:
                file.write(content[:length])
            self.refused(f"run: rosbag reindex '{cut}'" if length >= 5000 else f"'{cut}' is no bag", cut)
        with open(cut, 'wb') as file:
            file.write(content[:13] + bytes(range(256)) * 50)
        self.refused(f"run: rosbag reindex '{cut}'", cut)
        packed = self.path('packed.bag')
        self.call('sequence_to_bag', '--sequence', self.drive, '--compression', 'lz4', '--output', packed)
        with open(packed, 'r+b') as file:  # of the compressed data
            file.seek(10000)
            file.write(bytes(1000))
        self.refused(f"bag '{packed}' is damaged", packed)

    def test_a_signal_ends_it_after_the_cloud_at_hand(self):
        many = 3000  # the progress of so many is more than a terminal buffers, so that the program waits until it is read
        small = self.cloud(0.0)
        small.width = 20
        small.row_step = 20 * small.point_step
        small.data = small.data[:small.row_step]
        bag = self.path('many.bag')
        with rosbag.Bag(bag, 'w') as file:
            for n in range(many):
                stamp = rospy.Time.from_sec(100.0 + 0.1 * n)
                small.header.stamp = stamp
                file.write(TOPIC, small, stamp)  # whose pose comes later
                file.write('/tf', transform(stamp.to_sec(), 0.01 * n), stamp + rospy.Duration.from_sec(0.15))
        out, rest = self.path('stopped.bkm'), self.path('rest.bkm')
        program = Program('map_bag', bag, '--cloud-topic', TOPIC, '--output', out)
        program.wait_for(f' 20/{many} ')
        program.process.send_signal(signal.SIGINT)
        status, last = program.end()
        self.assertEqual(status, 130)
        said = re.fullmatch(rf'map_bag: stopped after cloud (\d+), (\d+) of {many} clouds; to map the rest, say --first (\d+) '
                            r'--scans (\d+) with another --output, and add both with merge_maps', last)
        self.assertTrue(said, last)
        scan, count, first, left = map(int, said.groups())
        self.assertEqual((scan + 1, first, left), (count, count, many - count))
        self.assertEqual(rows(out, 'SELECT id, scans FROM drive'), [(f'many.bag/000000-{scan:06d}', count)])
        self.call('map_bag', bag, '--cloud-topic', TOPIC, '--first', first, '--scans', left, '--output', rest)
        self.call('merge_maps', out, rest, '--output', self.path('sum.bkm'))
        self.call('map_bag', bag, '--cloud-topic', TOPIC, '--output', self.path('all.bkm'))
        self.assertEqual(self.tiles('sum.bkm'), self.tiles('all.bkm'))


if __name__ == '__main__':
    unittest.main()
