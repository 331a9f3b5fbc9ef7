#!/usr/bin/env python3
"""Prints the path in an argument of a launch file, for a node: relative to the folder where roslaunch is called, because
nodes run in another one (ROS_HOME); ~ is the user's home.

Usage: launch_path.py [--name] PATH      --name: one word that is no file is a name, such as of a preset, and stays as it is
"""
import os
import sys


def is_name(text):
    return '/' not in text and not os.path.splitext(text)[1] and not os.path.isfile(text)


def path_of(text):
    """The absolute path. A folder keeps a slash at its end."""
    path = os.path.abspath(os.path.expanduser(text))
    return os.path.join(path, '') if text.endswith('/') else path


if __name__ == '__main__':
    text = sys.argv[-1]
    keep = not text or sys.argv[1] == '--name' and is_name(text)
    sys.stdout.write(text if keep else path_of(text))
