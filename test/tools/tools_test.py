#!/usr/bin/env python3
"""The programs that need no ROS, called as a user calls them."""
import array
import contextlib
import csv
import io
import itertools
import json
import math
import os
import re
import shutil
import sqlite3
import stat
import struct
import subprocess
import unittest
import zlib

from programs import ProgramTest, call, read_bytes, read_json, tiles_of


def row_checksum(columns):
    """Of a row of a map file."""
    packed = b''
    for value in columns:
        if isinstance(value, int):
            packed += struct.pack('<q', value)
        elif isinstance(value, float):
            packed += struct.pack('<d', value)
        else:
            content = value.encode() if isinstance(value, str) else value
            packed += struct.pack('<q', len(content)) + content
    return zlib.crc32(packed)


def signed(number):
    """The difference that is stored as an unsigned number."""
    return -(number + 1) // 2 if number % 2 else number // 2


def touched_tiles(packed):
    """The column `tiles` of a scan, as z, y, x."""
    numbers, shift = [0], 0
    for byte in packed:
        numbers[-1] |= (byte & 127) << shift
        shift += 7
        if byte < 128:
            numbers.append(0)
            shift = 0
    differences = [signed(number) for number in numbers[:-1]]
    sums = [list(itertools.accumulate(differences[axis::3])) for axis in range(3)]
    return list(zip(*reversed(sums)))


def unpacked(content):
    """The hits of a packed scan in quanta, and their labels."""
    begin, flags = struct.unpack_from('<II', content)
    assert (begin, flags) == (0x32534b42, 0), 'only raw labels'
    hits, shares, directions, size = struct.unpack_from('<4I', content, 48)
    assert (shares, directions, size) == (0, 0, len(content) - 96)
    c, s, along_ray, by_rows, *widths, label_width, unused = struct.unpack_from('<2i6BH', content, 64)
    assert unused == 0
    stream = io.BytesIO(zlib.decompress(content[96:]))

    def numbers(planes):
        each = [stream.read(hits) for _ in range(planes)]
        return [sum(plane[n] << 8 * byte for byte, plane in enumerate(each)) for n in range(hits)]
    rows = [sum_ % 256 for sum_ in itertools.accumulate(numbers(1 if by_rows else 0))]
    order = sorted(range(hits), key=lambda n: rows[n])
    first, low, second, third = (numbers(planes) for planes in (widths[0], 1, *widths[1:]))
    points, labels = [None] * hits, [None] * hits
    point = (0, 0, 0)
    for n, *errors in zip(order, first, (l & 15 | e << 4 for l, e in zip(low, second)), (l >> 4 | e << 4 for l, e in zip(low, third))):
        x, y, z = point
        near = (c * x - s * y, s * x + c * y, 2**20 * z)
        axes = sorted(range(3), key=lambda axis: -abs(near[axis])) if along_ray else [0, 1, 2]
        axes = axes[:1] + sorted(axes[1:])
        point = [None] * 3
        for axis, error in zip(axes, errors):
            if along_ray and axis != axes[0]:
                of_ray = near[axes[0]]
                guess = int(point[axes[0]] / of_ray * float(256 * near[axis])) + 128 >> 8 if of_ray else 0
            else:
                guess = near[axis] + 2**19 >> 20
            point[axis] = guess + signed(error)
        points[n] = tuple(point)
    for n, label in zip(order, numbers(label_width)):
        labels[n] = label
    assert not stream.read()
    return points, labels


