#!/usr/bin/env python3
"""The Python module: it maps as the programs do, asks as C++ does, and answers wrong input in one sentence."""
import contextlib
import gc
import math
import os
import sqlite3
import subprocess
import tempfile
import threading
import unittest
import warnings

import numpy as np

import bki_mapping as bki

BIN = os.environ['BKI_MAPPING_BIN']
SOURCE = os.environ['BKI_MAPPING_SOURCE_DIR']
CAR, BUILDING, ROAD = 10, 50, 40  # raw labels of SemanticKITTI


def wall(x=4.0, count=400, seed=1):
    """Hits on a wall x metres ahead, and on the road."""
    random = np.random.default_rng(seed)
    points = random.uniform([x, -3, -1], [x + 0.01, 3, 1], (count, 3)).astype(np.float32)
    labels = np.where(points[:, 2] < -0.7, ROAD, BUILDING).astype(np.uint32)
    return points, labels


def mapper_with_wall(**settings):
    mapper = bki.SemanticMapper('semantic_kitti', **settings)
    mapper.integrate((0, 0, 1), *wall())
    return mapper


def centres(map_):
    """The centres of all voxels of a map's blocks, and of their neighbours, which it need not have."""
    corners = (map_.blocks[:, None, :] + np.indices((3, 3, 3)).reshape(3, -1).T[None] - 1).reshape(-1, 3)
    voxels = np.unique(corners, axis=0)[:, None, :] * 8 + np.indices((8, 8, 8)).reshape(3, -1).T[None]
    return (voxels.reshape(-1, 3) + 0.5) * map_.resolution


def evidence_of(map_):
    """All evidence: by block, the classes and their planes."""
    blocks = [map_.block(index) for index in map_.blocks]
    return {block.index: (block.classes.tolist(), block.planes.tobytes()) for block in blocks}


class WithFolder(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)


