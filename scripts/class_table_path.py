#!/usr/bin/env python3
"""Prints a class table independently of the working folder: a path made absolute, or a name unchanged."""
import os
import sys

table = os.path.expanduser(sys.argv[1])
sys.stdout.write(os.path.abspath(table) if '/' in table or os.path.isfile(table) else table)
