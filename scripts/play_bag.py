#!/usr/bin/env python3
"""Plays the bag named by the parameter ~bag with rosbag play, and passes on all arguments.

With --check BAG TOPIC it prints the absolute path of the bag, or exits with one sentence. roslaunch runs this before
any node, in the folder where it was called; nodes run in another folder.
"""
import os
import sys

import rosbag
import rosgraph
import roslib.packages


def clouds_of(path):
    """The topics with clouds. Exits with one sentence if the bag cannot be read."""
    try:
        with rosbag.Bag(path, skip_index=True) as bag:  # reading the index of a long bag takes long
            topics = bag.get_type_and_topic_info().topics
    except rosbag.ROSBagUnindexedException:
        sys.exit(f"bag '{path}' has no index because its recording was interrupted; run: rosbag reindex '{path}'")
    except (OSError, rosbag.ROSBagException) as fault:
        why = fault.strerror if isinstance(fault, OSError) else fault
        sys.exit(f"bag '{path}' cannot be read ({why}); check bag:=FILE")
    return [topic for topic, info in topics.items() if info.msg_type == 'sensor_msgs/PointCloud2']


def check(given, topic):
    path = os.path.abspath(os.path.expanduser(given))
    clouds = clouds_of(path)
    if not clouds:
        sys.exit(f"bag '{path}' has no clouds (sensor_msgs/PointCloud2); record some")
    if topic not in clouds:
        sys.exit(f"bag '{path}' has no clouds on {topic}; it has some on: {', '.join(clouds)}; choose with "
                 'cloud_topic:=TOPIC')
    sys.stdout.write(path)  # no newline: roslaunch would make it part of the path


def play(arguments):
    name = rosgraph.names.make_caller_id(rosgraph.names.load_mappings(arguments).get('__name', 'play_bag'))
    try:
        path = rosgraph.Master(name).getParam(name + 'bag')
    except rosgraph.MasterError:
        sys.exit(f'the parameter {name}bag is not set; start play_bag.py by replay.launch')
    player = roslib.packages.find_node('rosbag', 'play')[0]
    os.execv(player, [player, '--bags', path, *arguments])


if __name__ == '__main__':
    if sys.argv[1:2] == ['--check']:
        check(*sys.argv[2:])
    else:
        play(sys.argv[1:])