class Journals(WithFolder):
    """Scans that map files keep move to corrected poses."""
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.drive = os.path.join(folder.name, 'drive')
        subprocess.run([os.path.join(BIN, 'simulate_drive'), '--output', cls.drive, '--scans', '4', '--beams', '16', '--columns', '300'],
                       check=True, capture_output=True, timeout=60)
        cls.frames = list(bki.Sequence(cls.drive))
        cls.poses = np.array([frame.pose for frame in cls.frames])
        cls.poses[:, :3, 3] = np.round(cls.poses[:, :3, 3] * 1024) / 1024  # survive rounding to micrometres
        cls.drifted = cls.poses.copy()
        cls.drifted[:, 1, 3] += 0.25 * np.arange(4)
        cls.stamps = [frame.stamp for frame in cls.frames]

    def saved(self, name, poses, **settings):
        mapper = bki.SemanticMapper(config='robot', drive='drive/000000-000003', journal=0.01, **settings)
        for pose, frame in zip(poses, self.frames):
            mapper.integrate(pose, frame.points, frame.labels, stamp=frame.stamp)
        mapper.save(self.path(name))
        return self.path(name)

    def journal_of(self, path):
        with contextlib.closing(sqlite3.connect(path)) as database:
            return database.execute('SELECT number, drive, stamp, sensor, cleared, pose, odometry, content FROM scan '
                                    'JOIN scan_content USING (number) ORDER BY number').fetchall()

    def test_a_corrected_map_is_that_of_the_corrected_poses(self):
        wanted_file, wrong_file = self.saved('wanted.bkm', self.poses), self.saved('wrong.bkm', self.drifted)
        wanted, wrong = evidence_of(bki.load(wanted_file)), evidence_of(bki.load(wrong_file))
        self.assertNotEqual(wanted, wrong)
        corrected = self.path('corrected.bkm')
        said = bki.correct(wrong_file, self.poses, output=corrected)
        self.assertEqual((said['drive'], said['scans'], said['moved']), ('drive/000000-000003', 4, 3))
        self.assertAlmostEqual(said['largest_move'], 0.75, places=6)
        self.assertGreater(said['tiles'], 0)
        self.assertEqual(evidence_of(bki.load(corrected)), wanted)
        self.assertEqual(evidence_of(bki.load(wrong_file)), wrong)
        # In place, by stamps, of which two suffice because the drift is even.
        bki.correct(wrong_file, self.poses[[0, 3]], stamps=np.array(self.stamps)[[0, 3]])
        self.assertEqual(evidence_of(bki.load(wrong_file)), wanted)
        self.assertEqual(bki.correct(wrong_file, self.drifted, tolerance=0.6)['moved'], 1)
        # By a file.
        with open(self.path('poses.txt'), 'w') as file:
            file.writelines(' '.join(map(repr, map(float, pose[:3].ravel()))) + '\n' for pose in self.poses)
        bki.correct(wrong_file, self.path('poses.txt'), poses_in='lidar', drive='drive/000000-000003')
        self.assertEqual(evidence_of(bki.load(wrong_file)), wanted)
        forgotten = bki.forget_journal(wrong_file, output=corrected)
        self.assertEqual(forgotten, {'scans': 4, 'bytes': sum(len(row[-1]) for row in self.journal_of(wrong_file))})
        self.assertEqual(evidence_of(bki.load(corrected)), wanted)
        self.assertEqual(bki.forget_journal(wrong_file)['scans'], 4)
        self.assertEqual(self.journal_of(wrong_file), [])

    def test_the_journal_is_that_of_map_sequence(self):
        program = self.path('program.bkm')
        subprocess.run([os.path.join(BIN, 'map_sequence'), '--sequence', self.drive, '--config', 'robot', '--journal', '0.01', '--output',
                        program], check=True, capture_output=True, timeout=60)
        ours = self.saved('ours.bkm', [frame.pose for frame in self.frames])
        self.assertEqual(evidence_of(bki.load(ours)), evidence_of(bki.load(program)))
        self.assertEqual(self.journal_of(ours), self.journal_of(program))
        # Points in the map frame are rounded in that of the sensor, too.
        mapper = bki.SemanticMapper(config='robot', drive='drive/000000-000003', journal=0.01)
        for frame in self.frames:
            points = frame.points.astype(float) @ frame.pose[:3, :3].T + frame.pose[:3, 3]
            mapper.integrate(frame.pose, points, frame.labels, stamp=frame.stamp, points_in='map')
        mapper.save(self.path('in_map.bkm'))
        self.assertEqual([row[:7] for row in self.journal_of(self.path('in_map.bkm'))], [row[:7] for row in self.journal_of(ours)])

    def test_what_else_happens_to_the_map(self):
        mapper = bki.SemanticMapper(config='robot', journal=0.01)
        first, second = self.frames[:2]
        mapper.integrate(first.pose, first.points, first.labels, stamp=first.stamp)
        mapper.clear_box((-np.inf,) * 3, (np.inf,) * 3)
        mapper.reconfigure(**{'rules/stands_after': 3})
        mapper.integrate(second.pose, second.points, second.labels, stamp=second.stamp)
        mapper.save(self.path('cleared.bkm'))
        self.assertEqual([row[4] for row in self.journal_of(self.path('cleared.bkm'))], [0, 1])
        before = evidence_of(mapper.map)
        bki.correct(self.path('cleared.bkm'), self.drifted[[1]], stamps=[first.stamp])
        self.assertNotEqual(evidence_of(bki.load(self.path('cleared.bkm'))), before)
        bki.correct(self.path('cleared.bkm'), np.array([first.pose, second.pose]))
        self.assertEqual(evidence_of(bki.load(self.path('cleared.bkm'))), before)
        mapper.save(self.path('again.bkm'))
        self.assertEqual(self.journal_of(self.path('again.bkm')), self.journal_of(self.path('cleared.bkm')))
        mapper.reset()
        mapper.save(self.path('cleared.bkm'))
        self.assertEqual(self.journal_of(self.path('cleared.bkm')), [])
        with self.assertRaisesRegex(ValueError, '^a mapper with a journal keeps its scans; '):
            mapper.withdraw(first.pose, first.points, first.labels, stamp=first.stamp)

    def test_errors(self):
        file = self.saved('map.bkm', self.poses)
        plain = self.path('plain.bkm')
        mapper_with_wall().save(plain)
        for error, words, call in (
                (ValueError, 'poses has 3 poses, but drive .* has 4 scans', lambda: bki.correct(file, self.poses[:3])),
                (ValueError, 'there are 4 poses, but 1 stamps', lambda: bki.correct(file, self.poses, stamps=[1])),
                (ValueError, 'there are 1 poses, but 2 stamps', lambda: bki.correct(file, self.poses[:1], stamps=[1, 2])),
                (ValueError, 'no pose of poses has a stamp among', lambda: bki.correct(file, self.poses[:1], stamps=[1])),
                (ValueError, r'poses\[0\] must be a rotation', lambda: bki.correct(file, [np.diag([1, 2, 1, 1])] * 4)),
                (ValueError, r'poses must be .*\(N, 4, 4\)', lambda: bki.correct(file, self.poses[0])),
                (ValueError, 'a file has its own', lambda: bki.correct(file, 'poses.txt', stamps=[1])),
                (ValueError, 'an array has poses of the sensor', lambda: bki.correct(file, self.poses, poses_in='lidar')),
                (ValueError, "poses_in is 'radar'", lambda: bki.correct(file, os.path.join(self.drive, 'poses.txt'), poses_in='radar')),
                (ValueError, "has no scans of drive 'other'", lambda: bki.correct(file, self.poses, drive='other')),
                (ValueError, 'drive is empty', lambda: bki.correct(file, self.poses, drive='')),
                (ValueError, 'tolerance must be 0 or more', lambda: bki.correct(file, self.poses, tolerance=-1)),
                (ValueError, 'must end in .bkm', lambda: bki.correct(file, self.poses, output=self.path('map.ply'))),
                (ValueError, 'must end in .bkm', lambda: bki.forget_journal(file, output=self.path('map.ply'))),
                (RuntimeError, 'missing.txt cannot be read', lambda: bki.correct(file, self.path('missing.txt'))),
                (bki.MapFileError, 'has no scans in its journal', lambda: bki.correct(plain, self.poses)),
                (bki.MapFileError, 'missing.bkm', lambda: bki.forget_journal(self.path('missing.bkm'))),
                (ValueError, 'journal is 2, but must be from 0.0001 to 1', lambda: bki.SemanticMapper(journal=2)),
                (TypeError, 'journal must be a number', lambda: bki.SemanticMapper(journal='yes')),
                (ValueError, 'depend on the order of scans', lambda: bki.SemanticMapper(journal=0.01, free_space={'extent': 'mapped'}))):
            with self.subTest(words=words), self.assertRaisesRegex(error, words) as caught:
                call()
            self.assertNotIn('\n', str(caught.exception))
        self.assertEqual(len(self.journal_of(file)), 4)


