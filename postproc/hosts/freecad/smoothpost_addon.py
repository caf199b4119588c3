# SPDX-License-Identifier: Apache-2.0
"""The addon's start: says its version and lets FreeCAD find the post in posts/."""
import os
import sys

VERSION = "0.1.0"
POSTS = os.path.join(os.path.dirname(os.path.realpath(__file__)), "posts")


def start(console):
    """Called once by Init.py. A FreeCAD that reads posts of package.xml needs no more than the message."""
    if POSTS not in sys.path:
        sys.path.append(POSTS)
    console.PrintMessage(f"smoothpost addon {VERSION}: post \"smoothpost\" in {POSTS}\n")
