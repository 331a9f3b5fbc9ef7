#!/usr/bin/env python3
"""Plays the bag named by the parameter ~bag with rosbag play, to which all arguments go.

With --check BAG TOPIC it prints the bag's absolute path, or says what is wrong: roslaunch calls that before it
starts anything, in the folder of the shell (nodes run in another).
"""
import os
import sys

import rosbag
import rosgraph
import roslib.packages


def clouds_of(path):
    """The topics with clouds, or one sentence that ends the program."""
    try:
        with rosbag.Bag(path, skip_index=True) as bag:  # the index of a long bag takes a while
            topics = bag.get_type_and_topic_info().topics
    except rosbag.ROSBagUnindexedException:
        sys.exit(f"bag '{path}' was not recorded to its end; run: rosbag reindex '{path}'")
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
    sys.stdout.write(path)  # roslaunch takes a line's end for a part of the path


def play(arguments):
    name = rosgraph.names.make_caller_id(rosgraph.names.load_mappings(arguments).get('__name', 'play_bag'))
    try:
        path = rosgraph.Master(name).getParam(name + 'bag')
    except rosgraph.MasterError:
        sys.exit(f'the parameter {name}bag is not set; start this with replay.launch')
    player = roslib.packages.find_node('rosbag', 'play')[0]
    os.execv(player, [player, '--bags', path, *arguments])


if __name__ == '__main__':
    if sys.argv[1:2] == ['--check']:
        check(*sys.argv[2:])
    else:
        play(sys.argv[1:])