class Mapping(WithFolder):
    def test_maps_a_sequence_as_map_sequence_does(self):
        def run(program, *arguments):
            subprocess.run([os.path.join(BIN, program), *arguments], check=True, capture_output=True, timeout=60)
        run('simulate_drive', '--scans', '3', '--beams', '16', '--columns', '400', '--output', self.path('drive'))
        run('map_sequence', '--sequence', self.path('drive'), '--config', f'{SOURCE}/config/presets/robot.yaml',
            '--drive', 'a', '--output', self.path('program.bkm'))
        sequence = bki.Sequence(self.path('drive'))
        self.assertEqual([len(sequence), sequence.name(-1)], [3, '000002'])
        for config in ('robot', f'{SOURCE}/config/presets/robot.yaml'):
            mapper = bki.SemanticMapper('semantic_kitti', config=config, drive='a')
            for frame in sequence:
                stats = mapper.integrate(frame.pose, frame.points, frame.labels, stamp=frame.stamp)
                self.assertEqual(stats.points, len(frame.points))
            expected = bki.load(self.path('program.bkm'))
            self.assertGreater(len(expected.blocks), 100)
            self.assertEqual(evidence_of(mapper.map), evidence_of(expected))
            points = centres(expected)[::7]
            np.testing.assert_array_equal(mapper.map.states(points), expected.states(points))
            self.assertEqual([(d.id, d.scans, d.last_stamp) for d in mapper.map.drives],
                             [(d.id, d.scans, d.last_stamp) for d in expected.drives])

    def test_layout_and_dtype_do_not_change_the_map(self):
        points, labels = wall()
        expected = evidence_of(mapper_with_wall().map)
        strided = np.zeros((len(points), 4), np.float32)
        strided[:, :3] = points
        swapped = points.astype('>f4')
        unaligned = np.frombuffer(b'?' + points.tobytes(), np.uint8)[1:].view(np.float32).reshape(-1, 3)
        for same in (points.astype(np.float64), strided[:, :3], np.asfortranarray(points), swapped, unaligned, points.tolist(),
                     points[::-1][::-1]):
            for same_labels in (labels, labels.astype(np.int64), labels.astype(np.uint8), labels.tolist(), labels.astype('>i2'),
                                np.repeat(labels, 2)[::2]):
                mapper = bki.SemanticMapper('semantic_kitti')
                self.assertEqual(mapper.integrate([0, 0, 1], same, same_labels).used, len(points))
                self.assertEqual(evidence_of(mapper.map), expected)
        self.assertGreater(len(expected), 0)

    def test_poses_and_frames(self):
        points, labels = wall()
        turned = np.eye(4)
        turned[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
        turned[:3, 3] = 8, -4, 1
        mappers = [bki.SemanticMapper('semantic_kitti') for _ in range(4)]
        in_map_axes = points @ turned[:3, :3].T.astype(np.float32)
        mappers[0].integrate(turned, points, labels)
        mappers[1].integrate(turned[:3, 3], in_map_axes, labels)
        mappers[2].integrate(turned[:3, 3], in_map_axes.astype(np.float64) + turned[:3, 3], labels, points_in='map')
        mappers[3].integrate(turned, in_map_axes.astype(np.float64) + turned[:3, 3], labels, points_in='map')
        first, *others = [evidence_of(mapper.map) for mapper in mappers]
        for other in others:
            self.assertEqual(first, other)
        self.assertEqual(mappers[0].map.labels([[8, 0.01, 1.0]])[0], bki.ClassTable('semantic_kitti')['building'].id)

    def test_settings(self):
        nested = bki.SemanticMapper(resolution=0.2, free_space={'mode': 'none'}, kernel={'length': 0.5}, threads=1)
        flat = bki.SemanticMapper('semantic_kitti', 0.2, **{'free_space/mode': 'none', 'kernel/length': np.float32(0.5), 'threads': np.int64(1)})
        self.assertEqual(nested.parameters, flat.parameters)
        self.assertEqual((flat.parameters['resolution'], flat.parameters['kernel/length'], flat.parameters['threads']), (0.2, 0.5, 1))
        preset = bki.SemanticMapper(config='robot', clear_beyond_max_range=False)
        self.assertNotEqual(preset.parameters['rules/enabled'], nested.parameters['rules/enabled'])
        self.assertIs(preset.parameters['clear_beyond_max_range'], False)
        preset.reconfigure(memory_limit=100)
        self.assertEqual(preset.parameters['memory_limit'], 100.0)
        with self.assertWarnsRegex(UserWarning, 'kernel/length 0.1 m is below half a voxel'):
            bki.SemanticMapper(kernel={'length': 0.1})
        own = bki.SemanticMapper(bki.ClassTable(f'{SOURCE}/config/classes/toy.yaml'), drive='mine', frame='odom')
        self.assertEqual((own.classes.name, own.drive, own.frame, own.map.frame), ('toy', 'mine', 'odom', 'odom'))

    def test_withdraw_clear_and_reset(self):
        mapper = mapper_with_wall()
        before = evidence_of(mapper.map)
        other = wall(5.0, seed=2)
        self.assertGreater(mapper.integrate((0, 0, 1), *other).blocks, 0)
        self.assertNotEqual(evidence_of(mapper.map), before)
        self.assertEqual(mapper.withdraw((0, 0, 1), *other).negative, 0)
        self.assertEqual(evidence_of(mapper.map), before)
        self.assertEqual(mapper.map.drives[0].scans, 1)
        changed = mapper.clear_box((-math.inf, -math.inf, -math.inf), (math.inf, math.inf, 0.9))
        self.assertGreater(len(changed), 0)
        self.assertGreater(mapper.map.voxels()['z'].min(), 0.9)
        first = mapper.drive
        mapper.reset()
        self.assertEqual(len(mapper.map.blocks), 0)
        self.assertNotEqual(mapper.drive, first)

    def test_bad_points_are_counted(self):
        points, labels = wall(count=10)
        points[3, 1] = math.nan
        points[4] = math.inf
        points[5] = 0
        labels[6] = 12345
        stats = bki.SemanticMapper('semantic_kitti').integrate((0, 0, 0), points, labels)
        self.assertEqual((stats.points, stats.used, stats.not_finite, stats.at_sensor, stats.unknown_label), (10, 6, 2, 1, 1))
        self.assertEqual(bki.SemanticMapper().integrate((0, 0, 0), np.zeros((0, 3)), []).points, 0)

    def test_labels_may_have_instances_and_unknown_ones_are_warned_of_once(self):
        points, labels = wall()
        content = []
        for same in (labels, labels | np.uint32(300 << 16), (labels | np.uint32(0x8001 << 16)).view(np.int32)):
            mapper = bki.SemanticMapper('semantic_kitti')
            with warnings.catch_warnings():
                warnings.simplefilter('error')
                self.assertEqual(mapper.integrate((0, 0, 0), points, same).used, len(points))
            content.append(mapper.map.voxels('occupied'))
        for other in content[1:]:
            np.testing.assert_array_equal(content[0], other)
        self.assertEqual(bki.ClassTable('semantic_kitti').label_mask, 0xffff)
        self.assertEqual(bki.ClassTable('toy').label_mask, 0xffffffff)
        train_ids = (np.arange(len(points)) % 20).astype(np.uint8)
        mapper = bki.SemanticMapper('semantic_kitti')
        with self.assertWarnsRegex(UserWarning, 'does not list, .* all labels seen are ids of the table; set label_values to id'):
            self.assertLess(mapper.integrate((0, 0, 0), points, train_ids).used, 0.5 * len(points))
        with warnings.catch_warnings():
            warnings.simplefilter('error')
            mapper.integrate((0, 0, 0), points, train_ids)
        with self.assertWarnsRegex(UserWarning, r'-1 \(\d+ points\)'):
            none = bki.SemanticMapper('semantic_kitti').integrate((0, 0, 0), points, np.where(points[:, 2] < -0.7, 40, -1).astype(np.int8))
        self.assertEqual(none.used + none.unknown_label, len(points))
        self.assertGreater(none.unknown_label, 0)

    def test_points_and_labels_are_not_copied(self):
        def memory(key):
            with open('/proc/self/status') as file:
                return 1024 * int(next(line.split()[1] for line in file if line.startswith(key)))
        points = np.full((8_000_000, 3), math.nan, np.float32)
        labels = np.zeros(len(points), np.uint32)
        mapper = bki.SemanticMapper('semantic_kitti')
        for given in ((points, labels), (points.astype(np.float64), labels)):
            with open('/proc/self/clear_refs', 'w') as file:
                file.write('5')  # resets VmHWM
            before = memory('VmRSS')
            self.assertEqual(mapper.integrate((0, 0, 1), *given).not_finite, len(points))
            taken = memory('VmHWM') - before
            self.assertEqual(taken > points.nbytes // 2, given[0] is not points, taken)  # double precision is converted

    def test_threads_may_share_a_mapper(self):
        mapper = bki.SemanticMapper('semantic_kitti', threads=1)
        scans = [wall(4.0 + 0.1 * i, seed=i) for i in range(8)]
        stop = threading.Event()

        def read():
            while not stop.is_set():
                self.assertLessEqual(set(mapper.map.states(scans[0][0])), {0, 1, 2})
        reader = threading.Thread(target=read)
        writers = [threading.Thread(target=mapper.integrate, args=((0, 0, 1), *scan)) for scan in scans]
        for thread in (reader, *writers):
            thread.start()
        for thread in writers:
            thread.join()
        stop.set()
        reader.join()
        alone = bki.SemanticMapper('semantic_kitti')
        for scan in scans:
            alone.integrate((0, 0, 1), *scan)
        self.assertEqual(evidence_of(mapper.map), evidence_of(alone.map))
        self.assertEqual(mapper.map.drives[0].scans, 8)


class Queries(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.map = mapper_with_wall().map
        cls.points = centres(cls.map)

    def posterior_of(self, point):
        """The posterior at a point, from the planes, by the formulas of docs/method.md."""
        index = np.floor(point / self.map.resolution).astype(int)
        block = self.map.block(index // 8)
        alpha = dict.fromkeys([c.id for c in self.map.classes] + [bki.FREE_CLASS], self.map.prior)
        if block is not None:
            x, y, z = index % 8
            for class_id in block.classes:
                alpha[int(class_id)] += max(int(block.plane(class_id)[z, y, x]), 0) * bki.EVIDENCE_UNIT
        return np.array(list(alpha.values())), list(alpha)

    def test_queries_follow_from_the_planes(self):
        states, labels = self.map.states(self.points), self.map.labels(self.points)
        probabilities, variances = self.map.probabilities(self.points), self.map.variances(self.points)
        posterior, whole = self.map.posterior(self.points), self.map.query(self.points, 'state,label,probability,variance,entropy')
        self.assertEqual(set(states), {bki.UNKNOWN, bki.FREE, bki.OCCUPIED})
        for i in range(0, len(self.points), 5):
            alpha, ids = self.posterior_of(self.points[i])
            p = alpha / alpha.sum()
            best = int(np.argmax(alpha[:-1]))
            has_evidence = alpha.sum() > self.map.prior * len(alpha) * (1 + 1e-9)
            expected = bki.UNKNOWN if not has_evidence else bki.OCCUPIED if alpha[best] >= alpha[-1] else bki.FREE
            self.assertEqual(states[i], expected, self.points[i])
            column = best if expected == bki.OCCUPIED else -1
            self.assertEqual(labels[i], ids[column])
            np.testing.assert_allclose(posterior[i], p, rtol=1e-5)
            np.testing.assert_allclose(probabilities[i], p[column], rtol=1e-5)
            np.testing.assert_allclose(variances[i], p[column] * (1 - p[column]) / (alpha.sum() + 1), rtol=1e-4)
            np.testing.assert_allclose(whole['entropy'][i], -(p * np.log(p)).sum(), rtol=1e-3, atol=1e-6)
        for field, values in (('state', states), ('label', labels), ('probability', probabilities), ('variance', variances)):
            np.testing.assert_array_equal(whole[field], values)

    def test_voxels_are_exact_far_from_the_origin(self):
        mapper, place = bki.SemanticMapper(classes='semantic_kitti', resolution=0.1), np.array([500000.0, 4000000.0, 30.0])
        points = np.random.default_rng(5).uniform(-5, 5, (500, 3))
        mapper.integrate(place, points, np.full(500, 50, np.uint32))
        voxels = mapper.map.voxels(['occupied', 'free'])
        places = np.stack([voxels[axis] for axis in 'xyz'], axis=1)
        self.assertGreater(len(voxels), 1000)
        self.assertEqual(len(np.unique(places, axis=0)), len(voxels))
        np.testing.assert_allclose(places / 0.1 % 1.0, 0.5, atol=1e-3)
        np.testing.assert_array_equal(mapper.map.states(places), voxels['state'])

    def test_voxels_agree_with_queries(self):
        voxels = self.map.voxels(['occupied', 'free'])
        points = np.stack([voxels['x'], voxels['y'], voxels['z']], axis=1)
        states = self.map.states(points)
        np.testing.assert_array_equal(voxels['state'], states)
        self.assertEqual(len(voxels), np.count_nonzero(np.isin(self.map.states(self.points), (bki.FREE, bki.OCCUPIED))))
        self.assertEqual(len(self.map.voxels()), np.count_nonzero(states == bki.OCCUPIED))
        building = self.map.classes['building']
        of_building = voxels[voxels['label'] == building.id]
        self.assertGreater(len(of_building), 10)
        self.assertEqual((of_building['red'][0], of_building['green'][0], of_building['blue'][0]), building.color)
        np.testing.assert_array_equal(self.map.classes.colors[building.id], building.color)

    def test_dtypes_and_far_points(self):
        single = self.points.astype(np.float32)
        np.testing.assert_array_equal(self.map.states(single), self.map.states(self.points))
        np.testing.assert_array_equal(self.map.states(self.points[::3]), self.map.states(self.points)[::3])
        self.assertEqual(self.map.states([[1e12, 0, 0], [5, 5, 1e8]]).tolist(), [bki.UNKNOWN, bki.UNKNOWN])
        self.assertEqual(self.map.states(np.zeros((0, 3))).shape, (0,))
        self.assertEqual(self.map.states([[0, 0, 0]]).dtype, np.uint8)

    def test_planes_keep_their_map(self):
        def plane():
            map_ = mapper_with_wall().map
            return map_.block(map_.blocks[0]).planes
        planes = plane()
        gc.collect()
        block = self.map.block(self.map.blocks[0])
        np.testing.assert_array_equal(planes, block.planes)
        self.assertEqual(planes.base.index, block.index)
        self.assertFalse(planes.flags.owndata or planes.flags.writeable)
        self.assertRaises(ValueError, planes.setflags, write=True)
        np.testing.assert_allclose(block.origin, np.array(block.index) * 8 * self.map.resolution)
        self.assertIsNone(self.map.block((1000, 0, 0)))
        for index in self.map.blocks:
            block = self.map.block(index)
            for n, class_id in enumerate(block.classes):
                keys = [class_id, int(class_id)]
                if class_id != bki.FREE_CLASS:
                    keys += [self.map.classes[class_id], self.map.classes[class_id].name]
                for key in keys:
                    np.testing.assert_array_equal(block.plane(key), block.planes[n])

    def test_a_snapshot_stays(self):
        mapper = mapper_with_wall()
        snapshot = mapper.snapshot()
        planes = snapshot.block(snapshot.blocks[0]).planes
        before, copy = evidence_of(snapshot), planes.copy()
        mapper.integrate((0, 0, 1), *wall(seed=3))
        self.assertNotEqual(evidence_of(mapper.map), before)
        mapper.reset()
        self.assertEqual(evidence_of(snapshot), before)
        np.testing.assert_array_equal(planes, copy)


class Files(WithFolder):
    def test_scans_that_drives_share_count_once(self):
        whole, part = (bki.SemanticMapper(drive=f'04/000000-00000{last}') for last in (9, 4))
        whole.integrate((0, 0, 1), *wall())
        part.integrate((0, 0, 1), *wall())
        whole.save(self.path('whole.bkm'))
        part.save(self.path('part.bkm'))
        files, both = [self.path('whole.bkm'), self.path('part.bkm')], self.path('both.bkm')
        with self.assertRaisesRegex(bki.MapFileError, 'share scans 000000 to 000004 of 04, which would count twice'):
            bki.merge(files, both)
        for add in (lambda: whole.load(files[1]), lambda: whole.add(part.map)):
            with self.assertRaisesRegex(ValueError, 'share scans 000000 to 000004 of 04'):
                add()
        blocks = len(whole.map.blocks)
        whole.load(files[1], allow_overlap=True)
        self.assertGreaterEqual(len(whole.map.blocks), blocks)
        with self.assertRaisesRegex(ValueError, 'already holds drive'):
            whole.load(files[1], allow_overlap=True)
        other = bki.SemanticMapper()
        other.load(files[0])
        other.add(bki.load(files[1]), allow_overlap=True)
        self.assertEqual(len(other.map.drives), 2)
        self.assertEqual(len(bki.merge(files, both, allow_overlap=True)['drives']), 2)

    def test_sequences_without_labels_and_with_poses_of_the_lidar(self):
        subprocess.run([os.path.join(BIN, 'simulate_drive'), '--scans', '2', '--beams', '16', '--columns', '100', '--output',
                        self.path('drive')], check=True, capture_output=True, timeout=60)
        pose = bki.Sequence(self.path('drive'))[1].pose
        for name in ('labels', 'calib.txt'):
            os.rename(os.path.join(self.path('drive'), name), self.path(name))
        with self.assertRaisesRegex(RuntimeError, 'labels is not a folder'):
            bki.Sequence(self.path('drive'))
        plain = bki.Sequence(self.path('drive'), labels=None, poses_in='lidar')
        self.assertEqual(set(plain[1].labels), {0})
        np.testing.assert_array_equal(plain[1].pose, pose)
        with open(self.path('poses.tum'), 'w') as file:
            file.write('0 1 2 3 0 0 0 1\n0.1 4 5 6 0 0 0 1\n')
        self.assertEqual(list(bki.Sequence(self.path('drive'), None, poses=self.path('poses.tum'))[1].pose[:3, 3]), [4, 5, 6])
        with self.assertRaisesRegex(ValueError, "poses_in is 'radar', but must be 'camera' or 'lidar'"):
            bki.Sequence(self.path('drive'), None, poses_in='radar')

    def test_poses_of_the_other_sensor_are_noticed(self):
        drive = self.path('drive')
        subprocess.run([os.path.join(BIN, 'simulate_drive'), '--scans', '4', '--beams', '32', '--columns', '400', '--output', drive],
                       check=True, capture_output=True, timeout=60)
        with open(os.path.join(drive, 'calib.txt'), 'w') as file:
            file.write('Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n')
        with self.assertWarnsRegex(UserWarning, '^the poses seem to be those of the lidar: .*poses_in in Python'):
            bki.Sequence(drive)
        with open(os.path.join(drive, 'poses.txt')) as file:
            poses = file.read()
        with open(os.path.join(drive, 'poses.txt'), 'w') as file:
            file.write(''.join(poses.splitlines(True)[:3]))  # the last scan has no pose
        with self.assertWarnsRegex(UserWarning, 'seem to be those of the lidar'):
            bki.Sequence(drive)
        with warnings.catch_warnings():
            warnings.simplefilter('error')
            for sensor in ('lidar', 'camera'):
                bki.Sequence(drive, poses_in=sensor)

    def test_save_load_add_and_merge(self):
        a, b = bki.SemanticMapper(drive='a'), bki.SemanticMapper(drive='b')
        a.integrate((0, 0, 1), *wall())
        b.integrate((0, 0, 1), *wall(seed=2))
        both = bki.SemanticMapper(drive='both')
        both.integrate((0, 0, 1), *wall())
        both.integrate((0, 0, 1), *wall(seed=2))
        expected = evidence_of(both.map)
        a.save(self.path('a.bkm'))
        b.map.save(self.path('b.bkm').encode())
        report = bki.merge([self.path('a.bkm'), self.path('b.bkm')], self.path('ab.bkm'), keep_drives=True)
        self.assertEqual([drive.id for drive in report['drives']], ['a', 'b'])
        self.assertEqual(evidence_of(bki.load(self.path('ab.bkm'))), expected)
        bki.merge([self.path('ab.bkm')], self.path('b_alone.bkm'), without=['a'])
        self.assertEqual(evidence_of(bki.load(self.path('b_alone.bkm'))), evidence_of(b.map))
        bki.merge([(self.path('a.bkm'), (2.4, 0, 0), 90)], self.path('moved.bkm'))
        self.assertEqual(len(bki.load(self.path('moved.bkm')).voxels()), len(a.map.voxels()))
        a.load(self.path('b.bkm'))
        self.assertEqual(evidence_of(a.map), expected)
        self.assertEqual(sorted(drive.id for drive in a.map.drives), ['a', 'b'])
        for again in (lambda: a.add(b.map), lambda: b.load(self.path('b.bkm')), lambda: a.load(self.path('a.bkm'))):
            with self.assertRaisesRegex(ValueError, "the map already holds drive '[ab]'"):
                again()
        self.assertEqual(evidence_of(a.map), expected)

    def test_exports_are_those_of_export_map(self):
        mapper_with_wall(drive='a', config='robot').save(self.path('a.bkm'))
        map_ = bki.load(self.path('a.bkm'))
        pages = [('html', {}, [])] if os.path.exists('/usr/share/javascript/three/three.min.js') else []
        for ending, settings, options in (
                *pages, ('ply', {'states': 'occupied,free'}, ['--include', 'occupied,free']), ('pcd', {}, []), ('ot', {}, []), ('bt', {}, []),
                ('yaml', {'min_z': 0.5, 'height': 'ground'}, ['--min-z', '0.5', '--height', 'ground'])):
            os.mkdir(self.path(ending))
            own, program = self.path(f'a.{ending}'), os.path.join(self.path(ending), f'a.{ending}')
            map_.export(own, **settings)
            subprocess.run([os.path.join(BIN, 'export_map'), self.path('a.bkm'), '--output', program, *options], check=True,
                           capture_output=True, timeout=60)
            for name in {own, own.replace('yaml', 'pgm')}:
                with open(name, 'rb') as one, open(os.path.join(self.path(ending), os.path.basename(name)), 'rb') as other:
                    self.assertEqual(one.read(), other.read(), name)

    def test_files_that_are_none(self):
        mapper = mapper_with_wall()
        with open(self.path('text.bkm'), 'w') as file:
            file.write('no map')
        for call in (lambda: bki.load(self.path('none.bkm')), lambda: bki.load(self.path('text.bkm')),
                     lambda: mapper.load(self.path('text.bkm')), lambda: mapper.save('/no/such/folder/a.bkm')):
            with self.assertRaises(bki.MapFileError) as caught:
                call()
            self.assertIsInstance(caught.exception, RuntimeError)
            self.assertNotIn('\n', str(caught.exception))
        mapper.save(self.path('a.bkm'))
        other = bki.SemanticMapper(resolution=0.2)
        with self.assertRaisesRegex(bki.MapFileError, 'resolution'):
            other.load(self.path('a.bkm'))
        with self.assertRaisesRegex(ValueError, 'resolution'):
            other.add(mapper.map)
        with self.assertRaisesRegex(ValueError, "in frame 'map', and the mapper's in 'odom'"):
            bki.SemanticMapper(frame='odom').add(mapper.map)


class WrongInput(WithFolder):
    """One sentence each, and the map stays."""

    def refused(self, error, words, call):
        with self.assertRaises(error) as caught:
            call()
        self.assertNotIn('\n', str(caught.exception))
        self.assertRegex(str(caught.exception), words)

    def test_scans(self):
        mapper = mapper_with_wall()
        before = evidence_of(mapper.map)
        points, labels = wall(count=5)
        many = 'points must be an array of numbers of shape'
        bad_pose = np.eye(4)
        bad_pose[0, 0] = 2
        nan_pose = np.full((4, 4), math.nan)
        for call in (mapper.integrate, mapper.withdraw):
            for error, words, arguments in (
                    (ValueError, '5 points but 4 labels', ((0, 0, 0), points, labels[:4])),
                    (ValueError, many, ((0, 0, 0), points[:, :2], labels)),
                    (ValueError, many, ((0, 0, 0), points.ravel(), labels)),
                    (ValueError, many, ((0, 0, 0), points[0], labels)),
                    (TypeError, many, ((0, 0, 0), points.astype(complex), labels)),
                    (TypeError, many, ((0, 0, 0), points.astype(str), labels)),
                    (TypeError, many, ((0, 0, 0), points > 0, labels)),
                    (TypeError, many, ((0, 0, 0), [[1, 2, object()]], [0])),
                    (TypeError, 'points must be', ((0, 0, 0), [[1, 2], [3]], [0, 0])),
                    ((TypeError, ValueError), 'points must be', ((0, 0, 0), None, labels)),
                    (TypeError, 'labels must be an array of integers', ((0, 0, 0), points, labels.astype(float))),
                    (TypeError, 'labels must be an array of integers', ((0, 0, 0), points, ['car'] * 5)),
                    (ValueError, r'labels must be an array of integers of shape \(N,\)', ((0, 0, 0), points, labels[:, None])),
                    (ValueError, 'labels must be from -2147483648 to 4294967295, but -2147483649 is',
                     ((0, 0, 0), points, [0, 1, -2**31 - 1, 3, 4])),
                    (ValueError, 'labels must be from -2147483648 to 4294967295, but 4294967296 is',
                     ((0, 0, 0), points, [0, 1, 2**32, 3, 4])),
                    (ValueError, 'but 4294967296 is', ((0, 0, 0), points, [0, 1, 2**32, 3, 4])),
                    (ValueError, 'origin has a coordinate that is NaN', ((0, 0, math.nan), points, labels)),
                    (ValueError, 'not finite or too far', ((0, 0, math.inf), points, labels)),
                    (ValueError, 'not finite or too far', ((0, 0, 1e15), points, labels)),
                    (ValueError, 'origin must be three numbers', ((0, 0), points, labels)),
                    (ValueError, 'origin must be three numbers', (np.eye(3), points, labels)),
                    ((TypeError, ValueError), 'origin must be three numbers', ('here', points, labels)),
                    (ValueError, 'the pose must be a rotation and a translation', (bad_pose, points, labels)),
                    (ValueError, 'the pose must be a rotation and a translation', (nan_pose, points, labels)),
                    (ValueError, "points_in is 'car', but must be sensor or map", ((0, 0, 0), points, labels, 0, 'car')),
                    (TypeError, 'points_in must be a str, not int', ((0, 0, 0), points, labels, 0, 1)),
                    (ValueError, 'stamp must be an integer of nanoseconds, 0 or more', ((0, 0, 0), points, labels, -1)),
                    (ValueError, r'in seconds, give int\(t \* 1e9\)', ((0, 0, 0), points, labels, 1.5)),
                    (ValueError, 'stamp must be an integer of nanoseconds, 0 or more', ((0, 0, 0), points, labels, 2**80)),
                    (TypeError, 'labels_are_ids must be True or False, not str', ((0, 0, 0), points, labels, 0, 'map', 'no'))):
                with self.subTest(words=words, arguments=arguments):
                    self.refused(error, words, lambda: call(*arguments))
        self.assertEqual(evidence_of(mapper.map), before)
        self.refused(RuntimeError, 'cannot be withdrawn with occlusion marks',
                     lambda: bki.SemanticMapper(occlusion='all').withdraw((0, 0, 0), points, labels))
        limited = bki.SemanticMapper(scan_limit={'blocks': 1})
        self.refused(bki.ScanRefused, 'scan_limit/blocks', lambda: limited.integrate((0, 0, 0), *wall()))
        self.assertTrue(issubclass(bki.ScanRefused, RuntimeError))

    def test_masks(self):
        """A masked value must not count like the others: np.asarray would drop the mask."""
        points, labels = wall()
        map_ = mapper_with_wall().map
        nowhere = np.zeros(len(labels), bool)
        some = nowhere.copy()
        some[3] = True
        masked_points = np.ma.array(points, mask=np.repeat(some[:, None], 3, axis=1))
        masked_labels = np.ma.array(labels, mask=some)
        words = 'has masked values, which would count like the others; leave their rows out of all arrays'
        mapper = bki.SemanticMapper()
        for call in (mapper.integrate, mapper.withdraw):
            for arguments in (((0, 0, 0), masked_points, labels), ((0, 0, 0), points, masked_labels),
                              (np.ma.array([0.0, 0.0, 0.0], mask=[0, 0, 1]), points, labels),
                              (np.ma.array(np.eye(4), mask=np.eye(4)), points, labels)):
                self.refused(ValueError, words, lambda: call(*arguments))
        self.assertEqual(len(mapper.map.blocks), 0)
        for query in (map_.states, map_.labels, map_.query, map_.posterior):
            self.refused(ValueError, f'points {words}', lambda: query(masked_points))
        far = np.ma.array([[1.0, 0, 0]], mask=[[0, 0, 1]])
        self.refused(ValueError, f'directions {words}', lambda: map_.cast_rays([0, 0, 0], far, 5.0))
        self.refused(ValueError, f'origins {words}', lambda: map_.cast_rays(far, [[1.0, 0, 0]], 5.0))
        mapper.integrate((0, 0, 1), np.ma.array(points, mask=False), np.ma.array(labels, mask=nowhere))
        self.assertEqual(evidence_of(mapper.map), evidence_of(map_))

    def test_settings(self):
        for words, call in (
                ("class table 'semantic_kiti' is neither a file nor one of.*did you mean 'semantic_kitti'",
                 lambda: bki.SemanticMapper('semantic_kiti')),
                ("'resolutoin'.*did you mean 'resolution'", lambda: bki.SemanticMapper(resolutoin=0.2)),
                ("'free_space/mod'", lambda: bki.SemanticMapper(free_space={'mod': 'line'})),
                ("free_space/mode.*'liner'", lambda: bki.SemanticMapper(free_space={'mode': 'liner'})),
                ("resolution is '-1'", lambda: bki.SemanticMapper(resolution=-1)),
                ("resolution is 'nan'", lambda: bki.SemanticMapper(resolution=math.nan)),
                ("'free_space/mode' is given twice", lambda: bki.SemanticMapper(free_space={'mode': 'line'}, **{'free_space/mode': 'none'})),
                ("parameter 'prior' must be a number, a bool or a str, not list", lambda: bki.SemanticMapper(prior=[1])),
                ("parameter file 'robt' is neither a file nor one of.*did you mean 'robot'", lambda: bki.SemanticMapper(config='robt')),
                ('cannot change while mapping', lambda: bki.SemanticMapper().reconfigure(resolution=0.5)),
                ('low must not be above high', lambda: bki.SemanticMapper().clear_box((0, 0, 0), (1, -1, 1))),
                ('low has a coordinate that is NaN', lambda: bki.SemanticMapper().clear_box((0, math.nan, 0), (1, 1, 1))),
                ('drive is empty', lambda: bki.SemanticMapper(drive=''))):
            with self.subTest(words=words):
                self.refused(ValueError, words, call)
        self.refused(TypeError, 'classes must be a str or a path, not int', lambda: bki.SemanticMapper(5))

    def test_queries_and_files(self):
        map_ = mapper_with_wall().map
        for query in (map_.states, map_.labels, map_.probabilities, map_.variances, map_.posterior, map_.query):
            self.refused(ValueError, 'point 1 of 2 has a coordinate that is not finite', lambda: query([[0, 0, 0], [0, math.nan, 0]]))
            self.refused(ValueError, 'of shape', lambda: query([0, 0, 0]))
        self.refused(ValueError, "voxel state 'full' is unknown", lambda: map_.voxels('full'))
        self.refused(TypeError, 'states must be a str', lambda: map_.voxels(5))
        self.refused(ValueError, 'must be three integers', lambda: map_.block((0, 0)))
        self.refused(ValueError, 'must be three integers', lambda: map_.block((0.5, 0, 0)))
        self.refused(ValueError, 'must be three integers', lambda: map_.block((2**40, 0, 0)))
        block = map_.block(map_.blocks[0])
        self.refused(ValueError, 'has no class 77', lambda: block.plane(77))
        self.refused(ValueError, "has no class 'cars'", lambda: block.plane('cars'))
        self.refused(ValueError, r'has no plane of class \d+; see Block.classes', lambda: block.plane('bicycle'))
        self.refused(ValueError, 'class_ must be one class', lambda: block.plane(['car', 'road']))
        self.refused(TypeError, 'class_ must be a class', lambda: block.plane(1.5))
        self.refused(TypeError, 'min_z must be a number, not str', lambda: map_.export(self.path('a.yaml'), min_z='low'))
        self.refused(TypeError, 'height must be a str, not int', lambda: map_.export(self.path('a.yaml'), height=1))
        self.refused(KeyError, "has no class 'cars'", lambda: map_.classes['cars'])
        self.refused(ValueError, 'must end in .bkm', lambda: map_.save(self.path('a.ply')))
        self.refused(ValueError, 'must end in .ply, .pcd', lambda: map_.export(self.path('a.obj')))
        self.refused(ValueError, 'min_z must not be above max_z', lambda: map_.export(self.path('a.yaml'), min_z=2, max_z=1))
        self.refused(ValueError, 'must be map or ground', lambda: map_.export(self.path('a.yaml'), height='sea'))
        self.refused(RuntimeError, '/no/such', lambda: map_.export('/no/such/a.ply'))
        self.refused(TypeError, 'path must be a str or a path', lambda: map_.save(7))
        self.refused(TypeError, 'inputs must be a list', lambda: bki.merge(self.path('a.bkm'), self.path('b.bkm')))
        self.refused(ValueError, 'an input must be a path, or', lambda: bki.merge([('a.bkm', 1)], self.path('b.bkm')))
        self.refused(RuntimeError, '/no/such', lambda: bki.Sequence('/no/such'))
        with self.assertRaisesRegex(AttributeError, 'cars'):
            bki.cars


if __name__ == '__main__':
    unittest.main()
