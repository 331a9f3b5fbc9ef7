#!/usr/bin/env python3
"""Queries of a map in Python equal a search through all its voxels, and answer wrong input in one sentence."""
import gc
import itertools
import math
import os
import signal
import sys
import threading
import time
import unittest

import numpy as np

import bki_mapping as bki

CAR, ROAD, BUILDING = 10, 40, 50  # raw labels of SemanticKITTI
STATES = (bki.UNKNOWN, bki.FREE, bki.OCCUPIED, bki.OCCLUDED)


def scene(seed):
    """Hits around a sensor: a road, a wall, and a car."""
    random = np.random.default_rng(seed)
    road = random.uniform([-5, -5, -1.01], [5, 5, -1], (600, 3))
    wall = random.uniform([-5, 4, -1], [5, 4.1, 1.5], (300, 3))
    car = random.uniform([2, -2, -1], [3.5, -1, 0.2], (100, 3))
    labels = np.repeat(np.array([ROAD, BUILDING, CAR], np.uint32), [len(road), len(wall), len(car)])
    return np.concatenate([road, wall, car]).astype(np.float32), labels


def mapper_of(*seeds, **settings):
    mapper = bki.SemanticMapper('semantic_kitti', occlusion='all', threads=2, **settings)
    for seed in seeds:
        mapper.integrate((0.1 * seed, 0, 0.05), *scene(seed))
    return mapper


class Voxels:
    """States and labels of all voxels of a map and of some around it, by z, y, x; from Map.voxels."""

    def __init__(self, map_, margin=12):
        self.edge = map_.resolution
        blocks = map_.blocks
        self.first = 8 * blocks.min(axis=0) - margin  # index of the first voxel: x, y, z
        size = 8 * (blocks.max(axis=0) + 1) + margin - self.first
        self.states = np.full(size[::-1], bki.UNKNOWN, np.uint8)
        self.labels = np.full(size[::-1], bki.FREE_CLASS, np.uint8)
        voxels = map_.voxels('occupied,free,occluded')
        places = tuple(np.floor(voxels[axis] / self.edge).astype(int) - self.first[a] for a, axis in enumerate('xyz'))[::-1]
        self.states[places], self.labels[places] = voxels['state'], voxels['label']
        self.indices = np.stack(np.meshgrid(*(np.arange(n) for n in size), indexing='ij'), axis=-1).transpose(2, 1, 0, 3) + self.first
        self.centres = (self.indices + 0.5) * self.edge

    def at(self, indices):
        """States and labels of voxels by index; unknown outside."""
        place = np.asarray(indices) - self.first
        inside = ((place >= 0) & (place < self.states.shape[::-1])).all(axis=-1)
        place = tuple(np.where(inside[..., None], place, 0)[..., (2, 1, 0)].reshape(-1, 3).T)
        shape = inside.shape
        return (np.where(inside, self.states[place].reshape(shape), bki.UNKNOWN),
                np.where(inside, self.labels[place].reshape(shape), bki.FREE_CLASS))

    def is_unknown(self):
        return np.isin(self.states, (bki.UNKNOWN, bki.OCCLUDED))

    def obstacles(self, classes, unknown=False):
        found = (self.states == bki.OCCUPIED) & np.isin(self.labels, classes)
        return found | self.is_unknown() if unknown else found