class Tools(ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.drive = os.path.join(cls.folder, 'drive')
        cls.succeeds('simulate_drive', '--output', cls.drive, '--scans', '4', '--beams', '16', '--columns', '400')

    def rows_of_document(self):
        """The rows of docs/files.md by the name in their first column."""
        with open(os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'docs', 'files.md')) as file:
            return {row.split('`')[1]: row for row in file.read().splitlines() if row.startswith('| `')}

    def test_programs_are_documented_with_all_options(self):
        rows = self.rows_of_document()
        for program in ('clear_map', 'correct_map', 'export_map', 'forget_journal', 'inspect_map', 'map_bag', 'map_sequence', 'merge_maps', 'query_city', 'simulate_city', 'simulate_drive', 'evaluate_map', 'benchmark_sequence'):
            options = set(re.findall(r'^ +(--[a-z-]+)', call(program, '--help').stdout, re.MULTILINE)) - {'--help', '--version'}
            self.assertTrue(options, program)
            for option in options:
                self.assertIn(option, rows[program], program)

    def test_scripts_are_documented_with_all_options(self):
        source = os.environ['BKI_MAPPING_SOURCE_DIR']
        rows = self.rows_of_document()
        for script in ('compare', 'demo', 'package', 'reproduce', 'soak', 'test', 'test_on'):
            with open(os.path.join(source, 'scripts', script)) as file:
                options = set(re.findall(r'^ +(--[a-z-]+)\)', file.read(), re.MULTILINE)) - {'--help'}
            self.assertTrue(options, script)
            for option in options:
                self.assertIn(f'[{option}', rows[f'scripts/{script}'])

    def test_what_scans_and_settings_may_take_is_said(self):
        coarse = self.succeeds('map_sequence', '--sequence', self.drive, '--set', 'resolution=1', '--set', 'kernel/length=0.3')
        self.assertIn("warning: kernel/length 0.3 m is below half a voxel's diagonal, 0.866 m", coarse.stderr)
        fine = call('map_sequence', '--sequence', self.drive, '--set', 'resolution=0.005')
        self.assertEqual(fine.returncode, 1)
        self.assertRegex(fine.stderr, r'scan 000000: the scan would touch about .* blocks .* coarser resolution')
        self.assertIn('4 of 4 scans were refused', fine.stderr)

    def test_labels_that_the_table_lacks_are_warned_of_with_the_remedy(self):
        table = os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'config', 'classes', 'semantic_kitti.yaml')
        with open(table) as file:
            text = file.read()
        ids = {int(raw): int(number) for number, raws in re.findall(r'id: (\d+),.*raw: \[([\d, ]+)\]', text) for raw in raws.split(',')}
        plain = self.path('plain.yaml')
        with open(plain, 'w') as file:
            file.write(text.replace('label_mask: 0xFFFF\n', '').replace('name: semantic_kitti\n', 'name: plain\n'))
        self.labels('train_ids', lambda raw: ids[raw])
        self.labels('instances', lambda raw: raw | 300 << 16)
        for labels, classes, remedy in (
                ('train_ids', 'semantic_kitti', 'all labels seen are ids of the table; set label_values to id'),
                ('instances', plain, 'the table has the lower 16 bits of all labels seen; set its label_mask to 0xFFFF'),
                ('labels', 'carla', 'class table semantic_kitti has all labels seen; set classes to it')):
            for program in ('map_sequence', 'evaluate_map'):
                result = self.succeeds(program, '--sequence', self.drive, '--labels', labels, '--classes', classes)
                self.assertRegex(result.stderr, r'^warning: \d+ % of the points of a scan have labels that class table')
                self.assertIn('; ' + remedy + '\n', result.stderr)
                self.assertLessEqual(result.stderr.count('\n'), 4, result.stderr)
        good = call('map_sequence', '--sequence', self.drive, '--labels', 'instances', '--output', self.path('instances.ply'))
        self.assertEqual((good.returncode, good.stderr), (0, ''))
        self.assertEqual(call('map_sequence', '--sequence', self.drive, '--output', self.path('raw.ply')).returncode, 0)
        with open(self.path('instances.ply'), 'rb') as instances, open(self.path('raw.ply'), 'rb') as raw:
            self.assertEqual(instances.read(), raw.read())
        noisy = self.evaluation(more=['--labels', 'instances'])
        self.assertEqual(noisy['da'], self.evaluation()['da'], 'instances that move, move')

    def test_one_far_point_is_left_out_and_said(self):
        far = self.path('far')
        shutil.copytree(self.drive, far)
        with open(os.path.join(far, 'velodyne', '000002.bin'), 'r+b') as file:
            file.write(struct.pack('<fff', 1e7, 1e6, 0.0))
        result = call('map_sequence', '--sequence', far)
        self.assertEqual((result.returncode, result.stderr), (0, ''))
        self.assertRegex(result.stdout, r'left out of \d+ points: 1 beyond 300 m')
        trusted = call('map_sequence', '--sequence', far, '--set', 'sensor_model/max_range=1e9', '--report',
                       self.path('far.json'))
        self.assertEqual(trusted.returncode, 1)
        self.assertIn('scan 000002: the scan would touch', trusted.stderr)
        self.assertIn('1 of 4 scans was refused', trusted.stderr)
        self.assertEqual(len(read_json(self.path('far.json'))['scans']), 3, 'the others are mapped')

    def test_help(self):
        for program in ('map_sequence', 'simulate_drive'):
            result = call(program, '--help')
            self.assertEqual(result.returncode, 0)
            self.assertIn('--output', result.stdout)
            result = call(program, '--version')
            self.assertEqual(result.returncode, 0)
            self.assertRegex(result.stdout, r'^bki_mapping \d+\.\d+\.\d+\n$')

    def test_map_and_report(self):
        self.succeeds('map_sequence', '--sequence', self.drive, '--output', self.path('map.ply'), '--report',
                      self.path('report.json'), '--include', 'occupied,free', '--threads', '2', '--first', '1')
        report = read_json(self.path('report.json'))
        self.assertEqual([scan['name'] for scan in report['scans']], ['000001', '000002', '000003'])
        self.assertEqual(report['parameters']['threads'], '2')
        for scan in report['scans']:
            self.assertEqual(scan['points'], scan['used'] + sum(scan['dropped'].values()))
            self.assertGreater(scan['blocks'], 0)
            phases = sum(scan[name] for name in ('observe_ms', 'evidence_ms', 'collect_ms', 'update_ms'))
            self.assertAlmostEqual(scan['total_ms'], phases, places=6)
        self.assertEqual(sum(report['voxels_by_class'].values()), report['voxels']['occupied'])
        self.assertGreater(report['voxels']['free'], report['voxels']['occupied'])
        self.assertGreater(report['peak_resident_bytes'], report['map_bytes'])
        self.assertGreaterEqual(report['p99_ms'], report['median_ms'])
        with open(self.path('map.ply'), 'rb') as file:
            vertices = report['voxels']['free'] + report['voxels']['occupied']
            self.assertIn(f'element vertex {vertices}\n'.encode(), file.read(400))

    def evaluation(self, *settings, more=()):
        arguments = [word for setting in settings for word in ('--set', setting)]
        result = self.succeeds('evaluate_map', '--sequence', self.drive, '--late', '1', '--json', self.path('figures.json'),
                               *arguments, *more)
        self.table = result.stdout
        return read_json(self.path('figures.json'))

    def test_the_environment_names_the_fastest_instruction_set(self):
        map_file = self.path('generic.bkm')
        command = ('map_sequence', '--sequence', self.drive, '--output', map_file)
        self.succeeds(*command, env={**os.environ, 'BKI_MAPPING_INSTRUCTION_SET': 'generic'})
        os.remove(map_file)
        self.fails("BKI_MAPPING_INSTRUCTION_SET is 'abacus', which this processor does not have; unset it, or set it to one of: generic",
                   *command, env={**os.environ, 'BKI_MAPPING_INSTRUCTION_SET': 'abacus'})
        self.assertFalse(os.path.exists(map_file))

    def test_evaluation(self):
        hits_alone = self.evaluation('free_space/mode=none')
        self.assertEqual(hits_alone['sa'], 1.0)
        self.assertEqual(hits_alone['da'], 0.0)
        lines = self.evaluation()
        self.assertLess(lines['sa'], 1.0)
        self.assertGreater(lines['sa'], 0.5)
        self.assertGreater(lines['da'], 0.0)
        ruled = self.evaluation('rules/enabled=true')
        self.assertGreater(ruled['sa'], lines['sa'])
        self.assertGreater(ruled['da'], lines['da'])

    def test_an_octomap_of_the_same_points_is_measured_beside(self):
        alone = self.evaluation()
        both = self.evaluation(more=('--octomap', 'default', '--octomap', 'max_range=10,discretize=true'))
        octomap, near = both.pop('octomap')
        self.assertNotIn('octomap', alone)
        self.assertEqual([octomap['settings'], near['settings']], ['default', 'max_range=10,discretize=true'])
        for figure in ('sa', 'da', 'floor_holes', 'presence'):
            self.assertEqual(both[figure], alone[figure], figure)
        for count in ('static_points', 'moving_points', 'floor_voxels'):
            self.assertEqual(octomap[count], alone[count], count)
        self.assertGreater(octomap['sa'], 0.5)
        self.assertNotEqual(octomap['sa'], alone['sa'])
        self.assertGreater(octomap['map_bytes'], 2 * near['map_bytes'])
        self.assertGreater(near['map_bytes'], 0)
        self.assertGreater(octomap['sa'], near['sa'])
        for figures in (both, octomap, near):
            self.assertGreater(figures['truth']['free_precision'], 0.5)
            self.assertGreater(figures['truth']['free_recall'], 0.01)
            self.assertGreater(figures['occupancy_calibration_error'], 0.0)
            self.assertLess(figures['truth']['occupancy_calibration_error'], 0.5)
        self.assertGreater(octomap['truth']['free_recall'], 2 * near['truth']['free_recall'])
        self.assertGreater(both['processor_ms'], 0.0)
        self.assertLess(octomap['processor_ms'], octomap['median_ms'] + 1.0, 'one thread')
        self.assertGreater(both['yardstick_ms'], 0.0)
        self.assertGreater(both['yardstick_processor_ms'], 0.0)
        self.assertGreater(both['map_bytes'], 0)
        self.assertIn('OctoMap of the same scans, default: SA ', self.table)
        self.fails("'maxrange' is unknown; did you mean 'max_range'?", 'evaluate_map', '--sequence', self.drive, '--octomap', 'maxrange=10')

    def test_a_map_is_judged_by_other_gains(self):
        gains = ('rules/stands_after=1', 'rules/stands_after=9,rules/living_stands_after=1,rules/fixed_stands_after=3,rules/together=0')
        judged = self.evaluation('rules/enabled=true', more=[word for each in gains for word in ('--judge', each)])['judged']
        table = self.table
        self.assertEqual([each.pop('settings') for each in judged], list(gains))
        for given, figures in zip(gains, judged):
            self.assertIn(f'with {given}: SA ', table)
            mapped = self.evaluation('rules/enabled=true', *given.split(','))
            self.assertEqual(figures, {name: mapped[name] for name in figures})
        self.assertNotEqual(judged[0]['sa'], judged[1]['sa'])
        sequence = ('--sequence', self.drive)
        self.fails('changes more than decisions', 'evaluate_map', *sequence, '--judge', 'rules/stands_after=1,rules/void_outweighs=1')
        self.fails("has no '='", 'evaluate_map', *sequence, '--judge', 'rules/stands_after')
        self.fails('given twice', 'evaluate_map', *sequence, '--judge', 'rules/together=1,rules/together=2')
        self.fails('rules/together only', 'evaluate_map', *sequence, '--judge', 'rules/stand_after=1')

    def test_rules_are_left_out(self):
        given = ('rules/enabled=true', 'rules/latest=true')
        def unlike(figures):  # times differ from run to run
            return {name: value for name, value in figures.items() if not name.endswith('_ms')}
        every = self.evaluation(*given)
        without = self.evaluation(*given, more=('--without', 'looks', '--without', 'voids'))
        settings = ('rules/enabled=true', 'rules/latest=false', 'rules/void_outweighs=0')
        self.assertEqual(unlike(without), unlike(self.evaluation(*settings)))
        self.assertNotEqual(unlike(without), unlike(every))
        others = {'without=looks,without=voids': without,
                  'rules/void_outweighs=3,without=looks': self.evaluation(*given, 'rules/void_outweighs=3', more=('--without', 'looks'))}
        beside = self.evaluation(*given, more=[word for each in others for word in ('--also', each)])
        also = beside.pop('also')
        self.assertEqual(unlike(beside), unlike(every))
        self.assertEqual([each.pop('settings') for each in also], list(others))
        for figures, (other, alone) in zip(also, others.items()):
            self.assertIn(f'also mapped with {other}: SA ', self.table)
            in_the_scene = figures.pop('truth')
            self.assertEqual(in_the_scene, {name: alone['truth'][name] for name in in_the_scene})
            self.assertIn('presence', figures)
            self.assertEqual(figures, {name: alone[name] for name in figures})
        self.assertNotEqual(also[0]['presence'], every['presence'])
        self.assertNotEqual(also[0]['da'], every['da'])
        self.fails("there is no rule 'void' to leave out; known: hits_stay, ", 'evaluate_map', '--sequence', self.drive,
                   '--set', 'rules/enabled=true', '--without', 'void')
        self.fails('--also resolution=0.2 changes resolution or label_values', 'evaluate_map', '--sequence', self.drive,
                   '--also', 'resolution=0.2')
        self.fails("no rule 'void'", 'evaluate_map', '--sequence', self.drive, '--set', 'rules/enabled=true', '--also', 'without=void')
        self.fails('rules/enabled is false', 'evaluate_map', '--sequence', self.drive, '--without', 'voids')

    def cloud_figures(self, drive, *more):
        result = call('evaluate_map', '--sequence', drive, '--late', '1', '--cloud', '--json', self.path('figures.json'), *more)
        self.assertEqual((result.returncode, result.stderr), (0, ''))
        self.assertIn('as the DynamicMap benchmark counts', result.stdout)
        return read_json(self.path('figures.json'))

    def test_clouds_are_compared_as_the_dynamicmap_benchmark_does(self):
        export = self.path('export')
        self.succeeds('simulate_drive', '--output', export, '--scans', '4', '--beams', '16', '--columns', '400', '--layout', 'dynamic_map')
        self.assertEqual(sorted(os.listdir(export)), ['gt_cloud.pcd', 'labels', 'pcd', 'simulation.yaml', 'times.txt'])
        of_points, of_cloud = self.cloud_figures(self.drive), self.cloud_figures(export)
        for name in ('static_points', 'moving_points'):
            self.assertEqual(of_points['cloud'][name], of_cloud['cloud'][name])
        self.assertGreater(of_cloud['cloud']['moving_points'], 20)
        for name in ('sa', 'da', 'aa', 'ha'):  # coordinates are rounded to floats in another frame
            self.assertAlmostEqual(of_points['cloud'][name], of_cloud['cloud'][name], delta=0.01)
        self.assertLess(of_cloud['cloud']['sa'], 1.0)
        hits_alone = self.cloud_figures(export, '--set', 'free_space/mode=none')
        self.assertEqual((hits_alone['cloud']['sa'], hits_alone['cloud']['da']), (1.0, 0.0))

        # Without labels: the ground truth says what moves, but not what is of which class.
        shutil.rmtree(os.path.join(export, 'labels'))
        blind = self.cloud_figures(export, '--classes', 'occupancy')
        self.assertAlmostEqual(blind['sa'], of_cloud['sa'], delta=0.1)
        self.assertEqual(blind['static_points'] , of_cloud['cloud']['static_points'])
        self.assertIsNone(blind['miou_map'])
        self.fails('leave out --first, --scans and --pose-drift', 'evaluate_map', '--sequence', export, '--cloud', '--scans', '2')
        os.remove(os.path.join(export, 'gt_cloud.pcd'))
        self.fails('gt_cloud.pcd, a cloud of all scans', 'evaluate_map', '--sequence', export, '--cloud')
        self.fails('class ids do not say what moves', 'evaluate_map', '--sequence', self.drive, '--cloud', '--set', 'label_values=id')
        scan = os.path.join(export, 'pcd', '000002.pcd')
        text = read_bytes(scan)
        with open(scan, 'wb') as file:
            file.write(text.replace(b'VIEWPOINT', b'# VIEWPOINT'))
        self.fails('has no line VIEWPOINT', 'evaluate_map', '--sequence', export)

    def test_evaluation_against_the_truth_of_the_simulation(self):
        hits_alone, lines = self.evaluation('free_space/mode=none'), self.evaluation()
        self.assertEqual(hits_alone['truth']['free_recall'], 0.0)
        self.assertGreater(lines['truth']['free_recall'], 0.8)
        self.assertGreater(lines['truth']['free_precision'], 0.5)
        self.assertGreater(hits_alone['truth']['movable_voxels'], lines['truth']['movable_voxels'])
        self.assertGreater(hits_alone['truth']['occupied_recall'], lines['truth']['occupied_recall'])
        self.assertEqual([bin.get('up_to') for bin in lines['truth']['by_distance']], [10, 20, 40, 60, 80, None])
        self.assertGreaterEqual(lines['truth']['free_precision'], lines['truth']['free_empty'])
        self.assertIn('  free_precision ', self.table)
        self.assertGreater(lines['voxels_by_class']['road'], 100)

    def labels(self, name, change):
        """Writes a second folder of labels: change(label) for each label of the drive."""
        folder = os.path.join(self.drive, name)
        os.mkdir(folder)
        self.addCleanup(shutil.rmtree, folder)
        for file in os.listdir(os.path.join(self.drive, 'labels')):
            labels = array.array('I')
            with open(os.path.join(self.drive, 'labels', file), 'rb') as source:
                labels.frombytes(source.read())
            with open(os.path.join(folder, file), 'wb') as target:
                target.write(array.array('I', [change(label) for label in labels]).tobytes())

    def test_evaluation_with_errors(self):
        clean = self.evaluation()
        self.assertEqual(clean['miou_input'], 1.0)
        for kind in ('even', 'similar', 'objects', 'borders', 'far', 'network'):
            noisy = self.evaluation(more=('--label-noise', '0.5', '--label-errors', kind))
            self.assertLess(noisy['miou_input'], 0.99, kind)
            self.assertEqual(noisy['static_points'], clean['static_points'], kind)
        # Wrong labels of objects that change with each scan are outvoted more often than those that stay.
        objects = ('--label-noise', '0.5', '--label-errors', 'objects', '--label-error-seconds')
        brief, lasting = (self.evaluation(more=(*objects, seconds))['miou_map'] for seconds in ('0.1', '10'))
        self.assertGreater(brief, lasting)
        # Predictions that take every building for a fence.
        self.labels('predicted', lambda label: 51 if label == 50 else label)
        predicted = {each['name']: each for each in self.evaluation(more=('--predictions', 'predicted'))['classes']}
        self.assertEqual(predicted['building']['iou_input'], 0.0)
        self.assertEqual(predicted['building']['iou_map'], 0.0)
        self.assertEqual(predicted['road']['iou_input'], 1.0)
        # Predictions that were written are read again; a folder with some is not overwritten.
        network = ('--label-noise', '0.5', '--label-errors', 'network')
        written = self.evaluation(more=(*network, '--write-predictions', 'written'))
        self.addCleanup(shutil.rmtree, os.path.join(self.drive, 'written'))
        read = self.evaluation(more=('--predictions', 'written'))
        for figures in (written, read):
            for time in ('median_ms', 'processor_ms', 'yardstick_ms', 'yardstick_processor_ms'):
                del figures[time]
        self.assertEqual(read, written)
        self.assertLess(read['miou_input'], 0.9)
        self.fails('written is not empty', 'evaluate_map', '--sequence', self.drive, '--write-predictions', 'written')
        # Points are judged where they are: a map of poses that are a metre wrong keeps fewer. Where poses drift, the
        # frame of the map drifts with them, and there is no truth to compare it with.
        shaken = self.evaluation(more=('--pose-noise', '1,1'))
        self.assertLess(shaken['sa'], clean['sa'] - 0.05)
        self.assertIn('truth', shaken)
        drifting = self.evaluation(more=('--pose-drift', '1,0'))
        self.assertGreater(drifting['sa'], shaken['sa'])
        self.assertNotIn('truth', drifting)
        self.assertEqual(self.evaluation(more=('--pose-drift', '0,0'))['sa'], clean['sa'])
        # Also where the points of a journal are mapped: as coarse as voxels they lie in others.
        self.assertAlmostEqual(self.evaluation(more=('--journal', '0.0001'))['sa'], clean['sa'], delta=0.002)
        self.assertLess(self.evaluation(more=('--journal', '0.3'))['sa'], clean['sa'] - 0.005)
        self.fails('--journal is 0, but must be from 0.0001 to 1', 'evaluate_map', '--sequence', self.drive, '--journal', '0')

    def test_simulated_scenes(self):
        moving = {}
        for scene in ('street', 'traffic', 'crowd', 'queue', 'rooms'):
            folder = self.path(scene)
            self.succeeds('simulate_drive', '--output', folder, '--scene', scene, '--scans', '2', '--lidar', 'vlp16',
                          '--columns', '300')
            self.succeeds('evaluate_map', '--sequence', folder, '--late', '1', '--json', self.path('figures.json'))
            figures = read_json(self.path('figures.json'))
            moving[scene] = figures['moving_points']
            self.assertIn('truth', figures)
            by_label = {entry['label']: entry for entry in figures['sa_by_label']}
            self.assertEqual(sum(entry['static_points'] for entry in by_label.values()), figures['static_points'])
            kept = sum(entry['static_points'] * entry['sa'] for entry in by_label.values())
            self.assertAlmostEqual(kept, figures['static_kept'], places=3)
        self.assertGreater(moving['crowd'], moving['street'])
        # The last are the rooms: floor, walls, tables, chairs, furniture, within the usual reach of a low sensor.
        for label in (40, 50, 51, 70, 71):
            self.assertGreater(by_label[label]['static_points'], 10, label)
        with open(os.path.join(self.path('rooms'), 'simulation.yaml')) as file:
            self.assertRegex(file.read(), r'(?s)scene: rooms.*speed: 0\.5\n.*height: 0\.3')

    def test_evaluation_of_class_ids(self):
        table = os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'config', 'classes', 'semantic_kitti.yaml')
        ids = {}
        with open(table) as file:
            for number, raws in re.findall(r'id: (\d+),.*raw: \[([\d, ]+)\]', file.read()):
                ids.update({int(raw): int(number) for raw in raws.split(',')})
        self.labels('ids', lambda raw: ids[raw & 0xffff])
        raw, by_id = self.evaluation(), self.evaluation('label_values=id', more=['--labels', 'ids'])
        for figure in ('miou_map', 'accuracy_map', 'sa_ground', 'sa_other', 'floor_voxels', 'voxels_by_class', 'truth'):
            self.assertEqual(raw[figure], by_id[figure], figure)
        self.assertEqual(raw['labels_not_in_table'], 0)
        self.assertEqual(by_id['labels_not_in_table'], 0)
        self.assertEqual(by_id['static_points'], raw['static_points'] + self.count_moving())
        self.assertIsNone(by_id['da'])
        self.assertIn('ids do not say what moves', self.table)
        noisy = self.evaluation('label_values=id', more=['--labels', 'ids', '--label-noise', '0.3'])
        self.assertAlmostEqual(noisy['accuracy_input'], 0.7, delta=0.02)
        # Raw labels taken for ids: most are not in the table, which is reported.
        wrong = self.evaluation('label_values=id')
        self.assertGreater(wrong['labels_not_in_table'], 0.5 * raw['static_points'])
        self.assertRegex(self.table, r'\d+ of \d+ labels are not in the class table semantic_kitti')

    def count_moving(self):
        count = 0
        for file in os.listdir(os.path.join(self.drive, 'labels')):
            labels = array.array('I')
            with open(os.path.join(self.drive, 'labels', file), 'rb') as source:
                labels.frombytes(source.read())
            count += sum(252 <= label & 0xffff <= 259 for label in labels)
        self.assertGreater(count, 0)
        return count

    def test_figures_of_nothing_are_no_numbers(self):
        self.labels('unknown', lambda _: 7777)
        nothing = self.evaluation(more=['--labels', 'unknown'])
        self.assertIsNone(nothing['sa'])
        self.assertNotIn('nan', self.table.lower())
        self.assertRegex(self.table, r'SA +- % +of the points')
        self.assertIn('7777', self.table)
        first = self.evaluation(more=['--scans', '1'])
        self.assertIsNone(first['da'])
        self.assertNotIn('nan', self.table.lower())

    def test_numbers_out_of_their_limits(self):
        sequence = ('--sequence', self.drive)
        for program in ('map_sequence', 'evaluate_map', 'benchmark_sequence'):
            self.fails('--scans is 0, but must be at least 1', program, *sequence, '--scans', '0')
            self.fails('--scans is -1, but must be at least 1', program, *sequence, '--scans', '-1')
            self.fails('--first is -1, but must be at least 0', program, *sequence, '--first', '-1')
            for word in ('1.5', 'nan', 'many', '', '99999999999999999999'):
                self.fails('--scans', program, *sequence, '--scans', word)
        self.fails('--late is -1', 'evaluate_map', *sequence, '--late', '-1')
        self.fails('--noise-seed is -1', 'evaluate_map', *sequence, '--noise-seed', '-1')
        for share in ('nan', '-0.1', '1.1', 'inf'):
            self.fails('--label-noise is ', 'evaluate_map', *sequence, '--label-noise', share)
        for seconds in ('nan', '0', '-1', '1e9'):
            self.fails('--label-error-seconds is ', 'evaluate_map', *sequence, '--label-error-seconds', seconds)
        for option in ('--pose-noise', '--pose-drift'):
            for errors in ('0.1', '0.1,', '0.1,2,3', '-0.1,2', '0.1,nan', 'a,b', ''):
                self.fails(option + ' is ' + errors, 'evaluate_map', *sequence, option, errors)
        self.fails('keep one', 'evaluate_map', *sequence, '--pose-noise', '0,0', '--pose-drift', '0,0')
        self.fails('no label errors near', 'evaluate_map', *sequence, '--label-errors', 'near')
        self.fails('predicted', 'evaluate_map', *sequence, '--predictions', 'predicted')
        self.fails('--warm-up is -1', 'benchmark_sequence', *sequence, '--warm-up', '-1')
        self.fails('--repeats is -1', 'benchmark_sequence', *sequence, '--repeats', '-1')
        self.fails('--curve-scans is 1', 'benchmark_sequence', *sequence, '--curve-scans', '1')
        output = self.path('never')
        for option, values in {'scans': '-1 0 1000001', 'beams': '-1 0 1025', 'columns': '-1 0 100001',
                               'rate': '-1 0 nan inf', 'max-range': '-1 0 nan inf', 'range-noise': '-1 nan inf',
                               'label-noise': '-0.1 nan 2', 'speed': '-1 nan 101',
                               'height': '0 nan 101'}.items():
            for value in values.split():
                self.fails(f'{option} is {value}, but must be', 'simulate_drive', '--output', output, '--' + option,
                           value)
        self.fails('no scene desert', 'simulate_drive', '--output', output, '--scene', 'desert')
        self.fails('no lidar vlp17', 'simulate_drive', '--output', output, '--lidar', 'vlp17')
        self.fails('--seed is -1', 'simulate_drive', '--output', output, '--seed', '-1')
        self.assertFalse(os.path.exists(output))

    def test_errors_are_drawn(self):
        picture = self.path('errors.png')
        self.fails('must end in .png', 'evaluate_map', '--sequence', self.drive, '--errors', self.path('errors.jpg'))
        self.succeeds('evaluate_map', '--sequence', self.drive, '--errors', picture, '--octomap', 'default', '--octomap', 'max_range=5')
        self.assertEqual(read_bytes(picture)[:8], b'\x89PNG\r\n\x1a\n')
        with open(self.path('errors.csv'), newline='') as file:
            kinds = [row['what'] for row in csv.DictReader(file)]
        self.assertGreater(kinds.count('kept'), kinds.count('lost'))
        self.assertGreater(kinds.count('lost'), 0)
        lost = []
        for number in (1, 2):
            with open(self.path(f'errors_octomap_{number}.csv'), newline='') as file:
                rows = [row['what'] for row in csv.DictReader(file)]
            self.assertEqual(len(rows), sum(kinds.count(kind) for kind in ('kept', 'lost', 'forgotten', 'left')))
            lost.append(rows.count('lost'))
        self.assertGreater(lost[1], 2 * lost[0])

    def test_presets(self):
        folder = os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'config', 'presets')
        figures = {}
        for name in sorted(os.listdir(folder)):
            self.succeeds('evaluate_map', '--sequence', self.drive, '--late', '1', '--json', self.path('figures.json'),
                          '--config', os.path.join(folder, name))
            with open(self.path('figures.json')) as file:
                figures[name[:-len('.yaml')]] = json.load(file)
        self.assertEqual(set(figures), {'baseline_even', 'paper_line', 'paper_linear', 'paper_none', 'robot'})
        self.assertEqual(figures['paper_none']['sa'], 1.0)
        for figure in ('sa', 'sa_ground', 'sa_standing', 'sa_other'):
            self.assertGreater(figures['robot'][figure], figures['paper_line'][figure], figure)
        self.assertGreater(figures['robot']['sa'], 0.98)
        self.assertLess(figures['robot']['floor_holes'], 0.2 * figures['paper_line']['floor_holes'])

    def test_simulate_city(self):
        cities = [self.path('city_a'), self.path('city_b')]
        for city in cities:
            made = call('simulate_city', '--output', city, '--drives', '2', '--blocks', '1', '--scans', '2', '--beams', '8',
                        '--columns', '90')
            self.assertEqual((made.returncode, made.stderr), (0, ''))
        files = [sorted(os.path.relpath(os.path.join(folder, name), city) for folder, _, names in os.walk(city) for name in names)
                 for city in cities]
        self.assertEqual(files[0], files[1])
        self.assertEqual(len(files[0]), 1 + 2 * (3 + 2 + 2))
        for name in files[0]:
            with open(os.path.join(cities[0], name), 'rb') as a, open(os.path.join(cities[1], name), 'rb') as b:
                self.assertEqual(a.read(), b.read(), name)
        with open(os.path.join(cities[0], 'city.yaml')) as file:
            self.assertEqual(file.read(), 'classes: semantic_kitti\ndrives:\n  - sequence: drive_0000\n  - sequence: drive_0001\n')
        self.fails('city.yaml exists; give a new folder', 'simulate_city', '--output', cities[0])
        for option, value in (('drives', '0'), ('blocks', '101'), ('block-edge', '59'), ('scans', '0'), ('columns', '0')):
            self.fails(f'{option} is {value}, but must be', 'simulate_city', '--output', self.path('no'), '--' + option, value)
        self.assertFalse(os.path.exists(self.path('no')))

    def test_poses_in_the_frame_of_the_map(self):
        poses = os.path.join(self.drive, 'poses.txt')
        with open(poses) as file:
            lines = [line.split() for line in file]
        for line in lines:
            line[3] = repr(float(line[3]) + 19.2)  # by whole blocks
        moved = self.path('moved.txt')
        with open(moved, 'w') as file:
            file.writelines(' '.join(line) + '\n' for line in lines)
        bounds = []
        for given in ([], ['--poses', moved]):
            call('map_sequence', '--sequence', self.drive, '--output', self.path('moved.bkm'), *given)
            call('inspect_map', self.path('moved.bkm'), '--json', self.path('moved.json'))
            bounds.append(read_json(self.path('moved.json'))['bounds'])
        self.assertAlmostEqual(bounds[1]['min'][0] - bounds[0]['min'][0], 19.2, delta=0.31)
        self.assertAlmostEqual(bounds[1]['max'][1], bounds[0]['max'][1], delta=0.31)
        self.fails('missing.txt', 'map_sequence', '--sequence', self.drive, '--poses', self.path('missing.txt'))
        export = self.path('pcd_poses')
        call('simulate_drive', '--output', export, '--scans', '1', '--beams', '4', '--columns', '40', '--layout', 'dynamic_map')
        self.fails('have the poses of their scans', 'map_sequence', '--sequence', export, '--poses', moved)

    def test_benchmark(self):
        result = call('benchmark_sequence', '--sequence', self.drive, '--repeats', '0')
        self.assertNotEqual(result.returncode, 0)
        self.assertIn('--repeats', result.stderr)
        self.fails('--journal is 0, but must be from 0.0001 to 1', 'benchmark_sequence', '--sequence', self.drive, '--journal', '0')
        self.succeeds('benchmark_sequence', '--sequence', self.drive, '--warm-up', '2', '--repeats', '2',
                      '--journal', '0.01', '--csv', self.path('times.csv'))
        with open(self.path('times.csv'), newline='') as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(list(rows[0]),
                         ['mode', 'resolution', 'threads', 'median_ms', 'p99_ms', 'ratio_to_y', 'map_bytes', 'journal_ratio'])
        self.assertEqual(len(rows), 22)
        self.assertTrue(all(float(row['median_ms']) > 0 for row in rows))
        for row in rows:  # only scans that can be moved are kept
            if 'mapped' in row['mode'] or row['mode'] == 'paper_line':
                self.assertEqual(row['journal_ratio'], '')
            else:
                self.assertGreater(float(row['journal_ratio']), 0)
        self.assertEqual([(row['mode'], row['resolution']) for row in rows[-6::2]],
                         [('robot', '0.3'), ('robot', '0.1'), ('paper_line', '0.1')])

    def test_curves_are_drawn(self):
        folder = self.path('curves')
        os.mkdir(folder)
        tables = {'growth': 'mode,scan,blocks,map_bytes,ms\n"none",0,10,1000,5.0\n"none",1,20,2000,6.0\n',
                  'points': 'mode,points,hits,median_ms\n"none",100,50,1.0\n"none",200,90,2.0\n',
                  'resolution': 'mode,resolution,median_ms\n"none",0.3,1.0\n"none",0.1,9.0\n'}
        for name, table in tables.items():
            with open(os.path.join(folder, name + '.csv'), 'w') as file:
                file.write(table)
        script = os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'lab', 'tools', 'plot_curves.py')
        subprocess.run(['/usr/bin/python3', script, folder], check=True, capture_output=True, timeout=120)
        for name in tables:
            self.assertEqual(read_bytes(os.path.join(folder, name + '.png'))[:8], b'\x89PNG\r\n\x1a\n')

    def test_threads_do_not_show(self):
        maps = []
        for threads in ('1', '2', '7'):
            path = self.path(f'threads{threads}.ply')
            self.assertEqual(call('map_sequence', '--sequence', self.drive, '--threads', threads, '--include',
                                  'occupied,free', '--output', path).returncode, 0)
            maps.append(read_bytes(path))
        self.assertEqual(maps[0], maps[1])
        self.assertEqual(maps[0], maps[2])

    def test_config_file_and_set(self):
        config = self.path('config.yaml')
        with open(config, 'w') as file:
            file.write('prior: 0.01\nfree_space: {mode: linear}\n')
        result = call('map_sequence', '--config', config, '--set', 'prior=0.02', '--print-config')
        self.assertIn('\nprior: 0.02\n', result.stdout)
        self.assertIn('\n  mode: linear\n', result.stdout)

    def test_refusals(self):
        self.fails("did you mean '--sequence'?", 'map_sequence', '--seqence', self.drive)
        self.fails('--sequence DIR is missing', 'map_sequence')
        self.fails("'resolutoin' is unknown; did you mean 'resolution'?", 'map_sequence', '--sequence', self.drive,
                   '--set', 'resolutoin=0.1')
        self.fails("did you mean 'line'?", 'map_sequence', '--sequence', self.drive, '--set', 'free_space/mode=liner')
        self.fails('no such', 'map_sequence', '--sequence', '/no such')
        self.fails('must end in .bkm, which holds all of a map, or in .ply or .pcd', 'map_sequence', '--sequence', self.drive, '--output', 'map.xyz')
        self.fails("did you mean 'toy'?", 'map_sequence', '--sequence', self.drive, '--classes', 'tooy')
        self.fails("state 'busy' is unknown", 'map_sequence', '--sequence', self.drive, '--include', 'busy')
        self.fails('--first 9 is beyond', 'map_sequence', '--sequence', self.drive, '--first', '9')
        self.fails("no '='", 'map_sequence', '--sequence', self.drive, '--set', 'prior')
        self.fails('--set prior is given twice', 'map_sequence', '--sequence', self.drive, '--set', 'prior=0.1',
                   '--set', 'prior=0.2')
        self.fails('by --threads and by --set', 'map_sequence', '--sequence', self.drive, '--set', 'threads=1',
                   '--threads', '2')
        cycle = self.path('cycle.yaml')
        with open(cycle, 'w') as file:
            file.write('a: &a {b: *a}\n')
        self.fails('alias', 'map_sequence', '--sequence', self.drive, '--config', cycle)
        self.fails('alias', 'map_sequence', '--sequence', self.drive, '--classes', cycle)
        self.fails('is neither a file nor one of', 'map_sequence', '--sequence', self.drive, '--config', '/no/file.yaml')
        self.fails('cannot be written', 'map_sequence', '--sequence', self.drive, '--output', '/no/such/map.ply')
        self.fails('is not empty', 'simulate_drive', '--output', self.drive)

    def test_a_missing_scan_shifts_nothing(self):
        gap = self.path('gap')
        shutil.copytree(self.drive, gap)
        os.remove(os.path.join(gap, 'velodyne', '000001.bin'))
        said = f'scan 000001 is missing in {gap}/velodyne; the others keep their poses and times\n'
        maps = []
        for sequence, first in ((self.drive, '2'), (gap, '2'), (gap, '1')):
            path = self.path('part.ply')
            result = self.succeeds('map_sequence', '--sequence', sequence, '--first', first, '--scans', '2', '--output', path)
            self.assertEqual(result.stderr, said if sequence == gap else '')
            maps.append(read_bytes(path))
        self.assertEqual(maps[0], maps[1], '--first is the number of a scan')
        self.assertEqual(maps[0], maps[2], 'the first scan there is from --first on')
        result = call('evaluate_map', '--sequence', gap, '--json', self.path('gap.json'))
        self.assertEqual((result.returncode, result.stderr), (0, said))
        self.assertGreater(read_json(self.path('gap.json'))['truth']['occupied_near'], 0.98)
        self.assertEqual(call('benchmark_sequence', '--sequence', gap, '--repeats', '1', '--warm-up', '0').stderr, said)

    def test_what_is_no_file_is_refused_before_the_work(self):
        pipe, good = self.path('pipe'), self.path('good.json')
        os.mkfifo(pipe)
        self.fails('pipe is a pipe, not a regular file', 'map_sequence', '--sequence', self.drive, '--report', pipe)
        self.fails('pipe is a pipe, not a regular file', 'evaluate_map', '--sequence', self.drive, '--json', pipe)
        self.fails('pipe is a pipe, not a regular file', 'benchmark_sequence', '--sequence', self.drive, '--csv', pipe)
        self.assertTrue(stat.S_ISFIFO(os.stat(pipe).st_mode))
        self.fails('cannot be written', 'map_sequence', '--sequence', self.drive, '--report', good, '--output',
                   '/no/such/map.ply')
        self.assertFalse(os.path.exists(good))

    def map_of(self, name, first, scans):
        path = self.path(name)
        self.succeeds('map_sequence', '--sequence', self.drive, '--first', str(first), '--scans', str(scans), '--output', path)
        return path

    def test_merging_equals_mapping_in_one_run(self):
        whole, kept, merged = self.map_of('whole.bkm', 0, 4), self.path('kept.bkm'), self.path('merged.bkm')
        front, back = self.map_of('front.bkm', 0, 2), self.map_of('back.bkm', 2, 2)
        result = self.succeeds('merge_maps', back, front, '--output', kept, '--keep-drives')
        self.assertEqual(tiles_of(kept), tiles_of(whole))
        self.assertRegex(result.stdout, r'kept.bkm: 2 drives, \d+ blocks in \d+ tiles\n$')
        result = self.succeeds('merge_maps', kept, back, '--output', merged, '--without', 'drive/000000-000001')
        self.assertEqual(tiles_of(merged), tiles_of(back))
        self.assertIn("drive 'drive/000002-000003' is in more than one map, and counts once\n", result.stdout)
        more = self.succeeds('map_sequence', '--sequence', self.drive, '--drive', 'more', '--resume', kept, '--output', merged)
        self.assertIn('stores drives separately, and the continued map will not', more.stderr)

    def test_resuming_equals_one_run(self):
        # Here even what depends on the map that is there: `mapped` lines and occlusion marks.
        for mode in ((), ('--set', 'free_space/mode=line', '--set', 'free_space/extent=mapped', '--set', 'occlusion=mapped')):
            whole, front, resumed = (self.path(name) for name in ('one_run.bkm', 'begun.bkm', 'resumed.bkm'))
            begin = ('map_sequence', '--sequence', self.drive, *mode)
            self.succeeds(*begin, '--scans', '4', '--output', whole)
            self.succeeds(*begin, '--scans', '2', '--output', front)
            self.succeeds(*begin, '--first', '2', '--scans', '2', '--resume', front, '--output', resumed)
            self.assertEqual(tiles_of(resumed), tiles_of(whole), mode)
        self.fails('the resolution of', *begin, '--resume', front, '--set', 'resolution=0.2')
        self.fails('the prior of', *begin, '--resume', front, '--set', 'prior=0.5')
        self.fails('class', *begin, '--resume', front, '--classes', 'toy')
        self.fails("already holds drive 'drive/000000-000001'", *begin, '--scans', '2', '--resume', front)

    def test_merging_some_tiles(self):
        a, some = self.map_of('a.bkm', 0, 2), self.path('some.bkm')
        whole = tiles_of(a)
        x, y = min((tile[2], tile[1]) for tile in whole)
        self.succeeds('merge_maps', a, '--tiles', f'{x},{y},{x},{y + 1}', '--output', some)
        expected = {tile: content for tile, content in whole.items() if tile[2] == x and y <= tile[1] <= y + 1}
        self.assertEqual(tiles_of(some), expected)
        self.assertLess(len(expected), len(whole))

    def test_moving_maps(self):
        a, there, back = self.map_of('a.bkm', 0, 1), self.path('there.bkm'), self.path('back.bkm')
        self.assertEqual(self.succeeds('merge_maps', a, '--transform', f'{a}=0.3,-1.2,3,90', '--output', there).stderr, '')
        self.assertNotEqual(tiles_of(there), tiles_of(a))
        self.succeeds('merge_maps', there, '--transform', f'{there}=1.2,0.3,-3,-90', '--output', back)
        self.assertEqual(tiles_of(back), tiles_of(a))
        self.assertIn('which is approximate', self.succeeds('merge_maps', a, '--transform', f'{a}=0,0,0,30', '--output',
                                                            there).stderr)

    def test_what_cannot_be_merged(self):
        a, output = self.map_of('a.bkm', 0, 1), ('--output', self.path('never.bkm'))
        self.fails('the names of the maps are missing', 'merge_maps', *output)
        self.fails('--output FILE.bkm is missing', 'merge_maps', a)
        self.fails('must end in .bkm', 'merge_maps', a, '--output', self.path('map.ply'))
        self.fails("'drive/000000-000000'", 'merge_maps', a, '--without', 'x', *output)
        for place in ('0,0,0,0', f'{a}=', f'{a}=0,0,0', f'{a}=0,0,0,0,0', f'{a}=0,0,0,', f'{a}=0,0,x,0', f'{a}=0,0,0,9 0'):
            self.fails(f'--transform {place} is not of the form', 'merge_maps', a, '--transform', place, *output)
        self.fails('is not finite', 'merge_maps', a, '--transform', f'{a}=0,0,nan,0', *output)
        self.fails('names b.bkm, which is none of the maps', 'merge_maps', a, '--transform', 'b.bkm=0,0,0,0', *output)
        self.fails('given twice', 'merge_maps', a, *(2 * ('--transform', f'{a}=0,0,0,0')), *output)
        for columns in ('', '0,0,1', '0,0,1,1,1', '0,0,1,1 ', '0,0,x,1', '0,0,1,99999999999'):
            self.fails(f'--tiles {columns} is not of the form', 'merge_maps', a, '--tiles', columns, *output)
        self.fails('--tiles 0,2,1,1 has a first index above the last', 'merge_maps', a, '--tiles', '0,2,1,1', *output)
        self.fails('cannot be opened', 'merge_maps', a, self.path('missing.bkm'), *output)
        self.assertFalse(os.path.exists(output[1]))

    def test_clearing(self):
        a, cleared = self.map_of('a.bkm', 0, 1), self.path('cleared.bkm')
        whole = tiles_of(a)
        self.assertRegex(self.succeeds('clear_map', a, '--box', '0 100 -100 100 -100 100', '--output', cleared).stdout,
                         r'cleared in \d\d+ blocks of \d+ tiles')
        rest = tiles_of(cleared)
        self.assertEqual({index for index in rest if index[2] >= 0}, set(), 'tiles in front of the origin')
        self.assertTrue(rest)
        for index, content in rest.items():
            self.assertEqual(content, whole[index])
        self.succeeds('clear_map', a, '--box', '0 -inf -inf inf inf inf')
        self.assertEqual(tiles_of(a), rest)
        self.fails('name one map file', 'clear_map', '--box', '0 0 0 1 1 1')
        self.fails('--box "X0 Y0 Z0 X1 Y1 Z1" is missing', 'clear_map', a)
        self.fails('--box has 5 numbers', 'clear_map', a, '--box', '0 0 0 1 1')
        self.fails('1x is not a number', 'clear_map', a, '--box', '0 0 0 1 1 1x')
        self.fails('not a number', 'clear_map', a, '--box', '1 1 1 0 0 nan')

    def test_inspecting(self):
        a, report, json_file = self.path('inspected.bkm'), self.path('inspected_report.json'), self.path('inspected.json')
        self.succeeds('map_sequence', '--sequence', self.drive, '--output', a, '--report', report, '--set',
                      'rules/enabled=true')
        top, profile = self.path('top.png'), self.path('profile.png')
        printed = self.succeeds('inspect_map', a, '--json', json_file, '--top', top, '--profile', profile).stdout
        with open(report) as mapped, open(json_file) as file:
            mapped, found = json.load(mapped), json.load(file)
        for field in ('voxels', 'voxels_by_class', 'blocks'):
            self.assertEqual(found[field], mapped[field], field)
        self.assertEqual(found['tiles'], len(tiles_of(a)))
        self.assertEqual(found['file_bytes'], os.path.getsize(a))
        self.assertEqual(found['resolution'], 0.3)
        self.assertEqual([(drive['id'], drive['scans'], drive['first_stamp_ns']) for drive in found['drives']],
                         [('drive/000000-000003', 4, 1000000000)])
        self.assertIn(f'{found["voxels"]["occupied"]} occupied, {found["voxels"]["free"]} free', printed)
        self.assertIn('drive/000000-000003: 4 scans, from 1970-01-01 00:00:01 UTC', printed)
        for picture in (top, profile):
            self.assertEqual(read_bytes(picture)[:8], b'\x89PNG\r\n\x1a\n')
        self.assertIn('\n  enabled: true\n', self.succeeds('inspect_map', a, '--parameters').stdout)
        before = tiles_of(a)
        self.fails('must end in .png', 'inspect_map', a, '--top', a)
        self.assertEqual(tiles_of(a), before)
        self.succeeds('inspect_map', a, '--top', top, '--max-z', '-1')
        self.fails('--max-z -1000 is below the map', 'inspect_map', a, '--top', top, '--max-z', '-1000')
        self.fails('give --top or --profile', 'inspect_map', a, '--max-z', '1')
        self.fails('name one map file', 'inspect_map')
        self.fails('cannot be written', 'inspect_map', a, '--profile', '/no/such/a.png')
        empty = self.path('empty.bkm')
        self.succeeds('clear_map', a, '--box', '-inf -inf -inf inf inf inf', '--output', empty)
        self.assertIn('0 occupied', self.succeeds('inspect_map', empty, '--json', json_file, '--top', top).stdout)
        self.assertIsNone(read_json(json_file)['bounds'])

    def mapped(self, name, *settings):
        """The map file of the drive."""
        self.succeeds('map_sequence', '--sequence', self.drive, '--output', self.path(name), *settings)
        return self.path(name)

    def content(self, name):
        return read_bytes(self.path(name))

    def test_a_map_exports_as_its_drive_does(self):
        gain = ('--set', 'rules/enabled=true')
        a, exported = self.mapped('exported.bkm', *gain), self.path('exported.ply')
        for states in ('occupied', 'occupied,free'):
            self.mapped('direct.ply', '--include', states, *gain)
            self.succeeds('export_map', a, '--output', exported, '--include', states)
            self.assertEqual(self.content('direct.ply'), self.content('exported.ply'), states)

    def test_the_ending_chooses_the_format(self):
        a = self.mapped('formats.bkm')
        for name, begin in (('map.ot', b'# Octomap OcTree file\n'), ('map.bt', b'# Octomap OcTree binary file\n'),
                            ('map.pcd', b'# .PCD v0.7'), ('map.glb', b'glTF'), ('map.yaml', b'image: "map.pgm"\n'), ('map.pgm', b'P5\n')):
            if name != 'map.pgm':
                result = self.succeeds('export_map', a, '--output', self.path(name))
                self.assertEqual((result.stderr, result.stdout), ('', f'{self.path(name)}: written, in frame map\n'))
            self.assertEqual(self.content(name)[:len(begin)], begin)

    def test_a_ply_file_holds_points_or_a_mesh(self):
        a = self.mapped('meshes.bkm')
        self.succeeds('export_map', a, '--output', self.path('map.ply'), '--mesh')
        self.assertIn(b'property list uchar uint vertex_indices', self.content('map.ply')[:400])
        self.succeeds('export_map', a, '--output', self.path('map.ply'))
        self.assertNotIn(b'element face', self.content('map.ply')[:400])
        self.fails('must end in .glb or .ply', 'export_map', a, '--output', self.path('map.pcd'), '--mesh')

    def test_heights_above_the_ground_hide_what_is_low(self):
        a = self.mapped('heights.bkm')
        self.succeeds('export_map', a, '--output', self.path('map.yaml'))
        all_heights = self.content('map.pgm')
        self.succeeds('export_map', a, '--output', self.path('map.yaml'), '--height', 'ground', '--min-z', '0.5')
        above_ground = self.content('map.pgm')
        self.assertEqual(len(all_heights), len(above_ground))
        self.assertGreater(all_heights.count(b'\0'), above_ground.count(b'\0'))

    def test_far_maps_are_exported_relative_to_an_origin(self):
        a, far = self.mapped('near.bkm'), self.path('far.bkm')
        self.succeeds('merge_maps', a, '--transform', f'{a}=499800,3999900,0,0', '--output', far)
        self.assertIn('written, in frame map, relative to its VIEWPOINT at 500000, 4000000, 0 m',
                      self.succeeds('export_map', far, '--output', self.path('map.pcd')).stdout)
        self.fails('move the map to a local frame with merge_maps --transform', 'export_map', far, '--output', self.path('map.ot'))

    def test_exports_that_are_refused(self):
        a, exported = self.mapped('refused.bkm'), self.path('refused.ply')
        self.fails('name one map file', 'export_map', '--output', exported)
        self.fails('--output FILE is missing', 'export_map', a)
        self.fails('must end in .ply, .pcd, .ot, .bt, .yaml, .glb or .html', 'export_map', a, '--output', self.path('map.bkm'))
        self.fails("must be map or ground", 'export_map', a, '--output', self.path('map.yaml'), '--height', 'sea')
        self.fails('--min-z must not be above', 'export_map', a, '--output', self.path('map.yaml'), '--min-z', '1', '--max-z', '0')
        self.fails("state 'busy' is unknown", 'export_map', a, '--output', exported, '--include', 'busy')

    def test_exporting_a_box(self):
        a, whole, part = self.path('boxed.bkm'), self.path('whole.ply'), self.path('part.ply')
        self.succeeds('map_sequence', '--sequence', self.drive, '--output', a)
        self.succeeds('export_map', a, '--output', whole)
        self.succeeds('export_map', a, '--output', part, '--box', '4 inf -inf -5 -inf -1')

        def records(path):
            with open(path, 'rb') as file:
                # Without the probabilities, whose last bit depends on the classes of the block.
                return list(struct.iter_unpack('<fff6s24x', file.read().split(b'end_header\n', 1)[1]))
        inside = [record for record in records(whole) if -5 <= record[0] <= 4 and record[2] <= -1]
        self.assertGreater(len(inside), 100)
        self.assertEqual(records(part), inside)
        self.fails('--box has 2 numbers', 'export_map', a, '--output', part, '--box', '1 2')
        self.fails('MB of memory, and the limit is 1 MB; ask for a smaller box, or raise the limit', 'export_map', a, '--output', part,
                   '--memory-limit', '1')
        self.succeeds('export_map', a, '--output', part, '--memory-limit', '0')

    def test_exporting_a_page(self):
        a, page, library = self.path('paged.bkm'), self.path('page.html'), self.path('three.js')
        self.succeeds('map_sequence', '--sequence', self.drive, '--output', a)
        with open(library, 'w') as file:
            file.write('var THREE = {};\n')
        three = ('--three-js', library)
        self.succeeds('export_map', a, '--html', page, '--trajectory', self.drive, *three)
        with open(page) as file:
            text = file.read()
        self.assertIn('var THREE = {};', text)
        header = json.loads(re.search(r'<script type="application/json" id="map">(.*?)</script>', text)[1])
        self.assertEqual((header['name'], header['frame']), ('paged', 'map'))
        self.assertEqual([drive['id'] for drive in header['drives']], ['drive/000000-000003'])
        self.assertEqual([len(trajectory['points']) for trajectory in header['trajectories']], [4])
        self.assertGreater(header['voxels']['free'], header['voxels']['occupied'])
        self.succeeds('export_map', a, '--output', page, '--include', 'occupied', '--box', '-5 -inf -inf 5 inf inf', *three)
        with open(page) as file:
            part = json.loads(re.search(r'<script type="application/json" id="map">(.*?)</script>', file.read())[1])
        self.assertEqual(part['voxels']['free'], 0)
        self.assertLess(part['voxels']['occupied'], header['voxels']['occupied'])
        self.fails('keep one', 'export_map', a, '--html', page, '--output', page, *three)
        self.fails('must end in .html', 'export_map', a, '--html', self.path('page.ply'), *three)
        self.fails('three.js is not in /no/such', 'export_map', a, '--html', page, '--three-js', '/no/such')
        self.fails('there is no voxel to show', 'export_map', a, '--html', page, '--box', '900 900 900 901 901 901', *three)
        self.fails('/no/such cannot be read; give a file of poses', 'export_map', a, '--html', page, '--trajectory', '/no/such', *three)

    def test_cleaned_points(self):
        kept = {}
        for mode in ('none', 'line'):
            result = self.succeeds('map_sequence', '--sequence', self.drive, '--points', self.path('points.pcd'), '--set',
                                   f'free_space/mode={mode}')
            kept[mode], points = map(int, re.search(r'points.pcd: (\d+) of (\d+) points\n', result.stdout).groups())
            self.assertEqual(points, sum(os.path.getsize(os.path.join(self.drive, 'velodyne', name)) // 16
                                         for name in os.listdir(os.path.join(self.drive, 'velodyne'))))
            content = read_bytes(self.path('points.pcd'))
            begin = content.index(b'DATA binary\n') + len(b'DATA binary\n')
            self.assertEqual(len(content) - begin, 21 * kept[mode])
        self.assertEqual(kept['none'], points)
        self.assertLess(kept['line'], points)
        self.assertGreater(kept['line'], points // 2)
        self.fails('must end in .pcd', 'map_sequence', '--sequence', self.drive, '--points', self.path('points.ply'))
        self.fails('cannot be written', 'map_sequence', '--sequence', self.drive, '--points', '/no/such/points.pcd')

    def poses_file(self, name, poses):
        """A file of poses without rotations, each x, y, z, as matrices."""
        with open(self.path(name), 'w') as file:
            file.writelines(f'1 0 0 {x!r} 0 1 0 {y!r} 0 0 1 {z!r}\n' for x, y, z in poses)
        return self.path(name)

    def stamped_file(self, name, poses):
        """The same with stamps, each seconds, (x, y, z)."""
        with open(self.path(name), 'w') as file:
            file.writelines(f'{seconds!r} {x!r} {y!r} {z!r} 0 0 0 1\n' for seconds, (x, y, z) in poses)
        return self.path(name)

    def true_and_drifted(self):
        """Positions of the scans that survive rounding to micrometres, and the same with a drift to the left; the drive is
        straight."""
        with open(os.path.join(self.drive, 'poses.txt')) as file:
            rows = [list(map(float, line.split())) for line in file]
        truth = [tuple(round(row[n] * 1024) / 1024 for n in (3, 7, 11)) for row in rows]
        return truth, [(x, y + 0.25 * n, z) for n, (x, y, z) in enumerate(truth)]

    KEPT = ('--config', 'robot', '--poses-in', 'lidar', '--journal', '0.01')

    def kept(self, name, poses, *more):
        """The map file of the drive with a journal."""
        return self.mapped(name, '--poses', poses, *self.KEPT, *more)

    def journal_of(self, path):
        """The figures of inspect_map, and what it prints of them."""
        printed = self.succeeds('inspect_map', path, '--json', self.path('journal.json')).stdout
        with open(self.path('journal.json')) as file:
            return json.load(file)['journal'], re.findall('^journal: .*$', printed, re.MULTILINE)

    def rows_of_journal(self, path):
        with contextlib.closing(sqlite3.connect(path)) as database:
            return database.execute('SELECT number, drive, stamp, settings, cleared, pose, tiles, content FROM scan '
                                    'JOIN scan_content USING (number) ORDER BY number').fetchall()

    def test_a_corrected_map_is_that_of_the_corrected_poses(self):
        true_poses, drifted_poses = self.true_and_drifted()
        truth, drifted = self.poses_file('truth.txt', true_poses), self.poses_file('drifted.txt', drifted_poses)
        wanted_file, wrong_file = self.kept('kept_true.bkm', truth), self.kept('kept_drifted.bkm', drifted)
        wanted, wrong = tiles_of(wanted_file), tiles_of(wrong_file)
        self.assertNotEqual(wanted, wrong)
        corrected = self.path('corrected.bkm')
        said = self.succeeds('correct_map', wrong_file, '--poses', truth, '--poses-in', 'lidar', '--output', corrected)
        self.assertEqual(said.stderr, '')
        self.assertRegex(said.stdout, r"corrected.bkm: 3 of 4 scans of drive 'drive/000000-000003' moved, the farthest by 0.75 m; "
                                      r'\d\d+ tiles changed, in [\d.]+ s\n$')
        self.assertTrue(tiles_of(corrected) == wanted, 'the map is not that of the true poses')
        self.assertTrue(tiles_of(wrong_file) == wrong, 'the file has changed in spite of --output')
        self.assertEqual(self.rows_of_journal(corrected), self.rows_of_journal(wanted_file))
        # In place, to and fro.
        for poses, expected, scans in ((truth, wanted, 3), (truth, wanted, 0), (drifted, wrong, 3)):
            said = self.succeeds('correct_map', wrong_file, '--poses', poses, '--poses-in', 'lidar').stdout
            self.assertIn(f'kept_drifted.bkm: {scans} of 4 scans', said)
            self.assertTrue(tiles_of(wrong_file) == expected, poses)
            self.succeeds('inspect_map', wrong_file)
        # With stamps, of which two suffice because the drift is even; sequences begin at 0 s.
        two = self.stamped_file('two.txt', [(0.0, true_poses[0]), (0.3000001, true_poses[3])])
        self.succeeds('correct_map', wrong_file, '--poses', two, '--output', corrected)
        self.assertTrue(tiles_of(corrected) == wanted, 'by stamps')
        # Of a camera, whose axes are others.
        camera, calib = self.poses_file('camera.txt', [(-y, -z, x) for x, y, z in true_poses]), self.path('of_camera.txt')
        with open(calib, 'w') as file:
            file.write('Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n')
        self.succeeds('correct_map', wrong_file, '--poses', camera, '--calib', calib, '--output', corrected)
        self.assertTrue(tiles_of(corrected) == wanted, 'of the camera')
        said = self.succeeds('correct_map', wrong_file, '--poses', truth, '--poses-in', 'lidar', '--tolerance', '0.6').stdout
        self.assertIn('1 of 4 scans', said)

    def test_the_journal_of_a_continued_map_is_kept(self):
        true_poses, drifted_poses = self.true_and_drifted()
        truth, drifted = self.poses_file('truth.txt', true_poses), self.poses_file('drifted.txt', drifted_poses)
        wanted = tiles_of(self.kept('kept_true.bkm', truth))
        front = self.kept('kept_front.bkm', drifted, '--scans', '2')
        both = self.kept('kept_both.bkm', drifted, '--first', '2', '--resume', front)
        without = self.mapped('kept_without.bkm', '--poses', drifted, *self.KEPT[:-2], '--first', '2', '--resume', front)
        self.assertEqual(self.rows_of_journal(without), self.rows_of_journal(front))
        # The file itself is continued: it is the same.
        self.kept('kept_front.bkm', drifted, '--first', '2', '--resume', front)
        self.assertEqual(self.rows_of_journal(front), self.rows_of_journal(both))
        self.assertEqual(tiles_of(front), tiles_of(both))
        figures, _ = self.journal_of(both)
        self.assertEqual((figures['scans'], figures['drives']), (4, 2))
        self.assertEqual([row[0] for row in self.rows_of_journal(both)], [0, 1, 2, 3])
        ends = self.poses_file('ends.txt', true_poses[2:])
        self.fails("has scans of 2 drives; name the one whose scans move (drive): 'drive/000000-000001', 'drive/000002-000003'",
                   'correct_map', both, '--poses', ends, '--poses-in', 'lidar')
        self.fails("has no scans of drive 'drive'; it has those of 'drive/000000-000001', 'drive/000002-000003'",
                   'correct_map', both, '--poses', ends, '--poses-in', 'lidar', '--drive', 'drive')
        self.assertIn('2 of 2 scans', self.succeeds('correct_map', both, '--poses', ends, '--poses-in', 'lidar', '--drive',
                                                    'drive/000002-000003').stdout)
        self.assertTrue(tiles_of(both) != wanted)
        start = self.poses_file('start.txt', true_poses[:2])
        self.assertIn('1 of 2 scans', self.succeeds('correct_map', both, '--poses', start, '--poses-in', 'lidar', '--drive',
                                                    'drive/000000-000001').stdout)
        self.assertTrue(tiles_of(both) == wanted, 'two drives were corrected, one after the other')

    def test_what_was_cleared_stays_cleared_when_scans_move(self):
        true_poses, drifted_poses = self.true_and_drifted()
        a = self.kept('kept_cleared.bkm', self.poses_file('drifted.txt', drifted_poses))
        self.succeeds('clear_map', a, '--box', '-inf -inf -inf inf inf inf')
        self.succeeds('correct_map', a, '--poses', self.poses_file('truth.txt', true_poses), '--poses-in', 'lidar')
        self.assertEqual(tiles_of(a), {})

    def test_a_journal_is_shown_and_forgotten(self):
        true_poses, _ = self.true_and_drifted()
        truth, small, big = self.poses_file('truth.txt', true_poses), self.path('small.bkm'), self.kept('big.bkm', self.path('truth.txt'))
        plain = self.mapped('plain.bkm', '--poses', truth, *self.KEPT[:-2])
        figures, lines = self.journal_of(big)
        size = sum(len(row[-1]) for row in self.rows_of_journal(big))
        self.assertEqual(figures, {'scans': 4, 'bytes': size, 'drives': 1})
        self.assertEqual(len(lines), 1)
        self.assertRegex(lines[0], rf'4 scans of 1 drive that can be moved, [\d.]+ MB, {size // 4} bytes a scan')
        self.assertEqual(self.journal_of(plain), ({'scans': 0, 'bytes': 0, 'drives': 0}, []))
        tiles = tiles_of(big)
        merged = self.succeeds('merge_maps', big, '--keep-drives', '--output', small)
        self.assertRegex(merged.stderr, r'^warning: \S*big.bkm has scans in its journal, which the merged map does not have')
        self.assertEqual(self.journal_of(small)[0]['scans'], 0)
        self.assertEqual(self.succeeds('merge_maps', big, '--output', small).stderr, '')
        self.assertEqual(self.journal_of(small)[0]['scans'], 4)
        said = f'4 scans of the journal forgotten, {size} bytes\n'
        self.assertEqual(self.succeeds('forget_journal', big, '--output', small).stdout, f'{small}: {said}')
        self.assertEqual(len(self.rows_of_journal(big)), 4)
        self.assertEqual(self.succeeds('forget_journal', big).stdout, f'{big}: {said}')
        for path in (small, big):
            self.assertEqual(tiles_of(path), tiles)
            self.assertEqual(self.journal_of(path), ({'scans': 0, 'bytes': 0, 'drives': 0}, []))
        self.assertLess(os.path.getsize(small), os.path.getsize(big) - size // 2)
        self.fails('has no scans in its journal', 'correct_map', big, '--poses', truth, '--poses-in', 'lidar')
        self.fails('must end in .bkm', 'forget_journal', big, '--output', self.path('map.ply'))
        self.fails('name one map file', 'forget_journal')

    def test_the_journal_reads_as_documented(self):
        """By docs/map_file.md alone."""
        true_poses, _ = self.true_and_drifted()
        a = self.kept('documented.bkm', self.poses_file('truth.txt', true_poses))
        with contextlib.closing(sqlite3.connect(a)) as database:
            rows = database.execute('SELECT scan.*, content FROM scan JOIN scan_content USING (number) ORDER BY number').fetchall()
            tiles = set(database.execute('SELECT z, y, x FROM tile'))
            self.assertEqual(database.execute('SELECT scans, settings, cleared FROM total').fetchone(), (4, 1, 0))
            (parameters,), = database.execute('SELECT parameters FROM settings')
            of_map, = database.execute('SELECT parameters FROM map').fetchone()
            self.assertTrue(parameters.startswith(of_map))
            self.assertRegex(parameters[len(of_map):], r'^\nclass_table:\n  airborne: ""\n  digest: \d+\n$')
        self.assertEqual(len(rows), 4)
        for n, row in enumerate(rows):
            *columns, checksum, content = row
            number, drive, stamp, sensor, settings, cleared, jump, reach, pose, odometry, touched, size, content_checksum = columns
            self.assertEqual((number, drive, stamp, sensor, settings, cleared, jump),
                             (n, 'drive/000000-000003', 1000000000 + 100000000 * n, '', 0, 0, 0))
            self.assertEqual((size, content_checksum), (len(content), zlib.crc32(content)))
            self.assertEqual(checksum, row_checksum(columns))
            x, y, z = true_poses[n]
            self.assertEqual(struct.unpack('<12d', pose), (1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z))
            self.assertEqual(odometry, pose)
            touched = touched_tiles(touched)
            self.assertEqual(touched, sorted(set(touched)))
            self.assertGreater(len(tiles & set(touched)), 10)
            hits, labels = unpacked(content)
            points = array.array('f')
            with open(os.path.join(self.drive, 'velodyne', f'{n:06}.bin'), 'rb') as file:
                points.frombytes(file.read())
            self.assertEqual(len(hits), len(points) // 4)
            for axis in range(3):
                self.assertLess(max(abs(0.01 * hit[axis] - point) for hit, point in zip(hits, points[axis::4])), 0.00501)
            self.assertAlmostEqual(reach, 0.01 * max(math.dist(hit, (0, 0, 0)) for hit in hits), places=9)
            with open(os.path.join(self.drive, 'labels', f'{n:06}.label'), 'rb') as file:
                self.assertEqual(labels, [label for label, in struct.iter_unpack('<I', file.read())])
        self.assertLessEqual(tiles, {tile for row in rows for tile in touched_tiles(row[10])})

    def test_points_of_the_journal_are_exported(self):
        true_poses, drifted_poses = self.true_and_drifted()
        a = self.kept('pointed.bkm', self.poses_file('drifted.txt', drifted_poses))
        self.succeeds('correct_map', a, '--poses', self.poses_file('truth.txt', true_poses), '--poses-in', 'lidar')
        expected, raw = [], []
        for n, place in enumerate(true_poses):
            hits, labels = unpacked(self.rows_of_journal(a)[n][-1])
            expected += [tuple(0.01 * hit[axis] + place[axis] for axis in range(3)) for hit in hits]
            raw += labels
        ply, pcd = self.path('points.ply'), self.path('points.pcd')
        said = self.succeeds('export_map', a, '--points', ply).stdout
        self.assertEqual(said, f'{ply}: {len(expected)} points of 4 scans, in frame map\n')
        self.succeeds('export_map', a, '--points', pcd)
        header, _, data = self.content('points.ply').partition(b'end_header\n')
        self.assertIn(f'element vertex {len(expected):010}\nproperty float x\n'.encode(), header)
        of_ply = list(struct.iter_unpack('<fff3sIB', data))
        header, _, data = self.content('points.pcd').partition(b'DATA binary\n')
        self.assertIn(f'POINTS {len(expected):010}\n'.encode(), header)
        of_pcd = list(struct.iter_unpack('<fffIIB', data))
        self.assertEqual(len(of_ply), len(expected))
        self.assertEqual([point[4] for point in of_ply], raw)
        for place, (*point, color, label, number), of_other in zip(expected, of_ply, of_pcd):
            self.assertLess(math.dist(place, point), 1e-4)
            self.assertEqual(of_other, (*point, int.from_bytes(color, 'big'), label, number))
        building = {(color, number) for *_, color, label, number in of_ply if label == 50}
        self.assertEqual(building, {(bytes((255, 200, 0)), 13)})
        self.succeeds('export_map', a, '--points', ply, '--box', '0 0 -inf inf inf inf')
        _, _, data = self.content('points.ply').partition(b'end_header\n')
        self.assertEqual(list(struct.iter_unpack('<fff3sIB', data)), [point for point in of_ply if min(point[:2]) >= 0])
        far = self.kept('far.bkm', self.poses_file('far.txt', [(x + 512000, y - 4096000, z) for x, y, z in true_poses]))
        self.succeeds('export_map', far, '--points', ply)
        header, _, data = self.content('points.ply').partition(b'end_header\n')
        self.assertIn(b'property double x\n', header)
        for place, (x, y, z, *_) in zip(expected, struct.iter_unpack('<ddd3sIB', data)):
            self.assertLess(math.dist(place, (x - 512000, y + 4096000, z)), 1e-4)
        self.succeeds('export_map', far, '--points', pcd)
        header, _, data = self.content('points.pcd').partition(b'DATA binary\n')
        self.assertIn(b'VIEWPOINT 512000 -4096000 0 1 0 0 0\n', header)
        for place, (x, y, z, *_) in zip(expected, struct.iter_unpack('<fffIIB', data)):
            self.assertLess(math.dist(place, (x, y, z)), 1e-4)
        self.fails('has no scans in its journal, and so no points', 'export_map', self.mapped('plain.bkm'), '--points', ply)
        self.fails('must end in .ply or .pcd', 'export_map', a, '--points', self.path('points.las'))
        self.fails('--output cannot be given with --points', 'export_map', a, '--points', ply, '--output', pcd)

    def test_stamps_of_scans_of_a_node_are_those_of_the_poses(self):
        true_poses, drifted_poses = self.true_and_drifted()
        wanted = tiles_of(self.kept('kept_true.bkm', self.poses_file('truth.txt', true_poses)))
        a = self.kept('of_node.bkm', self.poses_file('drifted.txt', drifted_poses))

        def set_sensors(*names):
            with contextlib.closing(sqlite3.connect(a)) as database:
                for number, name in enumerate(names):
                    *columns, checksum = database.execute('SELECT * FROM scan WHERE number = ?', (number,)).fetchone()
                    columns[3] = name
                    database.execute('UPDATE scan SET sensor = ?, checksum = ? WHERE number = ?', (name, row_checksum(columns), number))
                    database.execute('UPDATE total SET checksums = checksums + ?', (row_checksum(columns) - checksum,))
                *totals, _ = database.execute('SELECT * FROM total').fetchone()
                database.execute('UPDATE total SET checksum = ?', (row_checksum(totals),))
                database.commit()
        two = self.stamped_file('two.txt', [(1.0, true_poses[0]), (1.3, true_poses[3])])
        set_sensors('front', 'rear', 'rear', 'rear')
        self.fails("the drive has scans of several sensors, 'front' and 'rear', and poses with stamps are of one; give a matrix for each scan",
                   'correct_map', a, '--poses', two)
        set_sensors('front', 'front', 'front', 'front')
        self.succeeds('correct_map', a, '--poses', two)
        self.assertTrue(tiles_of(a) == wanted)

    def test_corrections_that_are_refused(self):
        true_poses, drifted_poses = self.true_and_drifted()
        truth = self.poses_file('truth.txt', true_poses)
        a = self.kept('kept_refused.bkm', self.poses_file('drifted.txt', drifted_poses))
        before = self.content('kept_refused.bkm')
        lidar = ('--poses-in', 'lidar')
        self.fails('--poses FILE is missing', 'correct_map', a)
        self.fails('name one map file', 'correct_map', '--poses', truth)
        self.fails('missing.txt cannot be read', 'correct_map', a, '--poses', self.path('missing.txt'), *lidar)
        self.fails("three.txt has 3 poses, but drive 'drive/000000-000003' has 4 scans in the journal; give a pose for each",
                   'correct_map', a, '--poses', self.poses_file('three.txt', true_poses[:3]), *lidar)
        self.fails('calib.txt cannot be read; poses of the camera need calib.txt', 'correct_map', a, '--poses', truth)
        self.fails("--poses-in 'radar' is unknown", 'correct_map', a, '--poses', truth, '--poses-in', 'radar')
        self.fails('late.txt has a stamp among those of the scans, from 0 to 0.3 s', 'correct_map', a, '--poses',
                   self.stamped_file('late.txt', [(1.0, true_poses[0]), (1e12, true_poses[1])]))
        self.fails('must be', 'correct_map', a, '--poses', truth, '--tolerance', '-1')
        self.fails('must end in .bkm', 'correct_map', a, '--poses', truth, *lidar, '--output', self.path('map.ply'))
        self.fails('cannot be opened', 'correct_map', self.path('missing.bkm'), '--poses', truth, *lidar)
        self.fails('1 scan of drive', 'correct_map', a, *lidar, '--poses',
                   self.poses_file('far.txt', [*true_poses[:3], (1e11, 0.0, 0.0)]))
        plain = self.mapped('plain.bkm')
        self.fails('plain.bkm has no scans in its journal; map them again with a journal', 'correct_map', plain, '--poses', truth, *lidar)
        old = shutil.copy(os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'test', 'store', 'data', 'version_3.bkm'), self.folder)
        self.fails('has no journal of scans, since it has an older version of the format', 'correct_map', old, '--poses', truth, *lidar)
        self.assertEqual(self.content('kept_refused.bkm'), before)
        with contextlib.closing(sqlite3.connect(a)) as database:
            database.execute("UPDATE scan_content SET content = X'00' WHERE number = 2")
            database.commit()
        tiles = tiles_of(a)
        self.fails('the checksum of scan 2 is wrong', 'correct_map', a, '--poses', truth, *lidar)
        self.fails('the checksum of scan 2 is wrong', 'inspect_map', a)
        self.assertEqual(tiles_of(a), tiles)

    def test_migrating(self):
        a, copy = self.map_of('a.bkm', 0, 1), self.path('copy.bkm')
        self.assertIn('version 6, from version 6', self.succeeds('migrate_map', a, copy).stdout)
        first = os.path.join(os.environ['BKI_MAPPING_SOURCE_DIR'], 'test', 'store', 'data', 'version_1.bkm')
        self.assertIn('version 6, from version 1', self.succeeds('migrate_map', first, self.path('second.bkm')).stdout)
        self.assertEqual(tiles_of(copy), tiles_of(a))
        self.fails('exists already', 'migrate_map', a, copy)
        self.fails('needs two files', 'migrate_map', a)
        self.fails('must end in .bkm', 'migrate_map', a, self.path('copy.db'))
        self.fails('is not a map', 'migrate_map', os.path.join(self.drive, 'poses.txt'), self.path('never.bkm'))

    def test_occupancy_table_maps_everything_as_one_class(self):
        report = self.path('one.json')
        call('map_sequence', '--sequence', self.drive, '--classes', 'occupancy', '--report', report)
        counts = read_json(report)['voxels_by_class']
        self.assertEqual(list(counts), ['occupied'])
        self.assertGreater(counts['occupied'], 1000)


if __name__ == '__main__':
    unittest.main()
