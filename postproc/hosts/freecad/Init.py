# SPDX-License-Identifier: Apache-2.0
# FreeCAD runs this file at its start, with the addon's folder on sys.path.
import FreeCAD
import smoothpost_addon

smoothpost_addon.start(FreeCAD.Console)