class WithMap(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.map = mapper_of(1, 2).map
        cls.voxels = Voxels(cls.map)
        cls.id_of = {c.name: c.id for c in cls.map.classes}
        cls.ids = list(cls.id_of.values())
        cls.random = np.random.default_rng(7)
        # The scene is worth asking: all states, and three classes.
        assert set(np.unique(cls.voxels.states)) == set(STATES)
        assert {cls.id_of[name] for name in ('car', 'road', 'building')} <= set(cls.voxels.labels[cls.voxels.states == bki.OCCUPIED])

    def points(self, count, reach=6.0):
        return self.random.uniform([-reach, -reach, -2.5], [reach, reach, 2.5], (count, 3))

    def filters(self):
        """Filters as one may write them, and the ids that they mean."""
        classes, i = self.map.classes, self.id_of
        rest = [c for c in self.ids if c not in (i['road'], i['sidewalk'])]
        return ((None, self.ids), ('car', [i['car']]), (i['road'], [i['road']]), (['car', i['building']], [i['car'], i['building']]),
                (classes['car'], [i['car']]), (np.array([i['road']], np.uint8), [i['road']]), ([], []),
                (classes.all_but(['road', 'sidewalk']), rest), (classes.only(classes[n] for n in ('car', 'road')), [i['car'], i['road']]))


class Points(WithMap):
    def test_one_call_gives_what_all_functions_give(self):
        for points in (self.points(3000), self.points(3000).astype(np.float32), self.points(3000)[::2]):
            said = self.map.query(points)
            states, labels = self.voxels.at(np.floor(points.astype(float) / self.voxels.edge).astype(int))
            np.testing.assert_array_equal(said['state'], states)
            np.testing.assert_array_equal(said['label'], labels)
            for field, function in (('state', 'states'), ('label', 'labels'), ('probability', 'probabilities'), ('variance', 'variances'),
                                    ('occupancy', 'occupancies'), ('class_probability', 'class_probabilities')):
                np.testing.assert_array_equal(said[field], getattr(self.map, function)(points))
            self.assertEqual(set(said.dtype.names), {'state', 'label', 'probability', 'variance', 'occupancy', 'class_probability'})

    def test_fields(self):
        points = self.points(5000)
        voxels = self.map.voxels('occupied,free')
        centres = np.stack([voxels[axis] for axis in 'xyz'], axis=1)
        names = ['state', 'label', 'probability', 'variance', 'occupancy', 'class_probability', 'evidence', 'entropy']
        said = self.map.query(centres, names)
        self.assertEqual(list(said.dtype.names), names)
        for name in names:
            np.testing.assert_allclose(said[name], voxels[name], rtol=1e-5, atol=1e-6)
        whole = self.map.query(points, names)
        for wanted in (['entropy'], 'evidence', 'label,occupancy', ['variance', 'state', 'evidence'], names[::-1]):
            part = self.map.query(points, wanted)
            self.assertEqual(list(part.dtype.names), wanted if isinstance(wanted, list) else wanted.split(','))
            for name in part.dtype.names:
                np.testing.assert_array_equal(part[name], whole[name], name)
        self.assertEqual(self.map.query(np.zeros((0, 3))).shape, (0,))
        far = self.map.query([[1e12, 0, 0]], names)
        self.assertEqual((far['state'][0], far['label'][0], far['evidence'][0]), (bki.UNKNOWN, bki.FREE_CLASS, 0))

    def test_voxels_and_planes_say_the_same(self):
        prior, free = self.map.prior, bki.FREE_CLASS
        known = 0
        for index in self.map.blocks:
            block = self.map.block(index)
            voxels = 8 * index + np.stack(np.meshgrid(*[np.arange(8)] * 3, indexing='ij'), axis=-1).transpose(2, 1, 0, 3)
            states, labels = self.voxels.at(voxels)
            alpha = {int(c): prior + np.maximum(block.plane(c), 0) * bki.EVIDENCE_UNIT for c in block.classes}
            if not alpha:
                self.assertLessEqual(set(states.ravel()), {bki.UNKNOWN, bki.OCCLUDED})
                continue
            of_classes = [c for c in alpha if c != free]
            best = np.max([alpha[c] for c in of_classes], axis=0) if of_classes else np.full((8, 8, 8), prior)
            occupied = states == bki.OCCUPIED
            known += occupied.sum()
            np.testing.assert_array_equal(occupied, (best > prior) & (best >= alpha.get(free, prior)))
            for c in of_classes:
                self.assertTrue((alpha[c][occupied & (labels == c)] == best[occupied & (labels == c)]).all())
        self.assertEqual(known, len(self.map.voxels()))


class Rays(WithMap):
    def along(self, origin, direction, length):
        """The voxels that a ray crosses, in order, and where it enters each [m]."""
        unit = direction / np.linalg.norm(direction)
        cuts = [0.0, length]
        for axis in range(3):
            ends = sorted([origin[axis], origin[axis] + length * unit[axis]])
            planes = np.arange(math.floor(ends[0] / self.voxels.edge), math.ceil(ends[1] / self.voxels.edge) + 1) * self.voxels.edge
            cuts.extend((planes - origin[axis]) / unit[axis])
        cuts = np.unique([cut for cut in cuts if 0 <= cut <= length])
        middles = origin + unit * (0.5 * (cuts[1:] + cuts[:-1]))[:, None]
        return np.floor(middles / self.voxels.edge).astype(int), cuts[:-1]

    def cast(self, origin, direction, length, ids, stop_at_unknown):
        """What cast_rays should say."""
        indices, entered = self.along(origin, direction, length)
        states, labels = self.voxels.at(indices)
        first_unknown = math.inf
        for index, at, state, label in zip(indices, entered, states, labels):
            if state == bki.OCCUPIED and label in ids:
                return bki.RAY_OCCUPIED, label, index, at, first_unknown
            if state in (bki.UNKNOWN, bki.OCCLUDED) and first_unknown == math.inf:
                first_unknown = at
                if stop_at_unknown:
                    return bki.RAY_UNKNOWN, bki.FREE_CLASS, index, at, first_unknown
        return bki.RAY_NOTHING, bki.FREE_CLASS, None, length, first_unknown

    def test_equals_a_walk_through_all_voxels(self):
        ends = set()
        for classes, ids in self.filters():
            for unknown in (False, True):
                count = 60
                origins, directions = self.points(count, 3.0), self.random.normal(size=(count, 3))
                lengths = self.random.uniform(0.5, 9.0, count)
                hits = self.map.cast_rays(origins, directions, lengths, classes, unknown)
                for n in range(count):
                    end, label, voxel, length, first_unknown = self.cast(origins[n], directions[n], lengths[n], ids, unknown)
                    with self.subTest(classes=classes, unknown=unknown, n=n):
                        self.assertEqual((hits['end'][n], hits['label'][n]), (end, label))
                        np.testing.assert_allclose([hits['length'][n], hits['first_unknown'][n]], [length, first_unknown], atol=1e-9)
                        if voxel is not None:
                            np.testing.assert_array_equal(hits['voxel'][n], voxel)
                    ends.add(end)
        self.assertEqual(ends, {bki.RAY_NOTHING, bki.RAY_OCCUPIED, bki.RAY_UNKNOWN})

    def test_one_origin_and_layouts(self):
        directions = self.random.normal(size=(500, 3)).astype(np.float32)
        origin = (0.1, 0.0, 0.05)
        one = self.map.cast_rays(origin, directions)
        for same in (self.map.cast_rays(np.tile(origin, (500, 1)), directions), self.map.cast_rays(origin, directions.astype(float)),
                     self.map.cast_rays(origin, np.asfortranarray(directions), np.full(500, math.inf), stop_at_unknown=False)):
            np.testing.assert_array_equal(one, same)
        self.assertTrue((one['length'][one['end'] == bki.RAY_NOTHING] == math.inf).all())
        self.assertGreater(np.count_nonzero(one['end'] == bki.RAY_OCCUPIED), 100)
        self.assertEqual(self.map.cast_rays(np.zeros((0, 3)), np.zeros((0, 3))).shape, (0,))


class Shapes(WithMap):
    def expect(self, content, overlaps, order=()):
        states, labels = self.voxels.states[overlaps], self.voxels.labels[overlaps]
        counts = [np.count_nonzero(states == s) for s in STATES]
        self.assertEqual((content['free'], content['occupied'], content['unknown']), (counts[1], counts[2], counts[0] + counts[3]))
        self.assertEqual((content['is_free'], content['is_known']), (content['occupied'] + content['unknown'] == 0, content['unknown'] == 0))
        present = set(labels[states == bki.OCCUPIED])
        self.assertEqual(set(np.nonzero(content['classes'])[0]), present)
        self.assertEqual(content['worst'], next((c for c in order if c in present), bki.FREE_CLASS))
        return present

    def corners(self):
        return self.voxels.indices * self.voxels.edge, (self.voxels.indices + 1) * self.voxels.edge

    def test_boxes(self):
        centres, half = self.points(40, 4.0), self.random.uniform(0.05, 1.5, (40, 3))
        order = ['building', self.map.classes['car'], self.id_of['road']]
        contents = self.map.box_contents(centres - half, centres + half, order)
        low, high = self.corners()
        seen = set()
        for n in range(40):
            overlaps = ((low < (centres + half)[n]) & (high > (centres - half)[n])).all(axis=-1)
            seen |= self.expect(contents[n], overlaps, [self.id_of['building'], self.id_of['car'], self.id_of['road']])
        self.assertGreaterEqual(len(seen), 3)

    def test_spheres(self):
        centres, radii = self.points(40, 4.0), self.random.uniform(0.1, 1.5, 40)
        low, high = self.corners()

        def overlaps(n, radius):
            return np.linalg.norm(np.maximum(0, np.maximum(low - centres[n], centres[n] - high)), axis=-1) < radius
        for contents, all_radii in ((self.map.sphere_contents(centres, radii), radii), (self.map.sphere_contents(centres, 0.7), np.full(40, 0.7))):
            for n in range(40):
                self.expect(contents[n], overlaps(n, all_radii[n]))

    def test_a_vehicle_along_a_path(self):
        half, centre = np.array([0.9, 0.4, 0.3]), np.array([0.3, 0.0, 0.1])
        poses = np.tile(np.eye(4), (30, 1, 1))
        for n, pose in enumerate(poses):
            axis = self.random.normal(size=3) if n % 2 else np.array([0.0, 0.0, 1.0])
            axis /= np.linalg.norm(axis)
            cross = np.cross(np.eye(3), axis)
            angle = self.random.uniform(-3, 3)
            pose[:3, :3] = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
        poses[:, :3, 3] = self.points(30, 3.0)
        contents = self.map.contents_along(poses, half, centre, order='car')
        voxels = self.voxels.centres.reshape(-1, 3)
        for n, pose in enumerate(poses):
            # Two boxes overlap unless their projections are apart on an axis of one of them, or across two.
            turned = pose[:3, :3]
            offset = voxels - (pose[:3, 3] + turned @ centre)
            overlaps = np.ones(len(voxels), bool)
            crosses = [np.cross(a, b) for a in np.eye(3) for b in turned.T]
            for axis in [*np.eye(3), *turned.T, *(c for c in crosses if np.linalg.norm(c) > 1e-9)]:
                reach = 0.5 * self.voxels.edge * np.abs(axis).sum() + np.abs(turned.T @ axis) @ half
                overlaps &= np.abs(offset @ axis) < reach
            self.expect(contents[n], overlaps.reshape(self.voxels.states.shape), [self.id_of['car']])


class Nearest(WithMap):
    def test_no_other_is_nearer(self):
        points = self.points(200, 5.0)
        for classes, ids in self.filters():
            for most in (math.inf, 1.0):
                obstacles = self.voxels.obstacles(ids)
                centres, labels = self.voxels.centres[obstacles], self.voxels.labels[obstacles]
                for given in (points, points.astype(np.float32)):
                    found = self.map.nearest_obstacles(given, classes, most)
                    for n, point in enumerate(given.astype(float)):
                        distances = np.linalg.norm(centres - point, axis=1)
                        if len(distances) == 0 or distances.min() > most:
                            self.assertEqual((found['distance'][n], found['label'][n]), (math.inf, bki.FREE_CLASS))
                            continue
                        self.assertAlmostEqual(found['distance'][n], distances.min(), places=9)
                        chosen = np.linalg.norm((found['voxel'][n] + 0.5) * self.voxels.edge - centres, axis=1).argmin()
                        self.assertAlmostEqual(distances[chosen], distances.min(), places=9)
                        self.assertEqual(found['label'][n], labels[chosen])


class Sections(WithMap):
    def expect(self, section, shape):
        self.assertEqual((section.states.shape, section.labels.shape, section.centres.shape), (shape, shape, (*shape, 3)))
        rows, columns = np.indices(shape)[..., None] + 0.5
        centres = section.origin + section.resolution * (columns * section.right + rows * section.up)
        np.testing.assert_allclose(section.centres, centres, atol=1e-12)
        states, labels = self.voxels.at(np.floor(centres / self.voxels.edge).astype(int))
        np.testing.assert_array_equal(section.states, states)
        np.testing.assert_array_equal(section.labels, labels)
        self.assertGreater(len(np.unique(section.states)), 2)

    def test_horizontal(self):
        section = self.map.horizontal_section(-0.95, (-4.4, -3.1), (3.5, 4.5))
        low, high = np.floor(np.array([-4.4, -3.1]) / 0.3), np.ceil(np.array([3.5, 4.5]) / 0.3)
        self.expect(section, (int(high[1] - low[1]), int(high[0] - low[0])))
        np.testing.assert_allclose(section.origin[:2], 0.3 * low)
        self.assertEqual((section.right.tolist(), section.up.tolist(), section.resolution), ([1, 0, 0], [0, 1, 0], self.map.resolution))

    def test_vertical(self):
        start, end = np.array([-3.0, -4.03]), np.array([3.3, 4.71])
        section = self.map.vertical_section(start, end, -1.65, 1.65)
        self.expect(section, (12, math.ceil(np.linalg.norm(end - start) / 0.3)))
        np.testing.assert_allclose(section.right[:2], (end - start) / np.linalg.norm(end - start))

    def test_arrays_are_views_that_keep_the_section(self):
        states = self.map.horizontal_section(0, (-3, -3), (3, 3)).states
        gc.collect()
        np.testing.assert_array_equal(states, self.map.horizontal_section(0, (-3, -3), (3, 3)).states)
        self.assertFalse(states.flags.owndata or states.flags.writeable)


class Frontiers(WithMap):
    def clusters(self, among=True):
        """`among`: which voxels count."""
        free, unknown = self.voxels.states == bki.FREE, self.voxels.is_unknown()
        beside = np.zeros_like(free)
        for axis, step in itertools.product(range(3), (-1, 1)):
            beside |= np.roll(unknown, step, axis)  # nothing is known at the margins
        left = {tuple(index) for index in self.voxels.indices[free & beside & among]}
        steps = [np.array(step) for step in itertools.product((-1, 0, 1), repeat=3)]
        found = []
        while left:
            cluster = [left.pop()]
            for voxel in cluster:
                for step in steps:
                    beside = tuple(voxel + step)
                    if beside in left:
                        left.remove(beside)
                        cluster.append(beside)
            found.append(sorted(cluster, key=lambda v: v[::-1]))
        return sorted(found, key=lambda c: (-len(c), c[0][::-1]))

    def test_clusters(self):
        expected = self.clusters()
        self.assertGreater(len(expected), 2)
        for least in (0, 1, 4):
            kept = [cluster for cluster in expected if len(cluster) >= least]
            found, voxels = self.map.frontiers(least, return_voxels=True)
            self.assertEqual(found['size'].tolist(), [len(cluster) for cluster in kept])
            np.testing.assert_array_equal(voxels, np.concatenate(kept))
            np.testing.assert_allclose(found['centre'], [(np.mean(c, axis=0) + 0.5) * self.voxels.edge for c in kept], atol=1e-9)
            np.testing.assert_array_equal(self.map.frontiers(min_size=least), found)
        self.assertEqual(self.map.frontiers(10**9).shape, (0,))

    def test_box(self):
        lower, upper = np.array([-1.0, -1.7, -0.5]), np.array([1.3, 1.5, 1.1])
        indices, edge = self.voxels.indices, self.voxels.edge
        inside = ((indices + 1) * edge > lower).all(axis=-1) & (indices * edge < upper).all(axis=-1)
        expected = self.clusters(inside)
        self.assertNotEqual(expected, self.clusters())
        found, voxels = self.map.frontiers(return_voxels=True, lower=lower, upper=upper)
        np.testing.assert_array_equal(voxels, np.concatenate(expected))
        np.testing.assert_array_equal(self.map.frontiers(lower=lower, upper=upper), found)


class Distances(WithMap):
    LOWER, UPPER = np.array([1.6, -2.2, -1.6]), np.array([3.7, 4.3, 1.1])

    def expected(self, voxels, ids, unknown, lower=LOWER, upper=UPPER):
        """The signed distances of a box, and the index of its first voxel."""
        edge = voxels.edge
        low, high = np.floor(lower / edge).astype(int), np.ceil(upper / edge).astype(int)
        place = tuple(slice(low[a] - voxels.first[a], high[a] - voxels.first[a]) for a in (2, 1, 0))
        obstacles = voxels.obstacles(ids, unknown)[place]
        centres = voxels.centres[place]

        def to_nearest(of):
            if not of.any():
                return np.full(of.shape, math.inf)
            return np.sqrt([[((centres[of] - c) ** 2).sum(axis=1).min() for c in row] for row in centres.reshape(of.shape[0], -1, 3)]).reshape(of.shape)
        return np.where(obstacles, edge - to_nearest(~obstacles), to_nearest(obstacles)), low

    def test_equals_the_search_for_the_nearest(self):
        signs = set()
        for classes, ids in self.filters():
            for unknown in (False, True):
                field = self.map.distance_field(self.LOWER, self.UPPER, classes, unknown)
                expected, low = self.expected(self.voxels, ids, unknown)
                self.assertEqual(field.values.shape, expected.shape)
                np.testing.assert_allclose(field.values, expected, atol=1e-5, err_msg=f'{classes}')
                np.testing.assert_allclose(field.origin, low * self.map.resolution)
                self.assertEqual(field.resolution, self.map.resolution)
                signs |= set(np.sign(field.values).ravel())
        self.assertEqual(signs, {-1, 0, 1})

    def test_between_voxels(self):
        field = self.map.distance_field(self.LOWER, self.UPPER, self.map.classes.all_but('road'))
        edge, values = field.resolution, field.values
        points = self.random.uniform(self.LOWER + 0.5, self.UPPER - 0.5, (500, 3))
        for given in (points, points.astype(np.float32)):
            distances, gradients = field.at(given)
            at = (given.astype(float) - field.origin) / edge - 0.5
            first = np.floor(at).astype(int)
            share = at - first
            expected, slope = np.zeros(len(at)), np.zeros((len(at), 3))
            for x, y, z in itertools.product((0, 1), repeat=3):
                corner = values[first[:, 2] + z, first[:, 1] + y, first[:, 0] + x].astype(float)
                weights = np.where(np.array([x, y, z]) == 1, share, 1 - share)
                expected += weights.prod(axis=1) * corner
                for axis, up in enumerate((x, y, z)):
                    slope[:, axis] += (1 if up else -1) * np.delete(weights, axis, axis=1).prod(axis=1) * corner / edge
            np.testing.assert_allclose(distances, expected, atol=2e-6)
            np.testing.assert_allclose(gradients, slope, atol=2e-5)
        outside = [self.UPPER + 1, self.LOWER - 1, [math.nan, 0, 0], [0, math.inf, 0]]
        for part in field.at(outside):
            self.assertTrue(np.isnan(part).all())
        nothing = self.map.distance_field(self.LOWER, self.UPPER, 'bicycle')
        self.assertTrue((nothing.values == math.inf).all())
        distance, gradient = nothing.at([[2.5, 0, 0]])
        self.assertEqual((distance[0], gradient.tolist()), (math.inf, [[0, 0, 0]]))

    def test_follows_a_map(self):
        mapper = mapper_of(1)
        field = mapper.map.distance_field(self.LOWER, self.UPPER, unknown=True)
        view, before = field.values, field.values.copy()
        self.assertFalse(view.flags.owndata or view.flags.writeable)
        for seed in (2, 3):
            mapper.integrate((0.3 * seed, 0.1, 0.1), *scene(seed))
            field.update(mapper.map, mapper.touched_blocks)
            np.testing.assert_array_equal(field.values, mapper.map.distance_field(self.LOWER, self.UPPER, unknown=True).values)
        np.testing.assert_array_equal(view, field.values)  # the same memory
        self.assertGreater(np.count_nonzero(view != before), 10)
        changed = mapper.clear_box((-9, -9, -9), (0, 9, 9)).astype(np.int64)
        field.update(mapper.map, changed[::-1])
        np.testing.assert_array_equal(view, mapper.map.distance_field(self.LOWER, self.UPPER, unknown=True).values)

    def test_moves_with_a_robot(self):
        for keeps_array in (False, True):
            field = self.map.distance_field(self.LOWER, self.UPPER, 'building')
            kept = field.values if keeps_array else None
            before = field.values.copy()
            address = field.values.ctypes.data
            field.compute(self.map, self.LOWER + 0.9, self.UPPER + 0.6)
            self.assertEqual(field.values.ctypes.data == address, not keeps_array)
            fresh = self.map.distance_field(self.LOWER + 0.9, self.UPPER + 0.6, 'building')
            np.testing.assert_array_equal(field.values, fresh.values)
            np.testing.assert_array_equal(field.origin, fresh.origin)
            if keeps_array:
                np.testing.assert_array_equal(kept, before)
                del field
                gc.collect()
                np.testing.assert_array_equal(kept, before)


class ClassFilters(WithMap):
    def test_sets(self):
        classes = self.map.classes
        for given, ids in self.filters():
            if given is None or isinstance(given, bki.ClassFilter):
                continue
            only, rest = classes.only(given), classes.all_but(given)
            self.assertEqual(only.ids.tolist(), [c.id for c in classes if c.id in ids])
            self.assertEqual(only.names, [c.name for c in classes if c.id in ids])
            self.assertEqual(set(only.ids) | set(rest.ids), set(self.ids))
            self.assertEqual((len(only), len(rest)), (len(ids), len(classes) - len(ids)))
        ground = classes.only([c for c in classes if 'ground' in c.flags])
        self.assertTrue('road' in ground and classes['road'] in ground and self.id_of['road'] in ground)
        self.assertFalse('car' in ground or 'cars' in ground)
        self.assertEqual(classes.all_but(ground).ids.tolist(), [c.id for c in classes if c not in ground])
        self.assertRegex(repr(ground), r'of the \d+ classes of .semantic_kitti.')


class Threads(WithMap):
    def runs_meanwhile(self, call):
        """Whether this thread runs while another one is in a call."""
        started, end = threading.Event(), []

        def run():
            started.set()
            call()
            end.append(time.monotonic())
        thread = threading.Thread(target=run)
        thread.start()
        started.wait()
        mine = time.monotonic()
        thread.join()
        return mine < end[0]

    def test_queries_release_the_gil(self):
        interval = sys.getswitchinterval()
        self.addCleanup(sys.setswitchinterval, interval)
        sys.setswitchinterval(1000.0)  # so that no thread has to yield
        half, many = np.array([60.0, 60.0, 8.0]), self.points(2_000_000)
        origins, directions, some = many[:300_000].copy(), many[300_000:600_000].copy(), many[:500_000].copy()
        self.assertFalse(self.runs_meanwhile(lambda: sum(range(1_000_000))), 'Python itself holds the lock')
        for call in (lambda: self.map.distance_field(-half, half, unknown=True), lambda: self.map.query(many),
                     lambda: self.map.cast_rays(origins, directions, 20.0), lambda: self.map.posterior(some)):
            self.assertTrue(any(self.runs_meanwhile(call) for _ in range(5)))  # on a busy machine, this thread may come too late

    def test_threads_share_a_map_and_a_field(self):
        map_ = mapper_of(1, 2).map  # nothing of it was read yet
        points = self.points(20_000)
        field = map_.distance_field((-3, -3, -1), (3, 3, 1))
        expected = self.map.query(points), self.map.cast_rays((0, 0, 0), points), field.at(points)[0]
        results, faults = [], []

        def work(n):
            try:
                for _ in range(5):
                    if n == 0:
                        field.update(map_, map_.blocks)
                    results.append((map_.query(points), map_.cast_rays((0, 0, 0), points), field.at(points)[0]))
            except Exception as fault:
                faults.append(fault)
        threads = [threading.Thread(target=work, args=(n,)) for n in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual((faults, len(results)), ([], 20))
        for result in results:
            for own, other in zip(result, expected):
                np.testing.assert_array_equal(own, other)

    def test_forked_processes_ask_alone(self):
        """As those of multiprocessing do."""
        points = self.points(30_000)
        expected = self.map.states(points).tobytes()
        mapper = mapper_of(1)
        child = os.fork()
        if child == 0:
            signal.alarm(20)  # rather than hang
            mapper.integrate((0, 0, 0), *scene(3))
            same = self.map.states(points).tobytes() == expected and len(mapper.map.cast_rays((0, 0, 0), points)) == len(points)
            del mapper
            gc.collect()
            os._exit(0 if same else 1)
        self.assertEqual(os.waitpid(child, 0)[1], 0)
        self.assertEqual(self.map.states(points).tobytes(), expected)

    def test_number_of_threads_changes_nothing(self):
        points = self.points(30_000)
        one, two = (bki.SemanticMapper('semantic_kitti', occlusion='all', threads=threads) for threads in (1, 2))
        for mapper in (one, two):
            mapper.integrate((0.1, 0, 0.05), *scene(1))
        for ask in (lambda m: m.query(points), lambda m: m.posterior(points), lambda m: m.cast_rays((0, 0, 0), points),
                    lambda m: m.sphere_contents(points[:2000], 0.4), lambda m: m.nearest_obstacles(points[:2000])):
            np.testing.assert_array_equal(ask(one.map), ask(two.map))

    def test_points_are_not_copied(self):
        def memory(key):
            with open('/proc/self/status') as file:
                return 1024 * int(next(line.split()[1] for line in file if line.startswith(key)))
        points = np.full((8_000_000, 3), 50.0, np.float32)
        for given in (points, points[:, ::-1]):
            with open('/proc/self/clear_refs', 'w') as file:
                file.write('5')  # resets VmHWM
            before = memory('VmRSS')
            states = self.map.states(given)
            taken = memory('VmHWM') - before - states.nbytes
            self.assertEqual(taken > points.nbytes // 2, given is not points, taken)  # others are made contiguous


class WrongInput(WithMap):
    """One sentence each."""

    def refused(self, error, words, call):
        with self.subTest(words=words):
            with self.assertRaises(error) as caught:
                call()
            self.assertNotIn('\n', str(caught.exception))
            self.assertRegex(str(caught.exception), words)

    def test_points(self):
        map_ = self.map
        bad = np.zeros((3000, 3))
        bad[2500, 1], bad[2600, 2] = math.nan, math.inf
        for ask in (map_.states, map_.labels, map_.occupancies, map_.class_probabilities, map_.posterior, map_.query):
            for points in (bad, bad.astype(np.float32)):
                self.refused(ValueError, 'point 2500 of 3000 has a coordinate that is not finite; remove such points', lambda: ask(points))
            self.refused(ValueError, r'points must be an array of numbers of shape \(N, 3\), not of shape \(3,\)', lambda: ask([0, 0, 0]))
            self.refused(TypeError, 'points must be an array of numbers', lambda: ask([['a', 'b', 'c']]))
        self.refused(ValueError, "field 'stat' is unknown; known fields: state, label", lambda: map_.query(bad, 'stat'))
        self.refused(ValueError, "field 'label' is given twice", lambda: map_.query(bad, ['label', 'state', 'label']))
        self.refused(TypeError, 'fields must be a str', lambda: map_.query(bad, 5))
        self.refused(TypeError, 'fields must be a str', lambda: map_.query(bad, []))

    def test_classes(self):
        some = np.zeros((1, 3))
        other = bki.ClassTable('nuscenes')
        for ask in (lambda c: self.map.cast_rays(some, some + 1, 1.0, c), lambda c: self.map.nearest_obstacles(some, c),
                    lambda c: self.map.distance_field((0, 0, 0), (1, 1, 1), c), self.map.classes.only, self.map.classes.all_but):
            self.refused(ValueError, "class table 'semantic_kitti' has no class 'cars'; it has: unlabelled, car", lambda: ask('cars'))
            self.refused(ValueError, "has no class 'cars'; it has", lambda: ask(['road', 'cars']))
            self.refused(ValueError, "class table 'semantic_kitti' has no class 77", lambda: ask(77))
            self.refused(ValueError, 'has no class -1', lambda: ask([-1]))
            self.refused(TypeError, r'classes must be a class \(a name, an id or a SemanticClass\) or a list of them, not float', lambda: ask(1.5))
            self.refused(TypeError, 'or a list of them, not NoneType', lambda: ask([None]))
            self.refused(ValueError, "the filter is of class table 'nuscenes', the map of 'semantic_kitti'", lambda: ask(other.only(other[0])))
            self.refused(ValueError, 'has no class <bki_mapping.SemanticClass', lambda: ask(bki.ClassTable('nuscenes')['manmade']))

    def test_rays(self):
        cast = self.map.cast_rays
        ways = np.ones((4, 3))
        nan = ways.copy()
        nan[2, 0] = math.nan
        for words, arguments in (
                ('ray 2 has a coordinate that is not finite; remove such rays', ((0, 0, 0), nan)),
                ('ray 2 has a coordinate that is not finite', (nan, ways)),
                ('ray 0 has a coordinate that is not finite', ((0, math.inf, 0), ways)),
                ('ray 0 starts beyond the map', ((1e12, 0, 0), ways)),
                ('ray 0 has the direction 0; give one of any length > 0', ((0, 0, 0), 0 * ways)),
                ('ray 0 has a negative length or none; give 0 m or more', ((0, 0, 0), ways, -1)),
                ('ray 3 has a negative length', ((0, 0, 0), ways, [1, 1, 1, math.nan])),
                ('there are 3 origins and 4 directions; give one origin, or as many as directions', (ways[:3], ways)),
                (r'directions must be an array of numbers of shape \(N, 3\)', ((0, 0, 0), (1, 0, 0))),
                ('origins must be three numbers', ((0, 0), ways)),
                (r'max_length must be a number, or 4 of them, one for each of the rays, not of shape \(2,\)', ((0, 0, 0), ways, [1, 2]))):
            self.refused(ValueError, words, lambda: cast(*arguments))
        self.refused(TypeError, 'max_length must be a number, or 4 of them', lambda: cast((0, 0, 0), ways, 'far'))
        self.refused(TypeError, 'stop_at_unknown must be True or False, not str', lambda: cast((0, 0, 0), ways, 1.0, None, 'yes'))
        self.refused(TypeError, 'origins must be an array of numbers', lambda: cast(None, ways))

    def test_shapes(self):
        boxes, spheres, along = self.map.box_contents, self.map.sphere_contents, self.map.contents_along
        a, b = np.zeros((3, 3)), np.ones((3, 3))
        pose = np.eye(4)[None]
        scaled, bad_row, far = 2 * pose, pose.copy(), pose.copy()
        scaled[0, 3, 3] = 1
        bad_row[0, 3, 0] = 1
        far[0, 0, 3] = math.nan
        swapped = b.copy()
        swapped[1, 2] = -1
        for words, call in (
                ('box 1 is inside out or empty; give sizes > 0 and min below max', lambda: boxes(a, swapped)),
                ('box 0 has a coordinate or size that is not finite', lambda: boxes(a, b * math.nan)),
                ('box 0 reaches beyond the map', lambda: boxes(a, b * 1e10)),
                (r'box 0 spans 1\d* voxels; split it, 100 million are the most', lambda: boxes(a, b * 300)),
                ('there are 3 lower and 2 upper corners', lambda: boxes(a, b[:2])),
                ('lower must be an array of numbers', lambda: boxes(a[0], b)),
                ('sphere 2 has a radius that is not a number > 0', lambda: spheres(a, [1, 1, 0])),
                ('sphere 0 has a radius that is not a number > 0', lambda: spheres(a, math.nan)),
                ('sphere 0 has a coordinate or size that is not finite', lambda: spheres(a * math.nan, 1)),
                ('sphere 0 spans', lambda: spheres(a, 300)),
                ('the box has a half extent that is not a number > 0', lambda: along(pose, (1, 1, -1))),
                ('the box at pose 0 is not rotated by a rotation; give a pose without scale or shear', lambda: along(scaled, (1, 1, 1))),
                ('the box at pose 0 has a coordinate or size that is not finite', lambda: along(far, (1, 1, 1))),
                (r'poses\[0\] must have 0, 0, 0, 1 in the last row', lambda: along(bad_row, (1, 1, 1))),
                (r'poses must be an array of numbers of shape \(N, 4, 4\), not of shape \(4, 4\)', lambda: along(pose[0], (1, 1, 1))),
                ('the box at pose 0 spans', lambda: along(pose, (300, 300, 300))),
                ('centre must be three numbers', lambda: along(pose, (1, 1, 1), (0, 0))),
                ("has no class 'cars'", lambda: boxes(a, b, 'cars'))):
            self.refused(ValueError, words, call)
        self.refused(TypeError, 'order must be a class', lambda: boxes(a, b, 1.5))

    def refuses(self, cases):
        for error, words, call in cases:
            self.refused(error, words, call)

    def test_nearest_obstacles(self):
        nearest = self.map.nearest_obstacles
        self.refuses((
            (ValueError, 'point 1 is not finite or lies beyond the map', lambda: nearest([[0, 0, 0], [0, math.nan, 0]])),
            (ValueError, 'the greatest distance is negative or not a number; give metres, 0 or more', lambda: nearest([[0, 0, 0]], None, -1)),
            (TypeError, 'max_distance must be a number, not str', lambda: nearest([[0, 0, 0]], None, 'far'))))

    def test_sections(self):
        horizontal, vertical = self.map.horizontal_section, self.map.vertical_section
        self.refuses((
            (ValueError, 'the section has a coordinate that is not finite', lambda: horizontal(math.nan, (0, 0), (1, 1))),
            (ValueError, "the section's area is inside out; give a min below its max", lambda: horizontal(0, (0, 2), (1, 1))),
            (ValueError, 'the section has .* cells; make it smaller, 100 million are the most', lambda: horizontal(0, (0, 0), (1e4, 1e4))),
            (ValueError, 'the section reaches beyond the map', lambda: horizontal(0, (0, 0), (1e10, 1))),
            (ValueError, 'upper must be two numbers', lambda: horizontal(0, (0, 0), (1, 1, 1))),
            (ValueError, 'the section stands on two points that are the same', lambda: vertical((1, 1), (1, 1), 0, 1)),
            (ValueError, "the section's heights are inside out; give min_z below max_z", lambda: vertical((1, 1), (2, 1), 1, 0)),
            (TypeError, 'z must be a number, not NoneType', lambda: horizontal(None, (0, 0), (1, 1)))))

    def test_frontiers(self):
        frontiers = self.map.frontiers
        self.refuses((
            (ValueError, 'min_size must be an integer, 0 or more', lambda: frontiers(-1)),
            (ValueError, 'min_size must be an integer, 0 or more', lambda: frontiers(1.5)),
            (ValueError, 'the box is inside out; give a min below its max', lambda: frontiers(lower=(0, 2, 0), upper=(1, 1, 1))),
            (ValueError, 'the box has a coordinate that is not finite', lambda: frontiers(lower=(0, 0, 0), upper=(1, 1, math.inf))),
            (ValueError, "the box reaches beyond the map's grid", lambda: frontiers(lower=(0, 0, 0), upper=(1, 1, 1e10))),
            (ValueError, 'the box has only one corner; give lower and upper', lambda: frontiers(lower=(0, 0, 0))),
            (TypeError, 'return_voxels must be True or False, not int', lambda: frontiers(1, 1))))

    def test_distance_fields(self):
        map_, field = self.map, self.map.distance_field
        coarse = bki.SemanticMapper(resolution=0.5).map
        good = field((0, 0, 0), (1, 1, 1))
        self.refuses((
            (ValueError, 'the region has a coordinate that is not finite; give finite ones', lambda: field((0, 0, math.nan), (1, 1, 1))),
            (ValueError, 'the region is inside out; give a min below its max', lambda: field((0, 2, 0), (1, 1, 1))),
            (ValueError, 'the region has 3334 x 3334 x 334 voxels; make it smaller', lambda: field((0, 0, 0), (1e3, 1e3, 1e2))),
            (ValueError, 'the region reaches beyond the map', lambda: field((0, 0, 0), (1e10, 1, 1))),
            (ValueError, 'lower must be three numbers', lambda: field((0, 0), (1, 1, 1))),
            (ValueError, 'the region is inside out', lambda: good.compute(map_, (0, 2, 0), (1, 1, 1))),
            (ValueError, 'the map has voxels of another size than the distance field', lambda: good.compute(coarse, (0, 0, 0), (1, 1, 1))),
            (ValueError, 'the map has voxels of another size than the distance field', lambda: good.update(coarse, map_.blocks)),
            (ValueError, 'blocks must be integers of 32 bits', lambda: good.update(map_, [[2**40, 0, 0]])),
            (ValueError, r'blocks must be an array of integers of shape \(N, 3\)', lambda: good.update(map_, [0, 0, 0])),
            (ValueError, r'points must be an array of numbers of shape \(N, 3\)', lambda: good.at([0, 0, 0])),
            (TypeError, 'unknown must be True or False, not NoneType', lambda: field((0, 0, 0), (1, 1, 1), None, None)),
            (TypeError, 'map must be a bki_mapping.Map, not SemanticMapper', lambda: good.update(bki.SemanticMapper(), map_.blocks)),
            (TypeError, r'blocks must be an array of integers of shape \(N, 3\), not of dtype float64', lambda: good.update(map_, map_.blocks * 1.0))))
        self.assertEqual(good.values.shape, (4, 4, 4))


class EmptyMap(unittest.TestCase):
    def test_everything_is_unknown(self):
        map_ = bki.SemanticMapper().map
        points = np.zeros((2, 3))
        self.assertIsNone(map_.bounds)
        self.assertEqual(map_.states(points).tolist(), [bki.UNKNOWN] * 2)
        hits = map_.cast_rays(points, points + 1, stop_at_unknown=True)
        self.assertEqual((hits['end'].tolist(), hits['length'].tolist()), ([bki.RAY_UNKNOWN] * 2, [0, 0]))
        self.assertEqual(map_.box_contents(points, points + 0.25)['unknown'].tolist(), [1, 1])
        self.assertEqual(len(map_.frontiers()), 0)
        self.assertTrue((map_.distance_field((0, 0, 0), (1, 1, 1)).values == math.inf).all())
        self.assertTrue((map_.distance_field((0, 0, 0), (1, 1, 1), unknown=True).values == -math.inf).all())
        self.assertEqual(map_.nearest_obstacles(points)['distance'].tolist(), [math.inf] * 2)

    def test_bounds(self):
        map_ = mapper_of(1).map
        corners = 8 * map_.resolution * np.array([map_.blocks.min(axis=0), map_.blocks.max(axis=0) + 1])
        np.testing.assert_allclose(map_.bounds, corners)


if __name__ == '__main__':
    unittest.main()
