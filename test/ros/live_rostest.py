#!/usr/bin/env python3
"""The mapper on a robot with faults: every cloud is accounted for."""
import os
import sys

import rospy
import rostest
from bki_mapping.msg import OccupancyMap
from dynamic_reconfigure.client import Client
from dynamic_reconfigure.msg import Config, DoubleParameter, IntParameter
from dynamic_reconfigure.srv import Reconfigure
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import PointField
from std_srvs.srv import Trigger

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import CAR, ROAD, TIMEOUT, Listener, MapperTest, Robot, adds_up, make_cloud, random_scan, wait_until  # noqa: E402

QUEUE = 3  # queue_size in live.test
CAR_COLOR = 0x6496f5  # of config/classes/semantic_kitti.yaml


class Live(MapperTest):
    cloud_topic = 'front_cloud'

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.merged, cls.open = Robot('merged_cloud'), Robot('open_cloud')
        cls.log = Listener('/rosout', Log)
        for robot in (cls.merged, cls.open):
            robot.connect()

    def stamp_for(self, other):
        """The next stamp of the robot, for a cloud of another input."""
        other.seconds = self.robot.seconds = self.robot.seconds + 1
        return rospy.Time(other.seconds)

    def client(self):
        client = Client('/mapping/reconfigure', timeout=TIMEOUT)
        self.addCleanup(client.close)
        return client

    def fill_queue(self, clouds):
        """Publishes more clouds than the queue holds, and then their poses; returns the stamps."""
        before = self.deal_with(self.robot.scan([(2.0, 0.0, 0.0)], [CAR]))
        stamps = [self.robot.next_stamp() for _ in range(clouds)]
        for stamp in stamps:
            self.robot.clouds.publish(make_cloud([(2.0, 0.0, 0.0)], [CAR], stamp))
        full = self.status.wait_for(lambda m: m.dropped_queue_full == before.dropped_queue_full + clouds - QUEUE,
                                    'a full queue')
        self.assertEqual(full.waiting, QUEUE)
        self.assertTrue(adds_up(full), full)
        for stamp in reversed(stamps):  # out of order and late; every waiting cloud must still be found
            self.robot.publish_pose(stamp)
        status = self.status.wait_for(lambda m: m.waiting == 0 and m.received == before.received + clouds, 'the rest')
        self.assertEqual(status.integrated, before.integrated + QUEUE)
        self.assertTrue(adds_up(status), status)
        return stamps

    def integrated(self, stamps):
        return [self.deal_with(stamp).integrated_last for stamp in stamps]

    def test_the_queue_is_bounded_and_keeps_the_newest(self):
        stamps = self.fill_queue(8)
        self.assertEqual(self.integrated(stamps), 5 * [False] + QUEUE * [True])

    def test_the_queue_may_keep_the_oldest(self):
        self.reconfigure(queue_policy='drop_newest')
        stamps = self.fill_queue(8)
        self.assertEqual(self.integrated(stamps), QUEUE * [True] + 5 * [False])

    def test_under_overload_the_newest_win_and_latency_is_bounded(self):
        cloud = make_cloud(*random_scan(1, points=20000, reach=60.0), rospy.Time(0))
        before = self.deal_with(self.robot.scan([(2.0, 0.0, 0.0)], [CAR]))
        first = len(self.status.messages)
        stamps = [self.robot.next_stamp() for _ in range(40)]
        for stamp in (stamps[0], stamps[-1]):
            self.robot.publish_pose(stamp)
        for stamp in stamps:
            cloud.header.stamp = stamp
            self.robot.clouds.publish(cloud)
        self.assertTrue(self.deal_with(stamps[-1]).integrated_last, 'the newest is mapped')
        status = self.status.wait_for(lambda m: m.received == before.received + 40 and m.waiting == 0, 'the rest')
        self.assertGreater(status.dropped_queue_full, before.dropped_queue_full + 3, 'it was no overload')
        self.assertTrue(adds_up(status), status)
        during = self.status.messages[first:]
        self.assertLessEqual(max(m.waiting for m in during), QUEUE)
        slowest = max(m.integration_ms for m in during)
        self.assertLess(status.latency_p99_ms, (QUEUE + 2) * slowest + 50.0, 'a cloud waited behind too many')

    def test_pause_and_resume(self):
        before = self.deal_with(self.robot.scan([(2.0, 0.0, 0.0)], [CAR]))
        self.assertTrue(self.call('pause', Trigger).success)
        status = self.deal_with(self.robot.scan([(2.0, 0.0, 0.0)], [CAR]))
        self.assertEqual((status.dropped_paused, status.paused), (before.dropped_paused + 1, True))
        self.call('resume', Trigger)
        self.integrate([(2.0, 0.0, 0.0)], [CAR])

    def reports(self):
        """Listens to /diagnostics; returns a function that scans until a report has the given level and words."""
        reports = Listener('/diagnostics', DiagnosticArray)
        self.addCleanup(reports.close)

        def report(level, words, scan=lambda: None):
            def fits(message):
                return any(s.level == level and words in s.message and 'mapping' in s.name for s in message.status)
            return wait_until(lambda: scan() or reports.find(fits), f'a report of level {level} with "{words}"')
        return report

    def test_useless_points_are_reported(self):
        report = self.reports()
        nan = float('nan')
        for points, labels, level, words in (
                ([(2.0, 0.0, 0.0), (3.0, 0.0, 0.0)], [7777, 7777], DiagnosticStatus.ERROR,
                 "class table 'semantic_kitti' does not list (7777 most often); list them in the table"),
                ([(nan, nan, nan)], [CAR], DiagnosticStatus.WARN, 'are NaN or infinite')):
            def scan():
                self.integrate(points, labels)
            report(level, words, scan)
            self.log.wait_for(lambda m: words in m.msg and '/front_cloud' in m.msg, 'a warning in the log')
            self.assertEqual(self.status.find(lambda m: True).blocks, 0)
        self.reconfigure(sensor_model_min_range=5.0)
        report(DiagnosticStatus.ERROR, 'nearer than sensor_model/min_range 5 m',
               lambda: self.integrate([(2.0, 0.0, 0.0)], [CAR]) and None)
        half = [(nan, nan, nan), (6.0, 0.0, 0.0)]  # no reason for a warning
        report(DiagnosticStatus.OK, 'mapping', lambda: self.integrate(half, [0, CAR]) and None)

    def test_diagnostics_tell_how_it_goes(self):
        report = self.reports()
        report(DiagnosticStatus.OK, 'mapping', lambda: self.integrate([(2.0, 0.0, 0.0)], [CAR]) and None)
        bad = report(DiagnosticStatus.ERROR, 'empty', lambda: self.deal_with(self.robot.scan([], [])) and None)
        values = {v.key: v.value for v in bad.status[0].values}
        self.assertGreaterEqual(int(values['dropped: empty']), 1)
        self.assertIn('latency, 99th percentile [ms]', values)
        report(DiagnosticStatus.WARN, 'no clouds come')

    def test_a_place_beyond_the_map_is_said(self):
        before = self.integrate([(2.0, 0.0, 0.0)], [CAR]) and self.status.find(lambda m: True)
        for far in (1e300, 1e12):
            status = self.deal_with(self.robot.scan([(2.0, 0.0, 0.0)], [CAR], position=(far, 0.0, 0.0)))
            self.assertEqual(status.last_drop_reason, 'bad transform')
            self.assertIn("the transforms from 'map' to 'sensor'", status.last_drop)
            self.assertEqual((status.blocks, status.dropped_bad_cloud), (before.blocks, before.dropped_bad_cloud))
        self.assertTrue(adds_up(status), status)
        self.integrate([(2.0, 0.0, 0.0)], [CAR])

    def test_each_input_hears_of_its_own_fault(self):
        before = self.status.find(lambda m: True)
        stamp = self.robot.scan([(2.0, 0.0, 0.0)], [CAR], label_name='class')
        status = self.deal_with(stamp)
        self.assertEqual(status.dropped_bad_cloud, before.dropped_bad_cloud + 1)
        self.assertEqual(status.last_drop_reason, 'bad cloud')
        self.assertIn("no field 'label'", status.last_drop)
        stamp = self.stamp_for(self.merged)
        self.robot.publish_pose(stamp)
        self.merged.clouds.publish(make_cloud([(2.0, 0.0, 0.0)], [CAR], stamp, label_name='color'))
        self.assertIn("no field 'rgb'", self.deal_with(stamp).last_drop)
        for topic, words in (('/front_cloud', "no field 'label'"), ('/merged_cloud', "no field 'rgb'")):
            self.log.wait_for(lambda m: topic in m.msg and words in m.msg, f'a warning of {topic}')

    def test_settings_change_while_mapping(self):
        stamp = self.integrate([(4.5, 0.5, 0.5)], [CAR])
        self.assertEqual(self.map_of_server(stamp)[(0, 0, 0)][0][2], OccupancyMap.FREE)
        answer = self.reconfigure(free_space_mode='none', sensor_model_max_range=20.0)
        self.assertEqual((answer.free_space_mode, answer.sensor_model_max_range), ('none', 20.0))
        stamp = self.integrate([(0.5, 5.5, 0.5), (0.5, 25.5, 0.5)], [ROAD, ROAD])
        blocks = self.map_of_server(stamp)
        self.assertEqual(blocks[(0, 0, 0)][0][4], OccupancyMap.OCCUPIED, 'the map is kept')
        self.assertEqual(blocks[(0, 0, 0)][0][8 * 3], OccupancyMap.UNKNOWN, 'nothing is cleared')
        self.assertNotIn((0, 3, 0), blocks, 'hits beyond the range are not mapped')
        answer = self.reconfigure(resolution=0.5, view_range=3.0)
        self.assertEqual((answer.resolution, answer.view_range), (1.0, 0.0), 'refused as a whole')
        self.assertIn('resolution cannot change while mapping', answer.last_refusal)
        self.status.wait_for(lambda m: m.last_refusal == answer.last_refusal, 'the refusal in the status')
        self.log.wait_for(lambda m: 'resolution cannot change while mapping' in m.msg, 'the reason in the log')
        self.assertEqual(self.reconfigure(view_range=3.0).last_refusal, '', 'taken over')
        wait_until(lambda: self.status.messages[-1].last_refusal == '', 'the status without a refusal')

    def test_a_value_beyond_its_limits_is_refused_and_not_clamped(self):
        updates, client = Listener('/mapping/reconfigure/parameter_updates', Config), self.client()
        before = client.get_configuration(TIMEOUT)
        names = set(before) - {'last_refusal', 'groups'}
        for settings, words in (({'rules_stands_after': -1.0}, "rules/stands_after is '-1', but must be a number from 0 to 1000"),
                                ({'rules_together': 11.0}, "rules/together is '11'"),
                                ({'queue_size': -1}, "queue_size is '-1', but must be an integer from 1 to 10000"),
                                ({'queue_size': 20000}, "queue_size is '20000'"),
                                ({'view_range': 3.0, 'publish_rate': -1.0}, "publish_rate is '-1'")):
            seen = len(updates.messages)
            answer = client.update_configuration(settings)
            self.assertIn(words, answer.last_refusal)
            self.assertEqual({name: answer[name] for name in names}, {name: before[name] for name in names}, 'as a whole')
            wait_until(lambda: len(updates.messages) > seen, 'an update for clients that show the values')
            shown = {p.name: p.value for p in updates.messages[-1].doubles + updates.messages[-1].ints}
            self.assertEqual(shown, {name: before[name] for name in shown}, 'the values in force')
            self.assertEqual(rospy.get_param('/mapping/reconfigure/rules_stands_after'), before['rules_stands_after'])
            self.status.wait_for(lambda m: m.last_refusal == answer.last_refusal, 'the refusal in the status')
        self.assertIn('min', client.get_parameter_descriptions(TIMEOUT)[0], 'limits, for sliders')

    def test_settings_that_are_unknown_or_of_another_type_are_refused(self):
        change = rospy.ServiceProxy('/mapping/reconfigure/set_parameters', Reconfigure)
        for asked, words in ((Config(doubles=[DoubleParameter('rules_stand_after', 2.0)]),
                              "setting 'rules_stand_after' is unknown; did you mean 'rules_stands_after'?"),
                             (Config(ints=[IntParameter('rules_stands_after', 2)]),
                              'setting rules_stands_after is an integer, but must be a floating-point number'),
                             (Config(doubles=[DoubleParameter('window', 20.0), DoubleParameter('window', 30.0)]),
                              'setting window is given twice; keep one')):
            asked.doubles.append(DoubleParameter('view_range', 3.0))
            answer = change(asked).config
            self.assertEqual([p.value for p in answer.strs if p.name == 'last_refusal'], [words])
            self.assertEqual([p.value for p in answer.doubles if p.name == 'view_range'], [0.0])

    def test_window_and_memory_are_bounded(self):
        self.reconfigure(window=40.0)
        for step in range(6):
            stamp = self.integrate([(3.5, 0.5, 0.5)], [CAR], position=(30.0 * step, 0.0, 0.0))
        blocks = self.map_of_server(stamp)
        self.assertGreater(len(blocks), 0)
        self.assertTrue(all(8 * x + 8 > 150 - 28 for x, _, _ in blocks), blocks.keys())
        before = self.status.find(lambda m: True)
        self.reconfigure(memory_limit=0.001)
        status = self.deal_with(self.robot.scan([(3.5, 0.5, 0.5)], [CAR]))
        self.assertEqual(status.dropped_memory, before.dropped_memory + 1)
        self.assertEqual(status.blocks, before.blocks)
        self.assertLessEqual(status.map_bytes, before.map_bytes, 'planes that nobody uses are given back')

    def test_inputs_have_settings_of_their_own(self):
        # Merged clouds are in the map frame, with colours; beams start at the sensor.
        stamp = self.stamp_for(self.merged)
        self.robot.publish_pose(stamp, position=(5.0, 0.5, 0.5))
        self.merged.clouds.publish(make_cloud([(9.5, 0.5, 0.5)], [CAR_COLOR], stamp, frame='map', label_name='rgb',
                                              label_type=PointField.UINT32))
        status = self.deal_with(stamp)
        self.assertTrue(status.integrated_last, status)
        blocks = self.map_of_server(stamp)
        states, labels, _ = blocks[(1, 0, 0)]
        self.assertEqual((states[1], labels[1]), (OccupancyMap.OCCUPIED, 1))
        self.assertEqual(blocks[(0, 0, 0)][0][7], OccupancyMap.FREE)
        self.assertEqual(blocks[(0, 0, 0)][0][3], OccupancyMap.UNKNOWN, 'nothing is cleared from the map origin')

    def test_beams_without_a_return_clear(self):
        stamp = self.stamp_for(self.open)
        self.robot.publish_pose(stamp, position=(0.5, 0.5, 0.5))
        inf = float('inf')
        self.open.clouds.publish(make_cloud([(inf, 0.0, 0.0), (0.0, 8.0, 0.0), (0.0, 0.0, 4.0)], [CAR] * 3, stamp))
        self.deal_with(stamp)
        states, _, _ = self.map_of_server(stamp)[(0, 0, 0)]
        self.assertEqual([states[i] for i in range(1, 8)], 7 * [OccupancyMap.FREE], 'a point at infinity')
        self.assertEqual([states[8 * i] for i in range(1, 8)], 7 * [OccupancyMap.FREE], 'a point at max_range')
        self.assertEqual(states[64 * 4], OccupancyMap.OCCUPIED)

    def test_beams_that_point_nowhere_are_counted_and_explained_once(self):
        inf, nan, before = float('inf'), float('nan'), self.status.find(lambda m: True).points_no_direction
        for _ in range(2):
            stamp = self.stamp_for(self.open)
            self.robot.publish_pose(stamp, position=(0.5, 0.5, 0.5))
            nowhere = [(inf, -inf, inf), (nan, nan, nan), (0.0, 0.0, 0.0)]
            self.open.clouds.publish(make_cloud(nowhere + [(0.0, 0.0, 4.0)], [CAR] * 4, stamp))
            status = self.deal_with(stamp)
        self.assertEqual(status.points_no_direction, before + 6)
        self.assertTrue(adds_up(status), status)
        said = self.log.wait_for(lambda m: 'beams without a return' in m.msg and 'clear nothing' in m.msg, 'a warning')
        self.assertIn('3 beams without a return in a cloud of /open_cloud', said.msg)
        self.assertIn('publish organised clouds', said.msg)
        self.assertEqual(1, sum('clear nothing' in m.msg for m in self.log.messages))

    def test_a_cloud_in_the_map_frame_is_warned_of_once(self):
        for _ in range(2):
            self.integrate([(4.5, 0.5, 0.5)], [CAR], frame='map')
        warned = self.log.wait_for(lambda m: 'are in the map frame' in m.msg, 'a warning')
        self.assertIn('sensor_frame_id', warned.msg)
        self.assertIn('front_cloud', warned.msg)
        self.assertEqual(sum('are in the map frame' in m.msg for m in self.log.messages), 1)

    def jump_back(self):
        """Makes time jump back by 50 s while a cloud is waiting; returns the stamp of the last cloud."""
        self.integrate([(4.5, 0.5, 0.5)], [CAR])
        jumps = self.status.find(lambda m: True).time_jumps
        waiting = self.robot.next_stamp()
        self.robot.clouds.publish(make_cloud([(2.0, 0.0, 0.0)], [CAR], waiting))  # waits for its pose
        self.robot.seconds -= 49.5  # to stamps that no other test uses
        self.addCleanup(setattr, self.robot, 'seconds', int(waiting.to_sec()) + 10)
        first = self.robot.scan([(0.5, 3.5, 0.5)], [ROAD])  # a single old cloud could be a stray
        self.assertEqual(self.status.find(lambda m: True).time_jumps, jumps)
        again = self.robot.scan([(0.5, 5.5, 0.5)], [ROAD])
        status = self.deal_with(again)
        self.assertTrue(status.integrated_last, status)
        self.assertEqual(status.time_jumps, jumps + 1)
        self.assertTrue(self.deal_with(first).integrated_last, 'it waited, and is of the new time')
        self.assertEqual(self.status.find(lambda m: m.header.stamp == waiting).last_drop_reason, 'time jump')
        self.assertTrue(adds_up(status), status)
        return again

    def test_time_that_jumps_back_is_noticed_and_the_map_kept(self):
        again = self.jump_back()
        self.assertEqual(self.map_of_server(again)[(0, 0, 0)][0][4], OccupancyMap.OCCUPIED)

    def test_time_that_jumps_back_may_reset_the_map(self):
        self.reconfigure(on_time_jump='reset')
        states = self.map_of_server(self.jump_back())[(0, 0, 0)][0]
        self.assertEqual(states[4], OccupancyMap.UNKNOWN, 'of the old time')
        self.assertEqual(states[8 * 5], OccupancyMap.OCCUPIED, 'of the new time')
        self.log.wait_for(lambda m: 'Time jumped back' in m.msg and 'the map is reset' in m.msg, 'a warning')


if __name__ == '__main__':
    rostest.rosrun('bki_mapping', 'live', Live)
