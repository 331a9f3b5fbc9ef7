#!/usr/bin/env python3
"""Prints the absolute path of the drive that demo.launch plays. roslaunch runs it before any node.

Usage: demo_drive.py SEQUENCE SCANS      SEQUENCE: a folder, or '': simulates a drive of SCANS scans first
"""
import os
import shutil
import subprocess
import sys

import roslib.packages
import rospkg


def run(program, *arguments, **options):
    """Runs a program of the package, which says itself what is wrong; ends with its status."""
    paths = roslib.packages.find_node('bki_mapping', program)
    if not paths:
        sys.exit(f"{program}, which simulates the demo's drive, is not installed; name the folder of a drive with sequence:=")
    status = subprocess.run([paths[0], *arguments], check=False, **options).returncode
    if status != 0:
        sys.exit(status)


if __name__ == '__main__':
    sequence, scans = sys.argv[1:]
    if not sequence:
        sequence = os.path.join(rospkg.get_ros_home(), 'bki_mapping_demo')
        shutil.rmtree(sequence, ignore_errors=True)  # perhaps of more scans
        run('simulate_drive', '--output', sequence, '--scans', scans, stdout=sys.stderr)
    run('play_sequence', '--check', '--sequence', sequence)
