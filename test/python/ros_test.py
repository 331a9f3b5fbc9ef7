#!/usr/bin/env python3
"""A follower holds the map that its messages describe, notices what it has missed, and needs no ROS."""
import os
import struct
import subprocess
import sys
import threading
import unittest
from types import SimpleNamespace as Message

import numpy as np

import bki_mapping as bki
from bki_mapping.ros import BLOCK, OccupancyClass, OccupancyFollower, decode

CLASSES = (OccupancyClass(1, 'car', (100, 150, 245), True), OccupancyClass(9, 'road', (255, 0, 255), False))
RESOLUTION = 0.3


def header(seconds):
    return Message(seq=7, stamp=Message(secs=seconds, nsecs=250_000_000), frame_id='map')


def message_of(blocks, removed=(), sequence=1, whole=False, seconds=10, is_update=True, table=CLASSES):
    """A message as ROS makes it. @param blocks of dtype BLOCK."""
    listed = [Message(**{axis: int(b[axis]) for axis in 'xyz'}, state=b['state'].tobytes(), label=b['label'].tobytes(),
                      **{name: b[name].ravel().tolist() for name in ('probability', 'occupancy', 'class_probability')}) for b in blocks]
    classes = [Message(id=c.id, name=c.name, red=c.color[0], green=c.color[1], blue=c.color[2], dynamic=c.dynamic) for c in table]
    message = Message(header=header(seconds), resolution=float(np.float32(RESOLUTION)), block_edge=8, classes=classes if whole or not is_update else [],
                      blocks=listed)
    if is_update:
        message.sequence, message.whole = sequence, whole
        message.removed = [Message(x=x, y=y, z=z) for x, y, z in removed]
    return message


def packed(message):
    """A message as ROS sends it."""
    data = struct.pack('<III', message.header.seq, message.header.stamp.secs, message.header.stamp.nsecs)

    def text(words):
        return struct.pack('<I', len(words.encode())) + words.encode()
    data += text(message.header.frame_id)
    is_update = hasattr(message, 'sequence')
    if is_update:
        data += struct.pack('<QB', message.sequence, message.whole)
    data += struct.pack('<fII', message.resolution, message.block_edge, len(message.classes))
    for each in message.classes:
        data += struct.pack('<B', each.id) + text(each.name) + struct.pack('<4B', each.red, each.green, each.blue, each.dynamic)
    data += struct.pack('<I', len(message.blocks))
    for block in message.blocks:
        data += struct.pack('<3i', block.x, block.y, block.z) + block.state + block.label
        for values in (block.probability, block.occupancy, block.class_probability):
            data += struct.pack('<512f', *values)
    if is_update:
        data += struct.pack('<I', len(message.removed)) + b''.join(struct.pack('<3i', r.x, r.y, r.z) for r in message.removed)
    return data


class World:
    """A map that changes at random: what a follower should hold."""

    def __init__(self, seed):
        self.random = np.random.default_rng(seed)
        self.blocks = {}

    def make_blocks(self, indices):
        made = np.zeros(len(indices), BLOCK)
        for block, index in zip(made, indices):
            block['x'], block['y'], block['z'] = index
            block['state'] = self.random.integers(0, 4, (8, 8, 8))
            block['label'] = np.where(block['state'] == 2, self.random.choice([1, 9], (8, 8, 8)), 255)
            for name in ('probability', 'occupancy', 'class_probability'):
                block[name] = self.random.random((8, 8, 8), np.float32)
            self.blocks[tuple(int(i) for i in index)] = block.copy()
        return made

    def places(self, count):
        return np.unique(np.concatenate([self.random.integers(-4, 4, (count, 3)), self.random.integers(-30000000, 30000000, (1, 3))]), axis=0)

    def whole(self):
        return np.array([self.blocks[key] for key in sorted(self.blocks, key=lambda k: k[::-1])], BLOCK)

    def change(self):
        """Changes blocks, and erases some; returns both."""
        removed = [key for key in self.blocks if self.random.random() < 0.2]
        for key in removed:
            del self.blocks[key]
        return self.make_blocks([p for p in self.places(15) if tuple(p) not in removed]), removed


