#!/usr/bin/env python3
"""Checks the argument body_box of mapping.launch: body_box.py BOX CONFIG.

Exits with one sentence if BOX is not "x0 y0 z0 x1 y1 z1", or if the parameter file CONFIG names inputs, because the box
filters a single topic. roslaunch runs it before any node.
"""
import os
import sys

import yaml

FARTHEST = 1000.0  # pcl/CropBox clamps larger coordinates to this without a warning [m]
FORM = "six numbers in metres, 'x0 y0 z0 x1 y1 z1'; for example body_box:='-0.6 -0.4 -0.5 0.6 0.4 0.3'"


def fault_of(box):
    """Why the box is invalid; None if it is valid."""
    try:
        corners = [float(part) for part in box.split()]
    except ValueError:
        corners = []
    if len(corners) != 6:
        return f"body_box is '{box}', but must be {FORM}"
    for axis, low, high in zip('xyz', corners[:3], corners[3:]):
        if not (abs(low) <= FARTHEST and abs(high) <= FARTHEST):
            return f"body_box is '{box}', but must lie within {FARTHEST:g} m of its frame's origin"
        if low >= high:
            return f"body_box is '{box}', but its {axis}0 must be less than its {axis}1"
    return None


def names_inputs(config):
    try:
        with open(os.path.expanduser(config)) as file:
            settings = yaml.safe_load(file)
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return False  # a preset, none of which has inputs, or the node says what is wrong
    return isinstance(settings, dict) and any(str(name).split('/')[0] == 'inputs' for name in settings)


if __name__ == '__main__':
    fault = fault_of(sys.argv[1])
    if fault is None and names_inputs(sys.argv[2]):
        fault = (f"body_box filters cloud_topic, but '{sys.argv[2]}' names inputs with topics of their own; load a "
                 'pcl/CropBox for each of them, as docs/ros.md shows for pcl/PassThrough')
    if fault:
        sys.exit(fault)
