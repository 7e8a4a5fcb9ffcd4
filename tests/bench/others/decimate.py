"""Blender's decimation (Collapse) of every mesh of a tree, to a number of triangles.

    blender --background --factory-startup --python decimate.py -- IN.glb OUT.glb TRIANGLES

Leaves do not touch: collapse shrinks each on its own, as it does for an artist who presses the button.
"""

import sys

import bpy
import numpy

# Blender 3.4's importer asks numpy for a name that numpy 1.24 dropped.
if not hasattr(numpy, "bool"):
    numpy.bool = bool

source, target, wanted = sys.argv[sys.argv.index("--") + 1 :]
wanted = int(wanted)

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=source)
meshes = [o for o in bpy.context.scene.objects if o.type == "MESH"]
if not meshes:
    sys.exit("no mesh in " + source)
# A modifier can't be applied to a mesh that several objects share.
bpy.ops.object.select_all(action="SELECT")
bpy.ops.object.make_single_user(object=True, obdata=True)
for mesh in meshes:
    mesh.modifiers.new("Decimate", "DECIMATE").use_collapse_triangulate = True


def triangles(ratio):
    for mesh in meshes:
        mesh.modifiers["Decimate"].ratio = ratio
    graph = bpy.context.evaluated_depsgraph_get()
    graph.update()
    total = 0
    for mesh in meshes:
        drawn = mesh.evaluated_get(graph).to_mesh()
        drawn.calc_loop_triangles()
        total += len(drawn.loop_triangles)
    return total


# It misses the ratio it is asked for: search until the count is within a hundredth.
low, high = 0.0, 1.0
ratio = wanted / triangles(1.0)
for _ in range(8):
    count = triangles(ratio)
    if abs(count / wanted - 1) <= 0.01:
        break
    low, high = (low, ratio) if count > wanted else (ratio, high)
    ratio = (low + high) / 2
bpy.ops.export_scene.gltf(filepath=target, export_format="GLB", export_apply=True)
print("DECIMATED", triangles(ratio))
