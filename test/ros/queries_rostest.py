#!/usr/bin/env python3
"""The services for queries answer what the topic `occupancy` says, and refuse wrong requests with a sentence."""
import math
import os
import random
import struct
import sys

import rospy
import rostest
from bki_mapping import srv
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import PointCloud2

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import CAR, ROAD, Listener, MapperTest, random_scan, whole_map  # noqa: E402
from map_reference import FREE, OCCUPIED, MapReference  # noqa: E402

ALL = {'car', 'road'}  # of random_scan
KINDS = {'query_points': srv.QueryPoints, 'cast_rays': srv.CastRays, 'check_space': srv.CheckSpace,
         'get_nearest_obstacles': srv.GetNearestObstacles, 'get_section': srv.GetSection,
         'get_frontiers': srv.GetFrontiers, 'get_distances': srv.GetDistances}
NAN, INF = math.nan, math.inf


def xyz(message):
    return message.x, message.y, message.z


class Queries(MapperTest):
    def setUp(self):
        super().setUp()
        self.random = random.Random(7)

    def map_some(self):
        """Maps scans; returns a reference of the map."""
        self.integrate(*random_scan(4, points=20, reach=4.0), position=(-60.0, 0.0, 0.5))
        for seed in range(4):
            stamp = self.integrate(*random_scan(seed, points=150, reach=12.0), position=(4.0 * seed, 0.0, 0.5))
        return self.reference(stamp)

    def reference(self, stamp):
        self.stamp = stamp
        return MapReference(whole_map(stamp))

    def ask(self, service, **request):
        return rospy.ServiceProxy(f'mapping/{service}', KINDS[service])(**request)

    def answer(self, service, **request):
        """An answer, which must be of the last scan."""
        answer = self.ask(service, **request)
        self.assertTrue(answer.success, answer.message)
        self.assertEqual(answer.message, '')
        header = answer.grid.header if service == 'get_section' else answer.header
        self.assertEqual((header.stamp, header.frame_id), (self.stamp, 'map'))
        return answer

    def places(self, count, reach=20.0):
        """Random points, some of them on faces and in corners of voxels."""
        points = [tuple(self.random.uniform(-reach, reach) for _ in range(3)) for _ in range(count)]
        return points + [tuple(float(math.floor(c)) for c in point) for point in points[:count // 10]]

    def variances(self, truth):
        """Of all known voxels, from the topic voxel_cloud."""
        clouds = Listener('voxel_cloud', PointCloud2)
        self.addCleanup(clouds.close)
        cloud = clouds.wait_for(lambda m: m.header.stamp == self.stamp, 'a cloud of the voxels')
        offset = next(f.offset for f in cloud.fields if f.name == 'variance')
        return {truth.voxel_at(struct.unpack_from('<3f', cloud.data, at)): struct.unpack_from('<f', cloud.data, at + offset)[0]
                for at in range(0, len(cloud.data), cloud.point_step)}

    def test_points(self):
        truth = self.map_some()
        points = self.places(2000) + [truth.centre(voxel) for voxel in truth.occupied(ALL)]
        variances = self.variances(truth)
        answer = self.answer('query_points', points=[Point(*p) for p in points])
        for n, point in enumerate(points):
            voxel = truth.voxel_at(point)
            self.assertEqual((answer.state[n], answer.class_name[n]), (truth.state_of(voxel), truth.class_of(voxel)), point)
            if voxel not in truth.posterior:
                continue
            posterior = answer.occupancy[n], answer.class_probability[n], answer.probability[n]
            for own, expected in zip(posterior, truth.posterior[voxel]):
                self.assertAlmostEqual(own, expected, delta=2e-6, msg=point)
            if voxel in variances:
                self.assertAlmostEqual(answer.variance[n], variances[voxel], places=6)
        self.assertEqual({0, 1, 2}, set(answer.state))
        self.assertGreater(len({round(v, 3) for v in answer.variance}), 5)

    def test_rays(self):
        truth = self.map_some()
        for classes, all_but, stop in (([], False, False), (['car'], False, False), (['car'], True, True)):
            stops = ALL if not classes else (ALL - {'car'} if all_but else {'car'})
            origins = self.places(300, 10.0)
            directions = [tuple(self.random.gauss(0, 1) for _ in range(3)) for _ in origins]
            directions[:3] = [(1.0, 0.0, 0.0), (0.0, -2.0, 0.0), (0.0, 0.0, 0.5)]
            lengths = [self.random.uniform(0.0, 40.0) for _ in origins]
            answer = self.answer('cast_rays', origins=[Point(*o) for o in origins],
                                 directions=[Vector3(*d) for d in directions], lengths=lengths, classes=classes,
                                 all_but=all_but, stop_at_unknown=stop)
            for n, origin in enumerate(origins[:300]):
                met, name, length, first, voxel = truth.cast(origin, directions[n], lengths[n], stops, stop)
                self.assertEqual((answer.met[n], answer.class_name[n]), (met, name), (origin, directions[n]))
                self.assertAlmostEqual(answer.length[n], length, places=6)
                self.assertEqual(math.isinf(first), math.isinf(answer.first_unknown[n]))
                if math.isfinite(first):
                    self.assertAlmostEqual(answer.first_unknown[n], first, places=6)
                if voxel:
                    self.assertEqual(xyz(answer.voxel[n]), truth.centre(voxel))
            self.assertIn(1, answer.met)
        fan = self.answer('cast_rays', origins=[Point(0.5, 0.5, 0.5)], lengths=[INF],
                          directions=[Vector3(1, y, 0.1) for y in (-0.3, 0.1, 0.2)])
        self.assertEqual(len(fan.met), 3, 'one origin and one length for all rays')

    def check_shapes(self, answer, contents, obstacles):
        order = ['car', 'road']
        for n, (free, occupied, unknown, names) in enumerate(contents):
            self.assertEqual((answer.free_voxels[n], answer.occupied_voxels[n], answer.unknown_voxels[n]),
                             (free, occupied, unknown), n)
            self.assertEqual(answer.known[n], unknown == 0)
            self.assertEqual(answer.free[n], unknown == 0 and not names & obstacles)
            self.assertEqual(answer.worst_class[n], next((name for name in order if name in names), ''))

    def test_boxes_along_a_path_and_spheres(self):
        truth = self.map_some()
        centres = self.places(100, 12.0)[:100]
        yaws = [self.random.uniform(-math.pi, math.pi) for _ in centres]
        poses = [Pose(Point(*c), Quaternion(0, 0, math.sin(yaw / 2), math.cos(yaw / 2))) for c, yaw in zip(centres, yaws)]
        size = (2.3, 1.1, 0.8)
        boxes = self.answer('check_space', poses=poses, sizes=[Vector3(*size)], classes=['road'], all_but=True)
        self.check_shapes(boxes, [truth.content(truth.in_turned_box(c, yaw, size)) for c, yaw in zip(centres, yaws)], {'car'})
        self.assertEqual({True, False}, set(boxes.free))
        upright = self.answer('check_space', poses=[Pose(position=Point(*c)) for c in centres],
                              sizes=[Vector3(*size)] * len(centres))
        self.check_shapes(upright, [truth.content(truth.in_turned_box(c, 0.0, size)) for c in centres], ALL)
        radii = [self.random.uniform(0.1, 3.0) for _ in centres]
        spheres = self.answer('check_space', poses=[Pose(position=Point(*c)) for c in centres], radii=radii)
        self.check_shapes(spheres, [truth.content(truth.in_sphere(c, r)) for c, r in zip(centres, radii)], ALL)
        other = self.answer('check_space', poses=poses, radii=[8.0], worst_first=['road', 'car'])
        self.assertIn('road', other.worst_class)

    def test_nearest_obstacles(self):
        truth = self.map_some()
        points = self.places(60)
        for classes, most in ((['car'], 0.0), ([], 3.0)):
            answer = self.answer('get_nearest_obstacles', points=[Point(*p) for p in points], classes=classes, max_distance=most)
            obstacles = truth.occupied(set(classes) or ALL)
            for n, point in enumerate(points):
                distance, voxel = truth.nearest(point, obstacles)[0]
                if most and distance > most:
                    self.assertEqual((answer.distance[n], answer.class_name[n]), (INF, ''))
                    self.assertTrue(math.isnan(answer.obstacle[n].x))
                    continue
                self.assertAlmostEqual(answer.distance[n], distance, places=9)
                at = truth.voxel_at(xyz(answer.obstacle[n]))
                self.assertEqual(truth.class_of(at), answer.class_name[n])
                self.assertAlmostEqual(math.dist(point, truth.centre(at)), distance, places=9)

    def check_grid(self, truth, answer, place):
        """@param place: the point at the centre of (column, row)."""
        grid, names = answer.grid, {c.id: c.name for c in answer.classes}
        self.assertEqual(len(grid.data), grid.info.width * grid.info.height)
        labels = bytes(answer.label)
        for i, value in enumerate(grid.data):
            voxel = truth.voxel_at(place(i % grid.info.width, i // grid.info.width))
            self.assertEqual(value, {FREE: 0, OCCUPIED: 100}.get(truth.state_of(voxel), -1))
            self.assertEqual(names.get(labels[i], ''), truth.class_of(voxel))
        self.assertEqual({-1, 0, 100}, set(grid.data))

    def test_sections(self):
        truth = self.map_some()
        flat = self.answer('get_section', start=Point(-11.5, -9.2, 0.7), end=Point(20.1, 9.9, 0.0))
        info = flat.grid.info
        self.assertEqual((info.width, info.height, xyz(info.origin.position)), (33, 20, (-12.0, -10.0, 0.5)))
        self.check_grid(truth, flat, lambda x, y: (-12 + x + 0.5, -10 + y + 0.5, 0.7))
        upright = self.answer('get_section', vertical=True, start=Point(18.0, 5.0, -5.0), end=Point(-6.0, -13.0, 6.0))
        info, pose = upright.grid.info, upright.grid.info.origin
        self.assertEqual((info.width, info.height), (30, 11))

        def turned(v):  # by the pose's quaternion
            q = pose.orientation
            t = [2 * c for c in (q.y * v[2] - q.z * v[1], q.z * v[0] - q.x * v[2], q.x * v[1] - q.y * v[0])]
            return (v[0] + q.w * t[0] + q.y * t[2] - q.z * t[1], v[1] + q.w * t[1] + q.z * t[0] - q.x * t[2],
                    v[2] + q.w * t[2] + q.x * t[1] - q.y * t[0])
        for own, expected in ((turned((1, 0, 0)), (-0.8, -0.6, 0)), (turned((0, 1, 0)), (0, 0, 1))):
            for a, b in zip(own, expected):
                self.assertAlmostEqual(a, b)
        self.check_grid(truth, upright, lambda x, y: (18 - 0.8 * (x + 0.5), 5 - 0.6 * (x + 0.5), -5 + y + 0.5))

    def test_frontiers(self):
        truth = self.map_some()
        expected = truth.frontiers()
        answer = self.answer('get_frontiers', with_voxels=True)
        self.assertGreater(len(expected), 1)
        self.assertEqual(list(answer.size), [len(cluster) for cluster in expected])
        begin, found = 0, []
        for n, size in enumerate(answer.size):
            voxels = [xyz(p) for p in answer.voxels[begin:begin + size]]
            begin += size
            found.append(frozenset(truth.voxel_at(p) for p in voxels))
            for axis, mean in enumerate(xyz(answer.centre[n])):
                self.assertAlmostEqual(mean, sum(p[axis] for p in voxels) / size, places=6)
        self.assertEqual(begin, len(answer.voxels))
        self.assertEqual(set(found), {frozenset(cluster) for cluster in expected})
        least = expected[0] and len(expected[0])
        few = self.answer('get_frontiers', min_size=least)
        self.assertEqual((list(few.size), few.voxels), ([len(c) for c in expected if len(c) >= least], []))
        self.assertEqual(len(self.answer('get_frontiers', max_count=1).centre), 1)
        corners = {'min': Point(-4.5, -6.5, -3.5), 'max': Point(7.5, 5.0, 2.5)}
        boxed = truth.frontiers(lambda voxel: -5 <= voxel[0] <= 7 and -7 <= voxel[1] <= 4 and -4 <= voxel[2] <= 2)
        answer = self.answer('get_frontiers', with_voxels=True, **corners)
        self.assertEqual(list(answer.size), [len(cluster) for cluster in boxed])
        self.assertEqual({truth.voxel_at(xyz(p)) for p in answer.voxels}, set().union(*boxed))
        self.assertNotEqual(list(answer.size), [len(cluster) for cluster in expected])

    def distance(self, truth, voxel, obstacles):
        """Signed, between centres, as docs/queries.md has it. `obstacles`: a set of voxels."""
        if voxel not in obstacles:
            return truth.nearest(truth.centre(voxel), obstacles)[0][0]
        others = [other for other in truth.around(truth.centre(voxel), 4.0) if other not in obstacles]
        return truth.resolution - truth.nearest(truth.centre(voxel), others)[0][0]

    def test_distances(self):
        truth = self.map_some()
        for unknown in (False, True):
            obstacles = set(truth.occupied({'car'}))
            if unknown:
                obstacles |= {voxel for voxel in truth.around((0.0, 0.0, 0.0), 15.0) if not truth.is_known(voxel)}
            voxels = [truth.voxel_at(p) for p in self.places(150, 8.0)] + sorted(truth.occupied({'car'}))[::20]
            voxels = [v for v in voxels if max(map(abs, v)) < 9]
            answer = self.answer('get_distances', points=[Point(*truth.centre(v)) for v in voxels], classes=['car'],
                                 unknown_is_obstacle=unknown, max_distance=3.0)
            for n, voxel in enumerate(voxels):
                expected = self.distance(truth, voxel, obstacles)
                self.assertAlmostEqual(answer.distance[n], min(3.0, expected), places=5, msg=str(voxel))
                if expected > 3.0:
                    self.assertEqual(xyz(answer.gradient[n]), (0.0, 0.0, 0.0))
            self.assertGreater(max(math.hypot(*xyz(g)) for g in answer.gradient), 0.5)
        middle = [truth.centre((0, 0, 0)), truth.centre((1, 0, 0))]
        values = self.answer('get_distances', points=[Point(*p) for p in (*middle, (1.0, 0.5, 0.5))], max_distance=10.0).distance
        self.assertAlmostEqual(values[2], 0.5 * (values[0] + values[1]), places=5, msg='interpolated')

    def test_distance_section(self):
        sections = Listener('distance_section', OccupancyGrid)
        self.addCleanup(sections.close)
        self.check_distance_section(self.map_some(), sections)  # the field moves with the sensor
        # The sensor stays, and few blocks change: the field is updated.
        stamp = self.integrate([(-2.0, 1.0, -1.0), (3.0, 0.0, -1.0)], [CAR, ROAD], position=(12.0, 0.0, 0.5))
        self.check_distance_section(self.reference(stamp), sections)

    def check_distance_section(self, truth, sections):
        grid = sections.wait_for(lambda m: m.header.stamp == self.stamp, 'the section of the last scan')
        # The sensor is at (12, 0, 0.5), and the section 1 m below it: it has the voxels with z = -0.5.
        origin, edge = grid.info.origin.position, 8 * (2 * 2 + 1)
        self.assertEqual((xyz(origin), grid.info.width, grid.info.height), ((-8.0, -16.0, -0.5), edge, edge))
        obstacles, seen = truth.occupied({'car'}), set()
        for i, value in enumerate(grid.data):
            voxel = (-8 + i % edge, -16 + i // edge, -1)
            distance = truth.nearest(truth.centre(voxel), obstacles)[0][0]
            if voxel in obstacles:
                expected = 100
            elif truth.is_known(voxel):
                expected = round(99 * max(0.0, 1 - distance / 4.0))
            else:
                expected = -1
            self.assertLessEqual(abs(value - expected), 0 if expected in (-1, 100) else 1, (voxel, distance))
            seen.add(value)
        self.assertLessEqual({-1, 0, 100}, seen)
        self.assertGreater(len(seen), 10)

    def test_changes_are_seen_at_once(self):
        self.map_some()
        asked = {'points': [Point(0.5, 0.5, 0.5)]}
        self.assertEqual(list(self.answer('query_points', **asked).state), [1])
        self.call('reset')
        self.assertEqual(list(self.ask('query_points', **asked).state), [0])
        self.assertEqual(self.ask('get_frontiers').centre, [])

    def test_wrong_requests(self):
        self.map_some()
        here, pose, x = Point(0, 0, 0), Pose(), Vector3(1, 0, 0)
        ray = {'origins': [here], 'directions': [x], 'lengths': [5.0]}
        wrong = [
            ('query_points', {'points': [here, Point(NAN, 0, 0)]}, 'point 1 of 2 .*not finite; remove'),
            ('query_points', {'points': [here] * 100001}, '100001 points; split it, 100000 are the most'),
            ('cast_rays', {**ray, 'classes': ['car', 'trolley']}, "class table 'semantic_kitti' has no class 'trolley'; it has: "),
            ('cast_rays', {**ray, 'directions': [Vector3()]}, 'ray 0 .*direction 0; give'),
            ('cast_rays', {**ray, 'lengths': [-1.0]}, 'ray 0 .*negative length'),
            ('cast_rays', {**ray, 'lengths': []}, 'lengths has 0 entries for a batch of 1; give'),
            ('cast_rays', {**ray, 'origins': [here] * 3, 'directions': [x] * 2}, 'origins has 3 entries'),
            ('cast_rays', {**ray, 'origins': [Point(1e12, 0, 0)]}, 'starts beyond the map'),
            ('cast_rays', {**ray, 'classes': ['x'] * 300}, '300 names of classes; split'),
            ('check_space', {'poses': [pose]}, 'neither boxes nor spheres; give'),
            ('check_space', {'poses': [pose], 'sizes': [x], 'radii': [1.0]}, 'neither boxes nor spheres; give'),
            ('check_space', {'poses': [pose], 'sizes': [Vector3(1, -1, 1)]}, 'shape 0: .*give metres > 0'),
            ('check_space', {'poses': [pose], 'radii': [NAN]}, 'shape 0: .*give metres > 0'),
            ('check_space', {'poses': [pose] * 2, 'sizes': [Vector3(1e3, 1e3, 1e3)]}, 'span more than 20000000 voxels; split'),
            ('check_space', {'poses': [Pose(here, Quaternion(0, 0, 0, 2))], 'sizes': [Vector3(1, 1, 1)]}, 'not a rotation; give'),
            ('check_space', {'poses': [Pose(Point(NAN, 0, 0), Quaternion())], 'radii': [1.0]}, 'not finite; give'),
            ('check_space', {'poses': [pose], 'radii': [1.0], 'worst_first': ['ghost']}, "no class 'ghost'"),
            ('get_nearest_obstacles', {'points': [Point(0, INF, 0)]}, 'point 0: .*not finite'),
            ('get_nearest_obstacles', {'points': [here], 'max_distance': NAN}, 'not a number; give metres'),
            ('get_section', {'start': Point(1, 1, 0), 'end': Point(0, 2, 0)}, 'inside out; give'),
            ('get_section', {'start': Point(0, 0, NAN), 'end': Point(1, 1, 0)}, 'not finite; give'),
            ('get_section', {'start': Point(-5e4, -5e4, 0), 'end': Point(5e4, 5e4, 0)}, r'\d+ cells; make it smaller'),
            ('get_section', {'start': Point(-1e7, 0, 0), 'end': Point(1e7, 0, 0)}, '20000001 cells; make it smaller, 4000000 are'),
            ('get_section', {'vertical': True, 'start': here, 'end': Point(0, 0, 5)}, 'the same; give two that differ'),
            ('get_frontiers', {'min': Point(1, 1, 1), 'max': Point(2, 0, 2)}, 'the box is inside out; give'),
            ('get_frontiers', {'max': Point(2, NAN, 2)}, 'not finite; give'),
            ('get_distances', {'points': [here]}, 'max_distance is not a number > 0; give'),
            ('get_distances', {'points': [here], 'max_distance': INF}, r'has inf voxels; lower'),
            ('get_distances', {'points': [here, Point(1e6, 0, 0)], 'max_distance': 5.0}, r'voxels; lower max_distance'),
        ]
        for service, request, sentence in wrong:
            with self.subTest(service=service, sentence=sentence):
                answer = self.ask(service, **request)
                self.assertFalse(answer.success)
                self.assertRegex(answer.message, sentence)
                for name in answer.__slots__:
                    if isinstance(getattr(answer, name), (list, tuple, bytes)):
                        self.assertEqual(len(getattr(answer, name)), 0, name)
        self.assertTrue(self.ask('query_points').success, 'an empty batch is allowed')


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'queries', Queries)