class Follows(unittest.TestCase):
    def expect(self, follower, world):
        self.assertEqual([tuple(index) for index in follower.blocks], sorted(world.blocks, key=lambda k: k[::-1]))
        for key, block in world.blocks.items():
            self.assertEqual(follower.block(key).tobytes(), block.tobytes())
        self.assertIsNone(follower.block((100, 0, 0)))
        voxels = world.random.integers(-40, 40, (2000, 3))
        far = [8 * np.array(key) + 3 for key in world.blocks]
        voxels = np.concatenate([voxels, far]) if far else voxels
        said = follower.query((voxels + 0.5) * RESOLUTION)
        for voxel, each in zip(voxels, said):
            block = world.blocks.get(tuple(int(i) for i in voxel // 8))
            x, y, z = voxel % 8
            expected = (0, 255, np.nan, np.nan, np.nan) if block is None else [block[name][z, y, x] for name in said.dtype.names]
            np.testing.assert_array_equal(each.tolist(), np.array(expected, float))
        listed = follower.voxels(['occupied', 'occluded'])
        expected = []
        for key in sorted(world.blocks, key=lambda k: k[::-1]):
            block = world.blocks[key]
            for z, y, x in zip(*np.nonzero(np.isin(block['state'], (2, 3)))):
                color = next((c.color for c in CLASSES if c.id == block['label'][z, y, x]), (60, 60, 70))
                centre = [(8 * k + i + 0.5) * RESOLUTION for k, i in zip(key, (x, y, z))]
                expected.append((*centre, *color, *(block[name][z, y, x] for name in ('label', 'state', *listed.dtype.names[8:]))))
        np.testing.assert_array_equal(listed, np.array(expected, listed.dtype))

    def test_random_updates_in_both_forms(self):
        for through in (lambda message: message, lambda message: decode(packed(message))):
            world, follower = World(1), OccupancyFollower()
            world.make_blocks(world.places(10))
            self.assertTrue(follower.update(through(message_of(world.whole(), sequence=5, whole=True))))
            self.expect(follower, world)
            for sequence in range(6, 14):
                blocks, removed = world.change()
                self.assertTrue(follower.update(through(message_of(blocks, removed, sequence, seconds=sequence))))
                self.expect(follower, world)
                self.assertEqual((follower.sequence, follower.stamp), (sequence, sequence * 10**9 + 250_000_000))
            self.assertTrue(follower.update(through(message_of([], list(world.blocks), 14))))
            world.blocks = {}
            self.expect(follower, world)
            self.assertEqual((follower.in_sync, follower.missed, follower.frame, follower.resolution, follower.classes),
                             (True, 0, 'map', 0.3, CLASSES))

    def test_missed_updates(self):
        world, follower = World(2), OccupancyFollower()
        early = message_of(*world.change(), sequence=3)
        self.assertFalse(follower.update(early))  # before the whole map
        self.assertEqual((follower.in_sync, follower.missed, follower.sequence, follower.resolution), (False, 0, None, None))
        follower.update(message_of(world.whole(), sequence=3, whole=True))
        self.assertFalse(follower.update(early))  # it is in the map
        self.assertEqual((follower.in_sync, follower.missed), (True, 0))
        for gap in (2, 100, -1):
            before = follower.blocks.tolist()
            missed, number = follower.missed, follower.sequence
            world.change()
            self.assertFalse(follower.update(message_of(*world.change(), sequence=max(0, number + gap))))
            self.assertEqual((follower.in_sync, follower.missed, follower.sequence, follower.blocks.tolist()), (False, missed + 1, number, before))
            self.assertFalse(follower.update(message_of(*world.change(), sequence=number + 1)))  # too late
            self.assertEqual(follower.missed, missed + 1)
            self.assertTrue(follower.update(message_of(world.whole(), sequence=number + 7, whole=True)))
            self.assertTrue(follower.in_sync)
            self.expect(follower, world)
            self.assertTrue(follower.update(message_of(*world.change(), sequence=number + 8)))
            self.expect(follower, world)

    def test_whole_maps_without_numbers(self):
        world, follower = World(3), OccupancyFollower()
        world.change()
        whole = message_of(world.whole(), is_update=False)
        for form in (whole, decode(packed(whole), is_update=False)):
            follower = OccupancyFollower()
            self.assertTrue(follower.update(form))
            self.assertEqual((follower.in_sync, follower.sequence, follower.classes), (False, None, CLASSES))
            self.expect(follower, world)
        self.assertFalse(follower.update(message_of(*world.change(), sequence=9)))  # something between may be missing
        self.assertTrue(follower.update(message_of(world.whole(), is_update=False)))
        self.expect(follower, world)
        self.assertTrue(follower.update(message_of(world.whole(), sequence=9, whole=True)))
        self.assertTrue(follower.update(message_of(*world.change(), sequence=10)))
        self.assertFalse(follower.update(whole))  # older
        self.expect(follower, world)
        self.assertEqual(follower.sequence, 10)

    def test_wait_and_threads(self):
        world, follower = World(4), OccupancyFollower()
        self.assertFalse(follower.wait(0.01))
        messages = [message_of(world.whole(), sequence=1, whole=True)] + [message_of(*world.change(), sequence=n) for n in range(2, 30)]
        thread = threading.Thread(target=lambda: [follower.update(message) for message in messages])
        thread.start()
        self.assertTrue(follower.wait(30.0))
        while follower.sequence < 29:
            with follower.lock:
                self.assertEqual(len(follower.voxels('free,occupied,occluded')),
                                 sum(np.count_nonzero(follower.block(index)['state']) for index in follower.blocks))
        thread.join()
        self.assertTrue(follower.wait(0.0, sequence=29))
        self.assertFalse(follower.wait(0.01, sequence=30))
        self.expect(follower, world)

    def test_follows_a_real_map(self):
        """A map's blocks, sent as messages, say what the map says."""
        random = np.random.default_rng(5)
        mapper = bki.SemanticMapper('semantic_kitti', occlusion='all')
        mapper.integrate((0, 0, 1), random.uniform([4, -3, -1], [4.1, 3, 1], (400, 3)).astype(np.float32), np.full(400, 50, np.uint32))
        map_ = mapper.map
        blocks = np.zeros(len(map_.blocks), BLOCK)
        within = np.stack(np.meshgrid(*[np.arange(8)] * 3, indexing='ij'), axis=-1).transpose(2, 1, 0, 3)
        for to, index in zip(blocks, map_.blocks):
            to['x'], to['y'], to['z'] = index
            said = map_.query(((8 * index + within + 0.5) * map_.resolution).reshape(-1, 3))
            for name in BLOCK.names[3:]:
                to[name] = said[name].reshape(8, 8, 8)
        follower = OccupancyFollower()
        table = [OccupancyClass(c.id, c.name, c.color, 'dynamic' in c.flags) for c in map_.classes]
        follower.update(message_of(blocks, sequence=1, whole=True, table=table))
        points = random.uniform(-8, 8, (5000, 3))
        own, expected = follower.query(points), map_.query(points)
        np.testing.assert_array_equal(own['state'], expected['state'])
        np.testing.assert_array_equal(own['label'], expected['label'])
        known = own['probability'] == own['probability']
        for name in ('probability', 'occupancy', 'class_probability'):
            np.testing.assert_array_equal(own[name][known], expected[name][known])
        self.assertTrue((expected['state'][~known] == bki.UNKNOWN).all())
        voxels, listed = map_.voxels('occupied,free'), follower.voxels('occupied,free')
        for name in listed.dtype.names[:8]:
            np.testing.assert_array_equal(listed[name], voxels[name])

    def test_needs_neither_ros_nor_the_library(self):
        code = ("import sys; sys.modules['rospy'] = sys.modules['genpy'] = sys.modules['bki_mapping._core'] = None\n"
                'import bki_mapping.ros as r; f = r.OccupancyFollower(); print(f.in_sync, len(f.blocks), f.wait(0.0))')
        said = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, timeout=60, check=True, env=os.environ).stdout
        self.assertEqual(said, 'False 0 False\n')


class WrongInput(unittest.TestCase):
    def test_inconsistent_messages_change_nothing(self):
        world, follower = World(7), OccupancyFollower()
        world.change()
        blocks = world.whole()
        follower.update(message_of(blocks, sequence=1, whole=True))
        before = follower.blocks.tolist()

        def changed(**fields):
            message = message_of(blocks, sequence=2, whole=True)
            vars(message).update(fields)
            return message
        cut = message_of(blocks, sequence=2)
        cut.blocks[0].state = cut.blocks[0].state[:-1]
        data = packed(message_of(blocks, [(1, 2, 3)], sequence=2))
        for words, call in (
                ('blocks of 16 voxels along an edge, not of 8', lambda: follower.update(changed(block_edge=16))),
                ('a resolution that is not above 0', lambda: follower.update(changed(resolution=0.0))),
                ('a resolution that is not above 0', lambda: follower.update(changed(resolution=float('nan')))),
                ('511 values of state for the 512 voxels of a block', lambda: follower.update(cut)),
                ('the message has a block twice', lambda: follower.update(message_of(np.repeat(blocks, 2), sequence=2, whole=True))),
                ('the message is cut off, or of another type', lambda: decode(data[:-1])),
                ('the message is cut off, or of another type', lambda: decode(data[:40])),
                ('the message is cut off, or of another type', lambda: decode(b'')),
                ('the message is cut off, or of another type', lambda: decode(data[:12] + b'\xff\xff\xff\xff' + data[16:])),
                ('point 1 of 2 has a coordinate that is not finite', lambda: follower.query([[0, 0, 0], [0, np.inf, 0]])),
                ('points has masked values', lambda: follower.query(np.ma.array([[1.0, 0, 0]], mask=[[0, 0, 1]]))),
                (r'points must be an array of numbers of shape \(N, 3\)', lambda: follower.query([0, 0, 0])),
                ('index must be three integers', lambda: follower.block((1, 2))),
                ('index must be three integers', lambda: follower.block((1, 2, 0.5))),
                ("voxel state 'full' is unknown; known states: occupied, free, occluded", lambda: follower.voxels('full')),
                ('there is no map yet; wait for one', lambda: OccupancyFollower().query([[0, 0, 0]]))):
            with self.subTest(words=words):
                with self.assertRaisesRegex(ValueError, words) as caught:
                    call()
                self.assertNotIn('\n', str(caught.exception))
        self.assertEqual((follower.in_sync, follower.sequence, follower.blocks.tolist()), (True, 1, before))
        self.assertEqual(follower.query([[1e30, 0, 0], [-1e9, 1e9, 0]])['state'].tolist(), [0, 0])
        self.assertEqual(len(OccupancyFollower().voxels()), 0)

if __name__ == '__main__':
    unittest.main()
