#!/usr/bin/env python3
"""Prints a class table as the mapper understands it from any folder: an absolute path, or a name as it is."""
import os
import sys

table = os.path.expanduser(sys.argv[1])
sys.stdout.write(os.path.abspath(table) if '/' in table or os.path.isfile(table) else table)
