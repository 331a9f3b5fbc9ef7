#!/usr/bin/env python3
"""Sequences as people have them: without labels, with poses of other sensors and in other formats, or with few of them."""
import os
import shutil
import unittest

from programs import ProgramTest, call, read_bytes, read_json, rows

TR = [[0, -1, 0, 0.1], [0, 0, -1, 0.2], [1, 0, 0, 0.3]]  # from a lidar (x ahead, z up) to a camera (z ahead, y down)


def product(a, b):
    """Of transforms as three rows of four numbers."""
    return [[sum(a[r][k] * b[k][c] for k in range(3)) + (a[r][3] if c == 3 else 0) for c in range(4)] for r in range(3)]


def inverse(a):
    return [[a[k][r] for k in range(3)] + [-sum(a[k][r] * a[k][3] for k in range(3))] for r in range(3)]


def text_of(transform):
    return ' '.join(repr(number) for row in transform for number in row)


class Sequences(ProgramTest):
    def setUp(self):
        self.setUpClass()  # a folder for each test
        self.drive, self.out = self.path('drive'), self.path('out.bkm')
        self.make('--scans', '4', '--speed', '20')

    def make(self, *more):
        shutil.rmtree(self.drive, ignore_errors=True)
        self.succeeds('simulate_drive', '--output', self.drive, '--beams', '16', '--columns', '400', *more)
        with open(os.path.join(self.drive, 'poses.txt')) as file:
            numbers = [[float(word) for word in line.split()] for line in file]
        self.poses = [[line[0:4], line[4:8], line[8:12]] for line in numbers]  # of the lidar: Tr is the identity

    def write(self, name, *lines):
        path = os.path.join(self.drive, name)
        with open(path, 'w') as file:
            file.writelines(line + '\n' for line in lines)
        return path

    def mapped(self, *options):
        """The tiles of the map, and what was said."""
        said = self.succeeds('map_sequence', '--sequence', self.drive, '--output', self.out, *options).stderr
        return rows(self.out, 'SELECT z, y, x, content FROM tile WHERE part = 0'), said

    def test_without_labels(self):
        labelled, _ = self.mapped('--classes', 'occupancy')
        shutil.rmtree(os.path.join(self.drive, 'labels'))
        without, said = self.mapped('--classes', 'occupancy')
        self.assertEqual((without, said), (labelled, ''), 'labels say nothing where there is one class')
        self.assertEqual(self.mapped('--classes', 'occupancy', '--labels', 'none')[0], without)
        sequence = ('--sequence', self.drive)
        self.fails('labels is not a folder; name one with labels, or say --labels none', 'map_sequence', *sequence)
        self.fails('predictions is not a folder', 'map_sequence', *sequence, '--classes', 'occupancy', '--labels', 'predictions')
        self.assertTrue(self.mapped('--labels', 'none')[0], 'hits of no known class')
        figures = self.path('figures.json')
        self.succeeds('evaluate_map', *sequence, '--classes', 'occupancy', '--json', figures)
        self.assertIsNone(read_json(figures)['sa'])
        self.fails('--cloud needs labels', 'evaluate_map', *sequence, '--classes', 'occupancy', '--cloud')

    def test_scans_that_are_not_asked_for_need_no_pose(self):
        whole, _ = self.mapped('--scans', '3')
        lines = [text_of(pose) for pose in self.poses]
        for last in ((), ('0.5 1 0',), ('nan' + lines[3][1:],)):
            self.write('poses.txt', *lines[:3], *last)
            self.assertEqual(self.mapped('--scans', '3'), (whole, ''))
            self.fails('poses.txt has no line 4 for scan 000003' if not last else 'poses.txt line 4', 'map_sequence', '--sequence',
                       self.drive)
        self.write('poses.txt', *lines)
        self.write('times.txt', '0', '0.1', '0.2')
        self.assertEqual(self.mapped('--scans', '3'), (whole, ''))
        self.fails('times.txt has no line 4 for scan 000003', 'map_sequence', '--sequence', self.drive, '--first', '3')

    def test_one_reader_for_poses_and_trajectories(self):
        self.poses = [[[1, 0, 0, 0.5 * n], [0, 1, 0, 0.25 * n], [0, 0, 1, 0]] for n in range(4)]
        rows = self.write('rows.txt', *(text_of(pose) for pose in self.poses))
        whole, _ = self.mapped('--poses', rows)
        squares = self.write('squares.txt', '# 4x4', *(text_of(pose) + ' 0 0 0 1' for pose in self.poses))
        self.assertEqual(self.mapped('--poses', squares), (whole, ''))
        places = [' '.join(repr(pose[axis][3]) for axis in range(3)) for pose in self.poses]
        stamped = self.write('stamped.txt', *(f'{0.1 * n} {place} 0 0 0 1' for n, place in reversed(list(enumerate(places)))))
        self.assertEqual(self.mapped('--poses', stamped), (whole, ''))
        page, header = self.path('page.html'), set()
        for path in (rows, squares, self.write('places.txt', *(f'{n} {place}' for n, place in enumerate(places)))):
            self.succeeds('export_map', self.out, '--html', page, '--trajectory', path)
            with open(page) as file:
                header.add(file.read().split('"trajectories":')[1].split('"points":')[1].split('}')[0])
        self.assertEqual(len(header), 1)
        self.fails('rows.txt line 5 has 3 numbers, but needs 12, as the lines before it', 'export_map', self.out, '--html', page,
                   '--trajectory', self.write('rows.txt', *(text_of(pose) for pose in self.poses), '1 2 3'))
        late = self.write('late.txt', *(f'{100 + 0.1 * n} {place} 0 0 0 1' for n, place in enumerate(places)))
        self.fails('late.txt has no pose at 0 s, the time of scan 000000 in times.txt; the nearest is at 100 s, in line 1',
                   'map_sequence', '--sequence', self.drive, '--poses', late)
        self.fails('places.txt line 1 has no rotation', 'map_sequence', '--sequence', self.drive, '--poses',
                   os.path.join(self.drive, 'places.txt'))

    def test_a_drive_along_a_trajectory(self):
        first = [[[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3]]]  # not the identity: the frame is that of the file
        self.poses = first + [[[1, 0, 0, 1 + 1.2 * n], [0, 0.8, -0.6, 2], [0, 0.6, 0.8, 3 + 0.1 * n]] for n in range(1, 5)]
        of_camera = self.write('camera.txt', *(text_of(product(product(TR, pose), inverse(TR))) for pose in self.poses))
        calib = self.write('of_camera.txt', 'Tr: ' + text_of(TR))
        of_lidar = self.write('lidar.txt', *(text_of(pose) for pose in self.poses))
        along = ('simulate_drive', '--beams', '16', '--columns', '200', '--output')
        folders = [self.path(name) for name in ('by_camera', 'by_lidar')]
        self.succeeds(*along, folders[0], '--trajectory', of_camera, '--calib', calib)
        self.succeeds(*along, folders[1], '--trajectory', of_lidar, '--poses-in', 'lidar')
        for folder, trajectory in zip(folders, (of_camera, of_lidar)):
            self.assertEqual(len(os.listdir(os.path.join(folder, 'velodyne'))), len(self.poses))
            with open(os.path.join(folder, 'poses.txt')) as written, open(trajectory) as given:
                for line, other in zip(written.read().splitlines(), given.read().splitlines(), strict=True):
                    for number, expected in zip(line.split(), other.split(), strict=True):
                        self.assertAlmostEqual(float(number), float(expected), places=9)
        scans = []
        for folder in folders:
            scans.append(read_bytes(os.path.join(folder, 'labels', '000003.label')))
        self.assertGreater(len(scans[0]), 4 * 1000)
        self.drive = folders[0]
        self.assertEqual(self.mapped('--poses', of_camera), self.mapped('--poses', os.path.join(folders[0], 'poses.txt')))
        by_truth, said = self.mapped('--poses', of_camera)
        self.assertEqual(said, '')
        drifted = [[row[:3] + [row[3] + 0.2 * n] for row in pose] for n, pose in enumerate(self.poses)]
        odometry = self.write('odometry.txt', *(text_of(product(product(TR, pose), inverse(TR))) for pose in drifted))
        self.assertNotEqual(self.mapped('--poses', odometry)[0], by_truth)
        figures = self.path('figures.json')
        self.succeeds('evaluate_map', '--sequence', folders[0], '--json', figures)
        truth = read_json(figures)['truth']
        self.assertGreater(truth['free_precision'], 0.5, 'the truth is in the frame of the map')
        self.assertGreater(truth['occupied_recall'], 0.5)

        never = self.path('never')
        self.fails('scans is 6, but the trajectory has only 5 poses', *along, never, '--trajectory', of_lidar, '--poses-in', 'lidar',
                   '--scans', '6')
        self.fails('calib.txt cannot be read; poses of the camera need calib.txt', *along, never, '--trajectory',
                   shutil.copy(of_camera, self.folder))
        for option, value in (('--speed', '3'), ('--scene', 'crowd')):
            self.fails(option + ' cannot be given with --trajectory', *along, never, '--trajectory', of_lidar, option, value)
        self.fails('are for --trajectory', *along, never, '--poses-in', 'lidar')
        self.fails('needs poses; give --trajectory FILE', *along, never, '--scene', 'trajectory')
        self.fails('missing.txt cannot be read', *along, never, '--trajectory', self.path('missing.txt'))
        self.fails('has no pose', *along, never, '--trajectory', self.write('empty.txt'))
        self.fails('line 1 has no pose', *along, never, '--poses-in', 'lidar', '--trajectory', self.write('gap.txt', '', text_of(first[0])))
        self.assertFalse(os.path.exists(never))

    def test_a_trajectory_is_corrected_on_the_way(self):
        self.make('--scans', '8', '--speed', '20')
        truth = [[row[:3] + [round(row[3] * 1024) / 1024] for row in pose] for pose in self.poses]
        drifted = [product(pose, [[1, 0, 0, 0], [0, 1, 0, 0.2 * n], [0, 0, 1, 0]]) for n, pose in enumerate(truth)]
        half = truth[:4] + [product(truth[3], product(inverse(drifted[3]), pose)) for pose in drifted[4:]]
        for name, poses in (('truth', truth), ('half', half), ('drifted', drifted)):
            self.write(f'{name}.txt', *map(text_of, poses))
        updates = self.write('updates.txt', '# scan, poses', '3 half.txt', '', '7 truth.txt')
        common = ('--config', 'robot', '--journal', '0.01', '--poses-in', 'lidar')
        wanted, _ = self.mapped('--poses', os.path.join(self.drive, 'truth.txt'), *common)
        wrong, _ = self.mapped('--poses', os.path.join(self.drive, 'drifted.txt'), *common)
        self.assertNotEqual(wrong, wanted)
        options = ('--poses', os.path.join(self.drive, 'drifted.txt'), '--trajectory-updates', updates, *common)
        corrected, _ = self.mapped(*options)
        self.assertTrue(corrected == wanted, 'the map is not that of the true poses')
        said = self.succeeds('map_sequence', '--sequence', self.drive, *options).stdout
        self.assertIn('8 scans kept in ', said)
        self.assertIn('2 corrections made ', said)

    def test_updates_of_a_trajectory_that_cannot_be_read(self):
        def refused(words, *lines):
            self.fails(words, 'map_sequence', '--sequence', self.drive, '--poses-in', 'lidar', '--poses',
                       os.path.join(self.drive, 'poses.txt'), '--trajectory-updates', self.write('updates.txt', *lines))
        refused("line 2: must be the number of a scan and a file of poses, such as '120 poses_120.txt'",
                '1 poses.txt', 'two poses.txt')
        refused('line 1: must be the number of a scan and a file of poses', '3')
        refused('line 2: scan 1 comes after a later one; sort the lines by scan', '2 poses.txt', '1 poses.txt')
        refused('none.txt; paths are relative to the list', '1 none.txt')
        self.fails('give the first poses in it, too, with --poses', 'map_sequence', '--sequence', self.drive,
                   '--trajectory-updates', self.path('none.txt'))
        self.fails('--correction-tolerance needs --trajectory-updates', 'map_sequence', '--sequence', self.drive,
                   '--correction-tolerance', '1')

    def test_poses_of_the_other_sensor_are_noticed(self):
        self.write('calib.txt', 'Tr: ' + text_of(TR))
        of_camera = [text_of(product(product(TR, pose), inverse(TR))) for pose in self.poses]
        of_lidar = [text_of(pose) for pose in self.poses]
        for lines, right, wrong in ((of_camera, 'camera', 'lidar'), (of_lidar, 'lidar', 'camera')):
            self.write('poses.txt', *lines)
            whole, said = self.mapped('--poses-in', right)
            self.assertEqual(said, '')
            self.assertNotEqual(self.mapped('--poses-in', wrong), (whole, ''))
            self.assertEqual(self.mapped('--poses-in', wrong)[1], '', 'whoever says which sensor it is, is not warned')
            default, said = self.mapped()
            if right == 'camera':
                self.assertEqual((default, said), (whole, ''))
                continue
            self.assertNotEqual(default, whole)
            self.assertRegex(said, r'^warning: the poses seem to be those of the lidar: .* \d+ cm apart as poses of the camera, but '
                                   r'\d+ cm as poses of the lidar; say .* --poses-in lidar \(poses_in in Python and city.yaml\)\n$')
            self.assertIn('poses seem to be those of the lidar', call('evaluate_map', '--sequence', self.drive).stderr)
        stamps = self.write('stamped.txt', *(f'{0.1 * n} {" ".join(repr(row[3]) for row in product(product(TR, pose), inverse(TR)))} 0 0 0 1'
                                             for n, pose in enumerate(self.poses)))
        self.assertRegex(self.mapped('--poses', stamps)[1], 'poses seem to be those of the camera')
        os.remove(os.path.join(self.drive, 'calib.txt'))
        self.assertEqual(self.mapped('--poses-in', 'lidar'), (whole, ''))
        self.fails('calib.txt cannot be read; poses of the camera need calib.txt', 'map_sequence', '--sequence', self.drive)
        self.fails("--poses-in 'radar' is unknown; known sensors: camera, lidar", 'map_sequence', '--sequence', self.drive,
                   '--poses-in', 'radar')

    def test_poses_of_the_lidar_need_no_calibration(self):
        for calibration in ('P0: 1 0 0 0 0 1 0 0 0 0 1 0', 'Tr: 2 0 0 0 0 2 0 0 0 0 2 0'):
            self.write('calib.txt', calibration)
            self.write('poses.txt', *(f'{0.1 * n} {n} 0 0 0 0 0 1' for n in range(4)))
            self.assertEqual(self.mapped()[1], '')

    def test_a_sensor_at_rest_gives_no_warning(self):
        self.make('--scans', '3', '--speed', '0')
        self.write('calib.txt', 'Tr: ' + text_of(TR))
        self.assertEqual(self.mapped()[1], '')


if __name__ == '__main__':
    unittest.main()
