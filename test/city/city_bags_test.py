#!/usr/bin/env python3
"""Bags as drives of a city."""
import json
import math
import sys
import unittest

from harness import BIN, SCANS, MadeCity, program, tiles_of

import numpy
from bki_mapping.city import build, report

try:
    import rosbag
    import rospy
    from geometry_msgs.msg import TransformStamped
    from sensor_msgs.msg import PointCloud2, PointField
    from tf2_msgs.msg import TFMessage
except ImportError as error:
    print(f'SKIPPED: needs ROS: {error}', file=sys.stderr)
    sys.exit(77)
if not (BIN / 'map_bag').exists():
    print('SKIPPED: needs map_bag, which is built with ROS', file=sys.stderr)
    sys.exit(77)


class Bags(MadeCity):
    def write_bag(self, path, name, label=7):
        """Writes a sequence as a bag: the sensor on a vehicle, whose pose changes linearly between transforms 0.5 s apart."""
        poses = numpy.loadtxt(self.folder / name / 'poses.txt').reshape(-1, 3, 4)

        def transform(parent, child, stamp, translation, yaw=0.0):
            made = TransformStamped()
            made.header.frame_id, made.child_frame_id, made.header.stamp = parent, child, rospy.Time.from_sec(stamp)
            made.transform.translation.x, made.transform.translation.y, made.transform.translation.z = translation
            made.transform.rotation.z, made.transform.rotation.w = math.sin(yaw / 2), math.cos(yaw / 2)
            return made

        with rosbag.Bag(str(path), 'w', compression='lz4') as bag:
            bag.write('/tf_static', TFMessage([transform('base', 'lidar', 0.0, (0.0, 0.0, 1.5))]), rospy.Time(99))
            for number, pose in enumerate(poses):
                stamp = 100.0 + number
                points = numpy.fromfile(self.folder / name / f'velodyne/{number:06d}.bin', '<f4').reshape(-1, 4)
                labels = numpy.fromfile(self.folder / name / f'labels/{number:06d}.label', '<u4')
                rows = numpy.zeros(len(points), numpy.dtype({
                    'names': ['x', 'y', 'z', 'intensity', 'label'], 'formats': ['<f4', '<f4', '<f4', '<f4', '<u2'],
                    'offsets': [0, 4, 8, 16, 24], 'itemsize': 26}))
                for column, field in enumerate(('x', 'y', 'z', 'intensity')):
                    rows[field] = points[:, column]
                rows['label'] = labels
                cloud = PointCloud2(height=1, width=len(points), point_step=26, row_step=26 * len(points), data=rows.tobytes())
                cloud.fields = [PointField(field, offset, kind, 1) for field, offset, kind in (
                    ('x', 0, label), ('y', 4, 7), ('z', 8, 7), ('intensity', 16, 7), ('label', 24, 4))]
                cloud.header.frame_id, cloud.header.stamp = 'lidar', rospy.Time.from_sec(stamp)
                at = pose[:, 3] - [0, 0, 1.5]
                yaw = math.atan2(pose[1, 0], pose[0, 0])
                for shift in (-0.25, 0.25):  # the cloud is between the two
                    if number < len(poses) - 1:  # and the last one is later than all transforms
                        bag.write('/tf', TFMessage([transform('city', 'base', stamp + shift, at + [shift, 0, 0], yaw)]),
                                  rospy.Time.from_sec(stamp))
                bag.write('/points', cloud, rospy.Time.from_sec(stamp))
        return poses

    def describe_drives(self, *drives, **more):
        path = self.describe([])
        path.write_text(json.dumps({'piece_scans': 2, 'region_tiles': 3, 'drives': drives, **more}))
        return path

    def test_bags_are_drives(self):
        path = self.folder / 'monday.bag'
        poses = self.write_bag(path, 'd2')
        bag = {'bag': 'monday.bag', 'cloud_topic': '/points', 'frame': 'city'}
        city = self.describe_drives({'sequence': 'd1'}, bag)
        text = self.finish(self.start(city, '--workers', '2', '--no-picture'))
        self.assertIn(f"drive 'monday': 1 of {SCANS} clouds are left out: 1 transform late", text)
        self.assertIn('dropped the cloud of /points of time 104.000: the latest of the transforms', text)
        index = json.loads((self.output / 'index.json').read_text())
        drive = index['drives'][1]
        self.assertEqual((drive['name'], drive['bag'], drive['cloud_topic'], drive['frame']),
                         ('monday', str(path), '/points', 'city'))
        self.assertEqual([(piece['first'], piece['scans']) for piece in drive['pieces']], [(0, 2), (2, 2), (4, 1)])
        numpy.testing.assert_allclose(report.way_of(drive, self.output), poses[:SCANS - 1, :, 3], atol=1e-6)
        # The city is that of the sequence d1 and of the whole bag.
        self.whole(['d1'])
        program('map_bag', path, '--cloud-topic', '/points', '--frame', 'city', '--frame-in-file', 'map', '--output',
                self.folder / 'monday.bkm')
        program('merge_maps', self.folder / 'whole-d1.bkm', self.folder / 'monday.bkm', '--output', self.folder / 'both.bkm')
        whole = tiles_of(self.folder / 'both.bkm')
        self.expect_equal([], whole=whole)
        # Nothing is mapped again, unless the account of a piece is lost.
        self.finish(self.start(city, '--workers', '2', '--no-picture', '--resume'))
        self.assertIn('| map pieces | 6 | 0 | 0.0 |', (self.output / 'report.md').read_text())
        (self.output / drive['pieces'][1]['file']).with_suffix('.json').unlink()
        self.finish(self.start(city, '--workers', '2', '--no-picture', '--resume'))
        self.assertIn('| map pieces | 6 | 1 | ', (self.output / 'report.md').read_text())
        # Or is empty or cut, as after a loss of power. Bags that an earlier version has converted go, and others stay.
        for name in (f'bags/d-{"0" * 16}/bag.json', 'bags/mine.bag'):
            (self.output / name).parent.mkdir(parents=True, exist_ok=True)
            (self.output / name).write_text('')
        for number, left in ((0, 0), (1, 20)):
            account = (self.output / drive['pieces'][number]['file']).with_suffix('.json')
            account.write_text(account.read_text()[:left])
        self.assertEqual(report.way_of(drive, self.output).shape, (0, 3))
        self.finish(self.start(city, '--workers', '2', '--no-picture', '--resume'))
        self.assertIn('| map pieces | 6 | 2 | ', (self.output / 'report.md').read_text())
        self.assertEqual(list((self.output / 'bags').iterdir()), [self.output / 'bags/mine.bag'])
        numpy.testing.assert_allclose(report.way_of(drive, self.output), poses[:SCANS - 1, :, 3], atol=1e-6)
        self.expect_equal([], whole=whole)
        self.assertEqual([path for path in self.output.rglob('.*') if path.name != '.run'], [], 'nothing is left over')
        # Other pieces make the same city; without labels, it is that of such a map.
        self.finish(self.start(self.describe_drives({'sequence': 'd1'}, bag, piece_scans=3), '--workers', '2', '--no-picture', '--resume'))
        self.expect_equal([], whole=whole)
        program('map_bag', path, '--cloud-topic', '/points', '--frame', 'city', '--set', 'label_field=', '--classes', 'occupancy',
                '--output', self.folder / 'unlabelled.bkm')
        city = self.describe_drives({**bag, 'labelled': False}, classes='occupancy')
        self.finish(self.start(city, '--workers', '2', '--no-picture', '--resume'))
        self.expect_equal([], whole=tiles_of(self.folder / 'unlabelled.bkm'))

    def test_only_what_earlier_versions_wrote_leaves_the_folder_of_bags(self):
        bags = self.folder / 'old/bags'
        earlier = [f'my.drive-{"0" * 16}/bag.json', f'my.drive-{"0" * 16}/velodyne/000000.bin',
                   f'.my.{"f" * 32}.drive-{"0" * 16}/x']
        others = ['monday.bag', '.hidden/note', f'notes-{"0" * 16}/note', 'drive/bag.json', f'a-{"0" * 17}/bag.json']
        for name in earlier + others:
            (bags / name).parent.mkdir(parents=True, exist_ok=True)
            (bags / name).write_text('')
        build.remove_converted_bags(bags)
        self.assertEqual(sorted(str(path.relative_to(bags)) for path in bags.rglob('*') if path.is_file()), sorted(others))
        for name in others:
            (bags / name).unlink()
        for path in list(bags.iterdir()):
            path.rmdir()
        build.remove_converted_bags(bags)
        self.assertFalse(bags.exists(), 'an empty folder stays')
        build.remove_converted_bags(bags)

    def test_wrong_bags_are_left_out_with_a_sentence(self):
        good = {'cloud_topic': '/points', 'frame': 'city'}
        self.write_bag(self.folder / 'typed.bag', 'd2', label=9)
        self.write_bag(self.folder / 'good.bag', 'd2')
        content = (self.folder / 'good.bag').read_bytes()
        for name, some in (('cut', content[:len(content) // 2]), ('none', b''), ('text', b'no bag'),
                           ('garbage', b'#ROSBAG V2.0\n' + bytes(range(256)) * 50)):
            (self.folder / f'{name}.bag').write_bytes(some)
        wrong = {
            'typed': ({'bag': 'typed.bag', **good}, "field 'x'"),
            'topic': ({'bag': 'good.bag', **good, 'cloud_topic': '/cloud'},
                      'good.bag has no clouds at /cloud; it has clouds at: /points'),
            'frame': ({'bag': 'good.bag', **good, 'frame': 'earth'},
                      "no cloud of /points has a transform to 'earth' (5 unknown frame); record tf"),
            'label': ({'bag': 'good.bag', **good, 'label_field': 'class'}, "'class'"),
            'cut': ({'bag': 'cut.bag', **good}, 'run: rosbag reindex'),
            'none': ({'bag': 'none.bag', **good}, "is no bag"),
            'text': ({'bag': 'text.bag', **good}, "is no bag"),
            'garbage': ({'bag': 'garbage.bag', **good}, 'run: rosbag reindex'),
            'missing': ({'bag': 'missing.bag', **good}, 'missing.bag does not exist')}
        city = self.describe_drives({'sequence': 'd1'}, *({**bag, 'name': name} for name, (bag, _) in wrong.items()))
        text = self.finish(self.start(city, '--workers', '2', '--no-picture'), 1)
        left_out = dict(line[len("drive '"):].split("' is left out: ", 1) for line in text.splitlines()
                        if "' is left out: " in line)
        self.assertEqual(set(left_out), set(wrong))
        for name, (_, words) in wrong.items():
            self.assertIn(words, left_out[name], name)
        self.expect_equal(['d1'])


if __name__ == '__main__':
    unittest.main()
