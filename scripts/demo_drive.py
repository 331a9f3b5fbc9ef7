#!/usr/bin/env python3
"""Prints the absolute path of the drive that demo.launch plays. roslaunch runs it before any node.

Usage: demo_drive.py SEQUENCE SCANS      SEQUENCE: a folder, or '': a simulated drive of SCANS scans
"""
import os
import subprocess
import sys
import tempfile

import roslib.packages


def run(program, *arguments, **options):
    """Runs a program of the package, which says itself what is wrong; ends with its status."""
    paths = roslib.packages.find_node('bki_mapping', program)
    if not paths:
        sys.exit(f"{program}, which the demo needs, is not installed; for simulate_drive, you can name the folder of a drive "
                 'with sequence:= instead')
    status = subprocess.run([paths[0], *arguments], check=False, **options).returncode
    if status != 0:
        sys.exit(status)


def is_drive(folder, scans):
    """Whether simulate_drive has written a drive of so many scans there. It writes simulation.yaml last."""
    try:
        with open(os.path.join(folder, 'times.txt')) as times:
            return os.path.exists(os.path.join(folder, 'simulation.yaml')) and str(sum(1 for _ in times)) == scans
    except (OSError, ValueError):
        return False


def simulated(scans):
    """The folder of a simulated drive. Drives of earlier demos stay, as one of those may still be playing its own."""
    home = os.environ.get('ROS_HOME', '')
    drives = os.path.join(home if os.path.isabs(home) else os.path.expanduser('~/.ros'), 'bki_mapping_demo')
    folder = os.path.join(drives, f'{scans}_scans')
    if is_drive(folder, scans):
        return folder
    if os.path.lexists(folder):
        sys.exit(f'{folder} is no simulated drive of {scans} scans; move it elsewhere, or name the folder of a drive with '
                 'sequence:=')
    os.makedirs(drives, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix='.', dir=drives) as own:
        run('simulate_drive', '--output', os.path.join(own, 'drive'), '--scans', scans, stdout=sys.stderr)
        try:
            os.rename(os.path.join(own, 'drive'), folder)
        except OSError:
            if not is_drive(folder, scans):  # of a demo that was faster
                raise
    return folder


if __name__ == '__main__':
    sequence, scans = sys.argv[1:]
    try:
        sequence = sequence or simulated(scans)
    except OSError as error:
        sys.exit(f"the demo's drive cannot be written: {error}; name another folder in ROS_HOME")
    run('play_sequence', '--check', '--sequence', sequence)
